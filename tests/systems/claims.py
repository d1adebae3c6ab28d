"""Claims that hold of every controller, and derivatives along a motion."""

import numpy as np

from rigid_envs.mechanics import rotations


def assert_optimal(F, G, gain, P, Q, R, most=0.99, **tolerance):
    """Feedback is stable, and P solves the Riccati equation of the step F, G at the costs Q, R."""
    closed = F - G @ gain
    assert np.abs(np.linalg.eigvals(closed)).max() < most
    again = Q + gain.T @ R @ gain + closed.T @ P @ closed
    np.testing.assert_allclose(again, P, **tolerance)


def spinning(rng, lead, scale=1.0):
    """States of a free body, any attitude, omega normal [rad/s]."""
    omega = scale * rng.normal(size=(*lead, 3))
    return np.concatenate([rotations.random_quaternion(rng, lead), omega], axis=-1)


def rate_along(function, y, y_rate, columns):
    """Derivative along a motion of a function that is at most quadratic in these columns of y."""
    moved = np.zeros_like(y)
    moved[..., columns] = y_rate[..., columns]
    return 0.5 * (function(y + moved) - function(y - moved))
