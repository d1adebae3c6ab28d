"""How motions are judged: orders, drifts, and Newton's law integrated by somebody else."""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from rigid_envs.systems import FreeBody, HeavyTop

__all__ = [
    "EPS",
    "is_level",
    "leaning",
    "matrices",
    "newton",
    "orders",
    "random_attitude",
    "random_moments",
    "same_attitude",
    "sample_steps",
]

Array = npt.NDArray[np.float64]
EPS = float(np.finfo(np.float64).eps)


def orders(errors: list[float]) -> Array:
    """Powers of the step with which errors fall, for steps that are halved each time."""
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


def is_level(t: Array, values: Array, share: float = 0.1) -> bool:
    """Whether values oscillate but go nowhere.

    The straight line that fits them best changes by less than a share of their size in all the
    time. An oscillation seen at 20 000 moments leaves a hundredth; 1e-12 is for roundings.
    """
    slope = np.polyfit(t / (t[-1] - t[0]), values, 1)[0]
    return abs(slope) <= share * np.max(np.abs(values)) + 1e-12


def sample_steps(n_steps: int, size: int = 20000) -> Array:
    """Numbers of steps at which to look, 0 and `n_steps` among them.

    Irregular: regular ones can beat with a periodic motion, and a beat looks like a drift.
    """
    inside = np.random.default_rng(0).choice(n_steps - 1, size, replace=False) + 1
    return np.concatenate([[0], np.sort(inside), [n_steps]])


def matrices(q: npt.ArrayLike) -> Array:
    """Rotation matrices of quaternions (w, x, y, z), shape (n, 3, 3), by SciPy."""
    rows = np.asarray(q, dtype=np.float64).reshape(-1, 4)
    return Rotation.from_quat(rows, scalar_first=True).as_matrix()


def same_attitude(found: Array, expected: Array) -> float:
    """Largest difference of the rotation matrices of two series of quaternions."""
    return float(np.max(np.abs(matrices(found) - matrices(expected))))


def leaning(theta: float) -> tuple[float, float, float, float]:
    """Attitude with Euler angles (0, theta, 0): turned about world x."""
    return (np.cos(0.5 * theta), np.sin(0.5 * theta), 0.0, 0.0)


def random_attitude(rng: np.random.Generator) -> Array:
    """A unit quaternion, uniform on the rotation group."""
    q = rng.normal(size=4)
    return q / np.linalg.norm(q)


def random_moments(rng: np.random.Generator) -> Array:
    """Principal moments of a body: second moments of mass along the axes, added in pairs."""
    a, b, c = rng.uniform(0.05, 1.0, 3)
    return np.array([b + c, c + a, a + b])


def newton(
    system: FreeBody | HeavyTop,
    y0: Array,
    dt: float,
    inputs: Array,
    torque: Callable[[Array, Array], Array],
) -> tuple[Array, Array]:
    """Rotation matrices and body rates at the end of each interval of length dt under its input.

    Newton's law in the *world*: the momentum L changes by the torque, ``L' = torque(R, u)``, and
    the body turns with omega = R I^-1 R^T L, ``R' = [omega] R``. No equation of Euler's, no
    quaternion and none of our code; DOP853 of SciPy at rtol 1e-12.
    """
    moments = np.array([system.I1, system.I2, system.I3])
    R = matrices(y0[:4])[0]
    z = np.concatenate([np.ravel(R), R @ (moments * y0[4:7])])

    def rate(_: float, z: Array, u: Array) -> Array:
        R = z[:9].reshape(3, 3)
        omega = R @ ((R.T @ z[9:]) / moments)
        return np.concatenate([np.ravel(np.cross(omega, R.T).T), torque(R, u)])

    ends = []
    for u in inputs:
        z = solve_ivp(rate, (0.0, dt), z, "DOP853", args=(u,), rtol=1e-12, atol=1e-14).y[:, -1]
        ends.append(z)
    R = np.array(ends)[:, :9].reshape(-1, 3, 3)
    return R, np.einsum("nji,nj->ni", R, np.array(ends)[:, 9:]) / moments
