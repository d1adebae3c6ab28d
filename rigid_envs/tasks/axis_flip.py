"""Reverse a spin in the body by a commanded time, with the least impulse."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from rigid_envs.kernels import randoms
from rigid_envs.kernels.actions import clip_to_box
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import fma, select
from rigid_envs.kernels.episode import Episode
from rigid_envs.kernels.free_body import FREE_BODY, Input, Parameters, State
from rigid_envs.systems import FreeBody
from rigid_envs.tasks.base import ROTATION, Entry, Task
from rigid_envs.tasks.fields import Integer, Number, Range, physical, setting, span
from rigid_envs.tasks.free_bodies import (
    FASTEST,
    BodyTorque,
    check_order,
    fastest,
    observed_rates,
    perturbed_spin,
    spun_up,
    torque_about_axes,
)

__all__ = ["AxisFlip"]

_STEPS = 250  # time limit of the registered environment, for which rates are bounded


class Terms(NamedTuple):
    """Reward terms of `AxisFlip`."""

    spin: float
    impulse: float


class Constants(NamedTuple):
    """Rate [rad/s], torque [N m], tolerance, spread of the starts [rad/s], commanded times [s]."""

    spin_rate: float
    torque: float
    tolerance: float
    start_spread: float
    least_flip_time: float
    largest_flip_time: float


class Auxiliary(NamedTuple):
    """Time left until the commanded one [s]; 1 while no spin error was too large since then."""

    time_left: float = 0.0
    kept: float = 0.0


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, Auxiliary]:
    """Spin Omega about e2 and a perturbation uniform in a ball; the time left, uniform."""
    low, high = c.least_flip_time, c.largest_flip_time
    left = fma(high - low, randoms.uniform(stream, 1 << 21), low)
    return perturbed_spin(stream, c.spin_rate, c.start_spread), Auxiliary(left, 1.0)


@scalar
def actuate(
    a: BodyTorque, y: State, aux: Auxiliary, p: Parameters, c: Constants
) -> tuple[State, Input]:
    """Torque about the three body axes."""
    return y, torque_about_axes(a, c.torque)


@scalar
def outcome(
    y: State, u: Input, aux: Auxiliary, p: Parameters, c: Constants, dt: float
) -> tuple[Auxiliary, Terms, float, bool, bool]:
    """Spin error about -e2 once the time has come, impulse, and whether it has been small since."""
    scale = 1.0 / c.spin_rate
    e1, e2, e3 = scale * y.omega1, scale * y.omega2 + 1.0, scale * y.omega3
    error = math.sqrt(e1 * e1 + e2 * e2 + e3 * e3)
    torque = math.sqrt(u.tau1 * u.tau1 + u.tau2 * u.tau2 + u.tau3 * u.tau3)
    left = aux.time_left - dt
    due = left < 1e-9 * dt
    kept = select(due & (error >= c.tolerance), 0.0, aux.kept)
    terms = Terms(
        spin=select(due, 1.0 / (1.0 + 10.0 * error), 0.0),
        impulse=-torque / (math.sqrt(3.0) * c.torque),
    )
    return Auxiliary(left, kept), terms, dt * torque, due & (kept > 0.0), False


@scalar
def observe(
    y: State, aux: Auxiliary, p: Parameters, c: Constants
) -> tuple[float, float, float, float]:
    """Angular velocity in target rates, and the time left, as a part of the longest."""
    w1, w2, w3 = observed_rates(y, 1.0 / c.spin_rate)
    return w1, w2, w3, min(max(aux.time_left / c.largest_flip_time, 0.0), 1.0)


@dataclass(frozen=True)
class AxisFlip(Task):
    """Reverse the spin in the body, from e2 to -e2, by a commanded time with the least impulse.

    L is fixed in space, but not in the body: spin about the unstable intermediate axis flips to the
    opposite direction by itself (Dzhanibekov). A push onto the unstable direction is enough, if it
    comes in time, and the smaller, the more time there is. The difficulty is to flip at the right
    moment, and not to leave -e2 again, which is as unstable as e2.

    The time T is drawn at reset and the time left is observed. From T on to the end of the episode
    the spin must stay at -e2, where holding it costs next to nothing.

    Physics:
        Euler's equations ``I omega' = I omega x omega + tau``, all in body axes, which are the
        principal axes. Without torque the energy T and the angular momentum L in space are
        conserved.

        Turning the spin by brute force takes the impulse ``2 L = 2 I2 Omega``. A push of the size
        delta onto the unstable direction flips the body after ``log(1 / delta) / lambda`` and a
        constant, with ``lambda = Omega sqrt((I2 - I1)(I3 - I2) / (I1 I3))``. So from exact spin
        about e2 the impulse falls like ``exp(-lambda T)`` with the time T that is given.

        The energy that full torque could give the body before the time limit bounds its rates.

    Rewards:
        ``spin`` = ``1 / (1 + 10 error)`` with ``error = |omega + Omega e2| / Omega`` from the
        commanded time on, 0 before: how the body gets there does not count. ``impulse`` =
        ``-|tau| / (sqrt(3) torque)``, not squared: it sums up to the impulse that is to be least.

    Starting State:
        omega is ``Omega e2`` (`spin_rate`) and a perturbation uniform in a ball of radius
        `start_spread`; the attitude is uniform on SO(3). The commanded time is uniform in
        `flip_time`.

    Episode End:
        The episode does not end before its time. Success (`info["is_success"]`): the error has been
        below `tolerance` at the commanded time and ever since.

    Reference:
        `timed` tracks the free motion that flips in time, ``tau = -1.5 Omega I (omega -
        omega_free)``, where omega_free lies on the separatrix (a tanh and a cosh of the time left).
        `brute_force` turns the spin at once, ``tau = -4 Omega I (omega + Omega e2)``.

        Exact: torque about e2 alone, from exact spin, costs ``2 L = 2 I2 Omega``.

    Version History:
        v0: first version.

    Source:
        Landau & Lifshitz, *Mechanics*, section 37; Van Damme, Mardesic & Sugny 2017,
        arXiv:1606.08237.
    """

    n_substeps: int = setting(4, Integer("integrator steps per control period", 1, 1000))
    rotation: str = setting("none", ROTATION)
    I1: Range = physical(1.0, "least principal moment", "kg m^2")
    I2: Range = physical(2.0, "middle principal moment", "kg m^2")
    I3: Range = physical(3.0, "largest principal moment", "kg m^2")
    spin_rate: float = setting(1.0, Number("rate Omega", "rad/s", 1e-3, 1e3))
    torque: float = setting(0.5, Number("largest torque about each axis", "N m", 1e-6, 1e6))
    start_spread: float = setting(
        0.1, Number("radius of the ball of perturbations at the start", "rad/s", 0.0, 1e3)
    )
    flip_time: Range = setting((12.0, 20.0), Number("commanded time T", "s", 1e-3, 1e4, drawn=True))
    tolerance: float = setting(
        0.05, Number("largest spin error of a success / Omega", "1", 1e-6, 1.0)
    )
    weight_spin: float = setting(1.0, Number("weight of the spin term", "1", -1e3, 1e3))
    weight_impulse: float = setting(1.0, Number("weight of the impulse term", "1", -1e3, 1e3))

    system_type: ClassVar = FreeBody
    episode: ClassVar = Episode(
        dynamics=FREE_BODY,
        Action=BodyTorque,
        Terms=Terms,
        Constants=Constants,
        Auxiliary=Auxiliary,
        start=start,
        clip=clip_to_box,
        actuate=actuate,
        outcome=outcome,
        observe=observe,
    )
    cost_unit: ClassVar = "torque impulse [N m s]"

    def _check_parameters(self) -> None:
        check_order((self.I1, self.I2, self.I3))
        super()._check_parameters()

    @property
    def least_flip_time(self) -> float:
        """Least commanded time [s]."""
        return span(self.flip_time)[0]

    @property
    def largest_flip_time(self) -> float:
        """Largest commanded time [s]."""
        return span(self.flip_time)[1]

    def actions(self) -> tuple[Entry, ...]:
        """Torques about the body axes."""
        return tuple(Entry(f"tau{k}", "N m", "body", -self.torque, self.torque) for k in (1, 2, 3))

    def features(self) -> tuple[Entry, ...]:
        """Angular velocity in target rates, time left."""
        return (
            *(Entry(f"omega{k} / Omega", "1", "body", -FASTEST, FASTEST) for k in (1, 2, 3)),
            Entry("time left / longest", "1", "none", 0.0, 1.0),
        )

    def largest_rate(self) -> float:
        """What full torque can make of the start before the time limit."""
        moments, time = (self.I1, self.I2, self.I3), _STEPS * self.dt
        rate = self.spin_rate + self.start_spread
        return fastest(moments, spun_up(moments, rate, (self.torque,) * 3, time))
