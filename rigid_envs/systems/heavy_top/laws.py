"""Laws of a heavy top, symmetric or not, on a fixed or moving pivot."""

import math

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import laws, rotations
from rigid_envs.systems.heavy_top import closed_forms as theory
from rigid_envs.systems.heavy_top.system import HeavyTop

SUBJECT = laws.Subject("heavy_top", "a top in gravity, under torques, on a pivot that moves")

_TOP = HeavyTop(1.3, 1.1, 0.6, m=0.8, g=9.5, ell=0.13)
_Y, _U = laws.random_states(_TOP, 20)
_SYMMETRIC = HeavyTop(1.2, 1.2, 0.5, m=0.9, g=9.6, ell=0.14)  # symmetric: has closed forms
_PARAMETERS = {"i_perp": 1.2, "i3": 0.5, "mgl": 0.9 * 9.6 * 0.14}
_BODY_TORQUE, _WORLD_TORQUE, _PIVOT_ACCELERATION = slice(0, 3), slice(3, 6), slice(6, 8)  # of u
_LONG = np.linspace(0.0, 5000.0, 5001)


def _arm(y: Array) -> Array:
    """From the pivot to the centre of mass."""
    return _TOP.ell * laws.axis(y)


def _centre(y: Array) -> Array:
    return laws.horizontal(_TOP.pivot(y)) + _arm(y)


def _torque(y: Array, u: Array) -> Array:
    in_world = np.einsum("...ij,...j->...i", laws.attitudes(y), u[..., _BODY_TORQUE])
    return np.asarray(in_world + u[..., _WORLD_TORQUE])


_STEINER = _TOP.m * _TOP.ell**2 * np.array([1.0, 1.0, 0.0])
_WEIGHS, _TURNS = laws.constant(0.0, 0.0, -_TOP.m * _TOP.g), laws.turns_about(_arm)
_MODEL = laws.RigidBodyModel(_TOP.m, _TOP.moments - _STEINER, _centre, _WEIGHS, _torque, _TURNS)
laws.law_of_dalembert(SUBJECT, _TOP, _Y, _U, _MODEL)
laws.laws_of_every_system(SUBJECT, _TOP, _Y, _U)


def _leaning(theta: float, omega: tuple[float, float, float]) -> Array:
    q = (math.cos(0.5 * theta), math.sin(0.5 * theta), 0.0, 0.0)
    return _SYMMETRIC.state(q=q, omega_body=omega)


@SUBJECT.law("invariants with T + m g z and R L of NumPy", bound=1e-13, why=laws.ten_roundings(10))
def invariants_are_energy_and_momenta() -> float:
    """E = omega . I omega / 2 + m g ell e3_z, L_z, L_3 and the velocity of the pivot."""
    omega, found = _TOP.omega_body(_Y), _TOP.invariants(_Y)
    momentum = omega @ np.diag(_TOP.moments)
    L = np.einsum("nij,nj->ni", laws.attitudes(_Y), momentum)
    height = _arm(_Y)[:, 2]
    return laws.max_abs(
        found["energy"] - 0.5 * np.sum(momentum * omega, axis=-1) - _TOP.m * _TOP.g * height,
        found["L_vertical"] - L[:, 2],
        found["L_spin"] - momentum[:, 2],
        np.stack([found[f"pivot_velocity_{k}"] for k in "xy"], axis=-1) - _TOP.pivot_velocity(_Y),
    )


@SUBJECT.law("rates of the invariants with the power and the torques", bound=1e-9, why=laws.AS_RHS)
def inputs_do_their_work() -> float:
    """E' = (tau + ell e3 x (-m a)) . omega, and L_z' is the vertical part of the torque."""
    motion = laws.stencil(_TOP, _Y, _U)
    found = _TOP.invariants(motion.y)
    inertial = laws.horizontal(-_TOP.m * _U[:, _PIVOT_ACCELERATION])
    torque = _torque(_Y, _U) + np.cross(_arm(_Y), inertial)
    power = np.sum(torque * _TOP.omega_world(_Y), axis=-1)
    return laws.max_abs(
        motion.rate(found["energy"]) - power, motion.rate(found["L_vertical"]) - torque[:, 2]
    )


@SUBJECT.law("simulate with uniform acceleration", bound=1e-12, why=laws.HUNDREDS)
def the_pivot_moves_as_it_is_told() -> float:
    """X = X0 + V t + a t^2 / 2 and V' = a, whatever the body does."""
    t, a, v = 0.7, _U[:, _PIVOT_ACCELERATION], _TOP.pivot_velocity(_Y)
    end = _TOP.simulate(_Y, [0.0, t], _U[None]).y[-1]
    pivot = _TOP.pivot(_Y) + t * v + 0.5 * t * t * a
    return laws.max_abs(_TOP.pivot(end) - pivot, _TOP.pivot_velocity(end) - v - t * a)


laws.law_of_order(SUBJECT, _TOP, _Y, _U)


@SUBJECT.law(
    "simulate with Newton's law in world axes, by DOP853",
    bound=1e-8,
    why="1e-11 per radian, some 20 radians, and what the motion makes of it; DOP853: 1e-12",
)
def random_inputs_act_as_newton_says() -> float:
    """50 inputs, each held for 0.1 s: torques in both frames, weight, inertial force."""
    inputs = np.random.default_rng(2).uniform(-1.0, 1.0, (50, 8))

    def torque(R: Array, u: Array) -> Array:
        force = _TOP.m * np.array([*-u[_PIVOT_ACCELERATION], -_TOP.g])
        torque = R @ u[_BODY_TORQUE] + u[_WORLD_TORQUE]
        return np.asarray(torque + np.cross(_TOP.ell * R[:, 2], force))

    R, omega = laws.integrate_newton(
        *(_TOP.moments, laws.attitudes(_Y[0]), _TOP.omega_body(_Y[0])), *(0.1, inputs, torque)
    )
    motion = _TOP.simulate(_Y[0], 0.1 * np.arange(51), inputs)
    return laws.max_abs(motion["R"][1:] - R, motion["omega_body"][1:] - omega)


@SUBJECT.law(
    "simulate with elliptic functions, 6 s",
    bound=1e-8,
    why="1e-11 per radian, some 30 radians, and what the motion makes of it",
)
def nutation_follows_its_closed_form() -> float:
    """The tilt of 20 starts, upright and hanging ones among them."""
    rng, t = np.random.default_rng(3), np.linspace(0.0, 6.0, 25)
    errors = []
    for theta in np.linspace(0.0, math.pi, 20):
        y = _leaning(theta, tuple(rng.normal(size=3) * [1.0, 1.0, 4.0]))
        errors.append(
            _SYMMETRIC.simulate(y, t)["tilt"]
            - theory.tilt(t, _SYMMETRIC.omega_body(y), laws.quaternion(y), **_PARAMETERS)
        )
    return laws.max_abs(*errors)


@SUBJECT.law(
    "simulate with I theta'^2 / 2 + V(theta)",
    bound=1e-10,
    why="1e-11 per radian; the potential is steep near the vertical",
)
def the_tilt_moves_in_its_effective_potential() -> float:
    """The energy of the tilt is E - (I3 omega3)^2 / (2 I3), with theta' from omega."""
    y = _leaning(0.9, (0.4, -0.7, 2.5))
    motion = _SYMMETRIC.simulate(y, np.linspace(0.0, 10.0, 101))
    omega, gamma = motion["omega_body"], motion["gamma"]
    # theta' = -(cos theta)' / sin theta, with gamma' = gamma x omega
    rate = np.cross(omega, gamma)[:, 2] / np.sin(motion["tilt"])
    p_phi, p_psi = motion["L_world"][0, 2], 0.5 * _SYMMETRIC.omega_body(y)[2]
    mgl, i_perp = _PARAMETERS["mgl"], _PARAMETERS["i_perp"]
    potential = theory.effective_potential(motion["tilt"], p_phi, p_psi, i_perp=i_perp, mgl=mgl)
    expected = motion["energy"][0] - p_psi**2 / (2.0 * 0.5)
    return laws.max_abs(0.5 * i_perp * rate**2 + potential - expected)


@SUBJECT.law(
    "simulate with both roots of the theory",
    bound=1e-8,
    why="1e-11 per radian, some 60 radians; the fast precession multiplies by ten",
)
def steady_precession_is_steady() -> float:
    """I cos(theta) phi'^2 - I3 omega3 phi' + m g ell = 0: the axis goes round at that rate."""
    t, errors = np.linspace(0.0, 8.0, 17), []
    for theta in (0.4, 1.3, 2.2):
        for root in theory.steady_precession(theta, 7.0, **_PARAMETERS):
            rate = float(root)
            motion = _SYMMETRIC.simulate(_leaning(theta, (0.0, rate * math.sin(theta), 7.0)), t)
            across = math.sin(theta) * np.stack([np.sin(rate * t), -np.cos(rate * t)], axis=-1)
            errors += [motion["tilt"] - theta, motion["R"][:, :2, 2] - across]
    return laws.max_abs(*errors)


@SUBJECT.law(
    "eigenvalues of linearize with the exponents of the sleeping top",
    bound=1e-13,
    why="roundings of a matrix of norm 5",
)
def upright_tops_sleep_or_fall_at_their_exponents() -> float:
    """Seen from a frame that spins with the top, below and above the threshold."""
    errors = []
    for spin in (0.0, 1.5, 9.0):
        A, _ = _SYMMETRIC.linearize(_SYMMETRIC.state(omega_body=(0.0, 0.0, spin)))
        turn = 0.5 * spin * np.array([[0.0, 1.0], [-1.0, 0.0]])  # of (x, y) in q (0, spin e3) / 2
        kept = A[np.ix_([1, 2, 4, 5], [1, 2, 4, 5])]
        kept[:2, :2] += turn
        found = np.linalg.eigvals(kept)
        for exponent in theory.sleeping_exponents(spin, **_PARAMETERS):
            errors.append(np.min(np.abs(found - (exponent - 1j * spin))))
    return laws.max_abs(*errors)


@SUBJECT.law(
    "simulate with the homoclinic motion",
    bound=1e-8,
    why="1e-11 per radian, growing by exp(5) on the way up to the unstable upright state",
)
def a_falling_top_returns_to_upright() -> float:
    """sin(theta / 2) = sqrt(1 - c) sech(lambda t), five e-folds from its largest tilt."""
    spin = 2.0
    growth = theory.sleeping_exponents(spin, **_PARAMETERS)[0].real
    t = np.linspace(0.0, 5.0 / growth, 11)
    tilt = theory.homoclinic_tilt(t, spin, **_PARAMETERS)
    start = float(tilt[0])
    # p_phi = p_psi: phi' = I3 omega3 / (I (1 + cos theta))
    precession = 0.5 * spin / 1.2 / (1.0 + math.cos(start))
    y = _leaning(start, (0.0, precession * math.sin(start), spin))
    return laws.max_abs(_SYMMETRIC.simulate(y, t)["tilt"] - tilt)


@SUBJECT.law(
    "simulate on an accelerated pivot with a tilted world",
    bound=1e-10,
    why="the same steps but for roundings, which grow by exp(6) or so in 3 s",
)
def an_accelerated_pivot_is_a_tilted_gravity() -> float:
    """In the pivot's frame gravity is (-aX, -aY, -g): that world, turned upright again."""
    a, b = 3.0, -4.0
    size = math.hypot(_TOP.g, 5.0)
    heavier = HeavyTop(1.3, 1.1, 0.6, m=0.8, g=size, ell=0.13)
    # the turn that takes (a, b, g) to the vertical: about (b, -a, 0)
    angle = math.atan2(5.0, _TOP.g)
    upright = rotations.quaternion_from_axis_angle([0.2 * b, -0.2 * a, 0.0], angle)
    t = np.linspace(0.0, 3.0, 4)
    u = np.array([0.0] * 6 + [a, b])
    pushed = _TOP.simulate(_Y, t, u, max_step=0.02)
    y = heavier.state(
        q=rotations.multiply(upright, laws.quaternion(_Y)), omega_body=_TOP.omega_body(_Y)
    )
    tilted = heavier.simulate(y, t, max_step=0.02)
    turned = laws.matrices(upright) @ pushed["R"]
    return laws.max_abs(pushed["omega_body"] - tilted["omega_body"], turned - tilted["R"])


@SUBJECT.law("momenta with their start, a hundred thousand steps", bound=1e-11, why=laws.LONG_RUN)
def momenta_are_kept() -> float:
    """L_z and, of a symmetric top, L_3, without input."""
    motion = _SYMMETRIC.simulate(_leaning(0.5, (0.3, -0.2, 2.0)), _LONG, max_step=0.05)
    found = motion.invariants
    return laws.max_abs(*(found[k] - found[k][0] for k in ("L_vertical", "L_spin")))


@SUBJECT.law(
    "energy with its start, a hundred thousand steps",
    bound=1e-6,
    why="0.2 (rate x step)^4 with rate x step of 0.05: bounded for ever",
)
def energy_goes_nowhere() -> float:
    """Energy without input [J], of a symmetric and of an asymmetric top."""
    errors = []
    for top in (_SYMMETRIC, _TOP):
        motion = top.simulate(_leaning(0.5, (0.3, -0.2, 2.0)), _LONG, max_step=0.05)
        errors.append(motion.invariants["energy"] - motion.invariants["energy"][0])
    return laws.max_abs(*errors)
