"""Data sets of episodes in Minari's format: random, reference and trained behaviour of any id.

::

    from rigid_envs import datasets
    name = datasets.write("BallPark", "reference", episodes=100)
    minari.load_dataset(name).recover_environment()
    datasets.check(name)  # plays every episode again, bit for bit

It needs the extra `dataset`.
"""

from rigid_envs.datasets.behaviour import Behaviour, behaviour
from rigid_envs.datasets.checking import Check, check
from rigid_envs.datasets.collecting import Recorded, collect
from rigid_envs.datasets.writing import write

__all__ = ["Behaviour", "Check", "Recorded", "behaviour", "check", "collect", "write"]
