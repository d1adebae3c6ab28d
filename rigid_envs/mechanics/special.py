"""Special functions of the closed forms: elliptic, phi and conical functions, rotations."""

import cmath
import math

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import digamma, ellipkm1, elliprc, elliprf, elliprj

from rigid_envs.base.checks import Array, exact_array, unit_quaternion

# Jacobi elliptic functions that stay exact up to the separatrix, where the parameter m tends to 1.
#
# A body that starts 1e-8 away from spinning about its intermediate axis has 1 - m of about 1e-17:
# as m that number is lost. All functions here take the complementary parameter m1 = 1 - m instead,
# and `scipy.special.ellipj`, which takes m, is not used. m1 = 0 (hyperbolic functions, infinite
# period) and m1 = 1 (circular functions) are ordinary arguments.

SMALLEST = 1e-290
"""1 - m below which the squares of cn and dn underflow, perturbations of 1e-145: take 0 instead."""

# The arithmetic-geometric mean converges quadratically: one step after 1e-8 is full precision.
_AGM_TOLERANCE = 1e-8


def quarter_period(m1: float) -> float:
    """Complete elliptic integral of the first kind K(m), inf at m1 = 0."""
    return float(ellipkm1(m1))


def split_half_periods(u: ArrayLike, m1: float) -> tuple[Array, Array]:
    """Write u = 2 K n + v with an integer n and abs(v) <= K.

    Args:
        u: argument, any shape.
        m1: complementary parameter 1 - m, in [0, 1].

    Returns:
        n and v, both of the shape of u.
    """
    u = np.asarray(u, dtype=np.float64)
    if m1 == 0.0:
        return np.zeros_like(u), u
    half_period = 2.0 * quarter_period(m1)
    n = np.rint(u / half_period)
    return n, np.clip(u - n * half_period, -0.5 * half_period, 0.5 * half_period)


def jacobi(u: ArrayLike, m1: float) -> tuple[Array, Array, Array]:
    """Jacobi functions sn, cn, dn of parameter m = 1 - m1, each to full relative accuracy.

    Descending Landen transformation along the arithmetic-geometric mean, started from m1. The
    second half of the quarter period is folded onto the first by sn(K - v) = cn v / dn v,
    cn(K - v) = sqrt(m1) sn v / dn v, dn(K - v) = sqrt(m1) / dn v, so that cn and dn keep their
    digits where they are small.

    Args:
        u: argument, any shape; infinite only where m1 = 0.
        m1: complementary parameter 1 - m, in [0, 1].

    Returns:
        sn, cn, dn, each of the shape of u.

    Source: Bulirsch (1965), Numer. Math. 7:78, doi:10.1007/BF01397975; DLMF 22.20(ii).
    """
    n, v = split_half_periods(u, m1)
    odd = 1.0 - 2.0 * np.mod(n, 2.0)
    size = np.abs(v)
    if m1 == 0.0:
        decay = np.exp(-size)
        sech = 2.0 * decay / (1.0 + decay * decay)
        return np.tanh(v), sech, sech
    quarter = quarter_period(m1)
    far = size > 0.5 * quarter
    sn, cn, dn = _landen(np.where(far, quarter - size, size), m1)
    k1 = math.sqrt(m1)
    sn, cn, dn = (
        np.where(far, cn / dn, sn),
        np.where(far, k1 * sn / dn, cn),
        np.where(far, k1 / dn, dn),
    )
    return odd * np.copysign(sn, v), odd * cn, dn


def argument(sn: ArrayLike, cn: ArrayLike, dn: ArrayLike) -> Array:
    """Find u in [-K, K] from its Jacobi functions: u = sn R_F(cn^2, dn^2, 1), for cn >= 0.

    Source: DLMF 19.25(v).
    """
    sn, cn, dn = (np.asarray(x, dtype=np.float64) for x in (sn, cn, dn))
    return np.asarray(sn * elliprf(cn * cn, dn * dn, 1.0), dtype=np.float64)


def cn2_integral(u: ArrayLike, nu: float, m1: float) -> Array:
    """Integral of the third kind H(u) = int_0^u cn^2 / (1 + nu sn^2) du.

    It stays bounded where K does not: at m1 = 0 it is arctan(sqrt(nu) tanh u) / sqrt(nu).

    Args:
        u: argument, any shape; infinite only where m1 = 0.
        nu: minus the characteristic of Legendre's Pi, >= 0.
        m1: complementary parameter 1 - m, in [0, 1].

    Returns:
        H, of the shape of u.

    Source: DLMF 19.25(i), 19.7.8.
    """
    if m1 == 0.0:
        x = np.tanh(u)
        return np.asarray(x * elliprc(1.0, 1.0 + nu * x * x), dtype=np.float64)
    n, v = split_half_periods(u, m1)
    complete = _cn2_within(np.array(1.0), np.array(0.0), np.array(math.sqrt(m1)), nu, m1)
    return 2.0 * n * complete + _cn2_within(*jacobi(v, m1), nu, m1)


def _cn2_within(sn: Array, cn: Array, dn: Array, nu: float, m1: float) -> Array:
    """H within one half period, where cn >= 0, by Carlson's forms.

    For large nu the plain form is the small difference of large terms. There Legendre's change of
    parameter, nu to m / nu, takes the bulk of H out as an arctangent.
    """
    c2, d2, s2 = cn * cn, dn * dn, sn * sn
    first = sn * elliprf(c2, d2, 1.0)
    if nu <= 1.0:
        return np.asarray(first - (1.0 + nu) * _third(sn * s2, c2, d2, nu), dtype=np.float64)
    mu = (1.0 - m1) / nu
    g = math.sqrt((1.0 + nu) * (1.0 + mu))
    bulk = np.arctan2(g * sn, cn * dn) / g + mu * _third(sn * s2, c2, d2, mu)
    return np.asarray((1.0 + 1.0 / nu) * bulk - first / nu, dtype=np.float64)


def _third(s3: Array, c2: Array, d2: Array, nu: float) -> Array:
    """Integral of sn^2 / (1 + nu sn^2) from sn^3, cn^2 and dn^2."""
    rest = elliprj(c2, d2, 1.0, 1.0 + nu * (1.0 - c2))
    return np.asarray(s3 / 3.0 * rest, dtype=np.float64)


def _landen(v: Array, m1: float) -> tuple[Array, Array, Array]:
    """Evaluate sn, cn, dn on [0, K/2], where tan(a v) of the last mean a is at most 1."""
    means = [(1.0, math.sqrt(m1))]
    while (pair := means[-1])[0] - pair[1] > _AGM_TOLERANCE * pair[0]:
        means.append((0.5 * (pair[0] + pair[1]), math.sqrt(pair[0] * pair[1])))
    upper = 0.5 * (means[-1][0] + means[-1][1])
    ratio = np.tan(upper * v) / upper
    dn = np.ones_like(v)
    for a, b in reversed(means):
        square = upper * ratio * ratio
        ratio = ratio / dn
        dn = (1.0 + b * square) / (1.0 + a * square)
        upper = a
    cn = 1.0 / np.sqrt(1.0 + ratio * ratio)
    return ratio * cn, cn, dn


# The functions phi_1 and phi_2 of imaginary argument: integrals of a uniformly turning vector.
#
# int_0^t exp(i k s) ds = t phi_1(k t) and int_0^t (t - s) exp(i k s) ds = t^2 phi_2(k t): a vector
# that turns at the rate k, integrated once and twice. Nothing cancels where k t is small, so that
# straight motion is an ordinary case of turning motion.
#
# Source: Hochbruck & Ostermann (2010), Acta Numerica 19:209, doi:10.1017/S0962492910000048, sec.
# 2.1.

ComplexArray = NDArray[np.complex128]

# (x - sin x) / x^3 in powers of -x^2; at x = 1 the next term is 5e-17 of the first.
_SERIES = [1.0 / math.factorial(2 * n + 3) for n in range(8)]


def phi1(x: Array) -> ComplexArray:
    """(exp(i x) - 1) / (i x) = exp(i x / 2) sin(x / 2) / (x / 2), of the shape of x."""
    return np.asarray(np.exp(0.5j * x) * np.sinc(x / (2.0 * np.pi)))


def phi2(x: Array) -> ComplexArray:
    """(exp(i x) - 1 - i x) / (i x)^2 = (1 - cos x + i (x - sin x)) / x^2, of the shape of x."""
    near = np.clip(x, -1.0, 1.0)
    far = np.where(np.abs(x) > 1.0, x, 1.0)
    small = near * np.polynomial.polynomial.polyval(-near * near, _SERIES)
    large = (far - np.sin(far)) / (far * far)
    lag = np.where(np.abs(x) > 1.0, large, small)
    return np.asarray(0.5 * np.sinc(x / (2.0 * np.pi)) ** 2 + 1j * lag)


# The conical (Mehler) function of the falling disk, F(xi, 1 - xi; 1; x) with xi (1 - xi) = mu.
#
# It is Legendre's P_nu(1 - 2 x) of the degree nu = xi - 1, for a disk complex: -1/2 + i tau.
# SciPy's functions take real parameters; but the coefficients of the two series are real, and
# positive.

# Half a power of two is gained with each term on [0, 1/2].
_TERMS = 60


def conical(x: Array, y: Array, mu: float) -> tuple[Array, Array]:
    """F and dF/dx, a power series up to the middle, and one with a logarithm beyond.

    F = sum a_k x^k with a_0 = 1 and a_(k+1) / a_k = (mu + k + k^2) / (k + 1)^2, and by reflection

        F = sin(pi xi) / pi sum a_k (2 psi(k + 1) - psi(xi + k) - psi(1 - xi + k) - log y) y^k.

    Args:
        x: argument in [0, 1), any shape.
        y: 1 - x, given apart so that it keeps its digits where it is small.
        mu: xi (1 - xi), positive.

    Returns:
        F and dF/dx, of the shape of x.

    Source: DLMF 15.2.1, 15.8.10, 14.20.
    """
    k = np.arange(_TERMS)
    a = np.cumprod(np.concatenate([[1.0], (mu + k[:-1] + k[:-1] ** 2) / k[1:] ** 2]))
    polynomial = np.polynomial.polynomial.polyval
    xi = 0.5 + cmath.sqrt(0.25 - mu)
    other = mu / xi  # 1 - xi, without the cancellation for small mu
    scale = (cmath.sin(math.pi * other) / math.pi).real
    lag = a * (2.0 * digamma(k + 1.0) - (digamma(xi + k) + digamma(other + k)).real)
    log, rest = np.log(y), a[1:] * k[1:]
    beyond = polynomial(y, lag) - log * polynomial(y, a)
    slope = log * polynomial(y, rest) + polynomial(y, a) / y
    slope = slope - polynomial(y, lag[1:] * k[1:])
    return (
        np.where(x <= 0.5, polynomial(x, a), scale * beyond),
        np.where(x <= 0.5, polynomial(x, rest), scale * slope),
    )


# The few quaternion operations that the oracles need, written apart from `rotations` on purpose.
#
# Quaternions are (w, x, y, z) in the last axis.


def normalized(value: ArrayLike, name: str) -> Array:
    """One unit quaternion, shape (4,), normalised to rounding.

    Raises:
        ValueError: another shape, no finite numbers, or a length that is not 1 within 1e-6.
    """
    q = unit_quaternion(exact_array(value, name, 4), name)
    return q / float(np.linalg.norm(q))


def conjugate(q: Array) -> Array:
    """Inverse rotation of a unit quaternion, shape (..., 4)."""
    return np.concatenate([q[..., :1], -q[..., 1:]], axis=-1)


def product(p: Array, q: Array) -> Array:
    """Hamilton product p q, shape (..., 4): the rotation q followed by p."""
    p_scalar, p_vector, q_scalar, q_vector = p[..., :1], p[..., 1:], q[..., :1], q[..., 1:]
    scalar = p_scalar * q_scalar - np.sum(p_vector * q_vector, axis=-1, keepdims=True)
    cross = np.cross(p_vector, q_vector)
    return np.concatenate([scalar, p_scalar * q_vector + q_scalar * p_vector + cross], axis=-1)


def from_rotation_vector(rotation: Array) -> Array:
    """Unit quaternion (cos(a/2), sin(a/2) n) of the rotation vector a n [rad], shape (..., 3)."""
    angle = np.linalg.norm(rotation, axis=-1, keepdims=True)
    # np.sinc(x) = sin(pi x) / (pi x) is exact at 0, where a n / a is not.
    half_sinc = 0.5 * np.sinc(angle / (2.0 * np.pi))
    return np.concatenate([np.cos(0.5 * angle), half_sinc * rotation], axis=-1)


def about_vertical(angle: Array) -> Array:
    """Rotation about world z by the angle [rad], shape (..., 4)."""
    zero = np.zeros_like(angle)
    return np.stack([np.cos(0.5 * angle), zero, zero, np.sin(0.5 * angle)], axis=-1)
