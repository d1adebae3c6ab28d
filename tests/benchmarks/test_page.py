"""Speeds: the page is that of its data, and operations are counted as by hand and as in C."""

import json
import math
import shutil
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest

from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import fma, select, sqrt
from rigid_envs.systems.rolling_ball.dynamics import ROLLING_BALL
from rigid_envs.tools.bench.accuracy import free_run
from tests.benchmarks import fresh_starts, more_search, ppo_phases
from tests.benchmarks.__main__ import DOCS
from tests.benchmarks.flops import IDS, KINDS, count, flops, of_period, of_substep
from tests.benchmarks.kernel_vs_c import CASES, KERNELS, difference, loops
from tests.benchmarks.limit import limit, period
from tests.benchmarks.page import markdown
from tests.benchmarks.stock_ppo import TRAINERS, measure
from tests.benchmarks.targets import MINUTE, SIX_THOUSAND_SECONDS, over_c, targets
from tests.cli.test_bench import FIGURES


def test_the_page_of_the_repository_is_that_of_its_data():
    data = json.loads((DOCS / "speed.json").read_text())
    assert (DOCS / "speed.md").read_text() == markdown(data)


def test_tables_of_fresh_starts_are_those_of_their_data():
    data = json.loads(fresh_starts.DATA.read_text(encoding="utf-8"))
    for kind, file in fresh_starts.PAGES.items():
        text = file.read_text(encoding="utf-8")
        assert text == fresh_starts.page(kind, text, data)


def test_the_table_of_more_search_is_that_of_its_data():
    data = json.loads(more_search.DATA.read_text(encoding="utf-8"))
    text = more_search.PAGE.read_text(encoding="utf-8")
    assert text == more_search.page(text, data)
    for env_id, found in data.items():
        assert found["means"] == sorted(found["means"], reverse=True), env_id


def test_the_phases_of_a_training_add_up_and_none_is_counted_twice():
    found = ppo_phases.measure("IntermediateAxis", 40_000)
    assert found["timesteps"] > 0 and sum(found["shares"].values()) == pytest.approx(1.0)
    assert min(found["shares"].values()) > 0.0


@pytest.mark.long
def test_curves_on_rows_of_either_kind_are_the_same_and_times_are_positive():
    single, ours, application = found = measure((0,), 5 * 256 * 64)
    assert [kind.name for kind in found] == list(TRAINERS)
    assert single.returns == ours.returns
    for kind in found:
        assert [len(returns) for returns in kind.returns] == [len(kind.fractions)]
        assert min(kind.seconds) > 0.0 and kind.timesteps == application.timesteps


@pytest.mark.parametrize(("duration", "limits"), [(60.0, MINUTE), (6000.0, SIX_THOUSAND_SECONDS)])
def test_free_body_is_as_exact_as_promised(duration, limits):
    run = free_run(0.05, duration)
    for name, bound in limits.items():
        assert getattr(run, name) <= bound


def test_every_figure_has_its_verdict():
    verdicts = {target.text: (target.value, target.is_met) for target in targets(FIGURES)}
    free_body, rows = "IntermediateAxis-v0", "CartPole-v1, NumPy"
    assert verdicts[f"{free_body}, single, made, against CartPole-v1"][1]
    assert verdicts[f"{free_body}, N = 4096, against {rows}"] == (pytest.approx(32 / 24), False)
    assert verdicts["dearest row of 4096 (BallPark-v0)"] == (pytest.approx(3.5625), False)
    assert verdicts["omega_end of a free body, 60 s"] == (5e-10, True)
    assert verdicts["omega_end of a free body, 6000 s"] == (1e-6, False)
    assert verdicts["import to first step, compiled before [s]"] == (0.8, True)
    assert verdicts["import to first step, empty cache [s]"] == (6.0, False)
    assert [text for text in verdicts if "MuJoCo RK4 x 4" in text]
    assert not [text for text in verdicts if "N = 16" in text]  # was not measured


def test_the_kernels_may_take_a_fifth_more_than_the_faster_loop_in_c():
    for ratio, met in ((0.9, True), (0.8, False)):
        loops = [SimpleNamespace(ratio=each) for each in (1.0, 1.5, ratio)]
        assert over_c(loops).is_met == met


class Point(NamedTuple):
    x: float
    y: float


@scalar
def half(x):
    return 0.5 * x


@scalar
def everything(a, b, h):
    length = sqrt(fma(a.x, a.x, a.y * a.y))  # fma, product, root
    again = math.sqrt(fma(a.x, a.x, a.y * a.y))  # computed before
    ratio = b[0] / length - 0.25 * h * b[1]  # quotient, product, sum: 0.25 * h is of all rows
    shifted = fma(b[0], 1.0, ratio) + abs(-b[1])  # sum, sum
    return again, half(select(ratio < 0.0, shifted, 1.0)), max(b[0], h)  # product, three choices


def test_every_kind_is_counted():
    counts = count(everything, Point(3.0, 4.0), (1.0, 2.0), 0.1)
    assert counts == {"sum": 3, "product": 3, "fma": 1, "quotient": 1, "root": 1, "choice": 3}
    assert flops(counts) == 3 + 3 + 2 + 1 + 1


def test_the_step_of_the_ball_is_that_of_its_source():
    # step: the rate of rolling takes 2 products, half the turn 3, its square 1, s times it 3, the
    # quaternion 4; fma are 2 in the square, 7 and 8 in the polynomials, 12 in the quaternion, 2 in
    # the position. restore: 1 + 4 products, 3 + 1 fma
    substep = of_substep(ROLLING_BALL)
    assert substep["product"] == 2 + 3 + 1 + 3 + 4 + 1 + 4
    assert substep["fma"] == 2 + 7 + 8 + 12 + 2 + 3 + 1
    assert flops(substep) == 18 + 2 * 35
    assert of_period("BallPark") == substep


@pytest.mark.parametrize("kind", KINDS)
def test_a_period_is_all_of_its_substeps(kind):
    assert of_period("Reorient")[kind] == 2 * of_period("IntermediateAxis")[kind]


# 1e-16 per operation and some hundred operations per step: as a random walk, 2.5e-14 in 100 steps.
_ROUNDING = 2.5e-14
# What this becomes by the end, in the largest number of a state.
_GROWTH = {
    "free body": 400.0,  # departures from the unstable axis grow by exp(0.6 * 10) in 10 s
    "heavy top": 40.0,  # stable: an error of a rate of 8 rad/s becomes one of an angle in 5 s
    "rolling ball": 11.0,  # no growth, but 1 m/s lead to 11 m
    "rolling disk": 9.0,  # stable, as the top: 5 rad/s and 1.7 s
}


@pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")
@pytest.mark.parametrize("system", CASES)
def test_kernel_and_c_integrate_the_same_equations_to_rounding(system):
    case = CASES[system]
    others = [name for name in loops(case) if name != KERNELS]
    assert others
    for name in others:
        assert difference(case, name) < _ROUNDING * _GROWTH[system]


@pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")
def test_every_environment_is_measured():
    found = limit(rounds=1)
    assert [each.env_id for each in found.periods] == list(IDS)
    assert min(found.per_nanosecond.values()) > 0.0
    assert all(min(each.nanoseconds.values()) > 0.0 for each in found.periods)


def test_times_are_those_of_the_operations_and_ratios_are_to_ours():
    core = {"fma": 0.25, "sum": 0.5, "quotient": 2.0, "root": 4.0}
    of_core = {kind: np.full(3, time) for kind, time in core.items()}  # [ns]
    row = {KERNELS: 100.0, "C, slower": 400.0, "C, faster": 200.0, "step": 1000.0}
    found = period("IntermediateAxis", of_core, {k: np.full(3, time) for k, time in row.items()})
    counts = of_period("IntermediateAxis")
    written = (
        0.5 * counts["sum"]
        + 0.25 * (counts["product"] + counts["fma"])
        + 2.0 * counts["quotient"]
        + 4.0 * counts["root"]
    )
    fused = 0.5 * flops(counts) * 0.25
    times = {"all fused": fused, "as written": written, "C": 200.0, "ours": 100.0, "step": 1000.0}
    assert found.nanoseconds == pytest.approx(times)
    assert {name: ratio[0] for name, ratio in found.ratios.items()} == pytest.approx(
        {name: 100.0 / time for name, time in times.items()}
    )


def test_no_loop_on_the_page_is_faster_than_its_flops_in_multiply_adds():
    data = json.loads((DOCS / "speed.json").read_text())
    for each in data["limit"]["periods"]:
        times = each["nanoseconds"]
        assert 0.0 < times["all fused"] < min(times["C"], times["ours"])
