"""Newton's law for a turning body, integrated in world axes by SciPy."""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_ivp

from rigid_envs.laws.stencil import matrices

__all__ = ["newton"]

Array = npt.NDArray[np.float64]


def newton(
    moments: Array, y0: Array, dt: float, inputs: Array, torque: Callable[[Array, Array], Array]
) -> tuple[Array, Array]:
    """Attitude and rates of a body that turns about a fixed point, after each of some intervals.

    In the *world* the momentum L changes by the torque, ``L' = torque(R, u)``, and the body turns
    with ``omega = R I^-1 R^T L``, ``R' = [omega] R``: no equation of Euler's, no quaternion.

    Args:
        moments: along the body axes, at the fixed point, shape (3,) [kg m^2].
        y0: state that begins with q and omega_body.
        dt: length of an interval [s].
        inputs: one for each interval, shape (n, n_input).
        torque: about the fixed point, in world axes [N m], of matrix and input.

    Returns:
        R, shape (n, 3, 3), and omega_body [rad/s], shape (n, 3), at the end of each interval; by
        DOP853 with a relative tolerance of 1e-12 per step.
    """

    def rate(_: float, z: Array, u: Array) -> Array:
        R = z[:9].reshape(3, 3)
        omega = R @ ((R.T @ z[9:]) / moments)
        return np.concatenate([np.ravel(np.cross(omega, R.T).T), torque(R, u)])

    R0 = matrices(y0[:4])
    z = np.concatenate([np.ravel(R0), R0 @ (moments * y0[4:7])])
    ends = []
    for u in inputs:
        z = solve_ivp(rate, (0.0, dt), z, "DOP853", args=(u,), rtol=1e-12, atol=1e-14).y[:, -1]
        ends.append(z)
    R, L = np.array(ends)[:, :9].reshape(-1, 3, 3), np.array(ends)[:, 9:]
    return R, np.einsum("nji,nj->ni", R, L) / moments
