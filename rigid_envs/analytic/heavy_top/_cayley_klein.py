"""Cayley-Klein parameters of the top, w + i z and x + i y of its attitude, in closed form.

In Euler angles they are cos(theta / 2) exp(i (phi + psi) / 2) and sin(theta / 2)
exp(i (phi - psi) / 2), and their phases need one elliptic integral of the third kind each,

    (phi + psi)' = omega3 - a + (b + a) / (1 + u),
    (phi - psi)' = a - omega3 + (b - a) / (1 - u).

Both integrals have a pole where the axis passes a vertical. Legendre's relations between integrals
of the third kind take it out as an arctangent, whose factor is exactly 1. Together with the root
cos(theta / 2) or sin(theta / 2) in front, that is the smooth number p F(u) + i q G(u), and what
remains is H of `elliptic.cn2_integral`, bounded in all cases:

    (p F + i q G) / sqrt(2 (1 + nu sn^2)) exp(i ((spin + drift) t + depth H)).

So nothing special happens at the poles, beside them, or at the separatrix. With d = 1 - u,
e = 1 + u, D = u3 - 1, span = u3 - u1 and spin = +-(omega3 - a) / 2,

    w + i z: F = cn dn, G = sn, p^2 = e1, q^2 = e2 e3 / span, nu = e1 / span,
             depth^2 = e1 e2 / (span e3), drift = (b + a) / (2 e3);
    x + i y: F = cn, G = sn dn, p^2 = d1, q^2 = span nu, nu = d2 / D,
             depth^2 = d1 nu / span, drift = 0, where d2 <= D, and else
             F = dn, G = sn cn, p^2 = d1, q^2 = (d1 - d2) nu, nu = m D / d2, with the integral of
             dn^2 instead of cn^2 and its factor^2 = d1 D / (span d2).

q has the sign of b + a or b - a, and depth the other; in the last row it is reversed.

Sources: Whittaker, Analytical Dynamics, ch. VI; Klein & Sommerfeld, Theorie des Kreisels, vol. II;
DLMF 19.7(iii).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigid_envs.analytic import elliptic
from rigid_envs.analytic.heavy_top._nutation import Nutation, nutation_of
from rigid_envs.analytic.heavy_top._start import Start
from rigid_envs.checks import Array, array

__all__ = ["ComplexArray", "Wave", "waves"]

ComplexArray = NDArray[np.complex128]
_Pair = Callable[
    [Array, Array, Array, float],
    tuple[Array, Array, Array, Array],
]


@dataclass(frozen=True)
class Wave:
    """One of the two parameters as a function of time.

    Attributes:
        swing: the nutation that it belongs to.
        pair: F, G and their derivatives, from sn, cn, dn and m.
        winds: whether F and G change their signs with each half period 2 K, if there is one.
        p: factor of F.
        q: factor of G, with the sense in which the phase turns.
        nu: minus the characteristic of H.
        spin: rate of the phase that is opposite in the other parameter [rad/s].
        drift: rest of the steady rate of the phase [rad/s].
        depth: factor of H.
        turn: constant factor, of size 1, that makes it start as the top does.
    """

    swing: Nutation
    pair: _Pair
    winds: bool
    p: float
    q: float
    nu: float
    spin: float
    drift: float
    depth: float
    turn: complex = 1.0

    def at(self, t: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Value, and time derivative without that of the spin, at the times t [s]."""
        swing = self.swing
        sn, cn, dn = elliptic.jacobi(swing.argument(t), swing.m1)
        F, G, F_slope, G_slope = self.pair(sn, cn, dn, 1.0 - swing.m1)
        factor, slope = self.p * F + 1j * self.q * G, self.p * F_slope + 1j * self.q * G_slope
        under = 1.0 + self.nu * sn * sn
        growth = (1j * self.depth * cn * cn - self.nu * sn * cn * dn) / under
        turn = np.exp(1j * (self.spin * array(t, "t") + self._phase(t))) / np.sqrt(2.0 * under)
        rate = swing.rate * (slope + growth * factor) + 1j * self.drift * factor
        return self.turn * factor * turn, self.turn * rate * turn

    def argument(self, t: ArrayLike) -> tuple[Array, Array]:
        """Phase at the times t, continuous: half turns, and the rest without that of the spin."""
        n, v = elliptic.split_half_periods(self.swing.argument(t), self.swing.m1)
        F, G, _, _ = self.pair(*elliptic.jacobi(v, self.swing.m1), 1.0 - self.swing.m1)
        rest = np.angle(self.turn) + np.arctan2(self.q * G, self.p * F) + self._phase(t)
        return self.half_turn * n, np.asarray(rest)

    @property
    def half_turn(self) -> float:
        """Half turns of the phase that each nutation adds: 1, -1 or 0."""
        return math.copysign(1.0, self.q) if self.winds else 0.0

    def per_nutation(self) -> float:
        """Angle that one nutation adds to the phase, but for turns, drift and spin [rad]."""
        end = 2.0 * elliptic.quarter_period(self.swing.m1)
        return self.depth * float(self._bounded(np.array(end)))

    def _phase(self, t: ArrayLike) -> Array:
        """Phase of the exponential but for the spin, 0 at t = 0 [rad]."""
        u = self.swing.argument(t)
        turned = self._bounded(u) - self._bounded(np.array(self.swing.start))
        return np.asarray(self.drift * array(t, "t") + self.depth * turned)

    def _bounded(self, u: Array) -> Array:
        return elliptic.cn2_integral(u, self.nu, self.swing.m1)


def waves(start: Start) -> tuple[Wave, Wave]:
    """Find w + i z and x + i y of a motion."""
    swing = nutation_of(start)
    wz, xy = start.cayley_klein
    # q' = q (0, omega) / 2, without the spin.
    wz_rate = 0.5 * (1j * start.a * wz - xy * start.across.conjugate())
    xy_rate = 0.5 * (wz * start.across - 1j * start.a * xy)
    return (
        _aligned(_scalar(start, swing), wz, wz_rate, start.beta),
        _aligned(_vector(start, swing), xy, xy_rate, start.beta),
    )


def _aligned(wave: Wave, value: complex, rate: complex, weight: float) -> Wave:
    """Give a wave the phase of its start: of the value there, and at a pole of the rate.

    The ratios of both to those of the wave are the same complex number of size 1.
    """
    (found,), (found_rate,) = wave.at([0.0])
    turn = weight * value * found.conjugate() + rate * found_rate.conjugate()
    return replace(wave, turn=complex(turn / abs(turn)) if turn else 1.0)


def _scalar(start: Start, swing: Nutation) -> Wave:
    """Find w + i z, which vanishes at the lower pole."""
    e1, e2, e3 = swing.heights
    span, sense = _span(swing), math.copysign(1.0, start.hanging.twist)
    return Wave(
        swing=swing,
        pair=_far_pair,
        winds=True,
        p=math.sqrt(e1),
        q=sense * math.sqrt(e2 * e3 / span),
        nu=e1 / span,
        spin=0.5 * (start.omega3 - start.a),
        drift=0.5 * start.hanging.twist / e3,
        depth=-sense * math.sqrt(e1 * e2 / (span * e3)),
    )


def _vector(start: Start, swing: Nutation) -> Wave:
    """Find x + i y, which vanishes at the upper pole."""
    (d1, d2, beyond), m1 = swing.depths, swing.m1
    span, sense = _span(swing), math.copysign(1.0, start.upright.twist)
    spin, p = 0.5 * (start.a - start.omega3), math.sqrt(d1)
    if d2 <= beyond:
        nu = d2 / beyond if d2 > 0.0 else 0.0
        q, depth = sense * math.sqrt(span * nu), -sense * math.sqrt(d1 * nu / span)
        return Wave(swing, _near_pair, m1 > 0.0, p, q, nu, spin, 0.0, depth)
    nu = (1.0 - m1) * beyond / d2
    q, depth = -sense * math.sqrt((d1 - d2) * nu), sense * math.sqrt(d1 * beyond / (span * d2))
    # Here the integral is that of dn^2 = cn^2 + m1 sn^2 over 1 + nu sn^2.
    linear = m1 / (1.0 + nu)
    drift = depth * linear * swing.rate
    return Wave(swing, _beyond_pair, False, p, q, nu, spin, drift, depth * (1.0 - linear))


def _span(swing: Nutation) -> float:
    """u3 - u1; where it is 0, at the sleeping threshold, nothing moves and any value does."""
    return swing.depths[0] + swing.depths[2] if swing.rate > 0.0 else 1.0


def _far_pair(sn: Array, cn: Array, dn: Array, m: float) -> tuple[Array, Array, Array, Array]:
    """Pair F = cn dn, G = sn, and the derivatives of both."""
    return cn * dn, sn, -sn * (dn * dn + m * cn * cn), cn * dn


def _near_pair(sn: Array, cn: Array, dn: Array, m: float) -> tuple[Array, Array, Array, Array]:
    """Pair F = cn, G = sn dn, and the derivatives of both."""
    return cn, sn * dn, -sn * dn, cn * (dn * dn - m * sn * sn)


def _beyond_pair(sn: Array, cn: Array, dn: Array, m: float) -> tuple[Array, Array, Array, Array]:
    """Pair F = dn, G = sn cn, and the derivatives of both."""
    return dn, sn * cn, -m * sn * cn, dn * (cn * cn - sn * sn)
