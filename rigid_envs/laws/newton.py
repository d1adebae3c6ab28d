"""Rotation of a rigid body by Newton's law in world axes, integrated by SciPy."""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_ivp

__all__ = ["integrate_newton"]

Array = npt.NDArray[np.float64]


def integrate_newton(
    moments: Array,
    R0: Array,
    omega0: Array,
    dt: float,
    inputs: Array,
    torque: Callable[[Array, Array], Array],
) -> tuple[Array, Array]:
    """Attitude and angular velocity of a body about a fixed point, under piecewise constant inputs.

    In world axes ``L' = torque(R, u)``, ``omega = R I^-1 R^T L`` and ``R' = [omega] R``: neither
    Euler's equations nor quaternions. DOP853 with a relative tolerance of 1e-12 per step.

    Args:
        moments: along the body axes, about the fixed point, shape (3,) [kg m^2].
        R0: initial rotation matrix, shape (3, 3).
        omega0: initial angular velocity, body axes, shape (3,) [rad/s].
        dt: time that each input is held [s].
        inputs: one row per interval, shape (n, n_input).
        torque: about the fixed point, in world axes [N m], of R and u.

    Returns:
        R, shape (n, 3, 3), and omega_body [rad/s], shape (n, 3), at the end of each interval.
    """

    def rate(_: float, z: Array, u: Array) -> Array:
        R = z[:9].reshape(3, 3)
        omega = R @ ((R.T @ z[9:]) / moments)
        return np.concatenate([np.ravel(np.cross(omega, R.T).T), torque(R, u)])

    z = np.concatenate([np.ravel(R0), R0 @ (moments * omega0)])
    ends = []
    for u in inputs:
        z = solve_ivp(rate, (0.0, dt), z, "DOP853", args=(u,), rtol=1e-12, atol=1e-14).y[:, -1]
        ends.append(z)
    R, L = np.array(ends)[:, :9].reshape(-1, 3, 3), np.array(ends)[:, 9:]
    return R, np.einsum("nji,nj->ni", R, L) / moments
