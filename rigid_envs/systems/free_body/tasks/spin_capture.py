"""Bring a spin about any axis to the intermediate axis."""

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from rigid_envs.base.settings import Choice, Number, setting
from rigid_envs.engine import randoms
from rigid_envs.engine.algebra import Row, vertical
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import fma
from rigid_envs.engine.episode import Episode, clip_to_box
from rigid_envs.systems.free_body import saddle
from rigid_envs.systems.free_body.dynamics import FREE_BODY, Input, Parameters, State
from rigid_envs.systems.free_body.tasks import shared
from rigid_envs.tasks.fields import Entry, Range
from rigid_envs.tasks.parts import Held, held_for

# Reduced coordinates of a tumbling body that is steered to the separatrix: `SpinCapture`.
#
# A half turn about e2 makes the growing coordinate of the saddle positive. The distances of energy
# and momentum from those of the goal, and how torque changes them, are among the features. The
# moments are the middles of their ranges.

_FULL = 0.1  # slope against which torque is worth half of its largest value


@scalar
def observe_reduced(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """The spin relative to Omega e2, its distance from the separatrix, and how torque changes it.

    ``p = s d`` is 0 on the motions that approach e2 or -e2, ``E = omega2^2 + share (d^2 + s^2) -
    1`` on those with the rate Omega there. The slopes are the derivatives of ``(p^2 + E^2) / 2``
    along omega.
    """
    w1, w2, w3 = shared.observed_rates(y, 1.0 / c.spin_rate)
    at = saddle.place_at(w1, w3, c)
    sign = saddle.growing_side(at, w2)
    off = at.s * at.d
    energy = fma(at.share, fma(at.d, at.d, at.s * at.s), fma(w2, w2, -1.0))
    square = at.ratio * at.ratio
    slope1 = 2.0 * sign * w1 * fma(2.0 * at.share, energy, off)
    slope3 = 2.0 * sign * w3 * square * fma(2.0 * at.share, energy, -off)
    slope2 = 2.0 * w2 * energy
    return (
        sign * w1,
        w2,
        sign * w3,
        saddle.within(off, shared.FASTEST),
        saddle.within(energy, shared.FASTEST),
        saddle.near(slope1, _FULL),
        saddle.near(slope2, _FULL),
        saddle.near(slope3, _FULL),
        saddle.near(sign * at.d, c.tolerance),
        saddle.near(sign * at.s, c.tolerance),
        saddle.near(w2 - 1.0, c.tolerance),
    )


CAPTURE = saddle.half_turned(
    features=(
        *shared.REDUCED_RATES,
        *(Entry(k, "1", "", -shared.FASTEST, shared.FASTEST) for k in "pE"),
        *(Entry(f"near slope{k}", "1", "reduced", -1.0, 1.0) for k in (1, 2, 3)),
        *(Entry(f"near {k}", "1", "reduced", -1.0, 1.0) for k in ("d", "s", "omega2 - Omega")),
    ),
    observe=observe_reduced,
    frame_of=saddle.growing_frame,
    turn=saddle.turn,
    formulas="""
    With $w$, $r$, $d$ and $s$ of `IntermediateAxis` and $k = I1 (I3 - I1) / (4 I2 (I3 - I2))$, $S$
    is the sign of $w2 (d - s) + d + s$. Entries: $S w1$, $w2$, $S w3$, $p = s d$, $E = w2^2 + k
    (d^2 + s^2) - 1$, then the shares of the slopes $2 S w1 (2 k E + p)$, $2 w2 E$ and $2 S r^2 w3
    (2 k E - p)$ with the half 0.1, and of $S d$, $S s$ and $w2 - 1$ with the half `tolerance`. The
    action $a$ acts as $(S a1, a2, S a3)$.
    """,
)
"""Reduction of `SpinCapture`: SO(3), turns in space, times the half turn about e2."""


# Bring any spin to the unstable intermediate axis by weak torques.

_ACTUATORS = ("e1 e2 e3", "e1 e2", "e1 e3", "e2 e3", "e1", "e2", "e3")


class Terms(NamedTuple):
    """Reward terms of `SpinCapture`."""

    spin: float
    manifold: float
    effort: float


class Constants(NamedTuple):
    """Target rate [rad/s], tolerance, hold [s], rates at the start [rad/s], torques [N m].

    And the middles of the moments [kg m^2].
    """

    spin_rate: float
    tolerance: float
    hold: float
    least_start_rate: float
    largest_start_rate: float
    torque1: float
    torque2: float
    torque3: float
    middle1: float
    middle2: float
    middle3: float


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, Held]:
    """Spin axis uniform on the sphere, rate uniform; attitude uniform on SO(3)."""
    rate = shared.drawn_rate(stream, 0, c)
    axis = vertical(randoms.quaternion(stream, 1 << 21))
    q = randoms.quaternion(stream, 1 << 20)
    return State(*q, rate * axis[0], rate * axis[1], rate * axis[2]), Held(0.0)


@scalar
def actuate(
    a: shared.BodyTorque, y: State, aux: Held, p: Parameters, c: Constants
) -> tuple[State, Input]:
    """Torque about the body axes that have an actuator."""
    return y, Input(c.torque1 * a.tau1, c.torque2 * a.tau2, c.torque3 * a.tau3)


@scalar
def outcome(
    y: State, u: Input, aux: Held, p: Parameters, c: Constants, dt: float
) -> tuple[Held, Terms, float, bool, bool]:
    """Reward terms, torque impulse as cost, success after the hold time."""
    scale = 1.0 / c.spin_rate
    w1, w2, w3 = scale * y.omega1, scale * y.omega2, scale * y.omega3
    error = math.sqrt(w1 * w1 + (w2 - 1.0) * (w2 - 1.0) + w3 * w3)
    L1, L2, L3 = p.I1 * w1, p.I2 * w2, p.I3 * w3
    unit = p.inverse2 * p.inverse2
    momentum = unit * (L1 * L1 + L2 * L2 + L3 * L3)
    energy = p.inverse2 * (L1 * w1 + L2 * w2 + L3 * w3)
    apart = abs(energy - momentum) + abs(momentum - 1.0)
    square = u.tau1 * u.tau1 + u.tau2 * u.tau2 + u.tau3 * u.tau3
    full = c.torque1 * c.torque1 + c.torque2 * c.torque2
    full = full + c.torque3 * c.torque3
    held, success = held_for(error < c.tolerance, aux, c, dt)
    terms = Terms(
        spin=1.0 / (1.0 + 10.0 * error),
        manifold=1.0 / (1.0 + 10.0 * apart),
        effort=-square / full,
    )
    return Held(held), terms, dt * math.sqrt(square), success, False


@dataclass(frozen=True)
class SpinCapture(shared.DrawnRate, shared.SpinTask):
    """Bring a spin about any axis to the intermediate axis e2 at the rate Omega.

    The torque is weak: a tenth of the largest gyroscopic term in Euler's equations at the rate
    $Omega$, so it cannot overcome the tumbling. But it can change energy and momentum while the
    body tumbles, and free motions with the right values of both approach $e2$. There the spin must
    be caught, as $e2$ is unstable.

    Two actuators also suffice, but take longer. One does not, as each conserves a quadratic form
    under any torque; these choices of `actuators` serve as a proof of failure.

    Physics:
        The moments are $I1 < I2 < I3$. The gyroscopic term is $(I3 - I1) Omega^2 / 2$ at most at
        the rate $Omega$, 1 N m for the default body.

        Of all free motions only those on the separatrix, $2 T I2 = L^2$, approach $e2$ (half of
        them $-e2$); the rate $Omega$ requires $L = I2 Omega$ as well. Bounded torque holds the
        default body at $e2$, to first order, while $|omega1 - sqrt(3) omega3| < 0.273$ rad/s.

        One torque alone: $tau1$ conserves $I2 (I2 - I1) omega2^2 + I3 (I3 - I1) omega3^2$, $tau2$
        conserves $2 T I2 - L^2$, and $tau3$ conserves $I1 (I3 - I1) omega1^2 + I2 (I3 - I2)
        omega2^2$. Entries of the action about an axis without actuator have no effect.

    Rewards:
        `spin` = $1 / (1 + 10 error)$ with $error = |omega - Omega e2| / Omega$, the goal itself.
        `manifold` = $1 / (1 + 10 (|2 T I2 - L^2| + |L^2 - L0^2|) / L0^2)$ with $L0 = I2 Omega$,
        which is 1 on the motions that lead to $e2$ or $-e2$ and guides the tumbling body there.
        `effort` = $-|tau|^2$ divided by its maximum, $n torque^2$ for $n$ actuators.

    Starting State:
        The direction of $omega$ in the body is uniform on the sphere, its norm uniform in
        `start_rate`; the attitude is uniform on $SO(3)$.

    Episode End:
        The episode ends only at its time limit. Success (`info["is_success"]`): the error has been
        below `tolerance` throughout the last `hold` seconds.

    Reference:
        `transfer` gives impulses where the free motion makes them do most, until energy and
        momentum are right, and catches the spin: see
        `rigid_envs.systems.free_body.transfer.PolhodeTransfer`.
        `separatrix` steers onto the separatrix, by torque along the negative gradient of $(p^2 +
        E^2) / 2$, where $E = (omega2^2 + b (d^2 + s^2)) / Omega^2 - 1$ is the excess of the rate at
        which the motion would arrive and $p = d s / Omega^2$ with $d, s = omega1 -+ sqrt(I3 (I3 -
        I2) / (I1 (I2 - I1))) omega3$ vanishes on the separatrix; near $e2$, the linear-quadratic
        regulator.

        Proof of failure: with a torque about $e3$ alone the default body conserves $omega1^2 +
        omega2^2$, and $omega$ comes no nearer to $Omega e2$ than $|sqrt(omega1^2 + omega2^2) -
        Omega|$. A torque about $e1$ alone conserves $omega2^2 + 3 omega3^2$.

    Source:
        Landau & Lifshitz, *Mechanics*, section 37; Bloch & Marsden 1990,
        doi:10.1016/0167-6911(90)90055-Y.
    """

    n_substeps: int = 3
    actuators: str = setting("e1 e2 e3", Choice("body axes that have an actuator", _ACTUATORS))
    start_rate: Range = setting(
        (0.5, 1.5), Number("rate of the spin at the start", "rad/s", 0.0, 1e3, drawn=True)
    )
    tolerance: float = setting(
        0.05, Number("largest spin error of a success / Omega", "1", 1e-6, 1.0)
    )
    hold: float = setting(5.0, Number("time within tolerance at the end", "s", 0.0, 1e4))
    weight_spin: float = setting(1.0, Number("weight of the spin term", "1", -1e3, 1e3))
    weight_manifold: float = setting(0.2, Number("weight of the manifold term", "1", -1e3, 1e3))
    weight_effort: float = setting(0.1, Number("weight of the effort term", "1", -1e3, 1e3))

    episode: ClassVar = Episode(
        dynamics=FREE_BODY,
        Action=shared.BodyTorque,
        Terms=Terms,
        Constants=Constants,
        Auxiliary=Held,
        start=start,
        clip=clip_to_box,
        actuate=actuate,
        outcome=outcome,
        observe=shared.observe,
    )
    reduction: ClassVar = CAPTURE

    def torques(self) -> tuple[float, float, float]:
        """Largest torque about each body axis [N m]; 0 where there is no actuator."""
        first, second, third = (self.torque * (f"e{k}" in self.actuators) for k in (1, 2, 3))
        return first, second, third

    @property
    def torque1(self) -> float:
        """Largest torque about e1 [N m]."""
        return self.torques()[0]

    @property
    def torque2(self) -> float:
        """Largest torque about e2 [N m]."""
        return self.torques()[1]

    @property
    def torque3(self) -> float:
        """Largest torque about e3 [N m]."""
        return self.torques()[2]

    def largest_rate(self, duration: float) -> float:
        """Bound on the rates after full torque from the fastest start on."""
        return self.spun_up_from(self.largest_start_rate, duration)
