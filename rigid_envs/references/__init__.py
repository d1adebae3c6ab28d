"""Reference controllers as agents: they act on observations, as trained policies do.

::

    import rigid_envs
    agent = rigid_envs.reference("BallPark")
    action, state = agent.predict(observation)

Their laws are those of `rigid_envs.scores.bindings`. Here are the decoders, which find the states
that the laws read in what is observed: one for each task, one file for each family.
"""

from rigid_envs.references.agent import Reference, reference
from rigid_envs.references.decoding import Decoded, Decoder

__all__ = ["Decoded", "Decoder", "Reference", "reference"]
