"""Episodes begin as the pages say: what is seen first is distributed as that of their models."""

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


def columns(seen: Any) -> Array:
    """Numbers that are seen, to six places: what is one number but for rounding is one."""
    parts = [seen[key] for key in sorted(seen)] if isinstance(seen, dict) else [seen]
    return np.round(np.float64(np.float32(np.concatenate(parts, axis=-1))), 6)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_episodes_begin_as_the_page_says(kind: type[Model]) -> None:
    shown = {"observe_params": True}
    if kind.defaults()["rotation"] == "none" and kind is not wheels.RollPump:
        shown["rotation"] = "matrix"
    model, rng, ours = kind(**shown), np.random.default_rng(7), []
    for _ in range(N):
        params = model.draw_params(rng)
        model.begin(params, **model.draw_with(rng, params))
        ours.append(columns(model.observe()))
    theirs = columns(drawn(kind, N, **shown)[1])
    for k, (here, there) in enumerate(zip(np.transpose(ours), theirs.T, strict=True)):
        # of equal distributions one in ten thousand fails; the seeds are fixed
        assert ks_2samp(here, there).pvalue > 1e-4, k
        ends = np.array([[np.min(x), np.max(x)] for x in (here, there)])
        assert np.abs(ends[0] - ends[1]).max() <= 0.2 * np.ptp(ends[0]) + 1e-6, k
