"""Laws of the spheroid that slides, spins and rolls on a plane."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import laws
from rigid_envs.systems.spheroid import closed_forms as theory
from rigid_envs.systems.spheroid.system import Spheroid

SUBJECT = laws.Subject("spheroid", "a spheroid that slides, spins and rolls on a plane")

_EGG = Spheroid(
    **{"m": 1.2, "radius": 0.7, "half_height": 0.9, "offset": 0.15, "I1": 0.35, "I3": 0.3},
    **{"g": 2.5, "mu": 0.3, "slip_speed": 1.5, "drag": 0.1},
)
_SMOOTH = replace(_EGG, mu=0.0, drag=0.0)
_SPHERE = replace(_EGG, half_height=0.7)
_LOADED = replace(_EGG, half_height=0.6)  # so that spin is needed to rise, and to stand
_Y, _U = laws.random_states(_EGG, 20, 0.7)
_Z, _LEVEL = np.array([0.0, 0.0, 1.0]), np.array([1.0, 1.0, 0.0])


def _lean(y: Array) -> tuple[Array, Array, Array]:
    """Cosine and sine of the tilt, and the unit horizontal to which the axis leans."""
    axis = laws.axis(y)
    size = np.hypot(axis[..., 0], axis[..., 1])[..., None]
    level = np.concatenate([axis[..., :2] / size, np.zeros_like(size)], axis=-1)
    return axis[..., 2], size[..., 0], level


def _arm(y: Array, body: Spheroid = _EGG) -> Array:
    """From the centre of mass to the contact, which is where the meridian is horizontal.

    With the axis at the tilt theta, the lowest point of the ellipse is at the eccentric angle of
    tangent (b / c) tan(theta) from the lower pole.
    """
    c, s, level = _lean(y)
    axis, across = laws.axis(y), c[..., None] * level - s[..., None] * _Z
    polar = np.arctan2(body.radius * s, body.half_height * c)[..., None]
    along = body.half_height * np.cos(polar) - body.offset
    return np.asarray(body.radius * np.sin(polar) * across - along * axis)


def _world(y: Array, v: Array) -> Array:
    return np.asarray(np.einsum("...ij,...j->...i", laws.attitudes(y), v))


def _centre(y: Array) -> Array:
    return np.asarray(laws.horizontal(_EGG.centre(y)) - _arm(y)[..., 2:] * _Z)


def _slip(y: Array) -> Array:
    """Velocity of the material point at the contact, without its vertical part."""
    turn = np.cross(_world(y, _EGG.omega_body(y)), _arm(y))
    return np.asarray((laws.horizontal(_EGG.velocity(y)) + turn) * _LEVEL)


def _friction(y: Array, u: Array) -> Array:
    """-(mu / sqrt(v^2 + slip_speed^2) + drag) N v; N by `contact_force`, a law of its own."""
    slip, normal = _slip(y), _EGG.contact_force(y, u)[..., 2:]
    smooth = np.sqrt(np.sum(slip * slip, axis=-1, keepdims=True) + _EGG.slip_speed**2)
    return np.asarray(-(_EGG.mu / smooth + _EGG.drag) * normal * slip)


def _applied(y: Array, u: Array) -> Array:
    """Weight and pushing force."""
    return laws.horizontal(u[..., 3:5], -_EGG.m * _EGG.g)


def _torque(y: Array, u: Array) -> Array:
    return _world(y, u[..., :3])


def _displacements(y: Array) -> tuple[Array, Array]:
    """Any turn, with the rise of the centre that it asks for; any way along the plane."""
    turns = np.broadcast_to(laws.VIRTUAL_ROTATIONS, (3, *y.shape[:-1], 3))
    rise = -np.cross(turns, _arm(y)) * _Z
    ways = np.broadcast_to(laws.VIRTUAL_ROTATIONS[:2], (2, *y.shape[:-1], 3))
    return np.concatenate([rise, ways]), np.concatenate([turns, np.zeros_like(ways)])


_BODY = _EGG.m, _EGG.moments, _centre
_MODEL = laws.RigidBodyModel(
    *_BODY,
    lambda y, u: _applied(y, u) + _friction(y, u),
    lambda y, u: _torque(y, u) + np.cross(_arm(y), _friction(y, u)),
    _displacements,
)


def _along(rates: Array, value: Callable[[Array], dict[str, Array]]) -> dict[str, Array]:
    """Derivatives of named values along the rates, at the states of the subject."""
    h = 2e-5
    ahead, behind = value(_Y + h * rates), value(_Y - h * rates)
    return {name: (ahead[name] - behind[name]) / (2.0 * h) for name in ahead}


def _rise(y: Array) -> dict[str, Array]:
    """Vertical velocity of the centre of mass, with which the contact does not rise."""
    return {"rise": -np.cross(_world(y, _EGG.omega_body(y)), _arm(y))[..., 2]}


@SUBJECT.law(
    "rhs and contact_force with the forces, the torques and the power",
    bound=1e-7,
    why="differences in steps of 2e-5: 1e-9 of rates of 10, roundings 1e-15 / 2e-5 of 10",
)
def forces_and_torques_are_the_rates_of_momenta_and_energy() -> float:
    """M V' = F + friction, m z'' = N - m g, L_z', L_3' and E', all along rhs."""
    rates, force, friction = _EGG.rhs(_Y, _U), _EGG.contact_force(_Y, _U), _friction(_Y, _U)
    torque, omega = _torque(_Y, _U) + np.cross(_arm(_Y), friction), _world(_Y, _EGG.omega_body(_Y))
    push = laws.horizontal(_U[:, 3:5])
    power = np.sum(friction * _slip(_Y) + _torque(_Y, _U) * omega, axis=-1)
    power = power + np.sum(push * laws.horizontal(_EGG.velocity(_Y)), axis=-1)
    changes = _along(rates, _EGG.invariants) | _along(rates, _rise)
    return laws.max_abs(
        _EGG.m * laws.horizontal(_EGG.velocity(rates)) - push - friction,
        _EGG.m * (changes["rise"] + _EGG.g) - force[:, 2],
        changes["L_vertical"] - torque[:, 2],
        changes["L_spin"] - np.sum(torque * laws.axis(_Y), axis=-1),
        changes["energy"] - power,
    )


@SUBJECT.law(
    "differences of advance by a millisecond with rhs",
    bound=1e-8,
    why="differences of order 4 in steps of 1e-3: 1e-12 of rates of 10 and their fifth powers",
)
def steps_begin_as_rhs_says() -> float:
    """(y(h) - y(-h)) / (2 h), of one step and of one twice as long."""
    h, found = 1e-3, []
    for step in (h, 2.0 * h):
        ahead, behind = (_EGG.advance(_Y, _U, dt, 1) for dt in (step, -step))
        found.append((ahead - behind) / (2.0 * step))
    return laws.max_abs((4.0 * found[0] - found[1]) / 3.0 - _EGG.rhs(_Y, _U))


@SUBJECT.law("invariants with T + m g z and R L of NumPy", bound=1e-13, why=laws.ten_roundings(10))
def invariants_are_energy_momenta_and_jelletts_integral() -> float:
    """E = (m v^2 + omega . I omega) / 2 + m g z, L_z, L_3 and -L . rho; v_z = -(omega x rho)_z."""
    omega, found = _EGG.omega_body(_Y), _EGG.invariants(_Y)
    momentum = _EGG.moments * omega
    L, arm = _world(_Y, momentum), _arm(_Y)
    v = laws.horizontal(_EGG.velocity(_Y)) - np.cross(_world(_Y, omega), arm) * _Z
    kinetic = 0.5 * (np.sum(momentum * omega, axis=-1) + _EGG.m * np.sum(v * v, axis=-1))
    energy = kinetic - _EGG.m * _EGG.g * arm[:, 2]
    return laws.max_abs(
        *(found["energy"] - energy, _EGG.energy(_Y) - energy),
        *(found["L_vertical"] - L[:, 2], found["L_spin"] - momentum[:, 2]),
        found["jellett"] + np.sum(L * arm, axis=-1),
    )


@SUBJECT.law(
    "advance forth and back in steps that turn by up to half a radian",
    bound=1e-13,
    why=laws.HUNDREDS,
)
def the_impulse_of_the_plane_is_found_to_rounding() -> float:
    """On ice a step of any length is undone: its equation for the impulse is solved.

    The steps are nearly as long as they may be: what Newton's method leaves grows with them.
    """
    errors, fast = [], _Y.copy()
    fast[:, _EGG.components["omega_body"]] *= 5.0
    for y, span in ((_Y, 0.32), (fast, 0.11)):
        for body in (_SMOOTH, replace(_LOADED, mu=0.0, drag=0.0)):
            there = body.advance(y, None, span, 4)
            errors.append(body.advance(there, None, -span, 4) - y)
    return laws.max_abs(*errors)


@SUBJECT.law("contact_force with mu, slip_speed and drag", bound=1e-13, why=laws.ten_roundings(10))
def friction_opposes_the_slip() -> float:
    """Its part along the plane is -(mu / sqrt(v^2 + slip_speed^2) + drag) N v."""
    friction = _EGG.contact_force(_Y, _U) * _LEVEL
    return laws.max_abs(friction - _friction(_Y, _U))


laws.law_of_dalembert(SUBJECT, _EGG, _Y, _U, _MODEL)
laws.law_of_contact_force(
    SUBJECT,
    *(_EGG, _Y, _U, laws.RigidBodyModel(*_BODY, _applied, _torque, _displacements)),
    lambda y, u: (_EGG.contact_force(y, u), _arm(y)),
)


laws.laws_of_every_system(SUBJECT, _EGG, _Y, _U, _SMOOTH)
laws.law_of_order(SUBJECT, _EGG, _Y, _U, 0.3)


def _lowest(y: Array) -> Array:
    """Height of the lowest point of the surface, found on ever finer nets around it [m]."""
    down = laws.attitudes(y)[:, 2, :, None, None]
    net = np.linspace(-1.0, 1.0, 21)
    polar, azimuth = np.full((2, len(y)), 0.5 * math.pi)
    width, rows = math.pi, np.arange(len(y))
    for _ in range(12):
        chi = (polar[:, None] + width * net)[:, :, None]
        phi = (azimuth[:, None] + width * net)[:, None, :]
        x, y_ = (_EGG.radius * np.sin(chi) * wave(phi) for wave in (np.cos, np.sin))
        z = _EGG.half_height * np.cos(chi) + _EGG.offset
        heights = (down[:, 0] * x + down[:, 1] * y_ + down[:, 2] * z).reshape(len(y), -1)
        i, j = np.divmod(np.argmin(heights, axis=-1), len(net))
        polar, azimuth, width = polar + width * net[i], azimuth + width * net[j], 0.2 * width
    return np.asarray(heights[rows, len(net) * i + j] + _EGG.height(y))


@SUBJECT.law(
    "height with the lowest point of the surface, on nets", bound=1e-13, why=laws.ten_roundings(10)
)
def the_body_stands_on_its_lowest_point() -> float:
    """That is on the plane, at the start and 0.04 s later."""
    return laws.max_abs(_lowest(_Y), _lowest(laws.stencil(_EGG, _Y, _U).y[-1]))


@SUBJECT.law("velocity of the lowest point with 0", bound=1e-10, why=laws.SLOPES)
def the_contact_neither_rises_nor_sinks() -> float:
    """The material point at the contact has no vertical velocity, and slides at `slip`."""
    motion = laws.stencil(_EGG, _Y, _U)
    v = motion.rate(_centre(motion.y)) + np.cross(motion.omega(), _arm(_Y))
    return laws.max_abs(v - laws.horizontal(_EGG.slip(_Y)), _EGG.arm(_Y) - _arm(_Y))


@SUBJECT.law(
    "advance of a sphere in steps of 0.02 s with its start", bound=1e-13, why=laws.HUNDREDS
)
def friction_keeps_jelletts_integral() -> float:
    """L . (r e_z - offset e3) after 2 s of sliding and 100 steps: each impulse keeps it."""
    before, end = _SPHERE.invariants(_Y), _SPHERE.advance(_Y, None, 2.0, 100)
    arm = _SPHERE.radius * _Z - _SPHERE.offset * laws.axis(end)
    J = np.sum(_world(end, _SPHERE.moments * _SPHERE.omega_body(end)) * arm, axis=-1)
    return laws.max_abs(J - before["jellett"], _SPHERE.invariants(end)["jellett"] - J)


@SUBJECT.law("rate of Jellett's integral with the torque", bound=1e-9, why=laws.AS_RHS)
def torque_changes_jelletts_integral_by_its_lever() -> float:
    """J' = tau . (r e_z - offset e3), of a sphere with friction."""
    motion = laws.stencil(_SPHERE, _Y, _U)
    arm = _SPHERE.radius * _Z - _SPHERE.offset * laws.axis(_Y)
    power = np.sum(_torque(_Y, _U) * arm, axis=-1)
    return laws.max_abs(motion.rate(_SPHERE.invariants(motion.y)["jellett"]) - power)


@SUBJECT.law("advance in steps of 0.02 s with the start", bound=1e-12, why=laws.HUNDREDS)
def without_friction_the_momenta_and_the_velocity_are_kept() -> float:
    """L_z, L_3 and the horizontal velocity after 4 s and 200 steps, at any step."""
    before, end = _SMOOTH.invariants(_Y), _SMOOTH.advance(_Y, None, 4.0, 200)
    after, v = _SMOOTH.invariants(end), _SMOOTH.velocity(_Y)
    return laws.max_abs(
        *(after[name] - before[name] for name in ("L_vertical", "L_spin")),
        *(_SMOOTH.velocity(end) - v, _SMOOTH.centre(end) - _SMOOTH.centre(_Y) - 4.0 * v),
    )


@SUBJECT.law(
    "advance in steps of 0.05 s with two rotations in closed form",
    bound=1e-11,
    why="steps are exact there: the neglected term of the tangent, and roundings",
)
def a_balanced_sphere_on_ice_turns_freely_at_any_step() -> float:
    """R = exp(L t / A) R0 exp(e3 (1 - C / A) omega3 t): the plane has no torque on it."""
    ball = replace(_SPHERE, offset=0.0, I3=0.2, mu=0.0, drag=0.0)
    end, omega = ball.advance(_Y, None, 1.0, 20), ball.omega_body(_Y)
    L = _world(_Y, ball.moments * omega)
    about_L = Rotation.from_rotvec(L / ball.I1).as_matrix()
    about_axis = Rotation.from_rotvec((1.0 - ball.I3 / ball.I1) * omega[:, 2:] * _Z).as_matrix()
    return laws.max_abs(laws.attitudes(end) - about_L @ laws.attitudes(_Y) @ about_axis)


def _ball(**friction: float) -> Spheroid:
    """A ball with beta = 0.55."""
    shape = {"radius": 0.7, "half_height": 0.7, "offset": 0.0}
    inertia = 0.55 * 1.2 * 0.7**2
    return Spheroid(m=1.2, **shape, I1=inertia, I3=inertia, g=2.5, **friction)


@SUBJECT.law(
    "simulate with the closed forms of the slip", bound=1e-9, why="1e-11 per radian, 20 radians"
)
def balls_slide_as_in_closed_form() -> float:
    """Place, velocity and spin of a ball, with drag alone and with sliding friction alone."""
    t, errors, ball = np.linspace(0.0, 2.0, 9), [], {"beta": 0.55, "radius": 0.7, "g": 2.5}
    for y in _Y[:5]:
        start = np.concatenate([(1.0, 0.0, 0.0, 0.0), y[4:]])
        v, omega = _EGG.velocity(start), _EGG.omega_body(start)
        for body, exact in (
            (
                _ball(mu=0.0, slip_speed=1.0, drag=0.3),
                theory.slide_with_drag(t, v, omega, drag=0.3, **ball),
            ),
            (
                _ball(mu=0.4, slip_speed=0.3, drag=0.0),
                theory.slide_with_friction(t, v, omega, mu=0.4, slip_speed=0.3, **ball),
            ),
        ):
            motion = body.simulate(start, t)
            errors += [
                motion["centre"] - body.centre(start) - exact.position,
                *(motion["velocity"] - exact.velocity, motion["omega_world"] - exact.omega),
                motion["slip"] - exact.slip,
            ]
    return laws.max_abs(*errors)


_SHAPE = {name: getattr(_EGG, name) for name in ("m", "radius", "half_height", "offset", "g")}
_SPHERICAL = {name: getattr(_SPHERE, name) for name in ("m", "radius", "offset", "g")}
_MOMENTS = {"i_perp": _EGG.I1, "i3": _EGG.I3}


@SUBJECT.law(
    "simulate without friction for a period with its quadrature", bound=1e-8, why=laws.RADIANS
)
def a_body_on_ice_nods_between_its_turning_points() -> float:
    """Half a period after one turning point the tilt is at the other, after one it is back."""
    errors = []
    for theta, turn, spin in ((0.8, 0.9, 2.5), (2.0, 0.5, 3.0), (1.2, -1.0, 0.5), (0.3, 4.0, 2.0)):
        nod = theory.nutation(theta, phi_rate=turn, omega3=spin, **_SHAPE, **_MOMENTS)
        start = _SMOOTH.state(tilt=theta, precession=turn, spin=spin)
        tilt = _SMOOTH.simulate(start, [0.0, 0.5 * nod.period, nod.period])["tilt"]
        ends = np.array([nod.theta_min, nod.theta_max])
        other = ends[np.argmax(np.abs(ends - theta))]
        kept = _SMOOTH.invariants(start)
        errors += [*(tilt - [theta, other, theta]), kept["energy"] - nod.energy]
        errors += [kept["L_vertical"] - nod.p_phi, kept["L_spin"] - nod.p_psi]
    return laws.max_abs(*errors)


_SLOPE = _EGG.drag + _EGG.mu / _EGG.slip_speed


def _small_motions(body: Spheroid, spin: float) -> Array:
    """Eigenvalues of the motion about upright spin, in axes that turn with the body.

    Differences of the rates of gamma = R^T e_z, omega and v = R^T V across the axis, with
    gamma' = gamma x omega, v' = R^T V' - omega x v, and V horizontal.
    """
    h, zero = 1e-5, np.zeros(12)
    z = h * np.concatenate([np.eye(6), -np.eye(6)])
    q = np.stack([zero + 1.0, 0.5 * z[:, 1], -0.5 * z[:, 0], zero], axis=-1)
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    R = laws.matrices(q)
    omega = np.stack([z[:, 2], z[:, 3], zero + spin], axis=-1)
    V = np.einsum("nij,nj->ni", R, np.stack([z[:, 4], z[:, 5], zero], axis=-1)) * _LEVEL
    rates = body.rhs(body.state(q=q, omega_body=omega, velocity=V[:, :2]))
    pulled = np.einsum("nji,nj->ni", R, laws.horizontal(body.velocity(rates)))
    leaning, v = np.cross(R[:, 2], omega), np.einsum("nji,nj->ni", R, V)
    rows = (leaning, body.omega_body(rates), pulled + np.cross(v, omega))
    rate = np.concatenate([row[:, :2] for row in rows], axis=-1)
    return np.asarray(np.linalg.eigvals((rate[:6] - rate[6:]).T / (2.0 * h)))


def _exponents(body: Spheroid, spin: float) -> tuple[complex, complex, complex]:
    """Those of the theory for a body with the friction of the subject."""
    shape = {name: getattr(body, name) for name in _SHAPE}
    return theory.upright_exponents(spin, **shape, **_MOMENTS, drag=_SLOPE)


@SUBJECT.law(
    "eigenvalues of differences of rhs with a cubic",
    bound=1e-8,
    why="differences in steps of 1e-5: 1e-10 of rates of 10, times the condition of the roots",
)
def small_tilts_grow_as_in_closed_form() -> float:
    """Three exponents x - i n in the body, and their conjugates; upside down offset is negative."""
    errors = []
    for body in (_LOADED, _EGG, _SPHERE, replace(_LOADED, offset=-0.15), replace(_EGG, offset=0.0)):
        for n in (0.5, 3.0, 8.0):
            found = _small_motions(body, n)
            for x in _exponents(body, n):
                errors += [
                    np.min(np.abs(found - part)) for part in (x - 1j * n, x.conjugate() + 1j * n)
                ]
    return laws.max_abs(*errors)


@SUBJECT.law(
    "slowest_rate with the fastest exponent of bodies at rest",
    bound=1e-5,
    why="gravity beside the decay of slip: 1e-6 of it",
)
def steps_are_as_short_as_gravity_friction_and_shape_ask_for() -> float:
    """On ice an oblate body swings at it; of a long one on its end the slip dies out with it.

    Turns across the axis count as many times as the longer semi-axis has the shorter one.
    """
    flat = replace(_LOADED, mu=0.0, drag=0.0)
    long = replace(_EGG, offset=-0.15, I3=0.4, mu=1e6, drag=1e6)
    errors = [
        np.max(np.abs(_small_motions(body, 0.0))) / body.slowest_rate - 1.0 for body in (flat, long)
    ]
    turning = _EGG.state(omega_body=(3.0, 0.0, 0.0))
    for body, ratio in ((_EGG, 0.9 / 0.7), (_LOADED, 0.7 / 0.6)):
        turns = body.rate_bound(turning, np.zeros(5), 0.0) - body.slowest_rate
        errors.append(turns / 3.0 - ratio)
    return laws.max_abs(*errors)


@SUBJECT.law(
    "thresholds with the largest real part of an exponent", bound=1e-13, why=laws.ten_roundings(10)
)
def spins_above_a_threshold_rise_and_stand() -> float:
    """At `rising_spin` and `standing_spin` an exponent is i n R / z, and changes its sign there."""
    errors = []
    for body, upright, spin, sense in (
        (_LOADED, _LOADED, _LOADED.rising_spin, 1.0),
        (_SPHERE, _SPHERE, _SPHERE.rising_spin, 1.0),
        (_SPHERE, replace(_SPHERE, offset=-_SPHERE.offset), _SPHERE.standing_spin, -1.0),
    ):
        height = upright.half_height - upright.offset
        rolling = spin * body.radius**2 / body.half_height / height
        errors.append(min(abs(x - 1j * rolling) for x in _exponents(upright, spin)))
        above, below = (_exponents(upright, part * spin)[0].real for part in (1.01, 0.99))
        errors.append(0.0 if sense * above > 0.0 > sense * below else math.inf)
    levers = _SPHERE.I3 * (_SPHERE.radius + _SPHERE.offset * np.array([-1.0, 1.0]))
    spins = np.array([_SPHERE.rising_spin, _SPHERE.standing_spin])
    limits = theory.jellett_thresholds(**_SPHERICAL, **_MOMENTS)
    return laws.max_abs(*errors, levers * spins / _SPHERE.radius - limits)


@SUBJECT.law(
    "simulate of the tumbling of a value of Jellett's integral with its start",
    bound=1e-8,
    why="1e-11 per radian, some 50 radians, and what the motion makes of it",
)
def tops_tumble_without_slip_where_their_potential_is_level() -> float:
    """Turning about the line from the contact to the centre of mass, they do so for ever."""
    t, errors = np.linspace(0.0, 8.0, 9), []
    for p in (0.6, 1.2, -2.0):
        (steady,) = theory.tumbling(p, **_SPHERICAL, **_MOMENTS)
        lying = _SPHERE.state(tilt=steady.theta)
        line = -_arm(lying, _SPHERE)
        omega = laws.attitudes(lying).T @ line * (steady.omega / np.linalg.norm(line))
        motion = _SPHERE.simulate(_SPHERE.state(q=laws.quaternion(lying), omega_body=omega), t)
        energy = motion["energy"] - _SPHERE.m * _SPHERE.g * _SPHERE.radius
        errors += [motion["tilt"] - steady.theta, motion["slip"], motion["velocity"]]
        errors += [energy - steady.energy, motion.invariants["jellett"] - 0.7 * p]
    return laws.max_abs(*errors)
