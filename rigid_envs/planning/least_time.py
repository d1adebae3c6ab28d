"""Plans of least time: a deadline that is moved earlier as long as it can be met."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rigid_envs.planning.descent import Plans, improve
from rigid_envs.planning.model import Model

__all__ = ["shorten"]

Array = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

_FIRST_CUT = 0.25  # part of its steps by which a plan is first to be shorter


def shorten(
    model: Model,
    actions: npt.NDArray[np.floating],
    n_cuts: int,
    n_rounds: int,
) -> Plans:
    """Shorten plans: where a deadline is met the next is as much earlier, else half as much.

    Args:
        model: Of the rows, timed.
        actions: Plans that succeed, shape (T, N, m).
        n_cuts: Number of deadlines.
        n_rounds: Linearisations for each.
    """
    plans = Plans(np.array(actions, dtype=np.float32), np.full(model.n_rows, np.inf))
    plans.keep(np.arange(model.n_rows), model.roll(np.asarray(actions, dtype=np.float64)))
    period = model.task.dt * model.repeat
    cut = _FIRST_CUT * plans.costs / period
    for _ in range(n_cuts):
        steps = np.ceil(np.where(np.isinf(plans.costs), 0.0, plans.costs) / period - 1e-6)
        goal = np.maximum(steps - np.maximum(np.round(cut), 1.0), 1.0)
        rows = np.nonzero((cut >= 0.5) & (steps > 1.0))[0]
        if not len(rows):
            break
        part = model.part(rows)
        part.first = goal[rows].astype(np.int64)
        plan = compressed(plans.actions[:, rows], steps[rows], goal[rows])
        found = improve(part, plan, n_rounds)
        met = found.costs < plans.costs[rows] - 0.5 * period
        plans.actions[:, rows[met]] = found.actions[:, met]
        plans.costs[rows[met]] = found.costs[met]
        cut[rows[~met]] /= 2.0
    return plans


def compressed(actions: npt.NDArray[np.floating], steps: Array, goal: Array) -> Array:
    """Plans run faster, so that what took `steps` takes `goal` of them, with stronger actions.

    Args:
        actions: Shape (T, N, m).
        steps: Shape (N,).
        goal: Shape (N,).
    """
    speed = steps / goal
    t = np.arange(len(actions))[:, None] * speed
    at = np.minimum(np.round(t).astype(int), len(actions) - 1)
    return np.asarray(actions[at, np.arange(actions.shape[1])] * speed[:, None] ** 2, dtype=float)
