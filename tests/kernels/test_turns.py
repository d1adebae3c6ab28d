"""The polynomials inside the turns, as accurate as they say."""

import mpmath
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rigid_envs.engine import algebra as turns

EPS = float(np.finfo(np.float64).eps)
TINY = [0.0, 1e-300, 1e-20]


@pytest.mark.parametrize("x", [0.01, 0.1, 0.2, 0.3, 0.4, 0.5])
def test_the_tangent_of_half_a_turn_is_exact_but_for_its_first_neglected_term(x):
    exact = mpmath.tan(mpmath.mpf(x)) / mpmath.mpf(x)
    error = abs(float(turns.tangent(x * x) - exact))
    assert error <= 0.01 * x**10 + 2.0 * EPS


@pytest.mark.parametrize("z", TINY)
def test_the_tangent_of_no_turn_is_its_argument(z):
    assert turns.tangent(z) == 1.0


@pytest.mark.parametrize("a", [0.0, 1e-9, -0.3, 1.0, 7.0])
def test_versine_and_sine_of_a_cayley_turn_are_those_of_its_angle(a):
    versine, sine = turns.cayley(a)
    angle = 2 * mpmath.atan(mpmath.mpf(a))
    assert sine == pytest.approx(float(mpmath.sin(angle)), rel=4.0 * EPS)
    assert versine == pytest.approx(float(1 - mpmath.cos(angle)), rel=8.0 * EPS)


@pytest.mark.parametrize("x", [*np.linspace(0.0, 0.25 * np.pi, 30), 1e-9])
def test_a_roll_of_up_to_a_quarter_turn_is_exact_to_rounding(x):
    # A step turns by 2 x, the stability envelope of the ball is pi / 2.
    x = float(x)
    assert turns.cosine(x * x) == pytest.approx(np.cos(x), abs=2.0 * EPS)
    assert turns.sinc(x * x) == pytest.approx(np.sinc(x / np.pi), abs=2.0 * EPS)


@pytest.mark.parametrize("seed", range(5))
def test_a_half_turn_is_the_quaternion_of_twice_its_vector(seed):
    rng = np.random.default_rng(seed)
    half = rng.normal(size=3)
    half *= rng.uniform(0.0, 0.25 * np.pi) / np.linalg.norm(half)
    expected = Rotation.from_rotvec(2.0 * half).as_quat(scalar_first=True)
    np.testing.assert_allclose(turns.half_turn(tuple(half)), expected, rtol=0, atol=2.0 * EPS)
