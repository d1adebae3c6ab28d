"""The page of speeds is that of its data, which trainings and targets are measured into."""

import json

import pytest

from rigid_envs.tools.bench.accuracy import free_run
from tests.bench.examples import FIGURES
from tests.benchmarks import ppo_phases
from tests.benchmarks.__main__ import DOCS
from tests.benchmarks.page import markdown
from tests.benchmarks.stock_ppo import TRAINERS, measure
from tests.benchmarks.targets import MINUTE, SIX_THOUSAND_SECONDS, targets


def test_the_page_of_the_repository_is_that_of_its_data() -> None:
    data = json.loads((DOCS / "speed.json").read_text())
    assert (DOCS / "speed.md").read_text() == markdown(data)


def test_the_phases_of_a_training_add_up_and_none_is_counted_twice() -> None:
    found = ppo_phases.measure("IntermediateAxis", 40_000)
    assert found.timesteps > 0 and sum(found.shares) == pytest.approx(1.0)
    assert min(found.seconds) > 0.0


@pytest.mark.long
def test_curves_on_rows_of_either_kind_are_the_same_and_times_are_positive() -> None:
    single, ours, application = found = measure((0,), 5 * 256 * 64)
    assert [kind.name for kind in found] == list(TRAINERS)
    assert single.returns == ours.returns
    for kind in found:
        assert [len(returns) for returns in kind.returns] == [len(kind.fractions)]
        assert min(kind.seconds) > 0.0 and kind.timesteps == application.timesteps


@pytest.mark.parametrize(("duration", "limits"), [(60.0, MINUTE), (6000.0, SIX_THOUSAND_SECONDS)])
def test_free_body_is_as_exact_as_promised(duration: float, limits: dict[str, float]) -> None:
    run = free_run(0.05, duration)
    for name, limit in limits.items():
        assert getattr(run, name) <= limit


def test_every_figure_has_its_verdict() -> None:
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
