"""What is computed from the samples: costs against the median, ratios to peers."""

import json

import pytest

from rigid_envs.tools.bench.measuring import costs
from tests.bench.examples import FIGURES


def test_costs_are_compared_with_the_median_of_the_same_round() -> None:
    found = {cost.name: cost for cost in FIGURES.costs}
    assert list(found) == ["IntermediateAxis-v0", "SleepingTop-v0", "BallPark-v0"]
    assert found["SleepingTop-v0"].ratio == 1.0
    assert found["BallPark-v0"].ratio == pytest.approx((20 / 5 + 25 / 8) / 2)
    assert found["BallPark-v0"].seconds == pytest.approx((1 / 5e6 + 1 / 8e6) / 2)
    assert costs(FIGURES.speeds[:3]) == []  # too few


def test_ratios_are_of_the_same_round_and_to_the_peers_that_were_measured() -> None:
    found = {(r.name, r.form, r.peer): r.median for r in FIGURES.ratios}
    free_body, rows = "IntermediateAxis-v0", "CartPole-v1, NumPy"
    assert found == {
        (free_body, "single, made", "CartPole-v1"): pytest.approx(4.75),
        (free_body, "N = 4096", rows): pytest.approx(32 / 24),
        ("BallPark-v0", "N = 4096", rows): pytest.approx(6.5 / 24),
        ("SleepingTop-v0", "N = 4096", rows): pytest.approx(22.5 / 24),
        (free_body, "N = 4096, equal energy error", "MuJoCo RK4 x 4"): pytest.approx(800.0),
    }


def test_json_holds_every_sample() -> None:
    document = json.loads(json.dumps(FIGURES.as_json(), allow_nan=False))
    assert document["steps_per_second"][0]["samples"] == [900e3, 1000e3]
    assert document["mujoco"][0]["name"] == "MuJoCo RK4 x 4"
    assert document["ratios"][0]["peer"] == "CartPole-v1"
