"""Elementary functions against mpmath in 50 digits, in units of the last place."""

import itertools
from fractions import Fraction

import mpmath
import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigid_envs.engine import elementary

mpmath.mp.dps = 50
EXACT = mpmath.mpf


def worst_ulps(found, exact):
    """Largest distance from the exact values, in units of their last place."""
    unit = [EXACT(float(np.spacing(abs(float(x))))) for x in exact]
    return max(
        float(abs(EXACT(float(f)) - x) / u) for f, x, u in zip(found, exact, unit, strict=True)
    )


def log_uniform(rng, low, high, size):
    return np.exp(rng.uniform(np.log(low), np.log(high), size))


@pytest.mark.parametrize(
    # Inside +-pi the argument is reduced by pi / 2 at most twice; up to 1e6 the three-part constant
    # leaves an error of 1e-33 n beside results that a double keeps away from 0 by 1e-11.
    ("limit", "bar"),
    [(np.pi, 2.0), (1e6, 2.5)],
)
def test_sine_and_cosine_are_exact_to_a_few_units_in_the_last_place(limit, bar):
    rng = np.random.default_rng(1)
    quarters = np.floor(limit / (0.5 * np.pi))
    worst_case = 0.5 * np.pi * rng.integers(-quarters, quarters + 1, 1000)  # where one of them is 0
    x = np.concatenate([rng.uniform(-limit, limit, 1500), worst_case, [0.0, 1e-300, -1e-9]])
    sine, cosine = np.array([elementary.sincos(value) for value in x]).T
    assert worst_ulps(sine, [mpmath.sin(EXACT(float(value))) for value in x]) < bar
    assert worst_ulps(cosine, [mpmath.cos(EXACT(float(value))) for value in x]) < bar


def test_sine_and_cosine_differ_from_numpy_by_a_rounding():
    x = np.random.default_rng(2).uniform(-1e3, 1e3, 20000)
    found = np.array([elementary.sincos(value) for value in x])
    expected = np.stack([np.sin(x), np.cos(x)], axis=-1)
    np.testing.assert_allclose(found, expected, rtol=0, atol=np.finfo(np.float64).eps)


def test_atan2_is_exact_to_a_few_units_in_the_last_place():
    rng = np.random.default_rng(3)
    y, x = rng.normal(size=(2, 3000)) * log_uniform(rng, 1e-12, 1e12, (2, 3000))
    near_diagonal = np.arange(1, 500) / 500.0  # through tan(pi / 8), where the formula changes
    y, x = np.concatenate([y, near_diagonal]), np.concatenate([x, np.ones(499)])
    exact = [mpmath.atan2(EXACT(float(a)), EXACT(float(b))) for a, b in zip(y, x, strict=True)]
    found = [elementary.atan2(a, b) for a, b in zip(y, x, strict=True)]
    assert worst_ulps(found, exact) < 3.0


def test_atan2_is_exact_on_the_axes_and_zero_at_the_origin():
    for y, x in ((0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (-1.0, 0.0), (0.0, -1.0), (1e-300, -1e300)):
        assert elementary.atan2(y, x) == np.arctan2(y, x)


def test_cube_roots_are_exact_to_a_few_units_in_the_last_place():
    rng = np.random.default_rng(4)
    x = np.concatenate([log_uniform(rng, 1e-300, 1e300, 3000), np.arange(1.0, 50.0) ** 3, [1e-300]])
    found = [elementary.cbrt(value) for value in x]
    assert worst_ulps(found, [mpmath.cbrt(EXACT(float(value))) for value in x]) < 4.0


def test_logarithms_are_exact_to_a_few_units_in_the_last_place():
    rng = np.random.default_rng(5)
    wide = log_uniform(rng, 1e-300, 1e300, 2000)
    near_one = 1.0 + rng.uniform(-1.0, 1.0, 2000) * log_uniform(rng, 1e-15, 0.7, 2000)
    x = np.concatenate([wide, near_one, rng.random(2000), [2.0**-53, 0.5, 2.0]])
    found = [elementary.log(value) for value in x]
    assert worst_ulps(found, [mpmath.log(EXACT(float(value))) for value in x]) < 4.0
    assert elementary.log(1.0) == 0.0


def near_and_far(rng, far):
    """Arguments of both signs up to `far`, and down to 1e-20."""
    return np.concatenate(
        [
            rng.uniform(-far, far, 1500),
            rng.uniform(-2.0, 2.0, 2000),
            rng.choice([-1.0, 1.0], 1000) * log_uniform(rng, 1e-20, 1.0, 1000),
        ]
    )


def test_exponentials_less_one_are_exact_to_a_few_units_in_the_last_place():
    rng = np.random.default_rng(6)
    x = np.concatenate([near_and_far(rng, 60.0), rng.uniform(60.0, 700.0, 1000)])
    found = [elementary.expm1(value) for value in x]
    assert worst_ulps(found, [mpmath.expm1(EXACT(float(value))) for value in x]) < 2.0
    assert elementary.expm1(0.0) == 0.0
    assert elementary.expm1(-1e300) == -1.0


def test_hyperbolic_tangents_are_exact_to_a_few_units_in_the_last_place():
    rng = np.random.default_rng(7)
    x = near_and_far(rng, 30.0)
    found = [elementary.tanh(value) for value in x]
    assert worst_ulps(found, [mpmath.tanh(EXACT(float(value))) for value in x]) < 3.0
    assert [elementary.tanh(value) for value in (0.0, 1e300, -1e300)] == [0.0, 1.0, -1.0]


@numba.njit
def compiled_fma(a, b, c):
    return elementary.fma(a, b, c)


NUMBERS = st.floats(-1e100, 1e100, allow_subnormal=False).filter(lambda x: x == 0 or abs(x) > 1e-90)


@given(NUMBERS, NUMBERS, NUMBERS)
def test_fused_multiply_add_rounds_once(a, b, c):
    assert compiled_fma(a, b, c) == float(Fraction(a) * Fraction(b) + Fraction(c))


def test_fused_multiply_add_keeps_what_two_roundings_lose():
    tiny = 2.0**-30
    assert compiled_fma(1.0 + tiny, 1.0 - tiny, -1.0) == -(tiny**2)


@numba.njit
def compiled_select(condition, a, b):
    return elementary.select(condition, a, b)


def test_select_takes_one_of_two_even_where_the_other_is_not_a_number():
    assert compiled_select(True, 1.0, np.nan) == 1.0
    assert compiled_select(False, np.nan, 2.0) == 2.0


@numba.njit
def compiled_sqrt(x):
    return elementary.sqrt(x)


@numba.njit
def compiled_sincos(x):
    return elementary.sincos(x)


@pytest.mark.parametrize("x", [1e-12, 0.3, 1.0, 2.0, 7.5, 1e12])
def test_the_square_root_carries_a_tiny_imaginary_part_as_its_tangent(x):
    assert compiled_sqrt(x) == np.sqrt(x)  # rounded once
    found = compiled_sqrt(complex(x, 1e-100))
    assert found.real == np.sqrt(x)
    assert found.imag == pytest.approx(1e-100 * 0.5 / np.sqrt(x), rel=1e-15)


@pytest.mark.parametrize("x", [0.0, 1e-9, 0.3, -2.0, 0.5 * np.pi, 100.0])
def test_sine_and_cosine_carry_a_tiny_imaginary_part_as_their_tangents(x):
    sine, cosine = compiled_sincos(x)
    assert (sine, cosine) == elementary.sincos(x)
    for part in (1e-100, -3e-90):
        along_sine, along_cosine = compiled_sincos(complex(x, part))
        assert (along_sine.real, along_cosine.real) == (sine, cosine)
        assert along_sine.imag == pytest.approx(part * np.cos(x), rel=1e-15, abs=1e-116)
        assert along_cosine.imag == pytest.approx(-part * np.sin(x), rel=1e-15, abs=1e-116)


@given(st.floats(0.1, 10.0), st.floats(-3.0, 3.0))
def test_chains_of_them_are_differentiated_exactly(a, b):
    sine, cosine = compiled_sincos(compiled_sqrt(complex(a, 1e-100)) * b)
    root = np.sqrt(a)
    slope = 0.5 * b / root
    assert sine.imag / 1e-100 == pytest.approx(slope * np.cos(root * b), rel=1e-14, abs=1e-15)
    assert cosine.imag / 1e-100 == pytest.approx(-slope * np.sin(root * b), rel=1e-14, abs=1e-15)


def test_clamp_has_the_bits_of_min_and_max_for_any_numbers():
    ends = (-np.inf, -1.5, -0.0, 0.0, 1.5, np.inf)
    for x in (*ends, np.nan, -2.0, 1.0):
        for low, high in itertools.product(ends, ends):
            found, expected = elementary.clamp(x, low, high), min(max(x, low), high)
            assert np.float64(found).tobytes() == np.float64(expected).tobytes()
