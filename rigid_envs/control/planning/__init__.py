"""Planning by optimisation over the environments' own step maps: what the best could have done.

A plan is a sequence of actions from a known state. It is found by sequential convex programming:
`model` rolls plans out and linearises every step; `descent` solves the convex problem that this
leaves, again and again; `deadlines` shortens plans whose cost is time; `tracking` keeps errors
small in all steps. `planar` finds least times where the state is a point of a plane. What success
asks of a motion is in the `references` of each system.
"""

from rigid_envs.control.planning.deadlines import hurried, shorten, sooner
from rigid_envs.control.planning.descent import Plans, improve
from rigid_envs.control.planning.model import Conditions, Model, conditions_of

__all__ = [
    "Conditions",
    "Model",
    "Plans",
    "conditions_of",
    "hurried",
    "improve",
    "shorten",
    "sooner",
]
