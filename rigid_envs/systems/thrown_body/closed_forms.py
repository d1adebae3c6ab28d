"""Motion of thrown bodies in closed form: parabola, twist of a racket, wobble of a plate."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import quad
from scipy.optimize import brentq

from rigid_envs.base import checks
from rigid_envs.base.checks import Array


def parabola(
    t: ArrayLike, position0: ArrayLike, velocity0: ArrayLike, *, g: float
) -> tuple[Array, Array]:
    """Position [m] and velocity [m/s] of a centre of mass in flight, shape (..., 3) each.

    x = x0 + v0 t - g t^2 z / 2, v = v0 - g t z.

    Args:
        t: times [s], shape (...).
        position0: at t = 0 [m], shape (3,).
        velocity0: at t = 0 [m/s], shape (3,).
        g: gravitational acceleration, along -z [m/s^2].

    Raises:
        ValueError: values that are not finite, or of another shape; a negative g.

    Source: Goldstein, sec. 1.1.
    """
    times = checks.array(t, "t")[..., None]
    x0 = checks.exact_array(position0, "position0", 3)
    v0 = checks.exact_array(velocity0, "velocity0", 3)
    fall = -checks.non_negative(g, "g", "m/s^2") * np.array([0.0, 0.0, 1.0])
    return x0 + times * v0 + 0.5 * times * times * fall, v0 + times * fall


def flight_time(rise: float, velocity: float, *, g: float) -> float:
    """Time [s] after which a body that was thrown up comes down to the height `rise`.

    T = (v + sqrt(v^2 - 2 g rise)) / g, the later time at which v T - g T^2 / 2 = rise.

    Args:
        rise: height above that of the throw [m]; negative below it.
        velocity: upward velocity of the throw [m/s].
        g: gravitational acceleration [m/s^2].

    Raises:
        ValueError: a height that is not reached, or g that is not positive.

    Source: Goldstein, sec. 1.1.
    """
    checks.all_positive(g=g)
    square = checks.number(velocity, "velocity") ** 2 - 2.0 * g * checks.number(rise, "rise")
    reached = square >= 0.0 and (rise <= 0.0 or velocity > 0.0)
    highest = 0.5 * max(velocity, 0.0) ** 2 / g
    checks.require(reached, rise, "rise", f"at most {highest:g} m, where the body turns back")
    return (velocity + math.sqrt(square)) / g


# Twist of a racket. Its axes are the handle e1, e2 across it in the plane of the face, and the
# normal e3 of the face, with moments I1 < I2 < I3. theta is the angle from L to the handle and psi
# the angle of L's component across the handle, from e3 towards e2:
#
#     L = |L| (cos theta, sin theta sin psi, sin theta cos psi).
#
# With a = sin(psi)^2 / I2 + cos(psi)^2 / I3 the handle turns about L at phi' = |L| a, and about
# itself at psi' = |L| cos(theta) (1 / I1 - a). Energy keeps e = 2 T / |L|^2, so
#
#     cos(theta)^2 = (e - a) / (1 / I1 - a),    e - a = (1 / I2 - 1 / I3) (k^2 - sin(psi)^2).
#
# For k > 1 the racket twists on and on, for k < 1 it twists to and fro. With sin(psi) = k sin(chi)
# in the second case all turning points are passed by a chi that grows with phi.


@dataclass(frozen=True)
class Twist:
    """Where a racket is when its handle has turned about L.

    Attributes:
        psi: twist about the handle since the throw [rad], from e3 towards e2; pi is a half twist.
        theta: angle from L to the handle [rad].
        time: time since the throw [s].
    """

    psi: float
    theta: float
    time: float


def racket_twist(
    turns: float, moments: ArrayLike, momentum: float, theta0: float, psi0: float
) -> Twist:
    """Twist of a free body about its handle e1 while the handle turns about L.

    Integrals of dphi / dchi and dt / dchi, by quadrature, and the root of the first. A racket that
    is thrown to turn about e2, which is unstable, twists by about pi in a turn: caught by the
    handle, it shows its other face. It twists in the sense in which L leans towards the handle.

    Args:
        turns: of the handle about L, at least 0.
        moments: I1 < I2 < I3 [kg m^2]: about the handle, across it, and normal to the face.
        momentum: |L| [N m s].
        theta0: angle from L to the handle at the throw, in (0, pi) [rad].
        psi0: angle of L's component across the handle, from e3 towards e2 [rad].

    Raises:
        ValueError: moments in another order, an angle out of its range, or a motion on the
            separatrix, which never comes round.

    Source: Ashbaugh, Chicone & Cushman 1991, doi:10.1007/BF01049489.
    """
    I1, I2, I3 = checks.exact_array(moments, "moments", 3)
    checks.require(0.0 < I1 < I2 < I3, moments, "moments", "0 < I1 < I2 < I3")
    checks.non_negative(turns, "turns", "1")
    checks.all_positive(momentum=momentum)
    lean = checks.number(theta0, "theta0")
    checks.require(0.0 < lean < math.pi, theta0, "theta0", "an angle between 0 and pi rad")
    well = math.pi * round(checks.number(psi0, "psi0") / math.pi)  # psi of the nearest e3 or -e3
    return _Racket(I1, I2, I3, lean, psi0 - well).twisted(turns, I2 / momentum)


class _Racket:
    """The equations above, of one motion, with I2 = |L| = 1; psi is from the nearest of e3, -e3."""

    def __init__(self, I1: float, I2: float, I3: float, theta0: float, psi0: float) -> None:
        self.psi0, self.b, self.least, self.d = psi0, I2 / I1, I2 / I3, (I3 - I2) / I3
        across = (self.b - self._a(psi0)) / self.d
        self.k_squared = math.sin(psi0) ** 2 + math.cos(theta0) ** 2 * across
        self.sense = 1.0 if math.cos(theta0) >= 0.0 else -1.0
        self.to_and_fro = self.k_squared < 1.0
        expected = "an angle off the separatrix, on which the racket comes to turn about e2"
        checks.require(abs(self.k_squared - 1.0) > 1e-12, psi0, "psi0", expected)

    def twisted(self, turns: float, unit: float) -> Twist:
        """The state after so many turns, with the unit of time I2 / |L| [s]."""
        begin = self._chi(self.psi0)
        end = begin + self._advance(begin, 2.0 * math.pi * turns)
        psi = self._psi(end)
        cosine = math.sqrt(self._excess(psi) / (self.b - self._a(psi)))
        side = math.cos(end) if self.to_and_fro else self.sense
        time = unit * self._integral(self._slope, begin, end)
        return Twist(psi - self.psi0, math.acos(math.copysign(cosine, side)), time)

    def _a(self, psi: float) -> float:
        return self.least + self.d * math.sin(psi) ** 2

    def _excess(self, psi: float) -> float:
        return self.d * max(self.k_squared - math.sin(psi) ** 2, 0.0)

    def _chi(self, psi: float) -> float:
        if not self.to_and_fro:
            return self.sense * psi
        chi = math.asin(max(-1.0, min(1.0, math.sin(psi) / math.sqrt(self.k_squared))))
        return chi if self.sense > 0.0 else math.pi - chi

    def _psi(self, chi: float) -> float:
        if not self.to_and_fro:
            return self.sense * chi
        return math.asin(math.sqrt(self.k_squared) * math.sin(chi))

    def _slope(self, chi: float) -> float:
        """Slope dt / dchi."""
        psi = self._psi(chi)
        rest = self.d * math.cos(psi) ** 2 if self.to_and_fro else self._excess(psi)
        return 1.0 / math.sqrt(rest * (self.b - self._a(psi)))

    def _phase(self, chi: float) -> float:
        """Slope dphi / dchi."""
        return self._slope(chi) * self._a(self._psi(chi))

    def _integral(self, of: Callable[[float], float], begin: float, end: float) -> float:
        """Integral over ranges that end where the integrand is largest, at psi = pi / 2."""
        quarter = 0.5 * math.pi
        inner = range(math.ceil(begin / quarter), math.floor(end / quarter) + 1)
        bounds = [begin, *(quarter * n for n in inner), end]
        accuracy = {"epsabs": 0.0, "epsrel": 1e-13, "limit": 400}
        return math.fsum(quad(of, *part, **accuracy)[0] for part in pairwise(bounds))

    def _advance(self, begin: float, phase: float) -> float:
        """By how much chi grows while phi grows by the phase."""
        period = self._integral(self._phase, 0.0, math.pi)
        whole, rest = divmod(phase, period)

        def missed(grown: float) -> float:
            return self._integral(self._phase, begin, begin + grown) - rest

        return math.pi * whole + float(brentq(missed, 0.0, math.pi, xtol=1e-15, rtol=1e-14))


def wobble_ratio(tilt: ArrayLike, *, i_perp: float, i3: float) -> Array:
    """Turns of the wobble per visible turn of a symmetric body in flight, shape (...).

    phi' / (phi' + psi') = I3 / (I3 - (I3 - I1) cos(tilt)), of the precession phi' of the axis about
    L and the turning phi' + psi' that a mark on the body shows. A thin plate has I3 = 2 I1 and
    wobbles twice as fast as it spins, if it wobbles little; a football wobbles slower than it
    spins.

    Args:
        tilt: angle between the axis and L, at least 0 and below pi / 2 [rad].
        i_perp: transverse moment I1 [kg m^2].
        i3: axial moment I3 [kg m^2].

    Raises:
        ValueError: an angle out of its range, or moments that are not positive.

    Source: Goldstein, sec. 5.6; Feynman, "Surely You're Joking, Mr. Feynman!", "The Dignified
        Professor", who remembers the ratio the other way round.
    """
    checks.all_positive(i_perp=i_perp, i3=i3)
    angle = checks.array(tilt, "tilt")
    inside = "at least 0 and below pi / 2 rad"
    checks.require((angle >= 0.0) & (angle < 0.5 * math.pi), angle, "tilt", inside)
    return np.asarray(i3 / (i3 - (i3 - i_perp) * np.cos(angle)))
