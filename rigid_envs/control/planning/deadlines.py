"""Plans of least time: a deadline that is moved earlier as long as it can be met."""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, Integers
from rigid_envs.control.planning.descent import Plans, improve
from rigid_envs.control.planning.model import Model

_FIRST_CUT = 0.25  # part of its steps by which a plan is first to be shorter


def shorten(model: Model, actions: npt.NDArray[np.floating], n_cuts: int, n_rounds: int) -> Plans:
    """Shorten plans: where a deadline is met the next is as much earlier, else half as much.

    Args:
        model: Of the rows, timed.
        actions: Plans that succeed, shape (T, N, m).
        n_cuts: Number of deadlines.
        n_rounds: Linearisations for each.
    """
    plans = Plans(np.array(actions, dtype=np.float32), np.full(model.n_rows, np.inf))
    plans.keep(np.arange(model.n_rows), model.roll(np.asarray(actions, dtype=np.float64)))
    period = model.task.dt
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


def sooner(
    model: Model,
    plans: Plans,
    rows: Integers,
    first: Callable[[int, Integers], Array],
    n_rounds: int,
) -> Integers:
    """Let plans of a task that ends at success end a period earlier; the rows in which that is met.

    A plan has no action after its deadline, so that what comes later does not count.

    Args:
        model: Of all rows, timed.
        plans: The best so far; those that are met take their place.
        rows: Which to shorten.
        first: Plans to begin with, shape (T, n, m), from T and n rows.
        n_rounds: Linearisations.
    """
    longest = model.n_steps * model.task.dt
    ends = np.ceil(np.minimum(plans.costs[rows], longest) / model.task.dt - 1e-6).astype(int)
    better = []
    for n_steps in np.unique(ends[ends > 1]) - 1:
        part = rows[ends == n_steps + 1]
        found = improve(model.ending(part, int(n_steps)), first(int(n_steps), part), n_rounds)
        met = np.isfinite(found.costs)
        plans.actions[:, part[met]] = 0.0
        plans.actions[:n_steps, part[met]] = found.actions[:, met]
        plans.costs[part[met]] = found.costs[met]
        better.append(part[met])
    return np.concatenate([*better, rows[:0]])


def hurried(model: Model, plans: Plans, rows: Integers, n_rounds: int) -> None:
    """Run plans of a task that ends at success faster, as long as that is met; as `sooner`."""

    def faster(n_steps: int, part: Integers) -> Array:
        steps = np.ceil(plans.costs[part] / model.task.dt - 1e-6)
        return compressed(plans.actions[:, part], steps, np.full(len(part), n_steps))[:n_steps]

    rows = rows[np.isfinite(plans.costs[rows])]
    while len(rows):
        rows = sooner(model, plans, rows, faster, n_rounds)


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
