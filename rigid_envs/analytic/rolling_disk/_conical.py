"""The conical (Mehler) function of the falling disk, F(xi, 1 - xi; 1; x) with xi (1 - xi) = mu.

It is Legendre's P_nu(1 - 2 x) of the degree nu = xi - 1, for a disk complex: -1/2 + i tau. SciPy's
functions take real parameters; but the coefficients of the two series are real, and positive.
"""

import cmath
import math

import numpy as np
from scipy.special import digamma

from rigid_envs.checks import Array

__all__ = ["conical"]

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
    near, far = np.minimum(x, 0.5), np.minimum(y, 0.5)
    xi = 0.5 + cmath.sqrt(0.25 - mu)
    other = mu / xi  # 1 - xi, without the cancellation for small mu
    scale = (cmath.sin(math.pi * other) / math.pi).real
    lag = a * (2.0 * digamma(k + 1.0) - (digamma(xi + k) + digamma(other + k)).real)
    log, rest = np.log(far), a[1:] * k[1:]
    beyond = polynomial(far, lag) - log * polynomial(far, a)
    slope = log * polynomial(far, rest) + polynomial(far, a) / far
    slope = slope - polynomial(far, lag[1:] * k[1:])
    return (
        np.where(x <= 0.5, polynomial(near, a), scale * beyond),
        np.where(x <= 0.5, polynomial(near, rest), scale * slope),
    )
