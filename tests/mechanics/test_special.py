"""Elliptic and other special functions against SciPy, quadrature and 40-digit arithmetic."""

import math
from itertools import pairwise

import mpmath
import numpy as np
import pytest
from scipy import integrate, special

from rigid_envs.mechanics import special as elliptic
from rigid_envs.mechanics.special import phi1, phi2

EPS = np.finfo(np.float64).eps


# Every five decades: from some on the arithmetic-geometric mean takes one step more.
NEAR_AND_ON_THE_SEPARATRIX = [0.9, 0.3, *np.geomspace(1e-290, 1.0, 59).tolist(), 0.0]


@pytest.mark.parametrize("m", [0.0, 0.1, 0.5, 0.9])
def test_jacobi_functions_agree_with_scipy_where_scipy_is_good(m):
    u = np.linspace(-9.0, 9.0, 61)
    for ours, theirs in zip(elliptic.jacobi(u, 1.0 - m), special.ellipj(u, m)[:3], strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-14)


@pytest.mark.parametrize("m1", NEAR_AND_ON_THE_SEPARATRIX)
def test_the_argument_is_recovered_from_the_functions(m1):
    quarter = min(elliptic.quarter_period(m1), 300.0)
    u = quarter * np.array([-0.999, -0.6, -0.5, -1e-9, 0.0, 1e-200, 0.3, 0.5, 0.7])
    # R_F and the arithmetic-geometric mean share nothing; each rounds a handful of times, and at
    # u = 300 the rounding of u itself moves cn by 300 eps.
    np.testing.assert_allclose(elliptic.argument(*elliptic.jacobi(u, m1)), u, rtol=16 * EPS)


@pytest.mark.parametrize("m1", NEAR_AND_ON_THE_SEPARATRIX)
def test_small_cn_and_dn_keep_their_digits(m1):
    u = np.linspace(-3.3, 3.3, 67) * min(elliptic.quarter_period(m1), 90.0)
    sn, cn, dn = elliptic.jacobi(u, m1)
    np.testing.assert_allclose(sn**2 + cn**2, 1.0, rtol=0, atol=8 * EPS)
    np.testing.assert_allclose(m1 + (1.0 - m1) * cn**2, dn**2, rtol=64 * EPS)


def test_half_periods_change_the_signs_of_sn_and_cn_only():
    m1 = 1e-10
    half_period = 2.0 * elliptic.quarter_period(m1)
    u = np.linspace(-1.0, 1.0, 11)
    for n in (1, 2, 7):
        sn, cn, dn = elliptic.jacobi(u, m1)
        shifted = elliptic.jacobi(u + n * half_period, m1)
        for ours, expected in zip(shifted, ((-1) ** n * sn, (-1) ** n * cn, dn), strict=True):
            np.testing.assert_allclose(ours, expected, rtol=0, atol=4 * n * half_period * EPS)


@pytest.mark.parametrize("m1", [1.0, 0.3, 1e-10])
def test_what_is_left_of_whole_half_periods_is_at_most_a_quarter_period(m1):
    quarter = elliptic.quarter_period(m1)
    u = quarter * np.arange(-2001.0, 2002.0, 2.0)  # in the middle between two multiples of 2 K
    n, v = elliptic.split_half_periods(u, m1)
    assert np.abs(v).max() <= quarter
    np.testing.assert_allclose(2.0 * quarter * n + v, u, rtol=2 * EPS)


@pytest.mark.parametrize("nu", [0.0, 0.01, 0.99, 1.01, 30.0, 1e6])
@pytest.mark.parametrize("m1", [1.0, 0.4, 1e-6, 0.0])
def test_the_integral_of_the_third_kind_agrees_with_quadrature(m1, nu):
    def integrand(u):
        sn, cn, _ = elliptic.jacobi(u, m1)
        return float(cn**2 / (1.0 + nu * sn**2))

    # The integrand is a peak of width 1/sqrt(nu) at every even multiple of K.
    end = 2.7 * min(elliptic.quarter_period(m1), 9.0)
    peaks = [0.0] if m1 == 0.0 else [0.0, 2.0 * elliptic.quarter_period(m1)]
    width = 1.0 / math.sqrt(1.0 + nu)
    cuts = {0.0, end, *(p + s * width * k for p in peaks for s in (-1, 1) for k in (0, 1, 10, 100))}
    edges = sorted(c for c in cuts if 0.0 <= c <= end)
    total = sum(
        integrate.quad(integrand, a, b, epsabs=0, epsrel=1e-12)[0] for a, b in pairwise(edges)
    )
    np.testing.assert_allclose(elliptic.cn2_integral(end, nu, m1), total, rtol=1e-11)
    np.testing.assert_allclose(elliptic.cn2_integral(-end, nu, m1), -total, rtol=1e-11)


@pytest.mark.parametrize("x", [0.0, 1e-300, 1e-9, 0.3, 0.99, 1.0, 1.01, 5.0, 40.0, -0.7, -12.0])
def test_the_phi_functions_keep_their_digits(x):
    with mpmath.workdps(40):
        z = mpmath.mpc(0, x)
        first, second = mpmath.hyp1f1(1, 2, z), mpmath.hyp1f1(1, 3, z) / 2
    for found, exact in ((phi1(np.array(x)), first), (phi2(np.array(x)), second)):
        assert abs(found - complex(exact)) <= 8 * EPS * abs(complex(exact))
    assert phi2(np.array(x)).imag == pytest.approx(float(second.imag), rel=16 * EPS)
