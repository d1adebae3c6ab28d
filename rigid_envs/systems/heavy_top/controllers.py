"""Controllers of tops."""

import abc
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, ClassVar

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, CheckedFields, positive, positive_array, require
from rigid_envs.control import linear
from rigid_envs.control.predictive import Symbols, size
from rigid_envs.mechanics import rotations
from rigid_envs.mechanics.symbolic import casadi
from rigid_envs.systems.heavy_top.closed_forms import steady_precession
from rigid_envs.systems.heavy_top.system import HeavyTop

# Balancing slow symmetric tops: by horizontal torque, and by moving the pivot.

Complex = npt.NDArray[np.complex128]
_E_Z = np.array([0.0, 0.0, 1.0])
_SPINS = np.linspace(-1.5, 1.5, 31)  # in parts of the critical spin, for which there are gains


def axis_of(y: npt.ArrayLike) -> Complex:
    """Horizontal part of a top's axis, and of its pivot's position, in complex numbers.

    Args:
        y: states of `HeavyTop`, shape (..., 11).

    Returns:
        x = (e, e', X, X') with e = e_x + i e_y of the axis e3 in the world, X = X + i Y of the
        pivot [1, 1/s, m, m/s], shape (..., 4).
    """
    rows = HeavyTop.checked_state(y)
    e = rotations.rotate(rows[..., :4], _E_Z)
    rate = np.cross(rotations.rotate(rows[..., :4], rows[..., 4:7]), e)
    plane = np.stack([e[..., :2], rate[..., :2], rows[..., 7:9], rows[..., 9:11]], axis=-2)
    return np.asarray(plane[..., 0] + 1j * plane[..., 1])


def check_balanced(top: HeavyTop) -> None:
    """Refuse a top that no controller of symmetric tops can balance.

    Args:
        top: The top.

    Raises:
        ValueError: It is not symmetric, or cannot fall.
    """
    require(top.I1 == top.I2, top, "top", "a symmetric top, I1 = I2")
    require(top.critical_spin > 0.0, top, "top", "a top that can fall, g and ell above 0")


@dataclass(frozen=True)
class TopBalance(CheckedFields, abc.ABC):
    """Keeps a symmetric top upright by linear feedback of `axis_of`, scheduled on its spin.

    Attributes:
        top: symmetric top, I1 = I2.
        limit: largest input [N m or m/s^2].
        dt: control period [s].

    Raises:
        ValueError: a top that is not symmetric or cannot fall, numbers that are not positive.
    """

    top: HeavyTop
    limit: Annotated[float, positive, "N m or m/s^2"]
    dt: Annotated[float, positive, "s"]

    _n: ClassVar[int]
    """How many entries of `axis_of` are fed back."""
    _inputs: ClassVar[slice]
    """Where the two components of the input stand in u of `HeavyTop`."""
    _weights: ClassVar[tuple[list[float], list[float]]]
    """Weights of the states and of the input."""

    def __post_init__(self) -> None:
        """Check the symmetry of the top and the numbers."""
        super().__post_init__()
        check_balanced(self.top)

    @abc.abstractmethod
    def model(self, spin: float) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
        """A and B of the linear equation x' = A x + B u at a spin omega3 [rad/s]."""

    def __call__(self, y: npt.ArrayLike) -> Array:
        """Actions, inputs over the largest, in the disk, shape (..., 2), of states y (..., 11)."""
        u = self._regulator(y).feedback(axis_of(y)[..., : self._n])[..., 0]
        return linear.clip_to_ball(np.stack([u.real, u.imag], axis=-1) / self.limit)

    def inputs(self, action: npt.ArrayLike) -> Array:
        """Input u of `HeavyTop`, shape (..., 8), of actions (..., 2)."""
        given = np.asarray(action, dtype=np.float64)
        u = np.zeros((*given.shape[:-1], 8))
        u[..., self._inputs] = self.limit * given
        return u

    def value(self, y: npt.ArrayLike) -> Array:
        """Cost to go x* P x of states y, shape (..., 11), for small tilts and no limits; (...)."""
        return self._regulator(y).value(axis_of(y)[..., : self._n])

    def regulator(self, spin: float) -> linear.Regulator:
        """K and P, complex, at a spin omega3 [rad/s]."""
        return linear.lqr(*linear.zero_order_hold(*self.model(spin), self.dt), *self._weights)

    @cached_property
    def _table(self) -> Callable[..., linear.Regulator]:
        return linear.scheduled(self.regulator, self.top.critical_spin * _SPINS)

    def _regulator(self, y: npt.ArrayLike) -> linear.Regulator:
        return self._table(HeavyTop.checked_state(y)[..., 6])


@dataclass(frozen=True)
class UprightBalance(TopBalance):
    """Keeps a slow top upright by a horizontal torque, given in world axes.

    In complex numbers, with e = e_x + i e_y of the axis and tau = tau_x + i tau_y,

        I1 e'' - i I3 omega3 e' - m g ell e = -i tau,

    exactly linear but for terms of third order in the tilt. The torque tau = -K(omega3) (e, e') has
    the least sum of ``|e|^2 + 0.1 |e'|^2 + 0.03 |tau|^2`` over the control periods.

    Certificate: the Riccati matrix, 2 x 2 and Hermitian, at every spin: ``value(y) = x* P x`` is
    the sum from there on, and decreases. (It is interpolated between 31 spins up to 1.5 of the
    critical one, in either sense; faster ones are taken for that.)

    Region: in the linear equation no torque of size M brings back a tilt beyond ``M / (m g ell
    sqrt(1 - share^2))`` [rad] that is released with e' = 0, where share is the spin over the
    critical one. This controller brings back 0.95 of that (measured, up to 0.65 rad). Its
    eigenvalues stay inside the unit circle if moments, mass and length are each up to 15 % off
    (measured).

    Attributes:
        top: symmetric top, I1 = I2.
        limit: largest torque [N m].
        dt: control period [s].

    Raises:
        ValueError: a top that is not symmetric or cannot fall, numbers that are not positive.

    Source: Goldstein, Poole & Safko, *Classical Mechanics*, section 5.7; Anderson & Moore, *Optimal
    Control: Linear Quadratic Methods*, section 3.3.
    """

    _n: ClassVar[int] = 2
    _inputs: ClassVar[slice] = slice(3, 5)
    _weights: ClassVar[tuple[list[float], list[float]]] = ([1.0, 0.1], [0.03])

    def model(self, spin: float) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
        """A and B for x = (e, e') and the torque at a spin omega3 [rad/s]."""
        top = self.top
        fall, turn = top.m * top.g * top.ell / top.I1, 1j * top.I3 * spin / top.I1
        return np.array([[0.0, 1.0], [fall, turn]]), np.array([[0.0], [-1j / top.I1]])


@dataclass(frozen=True)
class PivotBalance(TopBalance):
    """Keeps a slow top upright by accelerating its pivot, and brings the pivot to the origin.

    In complex numbers, with e = e_x + i e_y of the axis and X = X + i Y of the pivot,

        I1 e'' - i I3 omega3 e' - m g ell e = -m ell a,   X'' = a.

    The acceleration a = -K(omega3) (e, e', X, X') has the least sum of ``|e|^2 + |e'|^2 + 0.05
    |X|^2 + 0.2 |X'|^2 + 0.03 |a|^2`` over the control periods.

    Certificate: the Riccati matrix, 4 x 4 and Hermitian, as of `UprightBalance`.

    Region: measured for the default top and 3 m/s^2, tilts up to 0.16 rad are brought back within 5
    m of the origin at 0.3 of the critical spin. Moments, mass and length may each be 5 % off.

    Attributes:
        top: symmetric top, I1 = I2.
        limit: largest acceleration [m/s^2].
        dt: control period [s].

    Raises:
        ValueError: a top that is not symmetric or cannot fall, numbers that are not positive.

    Source: Goldstein, Poole & Safko, *Classical Mechanics*, section 5.7, in the accelerated frame
    of the pivot.
    """

    _n: ClassVar[int] = 4
    _inputs: ClassVar[slice] = slice(6, 8)
    _weights: ClassVar[tuple[list[float], list[float]]] = ([1.0, 1.0, 0.05, 0.2], [0.03])

    def model(self, spin: float) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
        """A and B for x = (e, e', X, X') and the acceleration at a spin omega3 [rad/s]."""
        top = self.top
        fall, turn = top.m * top.g * top.ell / top.I1, 1j * top.I3 * spin / top.I1
        A = np.zeros((4, 4), dtype=np.complex128)
        A[0, 1] = A[2, 3] = 1.0
        A[1, :2] = fall, turn
        return A, np.array([[0.0], [-top.m * top.ell / top.I1], [0.0], [1.0]])


# Balancing a heavy top with three different moments.

_NODES = 25  # spins for which there are gains


def vertical_of(y: npt.ArrayLike) -> Array:
    """(G1, G2, omega1, omega2) of states y of `HeavyTop`, with the vertical G in body axes.

    Args:
        y: shape (..., 11).

    Returns:
        Shape (..., 4) [1, rad/s].
    """
    rows = HeavyTop.checked_state(y)
    vertical = rotations.rotate_inverse(rows[..., :4], _E_Z)
    return np.concatenate([vertical[..., :2], rows[..., 4:6]], axis=-1)


@dataclass(frozen=True)
class AsymmetricBalance(CheckedFields):
    """Keeps a top of any three moments upright, at whatever rate it turns about e3.

    Near upright, with the vertical G = R^T e_z and x = (G1, G2, omega1, omega2),

        x1' = omega3 x2 - x4,   I1 x3' = (I2 - I3) omega3 x4 + m g ell x2 + tau1,
        x2' = x3 - omega3 x1,   I2 x4' = (I3 - I1) omega3 x3 - m g ell x1 + tau2,

    and omega3 changes only with the product of x3 and x4. The torque (tau1, tau2) = -K(omega3) x
    has the least sum of ``x1^2 + x2^2 + 0.1 (x3^2 + x4^2) + 0.03 |tau|^2`` over the control
    periods; there is none about e3. K is interpolated between 25 spins; faster ones are taken for
    the fastest.

    Certificate: the Riccati matrix P at every spin: ``value(y) = x P x`` is the sum from there on,
    and a Lyapunov function, for small x and no limits.

    Region: measured for the moments (0.925, 1.15, 0.55), m g ell = 1 N m and 0.3 N m, tilts at rest
    up to 0.3 rad in any direction are brought back at all spins up to 2 rad/s. The eigenvalues stay
    inside the unit circle if the moments are others of 0.85 .. 1, 1.05 .. 1.25 and 0.45 .. 0.65.

    Attributes:
        top: heavy top of any moments.
        torque: largest torque about each axis [N m].
        dt: control period [s].
        fastest: largest abs(omega3) for which there are gains [rad/s].

    Raises:
        ValueError: numbers that are not positive.

    Source: Goldstein, Poole & Safko, *Classical Mechanics*, sections 5.5 and 5.7.
    """

    top: HeavyTop
    torque: Annotated[float, positive, "N m"]
    dt: Annotated[float, positive, "s"]
    fastest: Annotated[float, positive, "rad/s"]

    def __call__(self, y: npt.ArrayLike) -> Array:
        """Actions, torques over the largest, in [-1, 1], shape (..., 3), of states (..., 11)."""
        torque = self._regulator(y).feedback(vertical_of(y))
        return linear.clip_to_box(
            np.concatenate([torque, 0.0 * torque[..., :1]], axis=-1) / self.torque
        )

    def inputs(self, action: npt.ArrayLike) -> Array:
        """Input u of `HeavyTop` [N m], shape (..., 8), of actions (..., 3)."""
        given = np.asarray(action, dtype=np.float64)
        return np.concatenate([self.torque * given, np.zeros((*given.shape[:-1], 5))], axis=-1)

    def value(self, y: npt.ArrayLike) -> Array:
        """Cost to go of states y, shape (..., 11), for small x; of shape (...)."""
        return self._regulator(y).value(vertical_of(y))

    def model(self, spin: float) -> tuple[Array, Array]:
        """A and B for x = (G1, G2, omega1, omega2) and (tau1, tau2) at a spin omega3 [rad/s]."""
        I1, I2, I3 = self.top.moments
        mgl = self.top.m * self.top.g * self.top.ell
        A = np.array(
            [
                [0.0, spin, 0.0, -1.0],
                [-spin, 0.0, 1.0, 0.0],
                [0.0, mgl / I1, 0.0, (I2 - I3) * spin / I1],
                [-mgl / I2, 0.0, (I3 - I1) * spin / I2, 0.0],
            ]
        )
        return A, np.array([[0.0, 0.0], [0.0, 0.0], [1.0 / I1, 0.0], [0.0, 1.0 / I2]])

    def regulator(self, spin: float) -> linear.Regulator:
        """K and P at a spin omega3 [rad/s]."""
        held = linear.zero_order_hold(*self.model(spin), self.dt)
        return linear.lqr(*held, [1.0, 1.0, 0.1, 0.1], [0.03, 0.03])

    @cached_property
    def _table(self) -> Callable[..., linear.Regulator]:
        return linear.scheduled(self.regulator, self.fastest * np.linspace(-1.0, 1.0, _NODES))

    def _regulator(self, y: npt.ArrayLike) -> linear.Regulator:
        return self._table(HeavyTop.checked_state(y)[..., 6])


# Damping the nutation of a top: into steady precession at a commanded tilt.

_STEADY_NODES = 6  # of tilts and of spins, for which there are gains
_BRANCHES = ("slow", "fast")


def nutation_of(y: npt.ArrayLike) -> Array:
    """Tilt and rates (theta, theta', phi') of states y of `HeavyTop`, shape (..., 11).

    Returns:
        Shape (..., 3) [rad, rad/s]; phi' is far off within some 1e-6 rad of the vertical, where it
        is not defined.
    """
    rows = HeavyTop.checked_state(y)
    n, sine, cosine = _upward(rows)
    w1, w2 = rows[..., 4], rows[..., 5]
    rate = (w1 * n[..., 0] + w2 * n[..., 1]) / sine
    fall = w1 * n[..., 1] - w2 * n[..., 0]
    return np.stack([np.arctan2(sine, cosine), fall, rate], axis=-1)


@dataclass(frozen=True)
class PrecessionRegulator(CheckedFields):
    """Leads a symmetric top into steady precession at a tilt, by torque about e1 and e2.

    Steady precession at the tilt theta and the rate f, a root of ``I1 cos(theta) f^2 - I3 omega3 f
    + m g ell = 0``, needs no torque. With x = (theta - goal, theta', phi' - f), s = sin(goal) and
    kappa = I3 omega3 / I1 - 2 f cos(goal), the top near it moves by

        x1' = x2,   x2' = -f^2 s^2 x1 - s kappa x3 - u_l / I1,   x3' = kappa x2 / s + u_n / (I1 s),

    where n is the direction across e3 that points up and l = e3 x n. The torque u = -K x has the
    least sum of ``100 x1^2 + 10 x2^2 + 10 x3^2 + 3 |u|^2`` over the control periods; it is held in
    body axes, which turn from n and l at psi'. K is interpolated between 6 tilts and 6 spins. A
    goal beyond `tilts` has the f of the nearest one within, a slower spin that of the slowest.

    Certificate: the Riccati matrix P: ``value(y, goal) = x P x`` is the sum from there on, and a
    Lyapunov function, for small x and no limits.

    Region: measured for the default top and 0.5 N m, from all tilts up to 1.2 rad with rates across
    e3 up to 1 rad/s, to goals of 0.3 to 0.9 rad within 15 s, at 1.2 to 2 times the critical spin.

    Attributes:
        top: symmetric top, I1 = I2.
        torque: largest torque about each of the two axes [N m].
        dt: control period [s].
        tilts: range of the goals, within (0, pi) [rad].
        spins: range of omega3, fast enough for both roots at all goals [rad/s].
        branch: "slow" or "fast", which of the two roots.

    Raises:
        ValueError: a top that is not symmetric, numbers that are not positive, ranges that are none
            or that hold a tilt and a spin without steady precession.

    Source: Goldstein, Poole & Safko, *Classical Mechanics*, section 5.7.
    """

    top: HeavyTop
    torque: Annotated[float, positive, "N m"]
    dt: Annotated[float, positive, "s"]
    tilts: tuple[float, float]
    spins: tuple[float, float]
    branch: str = "slow"

    def __post_init__(self) -> None:
        """Check everything, and that there is a steady precession at the slowest spin."""
        super().__post_init__()
        require(self.top.I1 == self.top.I2, self.top, "top", "a symmetric top, I1 = I2")
        require(self.branch in _BRANCHES, self.branch, "branch", f"one of {_BRANCHES}")
        low, high = positive_array(self.tilts, "tilts", "rad", 2)
        require(low < high < np.pi, self.tilts, "tilts", "0 < least < largest < pi [rad]")
        slow, fast = positive_array(self.spins, "spins", "rad/s", 2)
        require(slow < fast, self.spins, "spins", "0 < least < largest [rad/s]")
        expected = (
            f"rates at which the top precesses steadily at a tilt of {low} rad [rad/s]: take "
            "faster ones"
        )
        steady = bool(np.isfinite(self.steady_rate(self.tilts[0], self.spins[0])))
        require(steady, self.spins, "spins", expected)

    def __call__(self, y: npt.ArrayLike, goal: npt.ArrayLike) -> Array:
        """Actions, torques over the largest, each in [-1, 1], shape (..., 2).

        Args:
            y: states, shape (..., 11).
            goal: commanded tilts [rad], shape (...).
        """
        x, regulator = self._deviation(y, goal)
        u = regulator.feedback(x)
        n, _, _ = _upward(HeavyTop.checked_state(y))
        ahead = np.stack([-n[..., 1], n[..., 0]], axis=-1)
        return linear.clip_to_box((u[..., :1] * n + u[..., 1:] * ahead) / self.torque)

    def inputs(self, action: npt.ArrayLike) -> Array:
        """Input u of `HeavyTop` [N m], shape (..., 8), of actions (..., 2)."""
        given = np.asarray(action, dtype=np.float64)
        return np.concatenate([self.torque * given, np.zeros((*given.shape[:-1], 6))], axis=-1)

    def value(self, y: npt.ArrayLike, goal: npt.ArrayLike) -> Array:
        """Cost to go of states (..., 11) and goals (...), for small x; of shape (...)."""
        x, regulator = self._deviation(y, goal)
        return regulator.value(x)

    def steady_rate(self, tilt: npt.ArrayLike, spin: npt.ArrayLike) -> Array:
        """The root f of this branch at tilts [rad] and spins [rad/s], shape (...) [rad/s]."""
        mgl = self.top.m * self.top.g * self.top.ell
        roots = steady_precession(tilt, spin, i_perp=self.top.I1, i3=self.top.I3, mgl=mgl)
        return roots[_BRANCHES.index(self.branch)]

    def regulator(self, tilt: float, spin: float) -> linear.Regulator:
        """K and P in x = (theta - goal, theta', phi' - f), for u along n and l."""
        I1, s, c = self.top.I1, np.sin(tilt), np.cos(tilt)
        f = float(self.steady_rate(tilt, spin))
        kappa = self.top.I3 * spin / I1 - 2.0 * f * c
        A = np.array([[0.0, 1.0, 0.0], [-((f * s) ** 2), 0.0, -s * kappa], [0.0, kappa / s, 0.0]])
        B = np.array([[0.0, 0.0], [0.0, -1.0], [1.0 / s, 0.0]]) / I1
        turn = (spin - f * c) * np.array([[0.0, -1.0], [1.0, 0.0]])
        F, G = linear.zero_order_hold(A, B, self.dt, turn)
        return linear.lqr(F, G, [100.0, 10.0, 10.0], [3.0, 3.0])

    @cached_property
    def _table(self) -> Callable[..., linear.Regulator]:
        return linear.scheduled(
            self.regulator,
            np.linspace(*self.tilts, _STEADY_NODES),
            np.linspace(*self.spins, _STEADY_NODES),
        )

    def _deviation(self, y: npt.ArrayLike, goal: npt.ArrayLike) -> tuple[Array, linear.Regulator]:
        """The deviation x, and the regulator there."""
        spin, tilt = HeavyTop.checked_state(y)[..., 6], np.asarray(goal, dtype=np.float64)
        steady = self.steady_rate(np.clip(tilt, *self.tilts), np.maximum(spin, self.spins[0]))
        x = nutation_of(y) - np.stack(np.broadcast_arrays(tilt, 0.0, steady), axis=-1)
        return x, self._table(tilt, spin)


def _upward(y: Array) -> tuple[Array, Array, Array]:
    """Direction of the vertical across e3, (n1, n2) in body axes, and sin and cos of theta."""
    vertical = rotations.rotate_inverse(y[..., :4], _E_Z)
    sine = np.maximum(np.hypot(vertical[..., 0], vertical[..., 1]), 1e-9)
    return vertical[..., :2] / sine[..., None], sine, vertical[..., 2]


# Problems for predictive control: a spin about the middle axis, a top on its pivot, a ball.


@dataclass(frozen=True)
class BalancedTop(CheckedFields):
    """Keeping a symmetric top upright by acceleration of its pivot, at the least of it.

    A symmetric top has no phase: of all states that turns about e3 lead to one another, the plan
    knows the one with z = 0 in its quaternion. Coordinates x = (x, y; omega; X, Y, VX, VY) of it.
    With the tilt theta the cost is ``push |a| + weight (2 - 2 cos(theta) + omega1^2 + omega2^2 +
    0.05 |X|^2 + 0.2 |V|^2)``.

    Attributes:
        top: symmetric top, I1 = I2.
        push: largest acceleration of the pivot [m/s^2].
        weight: of the deviation [m/s^2].

    Raises:
        ValueError: a top that is not symmetric, or numbers that are not positive.
    """

    top: HeavyTop
    push: Annotated[float, positive, "m/s^2"]
    weight: Annotated[float, positive, "m/s^2"] = 3.0

    sizes: ClassVar[tuple[int, int, int]] = (9, 2, 0)

    def __post_init__(self) -> None:
        """Check the symmetry of the top and the numbers."""
        super().__post_init__()
        require(self.top.I1 == self.top.I2, self.top, "top", "a symmetric top, I1 = I2")

    def coordinates(self, y: npt.ArrayLike) -> Array:
        """Of states y."""
        rows = np.moveaxis(self.top.checked_state(y), -1, 0)
        return np.stack(np.broadcast_arrays(*_without_phase(rows)), axis=-1)

    def step(self, x: Symbols, a: Symbols, h: float) -> Symbols:
        """Coordinates after a time h [s]."""
        ca = casadi()
        y = ca.vertcat(ca.sqrt(1.0 - x[0] ** 2 - x[1] ** 2), x[:2], 0.0, x[2:])
        u = ca.vertcat(ca.DM.zeros(6), self.push * a)
        after = self.top.symbolic().step(h)(y, u)
        return ca.vertcat(*_without_phase(ca.vertsplit(after)))

    def cost(self, x: Symbols, a: Symbols, goal: Symbols) -> Symbols:
        """Acceleration and deviation; 2 - 2 cos(theta) is 4 (x^2 + y^2)."""
        squares = casadi().DM([4.0, 4.0, 1.0, 1.0, 0.0, 0.05, 0.05, 0.2, 0.2])
        return self.push * size(a) + self.weight * casadi().dot(squares, x**2)

    def limits(self, x: Symbols, a: Symbols) -> Symbols:
        """Actions are in the disk."""
        return casadi().sumsqr(a) - 1.0


def _without_phase(y: Any) -> tuple[Any, ...]:
    """Entries x, y, omega and pivot after the turn about e3 that takes z of the quaternion to 0."""
    w, x, y_, z, w1, w2, w3, *pivot = y
    square = w * w + z * z
    c, s = (w * w - z * z) / square, 2.0 * w * z / square
    root = square**0.5
    tilt = (x * w - y_ * z) / root, (y_ * w + x * z) / root
    return (*tilt, c * w1 - s * w2, s * w1 + c * w2, w3, *pivot)
