"""The three systems with parameters of no symmetry, and random states and inputs for them."""

import numpy as np

from rigid_envs.systems import FreeBody, HeavyTop, RollingBall

SYSTEMS = (
    FreeBody(1.1, 1.7, 2.3),
    HeavyTop(1.3, 1.1, 0.6, m=0.8, g=9.5, ell=0.13),
    RollingBall(0.7),
)


def name_of(system):
    return type(system).__name__


def states(system, rng, *lead):
    """States of shape (*lead, n_state): attitudes all over the sphere, everything else near 1."""
    y = rng.normal(size=(*lead, len(system.state_entries)))
    y[..., :4] /= np.linalg.norm(y[..., :4], axis=-1, keepdims=True)
    return y


def inputs(system, rng, *lead):
    """Inputs of shape (*lead, n_input)."""
    return rng.uniform(-1.0, 1.0, (*lead, len(system.input_entries)))
