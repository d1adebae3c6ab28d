"""Laws of the disk that rolls on its rim, and of Euler's disk."""

import math

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import laws, rotations
from rigid_envs.systems.rolling_disk import closed_forms as theory
from rigid_envs.systems.rolling_disk.system import EulerDisk, RollingDisk

SUBJECT = laws.Subject("rolling_disk", "a disk that rolls on its rim, under torques")

_DISK = RollingDisk(m=1.2, radius=0.7, I1=0.21, I3=0.35, g=2.5)  # a weak gravity: it falls slowly
_PARAMETERS = {"m": 1.2, "radius": 0.7, "i_perp": 0.21, "i3": 0.35}
_Y, _U = laws.random_states(_DISK, 20, 0.7)
_ANGLES = np.random.default_rng(10).uniform([-3.0, 0.9, -3.0], [3.0, 2.2, 3.0], (20, 3))
_Y[:, _DISK.components["q"]] = rotations.quaternion_from_euler(_ANGLES)


def _frame(y: Array) -> tuple[Array, Array, Array]:
    """Unit vectors: n to the highest point of the rim, the horizontal l = e3 x n, the axis e3."""
    axis = laws.axis(y)
    up = np.array([0.0, 0.0, 1.0]) - axis[..., 2:] * axis
    n = up / np.linalg.norm(up, axis=-1, keepdims=True)
    return n, np.cross(axis, n), axis


def _arm(y: Array) -> Array:
    """From the point of contact to the centre."""
    return 0.7 * _frame(y)[0]


def _centre(y: Array) -> Array:
    return laws.horizontal(_DISK.contact(y)) + _arm(y)


def _torque(y: Array, u: Array) -> Array:
    return np.asarray(np.einsum("...k,k...i->...i", u, np.stack(_frame(y))))


_WEIGHS, _TURNS = laws.constant(0.0, 0.0, -1.2 * 2.5), laws.turns_about(_arm)
_MODEL = laws.RigidBodyModel(1.2, _DISK.moments, _centre, _WEIGHS, _torque, _TURNS)
laws.law_of_dalembert(SUBJECT, _DISK, _Y, _U, _MODEL)


@SUBJECT.law("velocity of the contact point of simulate with 0", bound=1e-10, why=laws.SLOPES)
def the_contact_point_is_at_rest() -> float:
    """The point at -r n: v + omega x (-r n) = 0, omega from R' R^T, which is that of the state."""
    motion = laws.stencil(_DISK, _Y, _U)
    omega = motion.omega()
    v = motion.rate(_centre(motion.y))
    in_body = np.einsum("nji,nj->ni", laws.attitudes(_Y), omega)
    return laws.max_abs(v + np.cross(omega, -_arm(_Y)), in_body - _DISK.omega_body(_Y))


laws.laws_of_every_system(SUBJECT, _DISK, _Y, _U)


@SUBJECT.law("invariants with T + m g z of NumPy", bound=1e-13, why=laws.ten_roundings(10))
def the_invariant_is_the_energy() -> float:
    """E = (m v^2 + omega . I omega) / 2 + m g z, with v = omega x r n."""
    omega = np.einsum("nij,nj->ni", laws.attitudes(_Y), _DISK.omega_body(_Y))
    v = np.cross(omega, _arm(_Y))
    turning = np.sum(_DISK.moments * _DISK.omega_body(_Y) ** 2, axis=-1)
    energy = 0.5 * (1.2 * np.sum(v * v, axis=-1) + turning) + 1.2 * 2.5 * _centre(_Y)[:, 2]
    return laws.max_abs(_DISK.invariants(_Y)["energy"] - energy)


@SUBJECT.law("rate of the energy invariant with tau . omega", bound=1e-9, why=laws.AS_RHS)
def torque_does_its_work() -> float:
    """E' = tau . omega: the contact force does none."""
    motion = laws.stencil(_DISK, _Y, _U)
    power = np.sum(_torque(_Y, _U) * _DISK.omega_world(_Y), axis=-1)
    return laws.max_abs(motion.rate(_DISK.invariants(motion.y)["energy"]) - power)


laws.law_of_order(SUBJECT, _DISK, _Y, _U, 0.2)
laws.law_of_contact_force(
    SUBJECT,
    *(_DISK, _Y, _U, _MODEL),
    lambda y, u: (_DISK.contact_force(y, u), -_arm(y)),
)


def _start(theta: float, theta_rate: float, phi_rate: float, omega3: float) -> Array:
    """Contact in the origin, phi = psi = 0: n is e2 and l is -e1."""
    q = rotations.quaternion_from_euler([0.0, theta, 0.0])
    return _DISK.state(q=q, omega_body=(theta_rate, phi_rate * math.sin(theta), omega3))


@SUBJECT.law(
    "simulate on both steady circles of a lean with the theory",
    bound=1e-8,
    why="1e-11 per radian, some 100 radians",
)
def steady_circles_are_steady() -> float:
    """Constant lean; the contact runs round a circle of the radius of the theory at phi'."""
    t, errors = np.linspace(0.0, 2.0, 9), []
    for theta, omega3 in ((0.9, 5.0), (2.1, -3.0)):
        for circle in theory.steady_precession(theta, omega3, g=2.5, **_PARAMETERS):
            motion = _DISK.simulate(_start(theta, 0.0, circle.precession, omega3), t)
            angle = circle.precession * t
            arc = circle.contact_radius * np.stack([np.sin(angle), 1.0 - np.cos(angle)], -1)
            errors += [motion["tilt"] - theta, motion["contact"] - arc]
    return laws.max_abs(*errors)


@SUBJECT.law(
    "advance in steps of 0.02 s on a steady circle with the theory",
    bound=1e-11,
    why="steps are exact there: the neglected term of the tangent, and roundings",
)
def steps_on_a_steady_circle_are_exact() -> float:
    """Attitude, spin and contact after 2 s, whatever the step."""
    theta, omega3, errors = 0.9, 3.0, []
    circle = theory.steady_precession(theta, omega3, g=2.5, **_PARAMETERS)[0]
    angle = 2.0 * circle.precession
    R = rotations.matrix_from_euler([angle, theta, 2.0 * circle.spin])
    arc = circle.contact_radius * np.array([math.sin(angle), 1.0 - math.cos(angle)])
    for n in (100, 200):
        end = _DISK.advance(_start(theta, 0.0, circle.precession, omega3), None, 2.0, n)
        errors += [
            laws.attitudes(end) - R,
            _DISK.omega_body(end)[2] - omega3,
            _DISK.contact(end) - arc,
        ]
    return laws.max_abs(*errors)


@SUBJECT.law(
    "advance in steps of 0.05 s without weight with uniform turning",
    bound=1e-11,
    why="steps are exact there: roundings, and a weight of 1e-12 N",
)
def a_disk_that_only_tips_tips_uniformly() -> float:
    """With omega along l the contact stays: theta = theta0 - omega_l t."""
    light = RollingDisk(m=1.2, radius=0.7, I1=0.21, I3=0.35, g=1e-12)
    theta, rate = 2.0, 0.8
    q = rotations.quaternion_from_euler([0.4, theta, 0.9])
    l_body = np.einsum("ji,j->i", laws.matrices(q), _frame(q)[1])
    start = light.state(q=q, omega_body=rate * l_body, contact=(0.3, 0.2))
    end = light.advance(start, None, 1.0, 20)
    l_after = _frame(end)[1]
    return laws.max_abs(
        light.tilt(end) - (theta - rate),
        light.contact(end) - [0.3, 0.2],
        light.omega_world(end) - rate * l_after,
        l_after - _frame(q)[1],
    )


@SUBJECT.law(
    "simulate with Legendre's integrals",
    bound=1e-8,
    why="1e-11 per radian, some 100 radians; precession grows as the disk lies down",
)
def spins_depend_on_the_lean_alone() -> float:
    """omega3 and p = phi' sin(theta) at every lean, from the two constants of the start."""
    theta, phi_rate, omega3 = 1.2, 0.8, 2.5
    c1, c2 = theory.legendre_constants(theta, phi_rate, omega3, **_PARAMETERS)
    motion = _DISK.simulate(_start(theta, 0.3, phi_rate, omega3), np.linspace(0.0, 6.0, 61))
    precession, axial = theory.spins(motion["tilt"], c1, c2, **_PARAMETERS)
    n = _frame(motion.y)[0]
    p = np.sum(motion["omega_world"] * n, axis=-1)
    return laws.max_abs(motion["omega_body"][:, 2] - axial, p - precession * np.sin(motion["tilt"]))


@SUBJECT.law(
    "simulate for a period with the quadrature of the effective potential",
    bound=1e-8,
    why="1e-11 per radian, some 30 radians",
)
def a_disk_nods_between_its_turning_points() -> float:
    """Started at its smallest lean it is there again after a period, and at its largest halfway."""
    theta, phi_rate, omega3 = 1.0, 1.2, 3.0
    nod = theory.fall(theta, 0.0, phi_rate, omega3, g=2.5, **_PARAMETERS)
    times = [0.0, 0.5 * nod.period, nod.period]
    tilt = _DISK.simulate(_start(theta, 0.0, phi_rate, omega3), times)["tilt"]
    ends = np.array([nod.theta_min, nod.theta_max])
    other = ends[np.argmax(np.abs(ends - theta))]
    return laws.max_abs(tilt - [theta, other, theta])


# Euler's disk: friction opposes the rate psi' of the contact along the rim.

EULER = laws.Subject("euler_disk", "a disk that rolls to rest, with friction at its contact")

_COIN = EulerDisk(m=1.2, radius=0.7, I1=0.21, I3=0.35, g=2.5, contour=0.3, drag=0.02)
_Y_COIN = _Y.copy()
_Y_COIN[:, 6] += np.resize([1.2, -1.2], 20) - _COIN.contact_rate(_Y)  # it does not come to rest
_AXIAL = 0.35 + 1.2 * 0.7**2  # about the parallel to the axis at the contact


def _friction(y: Array) -> tuple[Array, Array]:
    """Torque of friction in world axes, and its power.

    Of omega = phi' e_z + theta' node + psi' e3 the last rate is omega . d, with d = (e3 -
    cos(theta) e_z) / sin(theta)^2; the torque Q d does the work Q psi'.
    """
    axis = laws.axis(y)
    up = axis[..., 2:]
    dual = (axis - up * np.array([0.0, 0.0, 1.0])) / (1.0 - up * up)
    omega = np.einsum("...ij,...j->...i", laws.attitudes(y), _COIN.omega_body(y))
    spin = np.sum(omega * dual, axis=-1)
    torque = -0.3 * np.sign(spin) - 0.02 * spin**3
    return torque[..., None] * dual, torque * spin


_COIN_MODEL = laws.RigidBodyModel(
    *(1.2, _COIN.moments, _centre, _WEIGHS),
    torque=lambda y, u: _torque(y, u) + _friction(y)[0],
    displacements=_TURNS,
)
laws.law_of_dalembert(EULER, _COIN, _Y_COIN, _U, _COIN_MODEL)


@EULER.law(
    "advance of a disk that rolls upright with uniform deceleration and rest",
    bound=1e-12,
    why="kicks are exact: a thousand roundings",
)
def dry_friction_stops_the_disk_and_leaves_it_at_rest() -> float:
    """(C + m r^2) psi'' = -k until psi' = 0; the way is r times the angle."""
    dry = EulerDisk(m=1.2, radius=0.7, I1=0.21, I3=0.35, g=2.5, contour=0.3)
    errors = []
    for spin in (2.0, -2.0):
        for time in (3.0, 4.0, 2.0 * _AXIAL / 0.3, 7.0, 9.0):
            end = dry.advance(dry.state(spin=spin), None, time, 120)
            left = max(2.0 - 0.3 / _AXIAL * time, 0.0)
            way = 0.7 * math.copysign(0.5 * (2.0**2 - left**2) * _AXIAL / 0.3, spin)
            errors += [dry.contact_rate(end) - math.copysign(left, spin)]
            errors += [np.abs(dry.contact(end)) - [abs(way), 0.0]] if left else []
    return laws.max_abs(*errors)


@EULER.law(
    "advance of a disk that rolls upright with 1 / sqrt(1 + t / T)",
    bound=1e-12,
    why="kicks are exact: a hundred roundings",
)
def drag_slows_the_disk() -> float:
    """(C + m r^2) psi'' = -k psi'^3."""
    slowed = EulerDisk(m=1.2, radius=0.7, I1=0.21, I3=0.35, g=2.5, drag=0.02)
    end = slowed.advance(slowed.state(spin=[3.0, -3.0]), None, 4.0, 80)
    expected = 3.0 / math.sqrt(1.0 + 2.0 * 0.02 * 3.0**2 * 4.0 / _AXIAL)
    return laws.max_abs(slowed.contact_rate(end) - [expected, -expected])


laws.laws_of_every_system(EULER, _COIN, _Y_COIN, _U)


@EULER.law("rate of the energy with tau . omega + Q psi'", bound=1e-9, why=laws.AS_RHS)
def friction_takes_what_it_works() -> float:
    """E' = tau . omega + Q psi'."""
    motion = laws.stencil(_COIN, _Y_COIN, _U)
    power = np.sum(_torque(_Y_COIN, _U) * _COIN.omega_world(_Y_COIN), axis=-1)
    rate = motion.rate(_COIN.invariants(motion.y)["energy"])
    return laws.max_abs(rate - power - _friction(_Y_COIN)[1])


@EULER.law("simulate, rhs and contact_force with RollingDisk", bound=0.0, why="the same bits")
def without_friction_it_is_the_rolling_disk() -> float:
    """With contour = drag = 0."""
    free = EulerDisk(m=1.2, radius=0.7, I1=0.21, I3=0.35, g=2.5)
    t = np.linspace(0.0, 0.4, 5)
    motions = [disk.simulate(_Y, t, np.tile(_U, (4, 1, 1))).y for disk in (free, _DISK)]
    return laws.max_abs(
        motions[0] - motions[1],
        free.rhs(_Y, _U) - _DISK.rhs(_Y, _U),
        free.contact_force(_Y, _U) - _DISK.contact_force(_Y, _U),
    )


laws.law_of_order(EULER, _COIN, _Y_COIN, _U, 0.2)
laws.law_of_contact_force(
    EULER,
    *(_COIN, _Y_COIN, _U, _COIN_MODEL),
    lambda y, u: (_COIN.contact_force(y, u), -_arm(y)),
)
