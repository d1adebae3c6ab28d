"""Episodes begin as the pages say: starts, and what is seen first, are distributed as theirs."""

from typing import Any

import numpy as np
import pytest
from scipy.stats import ks_2samp

from rigid_envs.base.checks import Array
from tests.from_pages import balls, bodies, pushed_balls, tops, wheels
from tests.from_pages.model import Model
from tests.from_pages.side_by_side import drawn

KINDS: tuple[type[Model], ...] = (
    *bodies.KINDS,
    *tops.KINDS,
    *(balls.BallPark, balls.BallParkRandom, balls.BallReorient, balls.BallParkGoal),
    *(balls.BallGrid, balls.BallSteer, pushed_balls.BallParkDynamic, pushed_balls.BallPlate),
    *(wheels.CoinPark, wheels.DiskRoll, wheels.DiskRollRandom, wheels.RollPump),
)
N = 2000


def row(*parts: Any) -> Array:
    """All numbers but those of quaternions, whose sign has no meaning: they are seen as matrices.

    To six places: what is one number but for rounding is one.
    """
    dicts = [part if isinstance(part, dict) else {"": part} for part in parts]
    values = [np.ravel(each[key]) for each in dicts for key in sorted(each) if key != "q"]
    whole = np.concatenate([value for value in values if len(value) != 4])
    return np.round(np.float64(np.float32(whole)), 6)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_episodes_begin_as_the_page_says(kind: type[Model]) -> None:
    shown: dict[str, Any] = {"observe_params": True}
    if kind.defaults()["rotation"] == "none" and kind is not wheels.RollPump:
        shown["rotation"] = "matrix"
    model, rng = kind(**shown), np.random.default_rng(7)
    y, seen, envs = drawn(kind, N, **shown)
    aux, parts = envs.unwrapped.get_state().get("aux", []), envs.unwrapped.task.system_type
    ours, theirs = [], []
    for k in range(N):
        params = model.draw_params(rng)
        start = model.draw_with(rng, params)
        model.begin(params, **start)
        ours.append(row(model.observe(), start))
        state = {name: y[k, at] for name, at in parts.components.items() if name in start}
        beside = model.beside(aux[k] if len(aux) else np.empty(0))
        first = {key: part[k] for key, part in seen.items()} if isinstance(seen, dict) else seen[k]
        theirs.append(row(first, state | beside))
    for k, (here, there) in enumerate(zip(np.transpose(ours), np.transpose(theirs), strict=True)):
        # of equal distributions one in ten thousand fails; the seeds are fixed
        assert ks_2samp(here, there).pvalue > 1e-4, k
        for power in (1, 2):  # moments, to five of their standard errors
            a, b = here**power, there**power
            error = np.sqrt((a.var() + b.var()) / N)
            assert abs(a.mean() - b.mean()) <= 5.0 * error + 1e-6, (k, power)
