"""What the core can do limits what it does."""

import json
import shutil

import numpy as np
import pytest

from tests.benchmarks.__main__ import DOCS
from tests.benchmarks.flops import IDS, flops, of_period
from tests.benchmarks.kernel_vs_c import KERNELS
from tests.benchmarks.limit import limit, period


@pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")
def test_every_environment_is_measured() -> None:
    found = limit(rounds=1)
    assert [each.env_id for each in found.periods] == list(IDS)
    assert min(found.per_nanosecond.values()) > 0.0
    assert all(min(each.nanoseconds.values()) > 0.0 for each in found.periods)


def test_times_are_those_of_the_operations_and_ratios_are_to_ours() -> None:
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


def test_no_loop_on_the_page_is_faster_than_its_flops_in_multiply_adds() -> None:
    data = json.loads((DOCS / "speed.json").read_text())
    for each in data["limit"]["periods"]:
        times = each["nanoseconds"]
        assert 0.0 < times["all fused"] < min(times["C"], times["ours"])
