"""The comparison with C compares the same thing."""

import shutil

import pytest

from tests.benchmarks.kernel_vs_c import c_loops, difference


@pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")
def test_kernel_and_c_integrate_the_same_equations_to_rounding() -> None:
    # 10 s at rates near 1 rad/s: 1e-16 per operation, some hundred operations per step, and
    # departures from the unstable axis that grow by exp(0.6 * 10)
    with c_loops() as loops:
        assert {name: difference(loop) < 1e-11 for name, loop in loops.items()} == {
            "stage_by_stage": True,
            "in_registers": True,
        }
