"""Linear feedback: a system linearised about a motion, as its environment steps it, and its LQR."""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from scipy.interpolate import RegularGridInterpolator
from scipy.linalg import solve_discrete_are

__all__ = ["lqr", "scheduled", "step_jacobian"]

Array = npt.NDArray[np.float64]
_H = 1e-5  # differences: truncation h^2, rounding eps / h, both near 1e-10


def step_jacobian(
    advance: Callable[[Array, Array], Array], x: Array, n_input: int
) -> tuple[Array, Array]:
    """F and G of ``x+ = x + F dx + G u`` about a fixed point x of a step, by central differences.

    Args:
        advance: ``advance(x, u)`` with rows x (N, n) and u (N, n_input): the states after a control
            period under the input held over it. Coordinates x do not take part in the motion that
            goes on at the fixed point (the spin of a top, the place of a wheel).
        x: the fixed point, shape (n,).
        n_input: number of inputs.

    Returns:
        F of shape (n, n) and G of shape (n, n_input).
    """
    n = len(x)
    moves = _H * np.eye(n + n_input)
    rows = [advance(x + sign * moves[:, :n], sign * moves[:, n:]) for sign in (1.0, -1.0)]
    jacobian = (rows[0] - rows[1]).T / (2.0 * _H)
    return jacobian[:, :n], jacobian[:, n:]


def lqr(F: Array, G: Array, Q: Array, R: Array) -> Array:
    """Gain K of the feedback u = -K x that minimises the sum of x Q x + u R u.

    ``K = (R + G' P G)^-1 G' P F`` with P of the discrete algebraic Riccati equation.

    Args:
        F: shape (n, n).
        G: shape (n, m).
        Q: weights of the state, diagonal, shape (n,).
        R: weights of the input, diagonal, shape (m,).

    Returns:
        Gain of shape (m, n).

    Source: Anderson & Moore, *Optimal Control: Linear Quadratic Methods*, section 3.3.
    """
    P = solve_discrete_are(F, G, np.diag(Q), np.diag(R))
    gain = np.linalg.solve(np.diag(R) + G.T @ P @ G, G.T @ P @ F)
    return np.asarray(gain)


def scheduled(gain: Callable[..., Array], *grids: Array) -> Callable[..., Array]:
    """The same gain as a function of arrays, interpolated linearly on a grid of its arguments."""
    points = np.stack(np.meshgrid(*grids, indexing="ij"), axis=-1)
    table = np.array([gain(*point) for point in points.reshape(-1, len(grids))])
    table = table.reshape(*points.shape[:-1], *table.shape[1:])
    interpolate = RegularGridInterpolator(grids, table)

    def look_up(*at: Array) -> Array:
        inside = [np.clip(x, grid[0], grid[-1]) for x, grid in zip(at, grids, strict=True)]
        return np.asarray(interpolate(np.stack(inside, axis=-1)))

    return look_up
