"""Linear control: Riccati, gains, closed loops, saturation."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.linalg import expm, solve_discrete_are

from rigid_envs.base.checks import Array, array, exact_array, integer, positive_array, require

# Saturation: actions projected onto the action space.


def clip_to_box(action: Array) -> Array:
    """Actions, shape (..., m), with each entry clipped to [-1, 1]."""
    return np.asarray(np.clip(action, -1.0, 1.0))


def clip_to_ball(action: Array) -> Array:
    """Actions, shape (..., m), with vectors longer than 1 scaled to length 1."""
    size = np.linalg.norm(action, axis=-1, keepdims=True)
    return np.asarray(action / np.maximum(size, 1.0))


# Sampled closed loops: simulation and region of attraction.


def simulate_closed_loop(step: Callable[[Array], Array], y: npt.ArrayLike, n_steps: int) -> Array:
    """States of a closed loop under repeated steps: y, step(y), step(step(y)) and so on.

    With ``step = lambda y: system.advance(y, controller.inputs(controller(y)), dt, n_substeps)``
    this is the closed loop as an environment runs it, the limits of the actuator included.

    Args:
        step: the state after a control period, as a function of states (..., n).
        y: first states, shape (..., n).
        n_steps: number of steps.

    Returns:
        Shape (n_steps + 1, ..., n).
    """
    states = [array(y, "y")]
    for _ in range(integer(n_steps, "n_steps", 0)):
        states.append(step(states[-1]))
    return np.stack(states)


def region_of_attraction(
    succeeds: Callable[[Array], npt.NDArray[np.bool_]],
    directions: npt.ArrayLike,
    sizes: npt.ArrayLike,
) -> Array:
    """Region of attraction of a closed loop, sampled along several directions.

    Every size is tried; what lies beyond the first failure does not count.

    Args:
        succeeds: whether motions succeed that start with perturbations of shape (..., k); of shape
            (...).
        directions: shape (N, k).
        sizes: what the directions are multiplied by, ascending, positive, shape (M,).

    Returns:
        For each direction the last size before the first failure, 0 if already the first one fails;
        shape (N,).

    Raises:
        ValueError: sizes that are not positive and ascending.
    """
    tried = exact_array(sizes, "sizes", "M")
    ascending = bool((np.diff(tried, prepend=0.0) > 0.0).all())
    require(ascending, tried, "sizes", "positive numbers in ascending order")
    won = succeeds(tried[:, None, None] * exact_array(directions, "directions", "N", "k"))
    n_won = np.sum(np.logical_and.accumulate(won, axis=0), axis=0)
    return np.asarray(np.concatenate([[0.0], tried])[n_won])


# Linear feedback: sampled linear models, linear-quadratic regulators, gain scheduling.

Matrix = npt.NDArray[Any]  # real or complex
_H = 1e-5  # differences: truncation h^2, rounding eps / h, both near 1e-10


class Regulator(NamedTuple):
    """A linear feedback u = -K x and its cost to go.

    The arrays may have leading axes, broadcast against those of the states, and be complex.

    Attributes:
        gain: K of the feedback u = -K x, shape (..., m, n).
        riccati: P of the cost to go x* P x, shape (..., n, n), symmetric or Hermitian.
    """

    gain: Matrix
    riccati: Matrix

    def feedback(self, x: Matrix) -> Matrix:
        """The input -K x of states x, shape (..., n); of shape (..., m)."""
        return -np.asarray(np.einsum("...ij,...j->...i", self.gain, x))

    def value(self, x: Matrix) -> Array:
        """Cost to go x* P x of states x, shape (..., n); of shape (...)."""
        return np.asarray(np.einsum("...i,...ij,...j->...", x.conj(), self.riccati, x).real)


def zero_order_hold(
    A: Matrix, B: Matrix, dt: float, turn: Matrix | None = None
) -> tuple[Matrix, Matrix]:
    """Zero-order hold: F and G of ``x+ = F x + G u`` for ``x' = A x + B u``, u held over dt.

    The upper rows (F G) of ``exp(dt (A B; 0 S))``, with S = 0 unless the frame of u turns.

    Args:
        A: shape (n, n) [1/s].
        B: shape (n, m).
        dt: control period [s].
        turn: S of ``u' = S u`` for an input that is held in another frame than that in which it is
            given, shape (m, m) [1/s].

    Returns:
        F of shape (n, n) and G of shape (n, m).

    Source: Van Loan 1978, doi:10.1109/TAC.1978.1101743.
    """
    # scipy.signal.cont2discrete has no S, and imports all of scipy.signal
    n, m = B.shape
    S = np.zeros((m, m)) if turn is None else turn
    whole = expm(dt * np.block([[A, B], [np.zeros((m, n)), S]]))
    return whole[:n, :n], whole[:n, n:]


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
        F of shape (n, n) and G of shape (n, n_input), with errors near 1e-10 of their scale.
    """
    n = len(x)
    moves = _H * np.eye(n + n_input)
    rows = [advance(x + sign * moves[:, :n], sign * moves[:, n:]) for sign in (1.0, -1.0)]
    jacobian = (rows[0] - rows[1]).T / (2.0 * _H)
    return jacobian[:, :n], jacobian[:, n:]


def lqr(F: Matrix, G: Matrix, Q: npt.ArrayLike, R: npt.ArrayLike) -> Regulator:
    """The feedback u = -K x that minimises the sum of ``x* Q x + u* R u``.

    ``P = Q + F* P (F - G K)`` and ``K = (R + G* P G)^-1 G* P F``: from x the sum is ``x* P x``,
    which decreases along every motion, so all eigenvalues of F - G K are inside the unit circle.

    Args:
        F: shape (n, n), real or complex.
        G: shape (n, m).
        Q: weights of the state, diagonal, shape (n,).
        R: weights of the input, diagonal, shape (m,).

    Raises:
        ValueError: weights that are not positive, or no feedback that makes the motion stable.

    Source: Anderson & Moore, *Optimal Control: Linear Quadratic Methods*, section 3.3.
    """
    n, m = G.shape
    weights = np.diag(positive_array(Q, "Q", "", n)), np.diag(positive_array(R, "R", "", m))
    try:
        P = solve_discrete_are(F, G, *weights)
    except np.linalg.LinAlgError as error:
        raise ValueError(
            f"G = {G.tolist()}; expected inputs by which feedback can stabilise F: {error}"
        ) from None
    back = G.conj().T @ P
    return Regulator(np.linalg.solve(weights[1] + back @ G, back @ F), P)


def scheduled(regulator: Callable[..., Regulator], *grids: Array) -> Callable[..., Regulator]:
    """Gain scheduling: a regulator as a function of arrays, by linear interpolation on a grid.

    Exact at the nodes; beyond the grid the nearest node counts. P stays positive definite.

    Args:
        regulator: of one number for each grid.
        *grids: ascending nodes of each number.
    """
    from scipy.interpolate import RegularGridInterpolator  # slow to import: only where one is made

    points = np.stack(np.meshgrid(*grids, indexing="ij"), axis=-1)
    found = [regulator(*point) for point in points.reshape(-1, len(grids))]
    shapes = [part.shape for part in found[0]]
    n = found[0].gain.size
    table = np.array([np.concatenate([part.ravel() for part in each]) for each in found])
    interpolate = RegularGridInterpolator(grids, table.reshape(*points.shape[:-1], -1))

    def look_up(*at: npt.ArrayLike) -> Regulator:
        inside = [np.clip(x, grid[0], grid[-1]) for x, grid in zip(at, grids, strict=True)]
        flat = np.asarray(interpolate(np.stack(np.broadcast_arrays(*inside), axis=-1)))
        lead = np.broadcast_shapes(*(x.shape for x in inside))
        return Regulator(
            flat[..., :n].reshape(*lead, *shapes[0]), flat[..., n:].reshape(*lead, *shapes[1])
        )

    return look_up


# Piecewise constant plans.


def piecewise_constant(values: Array, counts: npt.NDArray[np.int64]) -> Array:
    """Piecewise constant sequence: each value repeated for its number of steps, then zero.

    Args:
        values: K of them for each row, shape (..., K, m).
        counts: shape (..., K).

    Returns:
        Shape (T + 1, ..., m), T the steps of the longest row: the last step is zero for all.
    """
    lead, m = counts.shape[:-1], values.shape[-1]
    last = int(np.max(np.sum(counts, axis=-1), initial=0))
    steps = np.zeros((last + 1, *lead, m))
    for row in np.ndindex(lead):
        whole = np.repeat(values[row], counts[row], axis=0)
        steps[: len(whole), *row] = whole
    return steps
