"""Align a spin with the unstable intermediate axis by one torque about another axis."""

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from rigid_envs.base.settings import Number, setting
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import atan2
from rigid_envs.engine.episode import Episode, clip_to_interval
from rigid_envs.systems.free_body.dynamics import FREE_BODY, Input, Parameters, State
from rigid_envs.systems.free_body.tasks.intermediate_axis import POINTING, Constants
from rigid_envs.systems.free_body.tasks.shared import PerturbedSpinTask, observe, start
from rigid_envs.tasks.fields import Entry
from rigid_envs.tasks.parts import Held, held_for


class Action(NamedTuple):
    """Torque about e3, as a fraction of the maximum."""

    tau3: float


class Terms(NamedTuple):
    """Reward terms of `IntermediateAxisSingle`."""

    axis: float
    effort: float


@scalar
def actuate(a: Action, y: State, aux: Held, p: Parameters, c: Constants) -> tuple[State, Input]:
    """Torque about e3."""
    return y, Input(0.0, 0.0, c.torque * a.tau3)


@scalar
def outcome(
    y: State, u: Input, aux: Held, p: Parameters, c: Constants, dt: float
) -> tuple[Held, Terms, float, bool, bool]:
    """Reward terms, torque impulse as cost, success after the hold time."""
    angle = atan2(math.sqrt(y.omega1 * y.omega1 + y.omega3 * y.omega3), y.omega2)
    share = u.tau3 * (1.0 / c.torque)
    held, success = held_for(angle < c.tolerance, aux, c, dt)
    terms = Terms(axis=1.0 / (1.0 + 10.0 * angle), effort=-share * share)
    return Held(held), terms, dt * abs(u.tau3), success, False


@dataclass(frozen=True)
class IntermediateAxisSingle(PerturbedSpinTask):
    """Align the spin with the unstable intermediate axis e2 by a torque about e3 alone.

    Without control the spin leaves $e2$ and flips over. One torque is enough to hold it there if it
    reverses the sign of a gyroscopic term; a law that only damps $omega3$ fails.

    The final rate of the spin cannot be chosen, as the torque conserves a quadratic form. So the
    goal is the direction of the spin only.

    Physics:
        The moments are $I1 < I2 < I3$, the torque is $(0, 0, tau3)$. Under any $tau3$ the sum $I1
        (I3 - I1) omega1^2 + I2 (I3 - I2) omega2^2$ is conserved.

        Without control the spin leaves $e2$ at the rate $lambda = Omega sqrt((I2 - I1)(I3 - I2) /
        (I1 I3))$, 0.577 per second for the default body. $tau3 = eps omega1 omega2 - k omega3$ with
        $k > 0$ makes $e2$ stable if and only if $eps > I2 - I1$, as it then reverses the sign of
        the gyroscopic term of $I3 omega3' = (I1 - I2) omega1 omega2 + tau3$. Bounded torque can
        hold the unstable mode only near the axis: to first order, for the default body, while
        $|omega1 - sqrt(3) omega3| < 0.45$ rad/s. At the start it is 0.4 at most.

    Rewards:
        `axis` = $1 / (1 + 10 angle)$ with the angle from $e2$ to $omega$: its slope is largest at
        zero angle and nowhere zero. `effort` = $-(tau3 / torque)^2$ has a small weight: spin at
        $e2$ needs no torque.

    Starting State:
        $omega$ is $Omega e2$ (`spin_rate`) plus a perturbation uniform in a ball of radius
        `start_spread`; the attitude is uniform on $SO(3)$.

    Episode End:
        The episode ends only at its time limit. Success (`info["is_success"]`): the angle has been
        below `tolerance` throughout the last `hold` seconds.

    Reference:
        `transfer` lets the body turn over and back, and gives its impulses where the free motion
        makes them do most: see `rigid_envs.systems.free_body.transfer.PolhodeTransfer`.
        `energy_casimir` keeps the spin beside $e2$ by energy-Casimir feedback, $tau3 = eps omega1
        omega2 - k omega3$ with $eps = 3 (I2 - I1)$ and $k = 5/3 I3 Omega$.

        Threshold: $eps = I2 - I1$. Torque about $e3$ moves one of the two numbers that free motion
        keeps, so no torque needs less than the change of that one: see
        `rigid_envs.systems.free_body.transfer.polhode_point`.

    Source:
        Bloch & Marsden 1990, doi:10.1016/0167-6911(90)90055-Y.
    """

    n_substeps: int = 2
    spin_rate: float = setting(1.0, Number("rate Omega about e2 at the start", "rad/s", 1e-3, 1e3))
    torque: float = setting(0.45, Number("largest torque about e3", "N m", 1e-6, 1e6))
    start_spread: float = 0.2
    tolerance: float = setting(
        0.05, Number("largest angle from e2 to the spin of a success", "rad", 1e-6, math.pi)
    )
    hold: float = setting(5.0, Number("time within tolerance at the end", "s", 0.0, 1e4))
    weight_axis: float = setting(1.0, Number("weight of the axis term", "1", -1e3, 1e3))
    weight_effort: float = setting(0.1, Number("weight of the effort term", "1", -1e3, 1e3))

    episode: ClassVar = Episode(
        dynamics=FREE_BODY,
        Action=Action,
        Terms=Terms,
        Constants=Constants,
        Auxiliary=Held,
        start=start,
        clip=clip_to_interval,
        actuate=actuate,
        outcome=outcome,
        observe=observe,
    )
    reduction: ClassVar = POINTING

    def torques(self) -> tuple[float, float, float]:
        """Torque about e3 only."""
        return 0.0, 0.0, self.torque

    def actions(self) -> tuple[Entry, ...]:
        """Torque about e3."""
        return (Entry("tau3", "N m", "body", -self.torque, self.torque),)
