"""Torque-free rotation of a rigid body in closed form: Euler's top.

For any principal moments in any order and any start: asymmetric, symmetric and spherical bodies,
steady rotation about each axis, the separatrix and its neighbourhood, and rest.
"""

from rigid_envs.analytic.free_body._attitude import attitude
from rigid_envs.analytic.free_body._polhode import Polhode, omega, polhode
from rigid_envs.analytic.free_body._rates import growth_rate, oscillation_rates, symmetric_rates

__all__ = [
    "Polhode",
    "attitude",
    "growth_rate",
    "omega",
    "oscillation_rates",
    "polhode",
    "symmetric_rates",
]
