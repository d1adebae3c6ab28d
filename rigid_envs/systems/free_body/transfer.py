"""From one polhode to another: the least impulse that it takes, and a controller that uses it."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt

from rigid_envs.base import checks
from rigid_envs.systems.free_body.controllers import SpinController, check_actuators

# What free motion keeps, as a point in a plane in which distances are impulses.


def polhode_point(moments: npt.ArrayLike, L: npt.ArrayLike) -> checks.Array:
    """The point (q1, q3) of the polhode through an angular momentum, shape (..., 2) [N m s].

        q1 = sqrt(L1^2 + a L2^2),   q3 = sqrt(L3^2 + (1 - a) L2^2),
        a = (1 / I2 - 1 / I3) / (1 / I1 - 1 / I3)

    Energy and norm(L) are functions of q1 and q3, so free motion keeps both. They are abs(L1) and
    abs(L3) where the polhode crosses the plane of e1 and e3, as every polhode does but the
    separatrices, which tend to e2. Spins about e2 and separatrices lie on the ray along (sqrt(a),
    sqrt(1 - a)).

    An impulse J moves the point by at most norm(J): the map from L to (L1, sqrt(a) L2, L3,
    sqrt(1 - a) L2) keeps distances, and the norms of its two halves change by no more than the
    halves do. Where the polhode crosses the plane of e1 and e3, an impulse in that plane moves the
    point by all of norm(J). So between two polhodes the least impulse is the distance of their
    points: no torque needs less, and with enough time it is enough.

    Args:
        moments: I1 < I2 < I3, shape (..., 3) [kg m^2].
        L: Angular momentum, body axes, shape (..., 3) [N m s].
    """
    L, a = np.asarray(L, dtype=np.float64), intermediate_share(moments)
    q1 = np.hypot(L[..., 0], np.sqrt(a) * L[..., 1])
    return np.stack([q1, np.hypot(L[..., 2], np.sqrt(1.0 - a) * L[..., 1])], axis=-1)


def intermediate_share(moments: npt.ArrayLike) -> checks.Array:
    """The a of `polhode_point`, shape (...), of moments I1 < I2 < I3, shape (..., 3)."""
    first, second, third = np.moveaxis(1.0 / np.asarray(moments, dtype=np.float64), -1, 0)
    return np.asarray((second - third) / (first - third))


def rays(moments: npt.ArrayLike) -> checks.Array:
    """Unit vectors along the ray of `polhode_point` and across it, as rows, shape (..., 2, 2)."""
    a = intermediate_share(moments)
    first, third = np.sqrt(a), np.sqrt(1.0 - a)
    rows = [np.stack([first, third], axis=-1), np.stack([third, -first], axis=-1)]
    return np.stack(rows, axis=-2)


# Controllers that change the polhode where an impulse does most.

_STUCK = 0.02  # of Omega: an s so small at -e2 that the motion would hardly leave
_TINY = 1e-300  # in place of a length of 0 that divides 0


@dataclass(frozen=True)
class Transfer(SpinController):
    """Base of controllers that lead a spin to e2 by impulses where free motion makes them do most.

    In the plane of `polhode_point` the goal lies on a ray, at distances from the origin within the
    tolerance of I2 Omega. The way there is a straight line D, and in a control period the least
    impulse that goes along it is J = G^+ D, with G the derivatives of the point by L. It is given
    if ``|D| >= efficiency |J|``. Else the controller waits: within half a turn of the polhode the
    motion crosses the plane of e1 and e3, where ``|D| = |J|``. What is along the ray can be changed
    at any time, as for it ``|J| = |D|`` everywhere.

    A motion that leaves e2 is not led to the ray, where it would come to rest at -e2, but to a
    distance of ``clearance I2 Omega`` from it: then it turns over once more and comes back.

    Near e2, where ``|d| < reach Omega`` (see `Saddle`), d is cancelled by the least impulse within
    a period.

    One actuator moves the point along one line. Then D is the way across the ray alone, and is
    worth its impulse if ``|D|`` is at least `efficiency` times the most that an impulse of that
    size brings anywhere; the tolerance should leave the rate free.

    Attributes:
        body: rigid body with I1 < I2 < I3.
        rate: Omega of the spin about e2 [rad/s].
        torque: largest torque about each axis [N m].
        dt: control period [s].
        tolerance: norm(omega - Omega e2) / Omega that may be left.
        efficiency: least distance that an impulse of 1 must bring.
        clearance: distance of a motion that leaves e2 from the ray, over I2 Omega.
        reach: largest abs(d) / Omega that is cancelled near e2.
        axes: which body axes have an actuator.

    Raises:
        ValueError: moments in another order, numbers that are not positive, or neither e1 nor e3
            with an actuator: torque about e2 alone keeps 2 T I2 - L^2.

    Source: for impulses where they do most, Lawden 1963, *Optimal Trajectories for Space
    Navigation* (the primer vector).
    """

    dt: Annotated[float, checks.positive, "s"]
    tolerance: Annotated[float, checks.positive, "1"]
    efficiency: Annotated[float, checks.positive, "1"] = 0.97
    clearance: Annotated[float, checks.positive, "1"] = 0.02
    reach: Annotated[float, checks.positive, "1"] = 0.15
    axes: tuple[bool, bool, bool] = (True, True, True)

    def __post_init__(self) -> None:
        """Check the numbers and the actuators too."""
        super().__post_init__()
        check_actuators(self.axes)

    def distance(self, y: npt.ArrayLike) -> checks.Array:
        """Distance from the goal of the polhodes of states y, shape (..., 7); (...) [N m s]."""
        place = self._place(self.omega(y))
        return np.asarray(np.hypot(place[..., 0] - self._along(place[..., 0]), place[..., 1]))

    def _actions(self, impulse: checks.Array) -> checks.Array:
        """Actions that give impulses within a period, or as much of them as the limits allow."""
        action = impulse * self.axes / (self.torque * self.dt)
        return np.asarray(action / np.maximum(np.abs(action).max(axis=-1, keepdims=True), 1.0))

    def _lead(self, omega: checks.Array) -> checks.Array:
        """Impulses along D, and near e2 those that catch the spin, shape (..., 3) [N m s]."""
        return np.where(self._near(omega)[..., None], self._catch(omega), self._steer(omega))

    def _near(self, omega: checks.Array) -> checks.Bools:
        d, _ = self.saddle.coordinates(omega)
        return np.asarray((omega[..., 1] > 0.0) & (np.abs(d) < self.reach * self.rate))

    def _place(self, omega: checks.Array) -> checks.Array:
        """Coordinates along the ray and across it, shape (..., 2)."""
        moments = self.body.moments
        return np.asarray(polhode_point(moments, moments * omega) @ rays(moments).T)

    def _along(self, along: checks.Array) -> checks.Array:
        """The nearest coordinate along the ray that is within the tolerance."""
        goal = self.body.I2 * self.rate
        return np.clip(along, goal * (1.0 - self.tolerance), goal * (1.0 + self.tolerance))

    def _steer(self, omega: checks.Array) -> checks.Array:
        """Impulses along D that are worth it, shape (..., 3) [N m s]."""
        place = self._place(omega)
        leaving = omega[..., 0] * omega[..., 2] < 0.0
        clear = np.copysign(self.clearance * self.body.I2 * self.rate, place[..., 1])
        goal = np.stack([self._along(place[..., 0]), np.where(leaving, clear, 0.0)], axis=-1)
        led = slice(1, 2) if sum(self.axes) == 1 else slice(0, 2)
        axes = rays(self.body.moments)[led]
        D = (goal - place)[..., led]
        impulse = (np.linalg.pinv(axes @ self._derivatives(omega), rcond=1e-9) @ D[..., None])[
            ..., 0
        ]
        most = np.linalg.norm(axes * (self.axes[0], self.axes[2]), 2)
        least = self.efficiency * most * np.linalg.norm(impulse, axis=-1)
        return np.where((np.linalg.norm(D, axis=-1) >= least)[..., None], impulse, 0.0)

    def _derivatives(self, omega: checks.Array) -> checks.Array:
        """G of the actuators, shape (..., 2, 3)."""
        moments = self.body.moments
        a, L = float(intermediate_share(moments)), moments * omega
        weights = np.array([[1.0, a, 0.0], [0.0, 1.0 - a, 1.0]]) * self.axes
        q = polhode_point(moments, L)
        return np.asarray(weights * L[..., None, :] / np.maximum(q, _TINY)[..., None])

    def _catch(self, omega: checks.Array) -> checks.Array:
        """Impulses that cancel d within a period and bring the rate within the tolerance."""
        b = np.array([1.0, 0.0, -self.saddle.ratio]) / self.body.moments * self.axes
        return self._cancelling(omega, b, self.dt) + self._to_rate(omega)

    def _to_rate(self, omega: checks.Array) -> checks.Array:
        """Impulses that bring abs(L), and so the rate at e2, within the tolerance."""
        L = self.body.moments * omega
        size = np.maximum(np.linalg.norm(L, axis=-1), _TINY)
        return np.asarray((self._along(size) / size - 1.0)[..., None] * L)


@dataclass(frozen=True)
class PolhodeTransfer(Transfer):
    """Brings any spin to e2 within a tolerance, see `Transfer`.

    Near -e2 the motion is pushed along s, the unstable direction there.

    Certificate: `distance` from the goal. Free motion keeps it, and for short control periods it
    falls by at least the efficiency times the impulse while the controller steers (pushing and
    catching may add to it), as long as it is above the clearance.

    Region: measured for the body (1, 2, 3), Omega = 1 and 0.1 N m, all spins of 0.5 to 1.5 rad/s in
    any direction are captured within 60 s with an efficiency of 0.8 and a clearance of 0.01.

    Attributes and errors: those of `Transfer`.
    """

    def __call__(self, y: npt.ArrayLike) -> checks.Array:
        """Actions, torques over the largest, shape (..., 3), of states y, shape (..., 7).

        Entries without an actuator are 0.
        """
        omega = self.omega(y)
        _, s = self.saddle.coordinates(omega)
        push = np.copysign(self.torque * self.dt, s)[..., None] * [1.0, 0.0, 1.0]
        impulse = np.where(self._stuck(omega)[..., None], push, self._lead(omega))
        return self._actions(impulse)

    def steers(self, y: npt.ArrayLike) -> checks.Bools:
        """Whether states y, shape (..., 7), are neither near e2 nor pushed out of -e2."""
        omega = self.omega(y)
        return np.asarray(~(self._near(omega) | self._stuck(omega)))

    def _stuck(self, omega: checks.Array) -> checks.Bools:
        _, s = self.saddle.coordinates(omega)
        return np.asarray((omega[..., 1] < 0.0) & (np.abs(s) < _STUCK * self.rate))


_HALF_TURN = np.array([1.0, -1.0, -1.0])  # about e1, which takes -e2 to e2


@dataclass(frozen=True)
class TimedTransfer(Transfer):
    """Lets the spin flip from e2 to -e2 by itself, in time, by a transfer to the separatrix.

    A body that is turned by half about e1 spins about e2 where the body spins about -e2: it is led
    there, see `Transfer`. It is pushed away from its start only if it would be late, that is if d
    (see `Saddle`) is smaller than on the free motion of `TimedFlip`, which is `margin` away from
    -e2 when no time is left. Then d is brought there at once, by the least impulse.

    Attributes:
        margin: norm(omega + Omega e2) / Omega that d may leave at the commanded time; together with
            `tolerance`, which abs(L) may leave, it should be within the tolerance of the task.

    Source: as `Transfer`.
    """

    margin: Annotated[float, checks.positive, "1"] = 0.03

    def __call__(self, y: npt.ArrayLike, time_left: npt.ArrayLike) -> checks.Array:
        """Actions, torques over the largest, shape (..., 3).

        Args:
            y: States, shape (..., 7).
            time_left: Until the commanded time [s], shape (...); 0 or less afterwards.
        """
        omega = self.omega(y) * _HALF_TURN
        b = np.array([1.0, 0.0, self.saddle.ratio]) / self.body.moments * self.axes
        _, s = self.saddle.coordinates(omega)
        least = self._least(checks.array(time_left, "time_left"))
        late = (omega[..., 1] < 0.0) & (np.abs(s) < least)
        push = ((np.copysign(least, s) - s) / (b @ b))[..., None] * b + self._to_rate(omega)
        impulse = np.where(late[..., None], push, self._lead(omega))
        return np.asarray(self._actions(impulse) * _HALF_TURN)

    def _least(self, time_left: checks.Array) -> checks.Array:
        """Least abs(d) that comes in time [rad/s]; 0 from half of the flip on."""
        left = self.saddle.growth * self.rate * np.maximum(time_left, 0.0)
        phase, free = self.saddle.flip(self.margin, left)
        return np.where(phase > 0.0, self.rate * free, 0.0)
