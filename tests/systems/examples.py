"""All systems with parameters of no symmetry, and random states and inputs for them."""

import numpy as np
import pytest

from rigid_envs import systems
from rigid_envs.mechanics import rotations

BODY = systems.FreeBody(1.1, 1.7, 2.3)
TOP = systems.HeavyTop(1.3, 1.1, 0.6, m=0.8, g=9.5, ell=0.13)
BALL = systems.RollingBall(0.7)
PLATE = systems.DynamicBall(m=1.2, radius=0.8, beta=0.55, g=9.6, turntable_rate=0.7)
DISK = systems.RollingDisk(m=5.0, radius=0.7, I1=1.4, I3=2.0, g=2.5)
EULER = systems.EulerDisk(m=5.0, radius=0.7, I1=1.4, I3=2.0, g=2.5, contour=0.2, drag=0.03)
COIN = systems.UprightCoin(m=1.1, radius=0.7, I1=0.3, I3=0.4, g=9.5, slope=0.3)
ROLLER = systems.Roller(m=1.1, radius=0.7, beta=0.45, g=9.5, slope=0.4, curvature=0.3, mu=0.6)
# without friction, which takes what else is kept; with it in the laws and the tests of its own
EGG = systems.Spheroid(
    **{"m": 1.2, "radius": 0.7, "half_height": 0.9, "offset": 0.15, "I1": 0.35, "I3": 0.3},
    **{"g": 2.5, "mu": 0.0, "slip_speed": 1.5},
)
THROWN = systems.ThrownBody(1.1, 1.7, 2.3, m=0.8, g=2.5)
SATELLITE = systems.Gyrostat(1.1, 1.7, 2.3, J1=0.1, J2=0.25, J3=0.2)
ORBITER = systems.Satellite(1.1, 1.7, 2.3, n=0.9, b=0.7, inclination=1.2)
SYSTEMS = (BODY, TOP, BALL, PLATE, DISK, EULER, COIN, ROLLER, EGG, THROWN, SATELLITE, ORBITER)
ANGLES = {"alpha_x", "alpha_y", "s", "latitude"}
"""Entries of states whose sines are taken: of those beyond 1e6 rad a sine has no digit."""
TURNING = tuple(system for system in SYSTEMS if "q" in system.components)


def name_of(system):
    return type(system).__name__


each_system = pytest.mark.parametrize("system", SYSTEMS, ids=name_of)
each_turning = pytest.mark.parametrize("system", TURNING, ids=name_of)
each_type = pytest.mark.parametrize("system_type", [type(system) for system in SYSTEMS])


def states(system, rng, *lead):
    """States of shape (*lead, n_state): attitudes all over the sphere, everything else near 1.

    Coins are upright; disks lean by up to 0.4 rad, and spin fast enough to stay so. Plates tilt by
    some tenths.
    """
    y = rng.normal(size=(*lead, len(system.state_entries)))
    if system is PLATE:
        y[..., 9:] *= 0.2
    if system in (DISK, EULER):
        y[..., :4] = upright(rng, 0.4, lead)
        y[..., 6] += 4.0
    elif system is COIN:
        y[..., :4] = upright(rng, 0.0, lead)
    elif system in TURNING:
        y[..., :4] /= np.linalg.norm(y[..., :4], axis=-1, keepdims=True)
    return y


def upright(rng, lean, lead):
    """Attitudes of a wheel that leans by up to `lean` [rad]."""
    phi, theta, psi = rng.uniform(-1.0, 1.0, (3, *lead))
    angles = np.stack([np.pi * phi, 0.5 * np.pi + lean * theta, np.pi * psi], axis=-1)
    return rotations.quaternion_from_euler(angles)


def inputs(system, rng, *lead):
    """Inputs of shape (*lead, n_input), near 1; plates are tilted gently, ratios increased."""
    u = rng.uniform(-1.0, 1.0, (*lead, len(system.input_entries)))
    if system is PLATE:
        u[..., 2:] *= 0.2
    elif system is ROLLER:
        u[..., 1] = np.abs(u[..., 1])
    return u
