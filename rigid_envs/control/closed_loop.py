"""Sampled closed loops: simulation and region of attraction."""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from rigid_envs.checks import array, exact_array, integer, require

__all__ = ["region_of_attraction", "simulate_closed_loop"]

Array = npt.NDArray[np.float64]


def simulate_closed_loop(step: Callable[[Array], Array], y: npt.ArrayLike, n_steps: int) -> Array:
    """States of a closed loop under repeated steps: y, step(y), step(step(y)) and so on.

    With ``step = lambda y: system.advance(y, law.inputs(law(y)), dt, n_substeps)`` this is the
    closed loop as an environment runs it, the limits of the actuator included.

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
