"""The comparison with C compares the same thing."""

import shutil

import pytest

from tests.benchmarks.kernel_vs_c import CASES, KERNELS, difference, loops

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
def test_kernel_and_c_integrate_the_same_equations_to_rounding(system: str) -> None:
    case = CASES[system]
    others = [name for name in loops(case) if name != KERNELS]
    assert others
    for name in others:
        assert difference(case, name) < _ROUNDING * _GROWTH[system]
