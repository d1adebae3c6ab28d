"""Targets: those of accuracy are met, and a figure on the wrong side of its limit is missed."""

import pytest

from rigid_envs.tools.bench.accuracy import free_run
from tests.bench.examples import FIGURES
from tests.benchmarks.targets import MINUTE, SIX_THOUSAND_SECONDS, targets


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
