"""Functions that compiled code is made of: vectors and matrices, elementary, random, networks."""

import itertools
import math
from fractions import Fraction
from itertools import pairwise

import mpmath
import numba
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy import stats

from rigid_envs.engine import algebra, elementary, randoms
from rigid_envs.engine.network import ACTIVATIONS, perceptron, relative_rotations
from tests.mechanics.attitudes import ULPS, quaternions, scipy_of, vectors

# Algebra of vectors and quaternions: turns, their polynomials, weights of the parts of a step.


def row(array):
    return tuple(float(x) for x in array)


def close(found, expected, size=1.0):
    np.testing.assert_allclose(found, expected, rtol=0, atol=ULPS * size)


@given(vectors, vectors)
def test_products_of_vectors_are_numpys(a, b):
    close(algebra.dot(row(a), row(b)), np.dot(a, b))
    close(algebra.cross(row(a), row(b)), np.cross(a, b))
    assert algebra.scaled(2.5, row(a)) == row(2.5 * a)


@given(quaternions)
def test_matrix_and_vertical_are_those_of_the_rotation(q):
    R = scipy_of(q).as_matrix()
    close(np.reshape(algebra.matrix(row(q)), (3, 3)), R)
    close(algebra.vertical(row(q)), R.T @ (0.0, 0.0, 1.0))


@given(quaternions, quaternions)
def test_the_product_of_a_matrix_and_a_transpose_is_numpys(p, q):
    A, B = scipy_of(p).as_matrix(), scipy_of(q).as_matrix()
    close(np.reshape(algebra.matrix_product(row(A.ravel()), row(B.ravel())), (3, 3)), A @ B.T)


@given(quaternions)
@example((1.0, 0.0, 0.0, 0.0))
@example((0.0, 1.0, 0.0, 0.0))
@example((0.0, 0.0, 1.0, 0.0))
@example((0.0, 0.0, 0.0, 1.0))
def test_the_quaternion_of_a_matrix_turns_as_it_does(q):
    R = scipy_of(q).as_matrix()
    found = algebra.unit_quaternion(row(R.ravel()))
    close(np.dot(found, found), 1.0)
    close(scipy_of(found).as_matrix(), R)


@given(quaternions)
def test_the_logarithm_is_the_rotation_vector(q):
    found = np.array(algebra.log_rotation(row(q)))
    expected = scipy_of(q).as_rotvec()
    # At half a turn both signs of the axis are right.
    if np.linalg.norm(expected) > math.pi - 1e-6:
        found, expected = np.outer(found, found), np.outer(expected, expected)
    close(found, expected, 2.0 * math.pi)


@given(st.floats(1e-300, 1e-3), vectors.filter(lambda v: np.linalg.norm(v) > 0.1))
def test_the_logarithm_of_a_small_turn_keeps_its_relative_accuracy(angle, v):
    axis = v / np.linalg.norm(v)
    q = (math.cos(0.5 * angle), *row(math.sin(0.5 * angle) * axis))
    close(np.array(algebra.log_rotation(q)) / angle, axis)


def test_the_logarithm_of_no_turn_is_zero():
    assert algebra.log_rotation((1.0, 0.0, 0.0, 0.0)) == (0.0, 0.0, 0.0)
    assert not any(algebra.log_rotation((-1.0, 0.0, 0.0, 0.0)))


@pytest.mark.parametrize("excess", [1e-15, -1e-12, 1e-9, -1e-8])
def test_one_newton_step_restores_a_length_that_is_nearly_one(excess):
    q = (1.0 + excess) * np.array([0.5, -0.5, 0.1, 0.7])
    # Newton's step on 1 / sqrt: what is left is 1.5 excess^2, and roundings.
    length = np.linalg.norm(algebra.normalize_near_unit(row(q)))
    assert length == pytest.approx(1.0, abs=1.5 * excess**2 + ULPS)


EPS = float(np.finfo(np.float64).eps)
TINY = [0.0, 1e-300, 1e-20]


@pytest.mark.parametrize("x", [0.01, 0.1, 0.2, 0.3, 0.4, 0.5])
def test_the_tangent_of_half_a_turn_is_exact_but_for_its_first_neglected_term(x):
    exact = mpmath.tan(mpmath.mpf(x)) / mpmath.mpf(x)
    error = abs(float(algebra.tangent(x * x) - exact))
    assert error <= 0.01 * x**10 + 2.0 * EPS


@pytest.mark.parametrize("z", TINY)
def test_the_tangent_of_no_turn_is_its_argument(z):
    assert algebra.tangent(z) == 1.0


@pytest.mark.parametrize("a", [0.0, 1e-9, -0.3, 1.0, 7.0])
def test_versine_and_sine_of_a_cayley_turn_are_those_of_its_angle(a):
    versine, sine = algebra.cayley(a)
    angle = 2 * mpmath.atan(mpmath.mpf(a))
    assert sine == pytest.approx(float(mpmath.sin(angle)), rel=4.0 * EPS)
    assert versine == pytest.approx(float(1 - mpmath.cos(angle)), rel=8.0 * EPS)


def test_suzuki_coefficients_are_the_closed_form_rounded_once():
    outer = float(1 / (4 - mpmath.cbrt(mpmath.mpf(4))))
    assert algebra.SUZUKI == (outer, outer, 1.0 - 4.0 * outer, outer, outer)


def test_suzuki_coefficients_fulfil_the_order_conditions_of_a_symmetric_fourth_order_method():
    assert algebra.SUZUKI == algebra.SUZUKI[::-1]
    # Consistency, and no third-order term: Hairer, Lubich & Wanner, theorem II.4.1.
    assert sum(algebra.SUZUKI) == 1.0  # exactly: a million steps last a million steps
    assert sum(weight**3 for weight in algebra.SUZUKI) == pytest.approx(0.0, abs=2e-16)


def test_the_exact_flow_is_taken_in_one_piece():
    assert algebra.EXACT == (1.0,)


# Elementary functions against mpmath in 50 digits, in units of the last place.


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


def cubes(rng):
    wide = log_uniform(rng, 1e-300, 1e300, 3000)
    return np.concatenate([wide, np.arange(1.0, 50.0) ** 3, [1e-300]])


def positive(rng):
    wide = log_uniform(rng, 1e-300, 1e300, 2000)
    near_one = 1.0 + rng.uniform(-1.0, 1.0, 2000) * log_uniform(rng, 1e-15, 0.7, 2000)
    return np.concatenate([wide, near_one, rng.random(2000), [2.0**-53, 0.5, 2.0]])


def near_and_far(rng, far):
    """Arguments of both signs up to `far`, and down to 1e-20."""
    small = rng.choice([-1.0, 1.0], 1000) * log_uniform(rng, 1e-20, 1.0, 1000)
    return np.concatenate([rng.uniform(-far, far, 1500), rng.uniform(-2.0, 2.0, 2000), small])


def up_to_700(rng):
    return np.concatenate([near_and_far(rng, 60.0), rng.uniform(60.0, 700.0, 1000)])


@pytest.mark.parametrize(
    ("name", "bar", "arguments", "known"),
    [
        ("cbrt", 4.0, cubes, {}),
        ("log", 4.0, positive, {1.0: 0.0}),
        ("expm1", 2.0, up_to_700, {0.0: 0.0, -1e300: -1.0}),
        ("tanh", 3.0, lambda rng: near_and_far(rng, 30.0), {0.0: 0.0, 1e300: 1.0, -1e300: -1.0}),
    ],
)
def test_a_function_is_exact_to_a_few_units_in_the_last_place(name, bar, arguments, known):
    function, exact = getattr(elementary, name), getattr(mpmath, name)
    x = arguments(np.random.default_rng(4)).tolist()
    assert worst_ulps([function(v) for v in x], [exact(EXACT(v)) for v in x]) < bar
    assert {v: function(v) for v in known} == known


@numba.njit
def compiled_fma(a, b, c):
    return elementary.fma(a, b, c)


NUMBERS = st.floats(-1e100, 1e100, allow_subnormal=False).filter(lambda x: x == 0 or abs(x) > 1e-90)


@given(NUMBERS, NUMBERS, NUMBERS)
@example(1.0 + 2.0**-30, 1.0 - 2.0**-30, -1.0)  # nothing is left by two roundings
def test_fused_multiply_add_rounds_once(a, b, c):
    assert compiled_fma(a, b, c) == float(Fraction(a) * Fraction(b) + Fraction(c))


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


def test_clamp_has_the_bits_of_min_and_max_for_any_numbers():
    ends = (-np.inf, -1.5, -0.0, 0.0, 1.5, np.inf)
    for x in (*ends, np.nan, -2.0, 1.0):
        for low, high in itertools.product(ends, ends):
            found, expected = elementary.clamp(x, low, high), min(max(x, low), high)
            assert np.float64(found).tobytes() == np.float64(expected).tobytes()


# Counter-based random numbers: bit for bit NumPy's Philox, and distributed as they say.


SIZE = 20000
WORD = st.integers(0, 2**64 - 1)
# The draws are fixed, so a test of a distribution passes or fails for good: a p-value above 1e-3 is
# what 999 of 1000 correct generators give. Means of SIZE numbers are taken at 4 standard errors.
P_VALUE = 1e-3


@numba.njit
def philox(counter, key):
    return randoms.philox(counter[0], counter[1], counter[2], counter[3], key[0], key[1])


def stream_of(*numbers):
    return tuple(np.uint64(number) for number in numbers)


@given(st.tuples(WORD, WORD, WORD, WORD), st.tuples(WORD, WORD))
def test_philox_is_numpys_bit_for_bit(counter, key):
    # NumPy counts up before it generates.
    before = (sum(word << 64 * k for k, word in enumerate(counter)) - 1) % 2**256
    generator = np.random.Philox(counter=before, key=np.array(key, dtype=np.uint64))
    found = philox(np.array(counter, dtype=np.uint64), np.array(key, dtype=np.uint64))
    assert [int(word) for word in found] == [int(word) for word in generator.random_raw(4)]


@given(WORD, st.integers(0, 2**53), st.integers(0, 2**31), st.integers(0, 2**40))
def test_a_uniform_number_is_numpys_of_that_key_and_counter(key, episode, use, index):
    before = (index + (use << 64) + (episode << 128) - 1) % 2**256
    generator = np.random.Generator(
        np.random.Philox(counter=before, key=np.array([key, 0], dtype=np.uint64))
    )
    stream = stream_of(key, episode, use)
    assert randoms.uniform(stream, index) == generator.random()


def draws(function, key=7, episode=3, use=1):
    """`SIZE` values of a function of (stream, index), shape (SIZE, k), indices far apart."""
    stream = stream_of(key, episode, use)
    return np.array([function(stream, 2**20 * k) for k in range(SIZE)])


def uniform_on(values, low, high):
    return stats.kstest(values, stats.uniform(low, high - low).cdf).pvalue > P_VALUE


def uncorrelated(x, y):
    return abs(np.corrcoef(x, y)[0, 1]) < 4.0 / math.sqrt(len(x))


def test_uniforms_fill_the_unit_interval():
    values = draws(randoms.uniform)
    assert uniform_on(values, 0.0, 1.0)
    assert values.min() >= 0.0
    assert values.max() < 1.0
    assert uncorrelated(values[:-1], values[1:])


def test_normal_pairs_are_standard_normal_and_independent():
    pairs = draws(randoms.normal_pair)
    for values in pairs.T:
        assert stats.kstest(values, stats.norm.cdf).pvalue > P_VALUE
        # Moments 1 to 4 are 0, 1, 0, 3; their standard errors are sqrt(1, 2, 15, 96) / sqrt(SIZE).
        moments = [np.mean(values**k) for k in (1, 2, 3, 4)]
        error = 4.0 * np.sqrt([1.0, 2.0, 15.0, 96.0]) / math.sqrt(SIZE)
        assert np.all(np.abs(np.subtract(moments, [0.0, 1.0, 0.0, 3.0])) < error)
    assert uncorrelated(*pairs.T)
    assert uncorrelated(*(pairs.T**2))  # Box & Muller's two share a radius: not these


def test_points_of_the_disc_are_uniform_by_area():
    x, y = draws(randoms.in_disk).T
    assert uniform_on(x**2 + y**2, 0.0, 1.0)
    assert uniform_on(np.arctan2(y, x), -math.pi, math.pi)
    assert uncorrelated(x**2 + y**2, np.arctan2(y, x))


def test_points_of_the_ball_are_uniform_by_volume():
    points = draws(randoms.in_ball)
    size = np.linalg.norm(points, axis=-1)
    assert uniform_on(size**3, 0.0, 1.0)
    for component in points.T:  # Archimedes: a coordinate on the sphere is uniform
        assert uniform_on(component / size, -1.0, 1.0)


def test_directions_are_uniform_on_the_circle():
    x, y = draws(randoms.direction).T
    np.testing.assert_allclose(np.hypot(x, y), 1.0, rtol=4e-16)
    assert uniform_on(np.arctan2(y, x), -math.pi, math.pi)


def test_attitudes_are_uniform_on_the_rotation_group():
    q = draws(randoms.quaternion)
    np.testing.assert_allclose(np.linalg.norm(q, axis=-1), 1.0, rtol=1e-15)
    # Haar measure: the angle has density (1 - cos a) / pi, and any axis goes anywhere uniformly.
    angle = 2.0 * np.arccos(np.minimum(np.abs(q[:, 0]), 1.0))
    assert stats.kstest(angle, lambda a: (a - np.sin(a)) / math.pi).pvalue > P_VALUE
    for component in q.T:  # on the 3-sphere: density 2 sqrt(1 - x^2) / pi
        cdf = stats.kstest(
            component, lambda x: 0.5 + (x * np.sqrt(1.0 - x * x) + np.arcsin(x)) / math.pi
        )
        assert cdf.pvalue > P_VALUE
    w, x, y, z = q.T
    assert uniform_on(w**2 + z**2 - x**2 - y**2, -1.0, 1.0)  # e_z . R e_z


@pytest.mark.parametrize(
    "others",
    [
        [{"key": 8}, {"key": 7 + 2**32}, {"key": 7 + 2**63}],
        [{"episode": 4}, {"episode": 3 + 2**32}],
        [{"use": 0}, {"use": 2}],
    ],
    ids=["rows", "episodes", "uses"],
)
def test_streams_of_neighbours_are_independent(others):
    streams = [draws(randoms.uniform), *(draws(randoms.uniform, **other) for other in others)]
    for one, two in itertools.combinations(streams, 2):
        assert uncorrelated(one, two)
        assert not np.any(one == two)


# Compiled networks against NumPy, which sums in another order with functions of the C library.


SIZES = np.array([21, 64, 13, 3])
NUMPY = {
    "identity": lambda x: x,
    "tanh": np.tanh,
    "relu": lambda x: np.maximum(x, 0.0),
    "elu": lambda x: np.where(x > 0.0, x, np.expm1(np.minimum(x, 0.0))),
    "silu": lambda x: x / (1.0 + np.exp(-x)),
}


def layers(stream):
    """Biases and matrices of float32, of a scale at which activations bend."""
    return [
        (stream.normal(size=m).astype(np.float32), stream.normal(size=(n, m)).astype(np.float32))
        for n, m in pairwise(SIZES)
    ]


@pytest.mark.parametrize("last", ["identity", "tanh"])
@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_a_network_is_what_numpy_makes_of_it(activation, last):
    stream = np.random.default_rng(1)
    own, x = layers(stream), stream.normal(size=(70, 21)).astype(np.float32)
    flat = np.concatenate([part.ravel() for layer in own for part in layer])
    out = np.empty((70, 3))
    perceptron(x, flat, SIZES, ACTIVATIONS.index(activation), ACTIVATIONS.index(last), out)
    h = x.astype(np.float64)
    for k, (bias, matrix) in enumerate(own):
        h = NUMPY[activation if k < 2 else last](h @ matrix.astype(np.float64) + bias)
    np.testing.assert_allclose(out, h, rtol=1e-12, atol=1e-12)


def test_a_row_is_the_same_alone_and_among_others():
    stream = np.random.default_rng(2)
    flat = np.concatenate([part.ravel() for layer in layers(stream) for part in layer])
    x, out, alone = stream.normal(size=(33, 21)).astype(np.float32), np.empty((33, 3)), np.empty(3)
    perceptron(x, flat, SIZES, 1, 0, out)
    for row, expected in zip(x, out, strict=True):
        perceptron(row[None], flat, SIZES, 1, 0, alone[None])
        np.testing.assert_array_equal(alone, expected)


def test_relative_rotations_are_products_of_the_matrices_in_the_inputs():
    x = np.random.default_rng(3).normal(size=(5, 20)).astype(np.float32)
    out = np.empty((5, 38), np.float32)
    relative_rotations(x, 1, 11, out)
    here, there = (x[:, at : at + 9].reshape(-1, 3, 3).astype(np.float64) for at in (1, 11))
    back = here.transpose(0, 2, 1)
    np.testing.assert_array_equal(out[:, :20], x)
    products = np.stack([back @ there, there @ back], axis=1).reshape(5, 18)
    np.testing.assert_allclose(out[:, 20:], products, rtol=1e-6, atol=1e-6)
