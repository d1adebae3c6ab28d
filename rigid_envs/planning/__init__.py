"""Planning by optimisation over the environments' own step maps: what the best could have done.

A plan is a sequence of actions from a known state. It is found by sequential convex programming:
`model` rolls plans out and linearises every step, `subproblem` solves the convex problem that the
linearisation leaves, `descent` repeats both, and `least_time` shortens plans whose cost is time.
`conditions` says what success asks of a motion.
"""

from rigid_envs.planning.conditions import Conditions, conditions_of
from rigid_envs.planning.descent import Plans, improve
from rigid_envs.planning.least_time import shorten
from rigid_envs.planning.model import Model

__all__ = ["Conditions", "Model", "Plans", "conditions_of", "improve", "shorten"]
