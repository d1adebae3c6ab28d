"""Torque-free rotation of a rigid body in closed form: Euler's top.

For any principal moments in any order and any start: asymmetric, symmetric and spherical bodies,
steady rotation about each axis, the separatrix and its neighbourhood, and rest.

Two times are easily mixed up: the component about the intermediate axis changes its sign every
`Polhode.flip_interval` = 2 K / p, and omega returns to its start in the body after
`Polhode.period` = 4 K / p, two flips later.
"""

from rigid_envs.analytic.free_body._body_attitude import attitude
from rigid_envs.analytic.free_body._poinsot import Poinsot, herpolhode, invariable_plane, poinsot
from rigid_envs.analytic.free_body._polhode import Polhode, omega, polhode
from rigid_envs.analytic.free_body._rates import growth_rate, oscillation_rates
from rigid_envs.analytic.free_body._symmetric import (
    Cones,
    chandler_period,
    chandler_turns,
    symmetric_cones,
    symmetric_rates,
)

__all__ = [
    "Cones",
    "Poinsot",
    "Polhode",
    "attitude",
    "chandler_period",
    "chandler_turns",
    "growth_rate",
    "herpolhode",
    "invariable_plane",
    "omega",
    "oscillation_rates",
    "poinsot",
    "polhode",
    "symmetric_cones",
    "symmetric_rates",
]
