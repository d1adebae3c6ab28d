"""Ball with inertia that rolls without slipping on a plate, which may tilt and turn.

The plate turns about the point O of its surface by the angles alpha_x, alpha_y: plate axes are
P = Rx(alpha_x) Ry(alpha_y) of the world's. The surface itself may besides turn about its normal at
the constant rate Omega (a turntable); the plate axes do not follow that.

State y = (q, X, Y, VX, VY, spin, alpha_x, alpha_y, rate_x, rate_y): attitude (w, x, y, z), body to
world; centre in plate axes [m], its height is the radius; velocity in plate axes [m/s]; component
of the angular velocity along the normal [rad/s]; angles of the plate [rad] and their rates [rad/s].
The rest of the angular velocity follows from rolling, so the ball cannot slip.
Inputs u = (FX, FY, a_x, a_y): force at the centre in plate axes [N], and the accelerations of the
two angles [rad/s^2].
Parameters p = (m, radius, beta, g, Omega, 1 / m, 1 / radius, 1 / (1 + beta)), beta = I / (m r^2).
"""

from rigid_envs.kernels import batch
from rigid_envs.kernels.algebra import Row, Vector, compose, dot, normalize_near_unit
from rigid_envs.kernels.batch import Array
from rigid_envs.kernels.compiler import kernel, scalar
from rigid_envs.kernels.composition import SUZUKI
from rigid_envs.kernels.elementary import fma, sincos
from rigid_envs.kernels.turns import cayley, half_turn, tangent

__all__ = [
    "INVARIANTS",
    "SHAPES",
    "WEIGHTS",
    "derive",
    "invariants",
    "level_step",
    "restore",
    "rhs",
    "step",
]

STATE = (1.0,) + (0.0,) * 12
INPUTS = (0.0,) * 4
PARAMETERS = (1.0,) * 8
SHAPES = (STATE, INPUTS, PARAMETERS)
WEIGHTS = SUZUKI
INVARIANTS = ("energy", "spin")

Pair = tuple[float, float]


@scalar
def derive(raw: Row) -> Row:
    """Parameter row p of (m [kg], radius [m], beta, g [m/s^2], turntable_rate [rad/s])."""
    m, radius, beta, g, turntable = raw
    return (m, radius, beta, g, turntable, 1.0 / m, 1.0 / radius, 1.0 / (1.0 + beta))


@scalar
def plate_rate(tilt: Row) -> Vector:
    """Angular velocity of the plate in its own axes, of (alpha_x, alpha_y, rate_x, rate_y)."""
    s, c = sincos(tilt[1])
    return (tilt[2] * c, tilt[3], tilt[2] * s)


@scalar
def ball_rate(y: Row, w: Vector, p: Row) -> Vector:
    """Angular velocity in plate axes: v' = (omega - w) x r n + Omega n x (X, Y), solved for it."""
    return (
        w[0] - (y[7] - p[4] * y[4]) * p[6],
        w[1] + (y[6] + p[4] * y[5]) * p[6],
        y[8],
    )


@scalar
def to_world(v: Vector, alpha_x: float, alpha_y: float) -> Vector:
    """World components P v of a vector in plate axes."""
    sx, cx = sincos(alpha_x)
    sy, cy = sincos(alpha_y)
    a, b = cy * v[0] + sy * v[2], cy * v[2] - sy * v[0]
    return (a, cx * v[1] - sx * b, sx * v[1] + cx * b)


@scalar
def gyration(w: Vector, p: Row) -> float:
    """The rate at which Coriolis and turntable turn the velocity [rad/s]."""
    return (p[2] * p[4] - (p[2] + 2.0) * w[2]) * p[7]


@scalar
def push(y: Row, u: Row, w: Vector, p: Row) -> Pair:
    """The part of the acceleration in plate axes that does not depend on the velocity [m/s^2].

    Gravity, force, the inertial forces of the accelerated plate, and what turns the ball's own
    angular momentum with the plate.
    """
    s, c = sincos(y[10])
    sx, cx = sincos(y[9])
    radius, beta, table = p[1], p[2], p[4]
    rho = (y[4], y[5], radius)
    grown = (u[2] * c - y[11] * y[12] * s, u[3], u[2] * s + y[11] * y[12] * c)  # w'
    along, square = dot(w, rho), dot(w, w)
    swing_x = grown[1] * radius - grown[2] * rho[1] + w[0] * along - square * rho[0]
    swing_y = grown[2] * rho[0] - grown[0] * radius + w[1] * along - square * rho[1]
    # omega without the part that moves with the velocity, and with it the gyroscopic terms
    still_x, still_y = w[0] + table * rho[0] * p[6], w[1] + table * rho[1] * p[6]
    twist_x = grown[0] + w[1] * y[8] - w[2] * still_y
    twist_y = grown[1] + w[2] * still_x - w[0] * y[8]
    return (
        p[7] * (p[3] * cx * s + u[0] * p[5] - swing_x - beta * radius * twist_y),
        p[7] * (u[1] * p[5] - p[3] * sx - swing_y + beta * radius * twist_x),
    )


@scalar
def rhs(y: Row, u: Row, p: Row) -> Row:
    """Newton's and Euler's laws in plate axes, without the contact force.

    ``m a = F + contact + m g``, ``beta m r^2 (omega' + w x omega) = -r n x contact``, where a is
    the absolute acceleration and the velocity is tied to omega by rolling; q' = (0, omega_world)
    q / 2. On a level turntable ``v' = k Omega n x v`` with k = beta / (1 + beta).

    Neimark & Fufaev, *Dynamics of Nonholonomic Systems*, chapter III; Weltner 1979,
    doi:10.1119/1.11602.
    """
    w, x, y_, z = y[0], y[1], y[2], y[3]
    plate = plate_rate((y[9], y[10], y[11], y[12]))
    omega = ball_rate(y, plate, p)
    a, b, c = to_world(omega, y[9], y[10])
    kappa = gyration(plate, p)
    ax, ay = push(y, u, plate, p)
    return (
        -0.5 * (a * x + b * y_ + c * z),
        0.5 * (a * w + b * z - c * y_),
        0.5 * (b * w + c * x - a * z),
        0.5 * (c * w + a * y_ - b * x),
        y[6],
        y[7],
        ax - kappa * y[7],
        ay + kappa * y[6],
        plate[1] * omega[0] - plate[0] * omega[1],
        y[11],
        y[12],
        u[2],
        u[3],
    )


@scalar
def step(y: Row, u: Row, p: Row, h: float) -> Row:
    """Half a kick, a drift at constant velocity, half a kick: symmetric, second order.

    The plate moves exactly; the ball turns about its axis at half the time.
    """
    vx, vy, spin = _kick(y, u, p, 0.5 * h)
    half = 0.5 * h
    x, y_ = fma(half, vx, y[4]), fma(half, vy, y[5])
    rate_x, rate_y = fma(half, u[2], y[11]), fma(half, u[3], y[12])
    # the angle at half the time is h / 2 times the mean rate of that half away
    alpha_x = fma(half, fma(-0.25 * h, u[2], rate_x), y[9])
    alpha_y = fma(half, fma(-0.25 * h, u[3], rate_y), y[10])
    q = (y[0], y[1], y[2], y[3])
    middle = (*q, x, y_, vx, vy, spin, alpha_x, alpha_y, rate_x, rate_y)
    omega = ball_rate(middle, plate_rate((alpha_x, alpha_y, rate_x, rate_y)), p)
    a, b, c = to_world(omega, alpha_x, alpha_y)
    q = compose(half_turn((half * a, half * b, half * c)), q)
    end = (
        *q,
        fma(half, vx, x),
        fma(half, vy, y_),
        vx,
        vy,
        spin,
        fma(h, rate_x, y[9]),
        fma(h, rate_y, y[10]),
        fma(h, u[2], y[11]),
        fma(h, u[3], y[12]),
    )
    vx, vy, spin = _kick(end, u, p, 0.5 * h)
    return (*q, end[4], end[5], vx, vy, spin, end[9], end[10], end[11], end[12])


@scalar
def level_step(y: Row, u: Row, p: Row, h: float) -> Row:
    """What `step` does, to the bit, on a plate that is level and stays so.

    Neither tilt nor gravity is looked at, and the spin is kept: a quarter of the work.
    """
    half = 0.5 * h
    push, kappa = (p[7] * (u[0] * p[5]), p[7] * (u[1] * p[5])), p[2] * p[4] * p[7]
    vx, vy = _pushed((y[6], y[7]), push, kappa, 0.5 * half)
    x, y_ = fma(half, vx, y[4]), fma(half, vy, y[5])
    a, b, c = ball_rate((*y[:4], x, y_, vx, vy, y[8]), (0.0, 0.0, 0.0), p)
    q = compose(half_turn((half * a, half * b, half * c)), (y[0], y[1], y[2], y[3]))
    x, y_ = fma(half, vx, x), fma(half, vy, y_)
    return (*q, x, y_, *_pushed((vx, vy), push, kappa, 0.5 * half), *y[8:])


@scalar
def _kick(y: Row, u: Row, p: Row, h: float) -> Vector:
    """Velocity and spin after h [s] at one place."""
    plate = plate_rate((y[9], y[10], y[11], y[12]))
    half = 0.5 * h
    spin = fma(half, _spin_rate(y, plate, p), y[8])
    pushed = push((*y[:8], spin, *y[9:]), u, plate, p)
    vx, vy = _pushed((y[6], y[7]), pushed, gyration(plate, p), half)
    after = (*y[:6], vx, vy, spin, *y[9:])
    return vx, vy, fma(half, _spin_rate(after, plate, p), spin)


@scalar
def _pushed(v: Pair, push: Pair, kappa: float, half: float) -> Pair:
    """Velocity after a time 2 half [s]: a turn at the rate kappa between half pushes.

    The turn keeps the speed to rounding, as the turntable does.
    """
    vx, vy = fma(half, push[0], v[0]), fma(half, push[1], v[1])
    x = half * kappa
    versine, sine = cayley(x * tangent(x * x))
    vx, vy = fma(-sine, vy, -versine * vx) + vx, fma(sine, vx, -versine * vy) + vy
    return fma(half, push[0], vx), fma(half, push[1], vy)


@scalar
def _spin_rate(y: Row, w: Vector, p: Row) -> float:
    """The contact force has no moment about n, but n turns: spin' = omega . (w x n)."""
    omega = ball_rate(y, w, p)
    return w[1] * omega[0] - w[0] * omega[1]


@scalar
def restore(y: Row) -> Row:
    """The same state with a quaternion of unit length: roundings of many turns add up."""
    return (*normalize_near_unit((y[0], y[1], y[2], y[3])), *y[4:])


@scalar
def invariants(y: Row, p: Row) -> Row:
    """Energy ((1 + beta) v^2 + beta r^2 spin^2) m / 2 + m g height [J], and the spin [rad/s].

    Constant without input on a plate that does not tilt. A turntable does work on the ball; the
    first is then no longer its energy, but the integral that takes its place, for the surface
    pushes at right angles to the velocity.
    """
    sx, cx = sincos(y[9])
    sy, cy = sincos(y[10])
    height = fma(sx, y[5], cx * fma(-sy, y[4], cy * p[1]))
    square = fma(1.0 + p[2], fma(y[6], y[6], y[7] * y[7]), p[2] * p[1] * p[1] * y[8] * y[8])
    return (p[0] * fma(p[3], height, 0.5 * square), y[8])


@kernel
def evaluate_rows(y: Array, u: Array, p: Array, out: Array) -> None:
    """`batch.evaluate` of this system."""
    batch.evaluate(rhs, SHAPES, y, u, p, out)


@kernel
def measure_rows(y: Array, p: Array, out: Array) -> None:
    """`batch.measure` of this system."""
    batch.measure(invariants, SHAPES, y, p, out)


@kernel
def simulate_rows(
    weights: Array,
    p: Array,
    u: Array,
    u_per_stage: bool,
    h: Array,
    n_substeps: Array,
    y: Array,
) -> None:
    """`batch.simulate` of this system."""
    batch.simulate(step, restore, weights, SHAPES, p, u, u_per_stage, h, n_substeps, y)
