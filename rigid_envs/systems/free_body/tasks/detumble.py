"""Bring a tumbling body to rest by impulses."""

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from rigid_envs.base.settings import Number, setting
from rigid_envs.engine import randoms
from rigid_envs.engine.algebra import Row, Vector, attitude, cross, dot, scaled
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import fma, log, select
from rigid_envs.engine.episode import Episode, NoAuxiliary, clip_to_ball, single
from rigid_envs.systems.free_body import dynamics as free_body
from rigid_envs.systems.free_body.dynamics import FREE_BODY, Input, Parameters, State
from rigid_envs.systems.free_body.symmetry import HALF_TURN_1, HALF_TURN_2, ROTATION_IN_SPACE
from rigid_envs.systems.free_body.tasks.shared import FASTEST, BodyTask, fastest, observed_rates
from rigid_envs.tasks.fields import Entry, span
from rigid_envs.tasks.reduction import Reduction

# Reduced coordinates of a tumbling body that impulses bring to rest: `Detumble`.
#
# Impulses are given in the frame of the angular momentum: against L, along the direction in which L
# moves in the body, and across both. The half turns of the body about its axes change the signs of
# L in pairs; what they keep is seen. The moments are the middles of their ranges.

_FAR = 100.0  # bound of the momentum
_LARGE = 1e8  # bound of the momentum in tolerances
_LOG_LARGE = 18.5  # just above its logarithm
_SHORT = 1e-9  # a shorter vector has no direction


class Axes(NamedTuple):
    """Direction n of the angular momentum; cosine and sine of its motion in the plane across n."""

    n1: float
    n2: float
    n3: float
    cosine: float
    sine: float


@scalar
def momentum(omega: Vector, c: Any) -> tuple[Vector, float]:
    """Direction of the angular momentum in the body, e3 where it is zero, and its norm [N m s]."""
    L = (c.middle1 * omega[0], c.middle2 * omega[1], c.middle3 * omega[2])
    norm = math.sqrt(dot(L, L))
    none = norm < _SHORT * c.start_momentum
    n = scaled(1.0 / select(none, 1.0, norm), L)
    return (select(none, 0.0, n[0]), select(none, 0.0, n[1]), select(none, 1.0, n[2])), norm


@scalar
def observe_reduced(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Norm of the angular momentum, and what the half turns keep of its direction."""
    n, norm = momentum(observed_rates(y, 1.0), c)
    steps, part = norm / c.impulse, norm / c.start_momentum
    return (
        min(part, _FAR),
        min(steps, 1.0),
        min(steps, _FAR),
        log(min(1.0 + part / c.tolerance, _LARGE)),
        abs(n[0]),
        abs(n[1]),
        abs(n[2]),
        3.0 * math.sqrt(3.0) * n[0] * n[1] * n[2],
    )


@scalar
def across(n: Vector) -> tuple[Vector, Vector]:
    """Two directions across n and each other, for every n."""
    side = select(n[2] < 0.0, -1.0, 1.0)
    g = -1.0 / (side + n[2])
    h = n[0] * n[1] * g
    b = (fma(side * n[0] * n[0], g, 1.0), side * h, -side * n[0])
    d = (h, fma(n[1] * n[1], g, side), -n[1])
    return b, d


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> Axes:
    """Axes along L and along its change in the body, ``L' = L x omega``."""
    omega = (y.omega1, y.omega2, y.omega3)
    n, _ = momentum(omega, c)
    b, d = across(n)
    moving = cross(n, omega)
    x, z = dot(b, moving), dot(d, moving)
    length = math.sqrt(fma(x, x, z * z))
    still = length < _SHORT
    inverse = 1.0 / select(still, 1.0, length)
    cosine, sine = select(still, 1.0, x * inverse), select(still, 0.0, z * inverse)
    return Axes(n[0], n[1], n[2], cosine, sine)


@scalar
def turn(a: Any, frame: Any) -> tuple[float, float, float]:
    """Impulse about the axes of the body."""
    b, d = across((frame.n1, frame.n2, frame.n3))
    along = fma(frame.cosine, a[1], -frame.sine * a[2])
    aside = fma(frame.sine, a[1], frame.cosine * a[2])
    return (
        single(fma(along, b[0], fma(aside, d[0], -a[0] * frame.n1))),
        single(fma(along, b[1], fma(aside, d[1], -a[0] * frame.n2))),
        single(fma(along, b[2], fma(aside, d[2], -a[0] * frame.n3))),
    )


MOMENTUM = Reduction(
    group="SO(3) x V4",
    frame="first axis against the angular momentum, second along its change in the body.",
    symmetries=(ROTATION_IN_SPACE, HALF_TURN_1, HALF_TURN_2),
    features=(
        Entry("L / start_momentum", "1", "norm", 0.0, _FAR),
        Entry("L / impulse, up to 1", "1", "norm", 0.0, 1.0),
        Entry("L / impulse", "1", "norm", 0.0, _FAR),
        Entry("log L", "1", "log(1 + L / tolerance)", 0.0, _LOG_LARGE),
        *(Entry(f"abs L{k} / L", "1", "body", 0.0, 1.0) for k in (1, 2, 3)),
        Entry("L1 L2 L3 / L^3", "1", "body, over the largest", -1.0, 1.0),
    ),
    observe=observe_reduced,
    Frame=Axes,
    frame_of=frame_of,
    turn=turn,
    formulas="""
    With $L = I omega$, in the entries of $omega$ limited to $+-20$, and $n = L / |L|$, $e3$ where
    $|L| < 1e-9 start_momentum$. Entries: $|L| / start_momentum$, $|L| / impulse$ up to 1 and up to
    100, $log(1 + |L| / (tolerance start_momentum))$ with an argument up to $1e8$, $|n1|$, $|n2|$,
    $|n3|$, and $3 sqrt(3) n1 n2 n3$.

    The action $a$ acts as $-a1 n + a2 b + a3 n x b$ with $b$ along $n x omega$. Where $|n x omega|
    < 1e-9$, $b = (1 - S n1^2 / (S + n3), -S n1 n2 / (S + n3), -S n1)$ with the sign $S$ of $n3$.
    """,
)
"""Reduction of `Detumble`: SO(3), turns in space, times the half turns about the three axes.

In the frame of L the norm of L does not depend on where L points: a step makes it ``|L + j|``.
"""


# Bring a tumbling body to rest by impulses.


class Action(NamedTuple):
    """Impulse in body axes, as a fraction of the maximum."""

    j1: float
    j2: float
    j3: float


class Terms(NamedTuple):
    """Reward terms of `Detumble`."""

    momentum: float
    impulse: float


class Constants(NamedTuple):
    """Largest impulse and largest |L| at the start [N m s], tolerance.

    And the middles of the moments [kg m^2].
    """

    impulse: float
    start_momentum: float
    tolerance: float
    middle1: float
    middle2: float
    middle3: float


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, tuple[()]]:
    """Angular momentum uniform in a ball; attitude uniform on SO(3)."""
    a, b, d = randoms.in_ball(stream, 0)
    q, L = randoms.quaternion(stream, 1 << 20), c.start_momentum
    return State(*q, L * a * p.inverse1, L * b * p.inverse2, L * d * p.inverse3), ()


@scalar
def actuate(
    a: Action, y: State, aux: NoAuxiliary, p: Parameters, c: Constants
) -> tuple[State, Input]:
    """The impulse changes omega at once; the input passes it on to `outcome`."""
    j1, j2, j3 = c.impulse * a.j1, c.impulse * a.j2, c.impulse * a.j3
    kicked = State(
        *attitude(y),
        y.omega1 + j1 * p.inverse1,
        y.omega2 + j2 * p.inverse2,
        y.omega3 + j3 * p.inverse3,
    )
    return kicked, Input(j1, j2, j3)


@scalar
def drift(y: State, u: Input, p: Parameters, h: float) -> State:
    """One step of free motion: the impulse in the input has acted already."""
    return free_body.step(y, Input(0.0, 0.0, 0.0), p, h)


@scalar
def outcome(
    y: State, u: Input, aux: NoAuxiliary, p: Parameters, c: Constants, dt: float
) -> tuple[NoAuxiliary, Terms, float, bool, bool]:
    """Quadratic terms of momentum and impulse."""
    L1, L2, L3 = p.I1 * y.omega1, p.I2 * y.omega2, p.I3 * y.omega3
    scale = 1.0 / c.start_momentum
    momentum = (L1 * L1 + L2 * L2 + L3 * L3) * (scale * scale)
    square = u.tau1 * u.tau1 + u.tau2 * u.tau2 + u.tau3 * u.tau3
    terms = Terms(momentum=-min(momentum, _FAR), impulse=-square / (c.impulse * c.impulse))
    return aux, terms, math.sqrt(square), momentum < c.tolerance * c.tolerance, False


@scalar
def observe(y: State, aux: NoAuxiliary, p: Parameters, c: Constants) -> tuple[float, float, float]:
    """Angular velocity."""
    return observed_rates(y, 1.0)


@dataclass(frozen=True)
class Detumble(BodyTask):
    """Bring the angular momentum of a tumbling body to zero by impulses.

    Each step is an impulse, which changes the angular momentum $L$ at once, and then free motion,
    which rotates $L$ in the body and conserves its norm. The observation is the angular velocity,
    whose free motion is nonlinear. But impulses act on the momentum, and the cost depends on its
    norm only, so the optimal policy is known exactly.

    Physics:
        An impulse $j$ changes the momentum by $L -> L + j$; then the body moves freely for a
        control period. Momentum and impulse are vectors in body axes, and $omega = I^-1 L$.

    Rewards:
        `momentum` = $-(|L| / start_momentum)^2$ after the step (not below -100) and `impulse` =
        $-(|j| / impulse)^2$: a quadratic cost with a known optimum.

    Starting State:
        The angular momentum is uniform in a ball of radius `start_momentum`; the attitude is
        uniform on $SO(3)$.

    Episode End:
        The episode ends only at its time limit. Success (`info["is_success"]`): $|L|$ is below
        `tolerance` times `start_momentum`.

    Reference:
        Exact: with $a$ and $b$ the weights over the squares of `start_momentum` and `impulse`, the
        cost to go is $P |L|^2$ with the root $P = (-a + sqrt(a^2 + 4 a b)) / 2$ of the scalar
        Riccati equation $P = b (a + P) / (a + b + P)$, under the law $j = -L (a + P) / (a + b +
        P)$, which is `riccati`: $n$ steps cost $P (|L_0|^2 - |L_n|^2)$. With equal weights it stays
        within the ball of impulses for all starts.

        The least time to rest is $|L| / impulse$ steps, rounded up. `brake` attains it with the
        largest impulse against $L$.

    Source:
        Bertsekas, *Dynamic Programming and Optimal Control*, volume I, section 4.1.
    """

    n_substeps: int = 6
    rotation: str = "none"
    impulse: float = setting(0.5, Number("largest impulse of a step", "N m s", 1e-6, 1e6))
    start_momentum: float = setting(3.0, Number("largest |L| at the start", "N m s", 1e-6, 1e6))
    tolerance: float = setting(
        0.01, Number("largest |L| of a success / start_momentum", "1", 1e-6, 1.0)
    )
    weight_momentum: float = setting(1.0, Number("weight of the momentum term", "1", -1e3, 1e3))
    weight_impulse: float = setting(1.0, Number("weight of the impulse term", "1", -1e3, 1e3))

    episode: ClassVar = Episode(
        dynamics=FREE_BODY,
        Action=Action,
        Terms=Terms,
        Constants=Constants,
        start=start,
        clip=clip_to_ball,
        actuate=actuate,
        outcome=outcome,
        observe=observe,
        advance=drift,
    )
    reduction: ClassVar = MOMENTUM
    cost_unit: ClassVar = "impulse [N m s]"

    def actions(self) -> tuple[Entry, ...]:
        """Impulse, in a ball."""
        return tuple(
            Entry(f"j{k}", "N m s", "body, ball", -self.impulse, self.impulse) for k in (1, 2, 3)
        )

    def features(self) -> tuple[Entry, ...]:
        """Angular velocity."""
        return tuple(Entry(f"omega{k}", "rad/s", "body", -FASTEST, FASTEST) for k in (1, 2, 3))

    def largest_rate(self, duration: float) -> float:
        """Bound on the rates after the largest impulse in every step."""
        moments = (self.I1, self.I2, self.I3)
        momentum = self.start_momentum + duration / self.dt * self.impulse
        return fastest(moments, momentum / math.sqrt(min(span(moment)[0] for moment in moments)))
