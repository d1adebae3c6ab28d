"""Counter-based random numbers: bit for bit NumPy's Philox, and distributed as they say."""

import itertools
import math

import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from rigid_envs.engine import randoms

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
