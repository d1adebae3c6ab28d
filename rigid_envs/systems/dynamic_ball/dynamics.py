"""A ball that rolls on a tilting, turning, shaken plate."""

from typing import NamedTuple

from rigid_envs.engine import algebra
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.dynamics import Dynamics
from rigid_envs.engine.elementary import fma, sincos, sqrt

# Ball with inertia that rolls without slipping on a plate, which can tilt and rotate.
#
# The plate turns about the point O of its surface by the angles alpha_x, alpha_y: plate axes are P
# = Rx(alpha_x) Ry(alpha_y) of the world's. The surface can also turn about its normal at the
# constant rate Omega (a turntable); the plate axes do not turn with it.
#
# State y = (q, X, Y, VX, VY, spin, alpha_x, alpha_y, rate_x, rate_y): attitude, body to world;
# centre in plate axes, its height is the radius; velocity in plate axes; component of the angular
# velocity along the normal [rad/s]; angles of the plate [rad] and their rates [rad/s]. The rest of
# the angular velocity follows from rolling, so the ball cannot slip. The ratio beta is I / (m r^2).

Pair = tuple[float, float]


class State(NamedTuple):
    """Attitude q; centre, velocity and rate about the normal in plate axes; tilt of the plate."""

    w: float = 1.0
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    X: float = 0.0
    Y: float = 0.0
    VX: float = 0.0
    VY: float = 0.0
    spin: float = 0.0
    alpha_x: float = 0.0
    alpha_y: float = 0.0
    rate_x: float = 0.0
    rate_y: float = 0.0


class Input(NamedTuple):
    """Force at the centre in plate axes [N], accelerations of the angles [rad/s^2]."""

    FX: float
    FY: float
    a_x: float
    a_y: float


class Parameters(NamedTuple):
    """m [kg], radius [m], beta, g [m/s^2], Omega [rad/s], mu; 1 / m, 1 / radius, 1 / (1 + beta)."""

    m: float
    radius: float
    beta: float
    g: float
    turntable_rate: float
    mu: float
    inverse_m: float
    inverse_radius: float
    share: float


class Invariants(NamedTuple):
    """Energy [J] and rate about the normal [rad/s]."""

    energy: float
    spin: float


@scalar
def derive(
    m: float, radius: float, beta: float, g: float, turntable_rate: float, mu: float
) -> Parameters:
    """Parameter row of the physical parameters."""
    inverses = (1.0 / m, 1.0 / radius, 1.0 / (1.0 + beta))
    return Parameters(m, radius, beta, g, turntable_rate, mu, *inverses)


@scalar
def plate_rate(y: State) -> algebra.Vector:
    """Angular velocity of the plate in its own axes."""
    s, c = sincos(y.alpha_y)
    return (y.rate_x * c, y.rate_y, y.rate_x * s)


@scalar
def plate_growth(y: State, u: Input, turn: Pair) -> algebra.Vector:
    """Its rate of change w' in plate axes, with sine and cosine of alpha_y [rad/s^2]."""
    s, c = turn
    gyroscopic = y.rate_x * y.rate_y
    return (u.a_x * c - gyroscopic * s, u.a_y, u.a_x * s + gyroscopic * c)


@scalar
def swing(y: State, w: algebra.Vector, grown: algebra.Vector, p: Parameters) -> algebra.Vector:
    """Acceleration of the point of the plate's frame where the centre is, in its axes [m/s^2]."""
    rho = (y.X, y.Y, p.radius)
    along, square = algebra.dot(w, rho), algebra.dot(w, w)
    return (
        grown[1] * p.radius - grown[2] * rho[1] + w[0] * along - square * rho[0],
        grown[2] * rho[0] - grown[0] * p.radius + w[1] * along - square * rho[1],
        grown[0] * rho[1] - grown[1] * rho[0] + w[2] * along - square * p.radius,
    )


@scalar
def ball_rate(y: State, w: algebra.Vector, p: Parameters) -> algebra.Vector:
    """Angular velocity in plate axes: v' = (omega - w) x r n + Omega n x (X, Y), solved for it."""
    return (
        w[0] - (y.VY - p.turntable_rate * y.X) * p.inverse_radius,
        w[1] + (y.VX + p.turntable_rate * y.Y) * p.inverse_radius,
        y.spin,
    )


@scalar
def to_world(v: algebra.Vector, alpha_x: float, alpha_y: float) -> algebra.Vector:
    """World components P v of a vector in plate axes."""
    sx, cx = sincos(alpha_x)
    sy, cy = sincos(alpha_y)
    a, b = cy * v[0] + sy * v[2], cy * v[2] - sy * v[0]
    return (a, cx * v[1] - sx * b, sx * v[1] + cx * b)


@scalar
def gyration(w: algebra.Vector, p: Parameters) -> float:
    """Rate at which Coriolis force and turntable turn the velocity [rad/s]."""
    return (p.beta * p.turntable_rate - (p.beta + 2.0) * w[2]) * p.share


@scalar
def push(y: State, u: Input, w: algebra.Vector, p: Parameters) -> Pair:
    """Velocity-independent part of the acceleration in plate axes [m/s^2].

    Gravity, force, the inertial forces of the accelerated plate, and the torque that turns the
    ball's own angular momentum with the plate.
    """
    s, c = sincos(y.alpha_y)
    sx, cx = sincos(y.alpha_x)
    radius, beta, table = p.radius, p.beta, p.turntable_rate
    grown = plate_growth(y, u, (s, c))
    swing_x, swing_y, _ = swing(y, w, grown, p)
    # omega at zero velocity, and the gyroscopic terms of it
    rest_x = w[0] + table * y.X * p.inverse_radius
    rest_y = w[1] + table * y.Y * p.inverse_radius
    twist_x = grown[0] + w[1] * y.spin - w[2] * rest_y
    twist_y = grown[1] + w[2] * rest_x - w[0] * y.spin
    return (
        p.share * (p.g * cx * s + u.FX * p.inverse_m - swing_x - beta * radius * twist_y),
        p.share * (u.FY * p.inverse_m - p.g * sx - swing_y + beta * radius * twist_x),
    )


@scalar
def rhs(y: State, u: Input, p: Parameters) -> State:
    """Newton's and Euler's laws in plate axes, without the contact force.

    ``m a = F + contact + m g``, ``beta m r^2 (omega' + w x omega) = -r n x contact``, where a is
    the absolute acceleration and the velocity is tied to omega by rolling; q' = (0, omega_world)
    q / 2. On a level turntable ``v' = k Omega n x v`` with k = beta / (1 + beta).

    Neimark & Fufaev, *Dynamics of Nonholonomic Systems*, chapter III; Weltner 1979,
    doi:10.1119/1.11602.
    """
    w, x, y_, z = algebra.attitude(y)
    plate = plate_rate(y)
    omega = ball_rate(y, plate, p)
    a, b, c = to_world(omega, y.alpha_x, y.alpha_y)
    kappa = gyration(plate, p)
    ax, ay = push(y, u, plate, p)
    return State(
        -0.5 * (a * x + b * y_ + c * z),
        0.5 * (a * w + b * z - c * y_),
        0.5 * (b * w + c * x - a * z),
        0.5 * (c * w + a * y_ - b * x),
        y.VX,
        y.VY,
        ax - kappa * y.VY,
        ay + kappa * y.VX,
        plate[1] * omega[0] - plate[0] * omega[1],
        y.rate_x,
        y.rate_y,
        u.a_x,
        u.a_y,
    )


@scalar
def step(y: State, u: Input, p: Parameters, h: float) -> State:
    """Half a kick, a drift at constant velocity, half a kick: symmetric, second order.

    The plate moves exactly; the ball turns about its axis at half the time.
    """
    half = 0.5 * h
    vx, vy, spin = _kick(y, u, p, half)
    X, Y = fma(half, vx, y.X), fma(half, vy, y.Y)
    rate_x, rate_y = fma(half, u.a_x, y.rate_x), fma(half, u.a_y, y.rate_y)
    # the change of angle over the first half is h / 2 times the mean rate of that half
    alpha_x = fma(half, fma(-0.25 * h, u.a_x, rate_x), y.alpha_x)
    alpha_y = fma(half, fma(-0.25 * h, u.a_y, rate_y), y.alpha_y)
    middle = State(*algebra.attitude(y), X, Y, vx, vy, spin, alpha_x, alpha_y, rate_x, rate_y)
    omega = ball_rate(middle, plate_rate(middle), p)
    a, b, c = to_world(omega, alpha_x, alpha_y)
    q = algebra.compose(algebra.half_turn((half * a, half * b, half * c)), algebra.attitude(y))
    X, Y = fma(half, vx, X), fma(half, vy, Y)
    alpha_x, alpha_y = fma(h, rate_x, y.alpha_x), fma(h, rate_y, y.alpha_y)
    rate_x, rate_y = fma(h, u.a_x, y.rate_x), fma(h, u.a_y, y.rate_y)
    end = State(*q, X, Y, vx, vy, spin, alpha_x, alpha_y, rate_x, rate_y)
    vx, vy, spin = _kick(end, u, p, half)
    return moving(end, X, Y, vx, vy, spin)


@scalar
def moving(y: State, X: float, Y: float, VX: float, VY: float, spin: float) -> State:
    """The state y with another position, velocity and spin."""
    tilt = (y.alpha_x, y.alpha_y, y.rate_x, y.rate_y)
    return State(*algebra.attitude(y), X, Y, VX, VY, spin, *tilt)


@scalar
def _kick(y: State, u: Input, p: Parameters, h: float) -> algebra.Vector:
    """Velocity and spin after h [s] at constant position."""
    plate = plate_rate(y)
    half = 0.5 * h
    spin = fma(half, _spin_rate(y, plate, p), y.spin)
    acceleration = push(moving(y, y.X, y.Y, y.VX, y.VY, spin), u, plate, p)
    vx, vy = pushed((y.VX, y.VY), acceleration, gyration(plate, p), half)
    after = moving(y, y.X, y.Y, vx, vy, spin)
    return vx, vy, fma(half, _spin_rate(after, plate, p), spin)


@scalar
def pushed(v: Pair, push: Pair, kappa: float, half: float) -> Pair:
    """Velocity after a time 2 half [s]: a turn at the rate kappa between half pushes.

    The turn conserves the speed to rounding.
    """
    vx, vy = fma(half, push[0], v[0]), fma(half, push[1], v[1])
    x = half * kappa
    versine, sine = algebra.cayley(x * algebra.tangent(x * x))
    vx, vy = fma(-sine, vy, -versine * vx) + vx, fma(sine, vx, -versine * vy) + vy
    return fma(half, push[0], vx), fma(half, push[1], vy)


@scalar
def _spin_rate(y: State, w: algebra.Vector, p: Parameters) -> float:
    """Rate of the spin, omega . (w x n): the contact force has no moment about n, but n turns."""
    omega = ball_rate(y, w, p)
    return w[1] * omega[0] - w[0] * omega[1]


@scalar
def restore(y: State) -> State:
    """State with q normalised, against the accumulation of rounding errors."""
    q = algebra.normalize_near_unit(algebra.attitude(y))
    tilt = (y.alpha_x, y.alpha_y, y.rate_x, y.rate_y)
    return State(*q, y.X, y.Y, y.VX, y.VY, y.spin, *tilt)


@scalar
def invariants(y: State, p: Parameters) -> Invariants:
    """Energy ((1 + beta) v^2 + beta r^2 spin^2) m / 2 + m g height [J], and the spin [rad/s].

    Conserved without input on a plate at constant tilt. A turntable does work on the ball; the
    first is then an integral, but not its energy, as the force of the surface is perpendicular to
    the velocity.
    """
    sx, cx = sincos(y.alpha_x)
    sy, cy = sincos(y.alpha_y)
    height = fma(sx, y.Y, cx * fma(-sy, y.X, cy * p.radius))
    spinning = p.beta * p.radius * p.radius * y.spin * y.spin
    square = fma(1.0 + p.beta, fma(y.VX, y.VX, y.VY * y.VY), spinning)
    return Invariants(p.m * fma(p.g, height, 0.5 * square), y.spin)


@scalar
def rate(y: State, p: Parameters) -> float:
    """Angular rate of the ball [rad/s]."""
    omega = ball_rate(y, plate_rate(y), p)
    return sqrt(algebra.dot(omega, omega))


@scalar
def ground_force(y: State, u: Input, p: Parameters) -> algebra.Vector:
    """Force of the plate, m a - m g - F, in plate axes [N].

    The absolute acceleration a is that relative to the plate, `swing`, and Coriolis' 2 w x v.
    """
    w = plate_rate(y)
    s, c = sincos(y.alpha_y)
    sx, cx = sincos(y.alpha_x)
    kappa = gyration(w, p)
    ax, ay = push(y, u, w, p)
    moved = swing(y, w, plate_growth(y, u, (s, c)), p)
    turn = 2.0 * w[2]
    x = ax - (kappa + turn) * y.VY + moved[0] - p.g * cx * s
    y_ = ay + (kappa + turn) * y.VX + moved[1] + p.g * sx
    z = 2.0 * (w[0] * y.VY - w[1] * y.VX) + moved[2] + p.g * cx * c
    return (p.m * x - u.FX, p.m * y_ - u.FY, p.m * z)


DYNAMIC_BALL = Dynamics(
    State,
    Input,
    Parameters,
    Invariants,
    derive,
    rhs,
    step,
    restore,
    invariants,
    rate=rate,
    contact=algebra.on_ground(ground_force, 3),
)


# The ball of `dynamic_ball` on a plate that is level and at rest: a fraction of the work.


@scalar
def level_step(y: State, u: Input, p: Parameters, h: float) -> State:
    """Same result as `dynamic_ball.step`, bit for bit.

    Tilt and gravity are ignored and the spin is constant: a quarter of the work.
    """
    half = 0.5 * h
    push = (p.share * (u.FX * p.inverse_m), p.share * (u.FY * p.inverse_m))
    kappa = p.beta * p.turntable_rate * p.share
    vx, vy = pushed((y.VX, y.VY), push, kappa, 0.5 * half)
    X, Y = fma(half, vx, y.X), fma(half, vy, y.Y)
    a, b, c = ball_rate(moving(y, X, Y, vx, vy, y.spin), (0.0, 0.0, 0.0), p)
    q = algebra.compose(algebra.half_turn((half * a, half * b, half * c)), algebra.attitude(y))
    X, Y = fma(half, vx, X), fma(half, vy, Y)
    vx, vy = pushed((vx, vy), push, kappa, 0.5 * half)
    return State(*q, X, Y, vx, vy, y.spin, y.alpha_x, y.alpha_y, y.rate_x, y.rate_y)


@scalar
def level_ground_force(y: State, u: Input, p: Parameters) -> algebra.Vector:
    """Same as `dynamic_ball.ground_force`."""
    kappa = p.beta * p.turntable_rate * p.share
    x = p.share * (u.FX * p.inverse_m) - kappa * y.VY
    y_ = p.share * (u.FY * p.inverse_m) + kappa * y.VX
    return (p.m * x - u.FX, p.m * y_ - u.FY, p.m * p.g)


LEVEL = algebra.on_ground(level_ground_force, 3)
"""Contact with the plate."""
