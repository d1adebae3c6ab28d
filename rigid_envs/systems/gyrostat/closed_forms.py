"""Motion of gyrostats in closed form: Volterra's free motion, dual spin, turns without momentum."""

import math
import sys
from dataclasses import dataclass
from decimal import Context, Decimal, localcontext

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike
from scipy.special import elliprc, elliprj

from rigid_envs.base import checks
from rigid_envs.base.checks import Array
from rigid_envs.mechanics import special

# The free gyrostat with one wheel, by Jacobi elliptic functions.
#
# Take the axes in cyclic order, the wheel's third. With moments A, B, C of the whole and J of the
# wheel, D = C - J and no torque of the motor, the spin momentum p = J (omega3 + s) is constant and
#
#     A omega1' = omega2 ((B - D) omega3 - p),
#     B omega2' = omega1 ((D - A) omega3 + p),
#     D omega3' = (A - B) omega1 omega2.
#
# omega1^2 and omega2^2 are quadratics in x = omega3, and x'^2 is a quartic. x goes to and fro
# between two adjacent roots a and b of it:
#
#     x = (a P + b Q) / (P + Q),
#     P = cn^2, Q = g sn^2                        if all roots are real,
#     P = (1 + cn) / 2, Q = g (1 - cn) / 2        if two are complex.
#
# The factors of the quartic are then squares of Jacobi functions over P + Q. Of real roots x - a
# has sn, x - b has cn, the next one beyond b has dn and the next one beyond a has 1; of complex
# ones (x - a)(x - b) has sn and the rest dn. Two factors make omega1 and two make omega2, with
# signs that hold for all time.
#
# The constants are computed in decimal arithmetic of so many digits that sums and products of
# doubles are exact: nothing is lost beside the separatrix, where two roots meet.
#
# Sources: Volterra (1899), Acta Math. 22:201, doi:10.1007/BF02417877; Byrd & Friedman, Handbook of
# Elliptic Integrals, 250-260; Wittenburg, Dynamics of Multibody Systems, ch. 4.

_DIGITS = Context(prec=400)
_NOTHING = Decimal("1e-150")  # a share that is the rounding of 0

_Root = tuple[int, Decimal, Decimal]  # of quadratic 0 or 1, at n / d: infinite where d = 0
_Quadratic = tuple[Decimal, Decimal, Decimal]  # alpha y^2 + 2 beta y + gamma


@dataclass(frozen=True)
class Pole:
    """One of the two parts of the precession that have poles, K / (x - e).

    Attributes:
        at_a: the part where x = a [rad/s].
        at_b: the part where x = b [rad/s].
        ratio: g (b - e) / (a - e).
    """

    at_a: float
    at_b: float
    ratio: float


@dataclass(frozen=True)
class Volterra:
    """Free motion of a gyrostat with one wheel, in Jacobi functions of u = start + rate t.

    Along the body axes `axes` omega is (c1 f1, c2 f2, a P + b Q) / (P + Q), with f1 and f2 by kind.

    Attributes:
        axes: body axes (0, 1, 2): of the component that has the factor sn, of the other one, and of
            the wheel.
        kind: f1 and f2: "sn cn" for sn cn and dn, "sn dn" for sn dn and cn, "sn" for sn and cn dn,
            and "complex" for sn and dn, where two roots are complex.
        ends: a and b, between which the rate about the wheel's axis goes to and fro [rad/s].
        amplitudes: c1 and c2 [rad/s].
        weight: g.
        m1: complementary parameter 1 - m of the elliptic functions, 0 on the separatrix.
        rate: of the argument [rad/s], 0 where omega is constant.
        start: argument at t = 0.
        momentum: magnitude H of the angular momentum [N m s].
        drift: part of the precession about L that is constant, H / D [rad/s].
        poles: the other parts; none where L is along the wheel.
    """

    axes: tuple[int, int, int]
    kind: str
    ends: tuple[float, float]
    amplitudes: tuple[float, float]
    weight: float
    m1: float
    rate: float
    start: float
    momentum: float
    drift: float
    poles: tuple[Pole, ...]

    @property
    def period(self) -> float:
        """Time in which omega returns in the body [s]; infinite on the separatrix, or at rest."""
        turn = self.swing_period
        return 2.0 * turn if self.kind in ("sn", "sn dn") else turn

    @property
    def swing_period(self) -> float:
        """Time in which the rate about the wheel's axis returns [s]."""
        if self.rate == 0.0:
            return math.inf
        halves = 4.0 if self.kind == "complex" else 2.0
        return halves * special.quarter_period(self.m1) / abs(self.rate)

    def argument(self, t: ArrayLike) -> Array:
        """Argument u of the elliptic functions at the times t [s], of the shape of t."""
        times = checks.array(t, "t")
        with np.errstate(over="ignore"):
            turned = self.rate * times
        expected = f"times with a finite phase at {self.rate:.9g} rad/s [s]"
        checks.require(np.isfinite(turned), times, "t", expected)
        return np.asarray(self.start + turned)

    def components(self, u: Array) -> tuple[Array, Array, Array]:
        """Components of omega along `axes` [rad/s], each of the shape of u."""
        sn, cn, dn = special.jacobi(u, self.m1)
        if self.kind == "complex":
            near, far = 0.5 * (1.0 + cn), self.weight * (0.5 * (1.0 - cn))
        else:
            near, far = cn * cn, self.weight * sn * sn
        f1 = sn * {"sn cn": cn, "sn dn": dn}.get(self.kind, 1.0)
        f2 = {"sn dn": cn, "sn": cn * dn}.get(self.kind, dn)
        (a, b), (c1, c2), whole = self.ends, self.amplitudes, near + far
        return c1 * f1 / whole, c2 * f2 / whole, (a * near + b * far) / whole


def volterra(
    moments: ArrayLike, wheels: ArrayLike, omega0: ArrayLike, wheel_rate0: float
) -> Volterra:
    """Find the constants of the free motion of a gyrostat with one wheel and its motor off.

    Args:
        moments: principal moments of the whole with the wheel locked, shape (3,) [kg m^2].
        wheels: axial moments of the wheels along the principal axes, shape (3,), one of them
            positive and the others 0 [kg m^2].
        omega0: angular velocity of the carrier at t = 0, shape (3,) [rad/s], principal body axes.
        wheel_rate0: rate s of the wheel in the carrier at t = 0 [rad/s].

    Raises:
        ValueError: a wrong shape, a moment that is not positive, no wheel or several, a wheel with
            more than the moment of the whole, a number that is not finite, an angular momentum that
            double precision has not, or a separatrix that is no limit of other motions of its kind:
            of a wheel without momentum, between opposite rotations about its axis, or of one that
            has one of `separatrix_limits`.

    Source: Volterra (1899).
    """
    with localcontext(_DIGITS):
        return _solved(_start(moments, wheels, omega0, wheel_rate0))


def omega(
    t: ArrayLike, moments: ArrayLike, wheels: ArrayLike, omega0: ArrayLike, wheel_rate0: float
) -> Array:
    """Angular velocity of the carrier of a free gyrostat with one wheel.

    Args:
        t: times, any shape [s].
        moments: principal moments of the whole with the wheel locked, shape (3,) [kg m^2].
        wheels: axial moments of the wheels, shape (3,), one positive, the others 0 [kg m^2].
        omega0: angular velocity of the carrier at t = 0, shape (3,) [rad/s], principal body axes.
        wheel_rate0: rate s of the wheel in the carrier at t = 0 [rad/s].

    Returns:
        Angular velocity, shape t.shape + (3,) [rad/s], principal body axes.

    Raises:
        ValueError: as `volterra`.

    Source: Volterra (1899).
    """
    path = volterra(moments, wheels, omega0, wheel_rate0)
    components = path.components(path.argument(t))
    return np.stack([components[path.axes.index(k)] for k in range(3)], axis=-1)


def wheel_rate(
    t: ArrayLike, moments: ArrayLike, wheels: ArrayLike, omega0: ArrayLike, wheel_rate0: float
) -> Array:
    """Rate of the wheel in the carrier of a free gyrostat, s = s(0) + omega3(0) - omega3.

    Args:
        t: times, any shape [s].
        moments: principal moments of the whole with the wheel locked, shape (3,) [kg m^2].
        wheels: axial moments of the wheels, shape (3,), one positive, the others 0 [kg m^2].
        omega0: angular velocity of the carrier at t = 0, shape (3,) [rad/s], principal body axes.
        wheel_rate0: rate s of the wheel in the carrier at t = 0 [rad/s].

    Returns:
        s, of the shape of t [rad/s].

    Raises:
        ValueError: as `volterra`.

    Source: Volterra (1899).
    """
    path = volterra(moments, wheels, omega0, wheel_rate0)
    along = float(checks.exact_array(omega0, "omega0", 3)[path.axes[2]])
    return np.asarray(wheel_rate0 + along - path.components(path.argument(t))[2])


@dataclass(frozen=True)
class _Start:
    """Start of a free motion in exact numbers; y is omega3 less its value at the start.

    Attributes:
        axes: body axes in cyclic order, the wheel's last.
        moments: A, B and D along them.
        omega: angular velocity along them.
        p: spin momentum.
    """

    axes: tuple[int, int, int]
    moments: tuple[Decimal, Decimal, Decimal]
    omega: tuple[Decimal, Decimal, Decimal]
    p: Decimal

    def forces(self) -> tuple[Decimal, Decimal, Decimal]:
        """A omega1' / omega2, B omega2' / omega1 and D omega3' at the start."""
        (A, B, D), (w1, w2, x) = self.moments, self.omega
        return (B - D) * x - self.p, (D - A) * x + self.p, (A - B) * w1 * w2

    def sizes(self) -> tuple[Decimal, Decimal]:
        """Ratios of the quadratics to omega1^2 and omega2^2."""
        A, B, _ = self.moments
        return A * abs(A - B), B * abs(A - B)

    def quadratics(self) -> tuple[_Quadratic, _Quadratic]:
        """Positive multiples of omega1^2 and omega2^2, in y."""
        (A, B, D), (w1, w2, _) = self.moments, self.omega
        (first, second, _), (one, other) = self.forces(), self.sizes()
        scale = D.copy_sign(A - B)
        return (
            (scale * (B - D), scale * first, one * w1 * w1),
            (scale * (D - A), scale * second, other * w2 * w2),
        )

    def momentum(self) -> Decimal:
        """Magnitude H of the angular momentum."""
        (A, B, D), (w1, w2, x) = self.moments, self.omega
        return ((A * w1) ** 2 + (B * w2) ** 2 + (D * x + self.p) ** 2).sqrt()

    def poles(self, a: Decimal, b: Decimal, weight: Decimal) -> tuple[Pole, ...]:
        """The parts of the precession that have poles, D e + p = H and -H, at both ends."""
        (A, B, D), (w1, w2, x) = self.moments, self.omega
        across, poles = A * w1 * w1 + B * w2 * w2, list[Pole]()
        if across == 0:
            return ()
        for sign in (1, -1):
            e = (sign * self.momentum() - self.p) / D - x
            along = D * e * (e + 2 * x)
            if abs(along - across) < _NOTHING * across:  # a separatrix ends on the wheel's axis
                poles.append(Pole(0.0, 0.0, 1.0))
                continue
            K, ratio = sign * (along - across) / (2 * D), weight * (b - e) / (a - e)
            poles.append(Pole(float(K / (a - e)), float(K / (b - e)), float(ratio)))
        return tuple(poles)


def _start(moments: ArrayLike, wheels: ArrayLike, omega0: ArrayLike, wheel_rate0: float) -> _Start:
    """A start, checked, in exact numbers."""
    inertia, axis, wheel = _one_wheel(moments, wheels)
    rates = checks.exact_array(omega0, "omega0", 3)
    axes = (axis + 1) % 3, (axis + 2) % 3, axis
    A, B, C = (Decimal(float(inertia[k])) for k in axes)
    w1, w2, w3 = (Decimal(float(rates[k])) for k in axes)
    J, s = Decimal(wheel), Decimal(checks.number(wheel_rate0, "wheel_rate0", "rad/s"))
    start = _Start(axes, (A, B, C - J), (w1, w2, w3), J * (w3 + s))
    momentum = start.momentum()
    normal = not momentum or sys.float_info.min <= float(momentum) < math.inf
    expected = "an angular momentum within double precision: choose other units"
    checks.require(normal, rates, "omega0", expected)
    return start


def _one_wheel(moments: ArrayLike, wheels: ArrayLike) -> tuple[Array, int, float]:
    """Moments of the whole, checked, and axis and axial moment of its one wheel."""
    inertia, axial = _with_wheels(moments, wheels)
    checks.require(np.count_nonzero(axial) == 1, axial, "wheels", "one positive, the others 0")
    axis = int(np.argmax(axial))
    return inertia, axis, float(axial[axis])


def _with_wheels(moments: ArrayLike, wheels: ArrayLike) -> tuple[Array, Array]:
    """Moments of the whole and of the wheels, checked."""
    inertia = checks.positive_array(moments, "moments", "kg m^2", 3)
    axial = checks.exact_array(wheels, "wheels", 3)
    expected = "at least 0 and below the moment of the whole about the same axis [kg m^2]"
    checks.require((axial >= 0.0) & (axial < inertia), axial, "wheels", expected)
    return inertia, axial


def _solved(start: _Start) -> Volterra:
    """Constants of a motion, in decimal arithmetic."""
    first, second, swing = start.forces()
    A, B, _ = start.moments
    w1, w2, _ = start.omega
    steady = not (swing or w2 * first or w1 * second)
    if steady or A == B:
        return _uniform(start, Decimal(0) if steady else first / A)
    quadratics = start.quadratics()
    pairs = [_roots(k, *quadratic) for k, quadratic in enumerate(quadratics)]
    # The cycle of the real roots, from above y = 0 to infinity and on from below. A root at 0 is
    # the last one if the motion goes up from it.
    up = all(next(filter(None, reversed(each))) > 0 for each in quadratics)
    ends = Decimal("Infinity" if up else "-Infinity")
    cycle = sorted(
        pairs[0][1] + pairs[1][1], key=lambda root: -root[2] / root[1] if root[1] else ends
    )
    if len(cycle) == 4:
        return _between_real(start, cycle, (pairs[0][0], pairs[1][0]))
    return _beside_complex(start, cycle)


def _uniform(start: _Start, turn: Decimal) -> Volterra:
    """A motion with a constant rate about the wheel, across which omega turns uniformly."""
    (w1, w2, x), nought = start.omega, Decimal(0)
    across = float((w1 * w1 + w2 * w2).sqrt())
    return Volterra(
        axes=start.axes,
        kind="sn",
        ends=(float(x), float(x)),
        amplitudes=(across, across),
        weight=1.0,
        m1=1.0,
        rate=float(turn),
        start=math.atan2(w1, w2),
        momentum=float(start.momentum()),
        drift=float(start.momentum() / start.moments[2]),
        poles=start.poles(nought, nought, Decimal(1)),
    )


def _roots(
    owner: int, alpha: Decimal, beta: Decimal, gamma: Decimal
) -> tuple[Decimal, list[_Root]]:
    """Factor k and real roots n / d of alpha y^2 + 2 beta y + gamma = k (d1 y - n1) (d2 y - n2)."""
    square = beta * beta - alpha * gamma
    if square < 0:
        return alpha, []
    q = -(beta + square.sqrt().copy_sign(beta))
    if q != 0:
        return 1 / q, [(owner, q, alpha), (owner, gamma, q)]
    nought, one = Decimal(0), Decimal(1)
    return (alpha, [(owner, nought, one)] * 2) if alpha else (gamma, [(owner, one, nought)] * 2)


def _between_real(start: _Start, cycle: list[_Root], factors: tuple[Decimal, Decimal]) -> Volterra:
    """Motion between two of four real roots."""

    def off(root: _Root, end: _Root) -> Decimal:
        return abs(root[2] * end[1] / end[2] - root[1])

    b, c, d, a = cycle
    if off(d, a) * off(c, a) < off(c, b) * off(d, b):  # let the root that may be double be at b
        a, b, c, d = b, a, d, c
    low, high = sorted((off(d, a), off(d, b)))
    rates = [float(start.omega[start.axes.index(k)]) for k in range(3)]
    expected = "a motion off the separatrix if the wheel has momentum 0 or a separatrix limit"
    checks.require(low > _NOTHING * high, rates, "omega0", expected)
    g, other = off(d, a) / off(d, b), off(c, b) / off(c, a)
    squares = [abs(k) / size for k, size in zip(factors, start.sizes(), strict=True)]
    for root, factor in ((a, off(a, b) * g), (b, off(b, a)), (c, off(c, a)), (d, off(d, a))):
        squares[root[0]] *= factor
    A, B, D = start.moments
    speed = abs(factors[0] * factors[1] * a[2] * b[2]) * off(d, b) * off(c, a) / (4 * A * B * D * D)
    kind = "sn cn" if a[0] == b[0] else "sn dn" if a[0] == c[0] else "sn"
    return _moving(start, kind, a[0], (a[1] / a[2], b[1] / b[2]), squares, g, g * other, speed)


def _beside_complex(start: _Start, cycle: list[_Root]) -> Volterra:
    """Motion between the two real roots if there are only two."""
    one, (b, a) = cycle[0][0], [n / d for _, n, d in cycle]
    (alpha, beta, gamma), (A, B, D) = start.quadratics()[1 - one], start.moments
    lead = start.quadratics()[one][0]
    # distances of a and b from the complex roots
    from_a, from_b = (((alpha * y + 2 * beta) * y + gamma) / alpha for y in (a, b))
    from_a, from_b = from_a.sqrt(), from_b.sqrt()
    weight, product = from_a / from_b, from_a * from_b
    squares = [abs(lead) * (b - a) ** 2 * weight / 4, abs(alpha) * from_a * from_a]
    if one == 1:
        squares.reverse()
    squares = [square / size for square, size in zip(squares, start.sizes(), strict=True)]
    m1 = ((from_a + from_b) ** 2 - (b - a) ** 2) / (4 * product)
    speed = abs(alpha * lead) * product / (A * B * D * D)
    return _moving(start, "complex", one, (a, b), squares, weight, m1, speed)


def _moving(
    start: _Start,
    kind: str,
    one: int,
    ends: tuple[Decimal, Decimal],
    squares: list[Decimal],
    weight: Decimal,
    m1: Decimal,
    speed: Decimal,
) -> Volterra:
    """The motion with these constants, started where omega is; `one` is the component with sn."""
    (a, b), x, (A, B, D) = ends, start.omega[2], start.moments
    other = 1 - one
    mine, others = (math.copysign(1.0, start.omega[k]) for k in (one, other))
    sense = math.copysign(1.0, (A - B) * (b - a))  # D omega3' = (A - B) omega1 omega2
    near, far = abs(b) * weight, abs(a)
    sn, cn = (far / (near + far)).sqrt(), (near / (near + far)).sqrt()
    if kind == "complex":
        sn, cn = 2 * sn * cn, (near - far) / (near + far)
    dn, rest = (cn * cn + m1 * sn * sn).sqrt(), min(float(m1), 1.0)
    rest = rest if rest > special.SMALLEST else 0.0
    u = float(special.argument(float(sn), float(abs(cn)), float(dn)))
    if cn < 0:
        u = 2.0 * special.quarter_period(rest) - u
    sizes = [float(square.sqrt()) for square in squares]
    return Volterra(
        axes=(start.axes[one], start.axes[other], start.axes[2]),
        kind=kind,
        ends=(float(x + a), float(x + b)),
        amplitudes=(sense * others * sizes[one], others * sizes[other]),
        weight=float(weight),
        m1=rest,
        rate=float(speed.sqrt()),
        start=mine * sense * others * u,
        momentum=float(start.momentum()),
        drift=float(start.momentum() / D),
        poles=start.poles(a, b, weight),
    )


# Attitude of the carrier, by elliptic integrals of the third kind.
#
# In a space frame with z along L the carrier has z-x-z Euler angles about the wheel's axis: theta
# and psi from the direction of L in the body, and the precession
#
#     phi' = H (A omega1^2 + B omega2^2) / (H^2 - (D x + p)^2) = H / D + sum K / (x - e)
#
# over both D e + p = H and -H. Over the ends a and b,
#
#     K / (x - e) = K / (b - e) + (K / (a - e) - K / (b - e)) P / (P + ratio / g Q).
#
# Sources: Volterra (1899); DLMF 19.25(i), 22.14.


def attitude(
    t: ArrayLike,
    moments: ArrayLike,
    wheels: ArrayLike,
    omega0: ArrayLike,
    wheel_rate0: float,
    q0: ArrayLike,
) -> Array:
    """Attitude of the carrier of a free gyrostat, continuous in t and equal to q0 at t = 0.

    Args:
        t: times, any shape [s].
        moments: principal moments of the whole with the wheel locked, shape (3,) [kg m^2].
        wheels: axial moments of the wheels, shape (3,), one positive, the others 0 [kg m^2].
        omega0: angular velocity of the carrier at t = 0, shape (3,) [rad/s], principal body axes.
        wheel_rate0: rate s of the wheel in the carrier at t = 0 [rad/s].
        q0: attitude at t = 0, shape (4,), unit (w, x, y, z), body to world.

    Returns:
        Attitude, shape t.shape + (4,), unit (w, x, y, z), body to world.

    Raises:
        ValueError: as `volterra`, or a quaternion that is not unit.

    Source: Volterra (1899).
    """
    with localcontext(_DIGITS):
        start = _start(moments, wheels, omega0, wheel_rate0)
        path = _solved(start)
    q_start = special.normalized(q0, "q0")
    u, times = path.argument(t), checks.array(t, "t")
    if not path.poles:  # L is along the wheel's axis, and omega is, too
        rates = checks.exact_array(omega0, "omega0", 3)
        turned = special.from_rotation_vector(times[..., None] * rates)
    else:
        here, now = (
            _from_momentum(path, start, np.asarray(each), np.asarray(at))
            for each, at in ((path.start, 0.0), (u, times))
        )
        turned = special.product(special.conjugate(here), now)
        turned[..., [1 + k for k in start.axes]] = turned[..., 1:].copy()
    return special.product(np.broadcast_to(q_start, turned.shape), turned)


def _from_momentum(path: Volterra, start: _Start, u: Array, t: Array) -> Array:
    """Quaternion from the axes in cyclic order to a space frame with z along L, (..., 4)."""
    first, second, along = path.components(u)
    sizes = dict(zip(start.axes, map(float, start.moments), strict=True))
    first, second = sizes[path.axes[0]] * first, sizes[path.axes[1]] * second
    along = sizes[path.axes[2]] * along + float(start.p)
    half = 0.5 * np.arctan2(np.hypot(first, second), along)
    phi, psi = _precession(path, u, t), _spin(path, u, first, second)
    if path.axes[0] != start.axes[0]:
        psi = 0.5 * math.pi - psi
    total, difference = 0.5 * (phi + psi), 0.5 * (phi - psi)
    parts = [
        np.cos(half) * np.cos(total),
        np.sin(half) * np.cos(difference),
        np.sin(half) * np.sin(difference),
        np.cos(half) * np.sin(total),
    ]
    return np.stack(parts, axis=-1)


def _spin(path: Volterra, u: Array, first: Array, second: Array) -> Array:
    """Angle of L across the wheel's axis from its second component to its first, continuous."""
    c1, c2 = path.amplitudes
    sense, side = math.copysign(1.0, c1 * c2), math.copysign(1.0, c2)
    halves, turned = np.zeros_like(u), np.full_like(u, side)
    if path.kind in ("sn", "sn dn"):
        halves, _ = special.split_half_periods(u, path.m1)
        turned = side * (1.0 - 2.0 * np.mod(halves, 2.0))
    within = np.arctan2(sense * turned * first, turned * second)
    return sense * (np.pi * halves + within) + (0.0 if side > 0.0 else math.pi)


def _precession(path: Volterra, u: Array, t: Array) -> Array:
    """Euler angle phi about L [rad], up to a constant."""
    phi = path.drift * t
    for pole in path.poles:
        steady = pole.at_b
        if path.kind == "complex":
            integral = _cn_integral(u, pole.ratio, path.m1)
        elif pole.ratio > 1.0 or path.m1 == 0.0:
            integral = special.cn2_integral(u, pole.ratio - 1.0, path.m1)
        else:  # P / (P + ratio / g Q) = 1 - ratio / g Q / (P + ratio / g Q)
            steady = pole.at_a
            integral = -pole.ratio * _sn2_integral(u, pole.ratio, path.m1)
        swing = (pole.at_a - pole.at_b) / path.rate if path.rate else 0.0
        phi = phi + steady * t + swing * integral
    return phi


def _sn2_integral(u: Array, ratio: float, m1: float) -> Array:
    """Integral from 0 to u of sn^2 / (cn^2 + ratio sn^2)."""

    def within(sn: ArrayLike, cn: ArrayLike, dn: ArrayLike) -> Array:
        s2, c2, d2 = np.square(sn), np.square(cn), np.square(dn)
        return np.asarray(s2 * sn / 3.0 * elliprj(c2, d2, 1.0, c2 + ratio * s2))

    n, v = special.split_half_periods(u, m1)
    return 2.0 * n * within(1.0, 0.0, math.sqrt(m1)) + within(*special.jacobi(v, m1))


def _cn_integral(u: Array, ratio: float, m1: float) -> Array:
    """Integral from 0 to u of (1 + cn) / (1 + cn + ratio (1 - cn))."""
    nu = (1.0 - ratio) ** 2 / (4.0 * ratio)
    sn, _, dn = special.jacobi(u, m1)
    sd, squares = sn / dn, special.cn2_integral(u, nu, m1)
    odd = sd * elliprc(1.0, 1.0 + (1.0 - m1 + nu) * sd * sd)  # of cn / (1 + nu sn^2)
    return np.asarray((u - squares) / (1.0 + ratio) + 0.5 * (squares + odd))


# Steady rotations of a gyrostat with one wheel, and the stability of dual spin.
#
# In a steady rotation omega is along L: omega = mu L, so that L1 (1 - A mu) = L2 (1 - B mu) = 0 and
# L3 (1 - D mu) = p. Departures from it grow, or oscillate, with the eigenvalue lambda of
#
#     lambda^2 = -(L1^2 K2 K3 + L2^2 K1 K3 + L3^2 K1 K2),
#     K = (1 / A - mu, 1 / B - mu, 1 / D - mu).
#
# Sources: Hughes, Spacecraft Attitude Dynamics, ch. 6; Hall (1995), J. Guidance, Control, and
# Dynamics 18(5):1177.


@dataclass(frozen=True)
class SteadyRotation:
    """A steady rotation of a gyrostat.

    Attributes:
        omega: angular velocity of the carrier, shape (3,) [rad/s], principal body axes.
        growth: lambda^2 of departures from it [1/s^2], positive where it is unstable.
    """

    omega: Array
    growth: float


def steady_rotations(
    moments: ArrayLike, wheels: ArrayLike, momentum: float, spin_momentum: float
) -> tuple[SteadyRotation, ...]:
    """Find all steady rotations of a gyrostat with one wheel that have these momenta.

    Two are about the wheel's axis, L3 = H and -H. Where p A / (A - D) is between them, it is the L3
    of two more with mu = 1 / A and L2 = 0; and likewise with B. If A = B, each of these four stands
    for a circle.

    Args:
        moments: principal moments of the whole with the wheel locked, shape (3,) [kg m^2].
        wheels: axial moments of the wheels, shape (3,), one positive, the others 0 [kg m^2].
        momentum: magnitude H of the angular momentum of the whole [N m s].
        spin_momentum: p = J (omega3 + s) of the wheel along its axis [N m s].

    Raises:
        ValueError: moments as in `volterra`, a momentum that is not positive, or a number that is
            not finite.

    Source: Hall (1995).
    """
    inertia, axis, wheel = _one_wheel(moments, wheels)
    checks.all_positive(momentum=momentum)
    p, unit = checks.number(spin_momentum, "spin_momentum", "N m s"), np.eye(3)
    first, second = (axis + 1) % 3, (axis + 2) % 3
    D, found = float(inertia[axis]) - wheel, []
    for along in (momentum, -momentum):
        spin = (along - p) / D
        growth = _growth(along, spin, float(inertia[first]), float(inertia[second]))
        found.append(SteadyRotation(spin * unit[axis], growth))
    for k, other in ((first, second), (second, first)):
        A, B = float(inertia[k]), float(inertia[other])
        if abs(p) < momentum * (abs(A - D) / A):
            along = p / ((A - D) / A)
            across = math.sqrt(momentum - along) * math.sqrt(momentum + along) / A
            growth = -(across * ((A - B) / B)) * (across * ((A - D) / D))
            for rate in (across, -across):
                found.append(SteadyRotation(rate * unit[k] + along / A * unit[axis], growth))
    return tuple(found)


def separatrix_limits(
    moments: ArrayLike, wheels: ArrayLike, momentum: float
) -> tuple[float, float]:
    """Sizes of the wheel's momentum at which steady rotations off its axis appear [N m s].

    H abs(A - D) / A and H abs(B - D) / B, the smaller one first. At each a rotation about the
    wheel's axis throws off two others, a pitchfork. Above both the two rotations about the axis are
    alone and stable, and there is no separatrix.

    Args:
        moments: principal moments of the whole with the wheel locked, shape (3,) [kg m^2].
        wheels: axial moments of the wheels, shape (3,), one positive, the others 0 [kg m^2].
        momentum: magnitude H of the angular momentum of the whole [N m s].

    Raises:
        ValueError: moments as in `volterra`, or a momentum that is not positive.

    Source: Hall (1995).
    """
    inertia, axis, wheel = _one_wheel(moments, wheels)
    checks.all_positive(momentum=momentum)
    D = float(inertia[axis]) - wheel
    across = float(inertia[axis - 2]), float(inertia[axis - 1])
    low, high = sorted(momentum * (abs(A - D) / A) for A in across)
    return low, high


def transverse_growth(
    moments: ArrayLike, wheels: ArrayLike, spin: float, wheel_rate: float
) -> float:
    """Growth of departures from steady spin about the wheel's axis, lambda^2 [1/s^2].

    lambda^2 = -(h - A Omega) (h - B Omega) / (A B), with h = C Omega + J s.

    Args:
        moments: principal moments of the whole with the wheel locked, shape (3,) [kg m^2].
        wheels: axial moments of the wheels, shape (3,), one positive, the others 0 [kg m^2].
        spin: rate Omega of the carrier about the wheel's axis [rad/s].
        wheel_rate: rate s of the wheel in the carrier [rad/s].

    Returns:
        lambda^2, positive where the spin is unstable.

    Raises:
        ValueError: moments as in `volterra`, or a number that is not finite.

    Source: Hughes, ch. 6.
    """
    inertia, axis, wheel = _one_wheel(moments, wheels)
    checks.all_finite(spin=spin, wheel_rate=wheel_rate)
    along = float(inertia[axis]) * spin + wheel * wheel_rate
    return _growth(along, spin, float(inertia[axis - 2]), float(inertia[axis - 1]))


def _growth(along: float, spin: float, first: float, second: float) -> float:
    """lambda^2 of spin about the wheel's axis with the momentum `along` it."""
    return -((along - first * spin) / first) * ((along - second * spin) / second)


def unstable_wheel_rates(moments: ArrayLike, wheels: ArrayLike, spin: float) -> tuple[float, float]:
    """Rates of the wheel between which steady spin about its axis is unstable [rad/s].

    (A - C) Omega / J and (B - C) Omega / J, the lower one first.

    Args:
        moments: principal moments of the whole with the wheel locked, shape (3,) [kg m^2].
        wheels: axial moments of the wheels, shape (3,), one positive, the others 0 [kg m^2].
        spin: rate Omega of the carrier about the wheel's axis [rad/s].

    Raises:
        ValueError: moments as in `volterra`, or a number that is not finite.

    Source: Hughes, ch. 6.
    """
    inertia, axis, wheel = _one_wheel(moments, wheels)
    rate = checks.number(spin, "spin", "rad/s")
    low, high = sorted(
        float(inertia[k] - inertia[axis]) / wheel * rate for k in (axis - 2, axis - 1)
    )
    return low, high


# Dual spin with damping: an axisymmetric platform P and rotor R on a common axis.
#
# Seen from space a small nutation turns at lambda0 = h / A, with h = Cp wp + Cr wr, and seen from
# either part at lambda_k = h / A - w_k. A spherical slug in a part, of the moment j, is dragged by
# the torque c times its rate relative to the part. Small departures go as exp(lambda t) with
#
#     A lambda - i h + sum c j (lambda - i w) / (j lambda + c) = 0.
#
# Sources: Landon & Stewart (1964), J. Spacecraft and Rockets 1(6):682; Likins (1967), J. Spacecraft
# and Rockets 4(12):1638; Hughes, ch. 7.


def nutation_rates(
    axial_moments: ArrayLike, axial_rates: ArrayLike, *, i_perp: float
) -> tuple[float, float]:
    """Rates at which a small nutation is seen to turn from platform and rotor [rad/s].

    lambda_k = h / A - w_k, with h = Cp wp + Cr wr.

    Args:
        axial_moments: Cp of the platform, Cr of the rotor, shape (2,) [kg m^2].
        axial_rates: wp and wr in space, shape (2,) [rad/s].
        i_perp: transverse moment A of the whole [kg m^2].

    Raises:
        ValueError: a wrong shape, a moment that is not positive, or a number that is not finite.

    Source: Likins (1967).
    """
    rates, free = _dual_spin(axial_moments, axial_rates, i_perp)
    return float(free - rates[0]), float(free - rates[1])


def energy_sink(
    axial_moments: ArrayLike, axial_rates: ArrayLike, losses: ArrayLike, *, i_perp: float
) -> float:
    """Growth of the energy A (omega1^2 + omega2^2) / 2 of a nutation as the parts lose energy [J].

    lambda0 (Ep / lambda_p + Er / lambda_r), with the energies Ep and Er, negative, that the parts
    gain meanwhile. So dual spin is stable where the bracket and lambda0 have opposite signs: losses
    in a platform at rest damp, and those in the rotor of a prolate body, Cr < A, do not. It holds
    for losses that are small in each turn.

    Args:
        axial_moments: Cp of the platform, Cr of the rotor, shape (2,) [kg m^2].
        axial_rates: wp and wr in space, shape (2,) [rad/s].
        losses: energies -Ep and -Er that platform and rotor lose, shape (2,) [J].
        i_perp: transverse moment A of the whole [kg m^2].

    Raises:
        ValueError: a wrong shape, a moment that is not positive, a negative loss, a number that is
            not finite, or a part that turns with the nutation and so sees none.

    Source: Likins (1967).
    """
    rates, free = _dual_spin(axial_moments, axial_rates, i_perp)
    spent = checks.exact_array(losses, "losses", 2)
    checks.require(spent >= 0.0, spent, "losses", "at least 0 J")
    checks.require(rates != free, rates, "axial_rates", "other rates than that of the nutation")
    return -float(np.sum(spent * (free / (free - rates))))


def damped_nutation(
    axial_moments: ArrayLike,
    axial_rates: ArrayLike,
    slugs: ArrayLike,
    drags: ArrayLike,
    *,
    i_perp: float,
) -> complex:
    """Growth rate and frequency of a small nutation that spherical slugs damp, exact.

    The root lambda of the equation above that tends to i h / A for small slugs.

    Args:
        axial_moments: Cp of the platform, Cr of the rotor, without slugs, shape (2,) [kg m^2].
        axial_rates: wp and wr in space, shape (2,) [rad/s].
        slugs: moments j of the slugs in platform and rotor, shape (2,) [kg m^2]; 0 without.
        drags: torques c on them per relative rate, shape (2,) [N m s].
        i_perp: transverse moment A of the whole without slugs [kg m^2].

    Returns:
        lambda: its real part is the growth rate [1/s], its imaginary part the rate in space at
        which the axis turns [rad/s].

    Raises:
        ValueError: a wrong shape, a moment that is not positive, a negative slug or drag, a number
            that is not finite, or parts without axial momentum.

    Source: Hughes, ch. 7.
    """
    rates, free = _dual_spin(axial_moments, axial_rates, i_perp)
    checks.require(free != 0.0, rates, "axial_rates", "rates with an axial momentum")
    j, c = checks.exact_array(slugs, "slugs", 2), checks.exact_array(drags, "drags", 2)
    checks.require(j >= 0.0, j, "slugs", "at least 0 kg m^2")
    checks.require(c >= 0.0, c, "drags", "at least 0 N m s")
    active = (j > 0.0) & (c > 0.0)
    # With lambda = lambda0 (i + z): z + sum share (i seen + z) / (1 + lag (i + z)) = 0.
    share, seen = j[active] / i_perp, 1.0 - rates[active] / free
    lag = j[active] / c[active] * free
    behind = [Polynomial([1.0 + 1j * each, each]) for each in lag]
    whole = Polynomial([0.0, 1.0]) * math.prod(behind, start=Polynomial([1.0]))
    for k in range(len(behind)):
        pull = Polynomial([1j * share[k] * seen[k], share[k]])
        whole += pull * math.prod(behind[:k] + behind[k + 1 :], start=Polynomial([1.0]))
    roots = whole.roots()
    z = complex(roots[np.argmin(np.abs(roots))])
    for _ in range(3):  # Newton's steps: small growth keeps its digits
        drag = 1.0 + lag * (1j + z)
        miss = z + np.sum(share * (1j * seen + z) / drag)
        z -= miss / (1.0 + np.sum(share * (1.0 + 1j * lag * (1.0 - seen)) / drag**2))
    return complex(free * z.real, free * (1.0 + z.imag))


def _dual_spin(
    axial_moments: ArrayLike, axial_rates: ArrayLike, i_perp: float
) -> tuple[Array, float]:
    """Axial rates, checked, and the rate lambda0 of the nutation in space."""
    checks.all_positive(i_perp=i_perp)
    axial = checks.positive_array(axial_moments, "axial_moments", "kg m^2", 2)
    rates = checks.exact_array(axial_rates, "axial_rates", 2)
    return rates, float(np.sum(axial / i_perp * rates))


# Turns of a gyrostat without angular momentum: the wheels turn, and the carrier turns back.
#
# With L = 0 the carrier turns at omega_k = -l_k / A_k and the wheel at s_k = -(I_k / J_k) omega_k.
# So the wheels' angles are proportional to the integrals of omega_k, whatever the order of turns,
# but the attitude depends on the order.
#
# Source: Hughes, ch. 6.


def carrier_rates(spin_momenta: ArrayLike, moments: ArrayLike, wheels: ArrayLike) -> Array:
    """Angular velocity of the carrier of a gyrostat without angular momentum, -l_k / (I_k - J_k).

    Args:
        spin_momenta: l_k of the wheels, shape (..., 3) [N m s]; 0 where there is none.
        moments: principal moments of the whole with the wheels locked, shape (3,) [kg m^2].
        wheels: axial moments of the wheels along the principal axes, shape (3,) [kg m^2].

    Returns:
        omega, shape (..., 3) [rad/s], principal body axes.

    Raises:
        ValueError: a wrong shape, a moment that is not positive, a wheel with more than the moment
            of the whole, a number that is not finite, or momentum of a wheel that is not there.

    Source: Hughes, ch. 6.
    """
    inertia, axial = _with_wheels(moments, wheels)
    momenta = checks.array(spin_momenta, "spin_momenta", 3)
    there = (momenta == 0.0) | (axial > 0.0)
    checks.require(there, momenta, "spin_momenta", "0 where there is no wheel")
    return -momenta / (inertia - axial)


def wheel_turns(turned: ArrayLike, moments: ArrayLike, wheels: ArrayLike) -> Array:
    """Angles by which the wheels turn in the carrier while it turns, without angular momentum.

    -(I_k / J_k) times the integral of omega_k.

    Args:
        turned: integrals of omega about the principal axes, shape (..., 3) [rad].
        moments: principal moments of the whole with the wheels locked, shape (3,) [kg m^2].
        wheels: axial moments of the wheels along the principal axes, shape (3,) [kg m^2].

    Returns:
        Angles, shape (..., 3) [rad]; 0 where there is no wheel.

    Raises:
        ValueError: as `carrier_rates`, or a turn about an axis without a wheel.

    Source: Hughes, ch. 6.
    """
    inertia, axial = _with_wheels(moments, wheels)
    angles = checks.array(turned, "turned", 3)
    there = (angles == 0.0) | (axial > 0.0)
    checks.require(there, angles, "turned", "0 about an axis without a wheel")
    return -angles * inertia / np.where(axial > 0.0, axial, np.inf)


def commutator(turn1: ArrayLike, turn2: ArrayLike) -> Array:
    """Rotation by a loop: alpha about e1, then beta about e2, -alpha about e1, -beta about e2.

    With s, c of half alpha and S, C of half beta the quaternion is

        (1 - 2 s^2 S^2, 2 s S^2 c, -2 s^2 S C, 2 s S c C),

    for small angles a turn by alpha beta about e3. The wheels are where they were.

    Args:
        turn1: alpha about e1 [rad], any shape.
        turn2: beta about e2 [rad], of a shape that broadcasts with that of the first.

    Returns:
        Attitude of the carrier after the loop in that before, shape (..., 4), unit (w, x, y, z).

    Raises:
        ValueError: angles that are not finite.

    Source: Hughes, ch. 2.
    """
    alpha, beta = 0.5 * checks.array(turn1, "turn1"), 0.5 * checks.array(turn2, "turn2")
    s, c, S, C = np.sin(alpha), np.cos(alpha), np.sin(beta), np.cos(beta)
    q = [1.0 - 2.0 * (s * S) ** 2, 2.0 * s * S * S * c, -2.0 * s * s * S * C, 2.0 * s * S * c * C]
    return np.stack(np.broadcast_arrays(*q), axis=-1)


def slew_time(theta: ArrayLike, *, carrier: float, torque: float, momentum: float) -> Array:
    """Least time in which one wheel turns the carrier about its axis, from rest to rest [s].

    2 sqrt(A theta / u) up to theta = l^2 / (A u), by full torque and full torque back; then
    A theta / l + l / u, with a coast between at the largest momentum.

    Args:
        theta: angle of the turn [rad], any shape.
        carrier: A = I - J about the axis [kg m^2].
        torque: largest torque u of the motor [N m].
        momentum: largest size l of the wheel's momentum [N m s].

    Returns:
        Time, of the shape of theta [s].

    Raises:
        ValueError: a moment, torque or momentum that is not positive, or a number that is not
            finite.

    Source: Bryson & Ho, Applied Optimal Control, sec. 3.9.
    """
    checks.all_positive(carrier=carrier, torque=torque, momentum=momentum)
    angle = np.abs(checks.array(theta, "theta"))
    fastest, rise = momentum / carrier, momentum / torque
    bang = 2.0 * np.sqrt(angle / fastest) * math.sqrt(rise)
    return np.asarray(np.where(angle <= fastest * rise, bang, angle / fastest + rise))
