"""The functions phi_1 and phi_2 of imaginary argument: integrals of a uniformly turning vector.

int_0^t exp(i k s) ds = t phi_1(k t) and int_0^t (t - s) exp(i k s) ds = t^2 phi_2(k t): a vector
that turns at the rate k, integrated once and twice. Nothing cancels where k t is small, so that
straight motion is an ordinary case of turning motion.

Source: Hochbruck & Ostermann (2010), Acta Numerica 19:209, doi:10.1017/S0962492910000048, sec. 2.1.
"""

import math

import numpy as np
from numpy.typing import NDArray

from rigid_envs.checks import Array

__all__ = ["phi1", "phi2"]

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
