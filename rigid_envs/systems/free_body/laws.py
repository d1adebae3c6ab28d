"""Laws of a rigid body without torque or under body torques."""

import numpy as np

from rigid_envs.mechanics import laws
from rigid_envs.mechanics.integration import Trajectory
from rigid_envs.systems.free_body import closed_forms as theory
from rigid_envs.systems.free_body.system import FreeBody

SUBJECT = laws.Subject("free_body", "a rigid body under body torques")

_BODY = FreeBody(1.1, 1.7, 2.3)
_Y, _U = laws.random_states(_BODY, 20)


def _long_run() -> Trajectory:
    """A body that starts beside its unstable axis, at 5001 times of 5000 s."""
    body = FreeBody(1.0, 2.0, 3.0)
    start = body.state(omega_body=(0.01, 1.0, 0.01))
    return body.simulate(start, np.linspace(0.0, 5000.0, 5001), max_step=0.05)


_MODEL = laws.RigidBodyModel(
    mass=1.0,
    moments=_BODY.moments,
    centre=lambda y: np.zeros((*y.shape[:-1], 3)),
    force=laws.constant(0.0, 0.0, 0.0),
    torque=lambda y, u: np.einsum("...ij,...j->...i", laws.attitudes(y), u),
    displacements=lambda y: (np.zeros((3, 1, 3)), laws.VIRTUAL_ROTATIONS),
)
laws.law_of_dalembert(SUBJECT, _BODY, _Y, _U, _MODEL)
laws.laws_of_every_system(SUBJECT, _BODY, _Y, _U)


@SUBJECT.law("invariants with T, L^2 and R L of NumPy", bound=1e-13, why=laws.ten_roundings(50))
def invariants_are_energy_and_momentum() -> float:
    """T = omega . I omega / 2, L = R I omega, at 20 states."""
    omega, found = _BODY.omega_body(_Y), _BODY.invariants(_Y)
    momentum = omega @ np.diag(_BODY.moments)
    L = np.einsum("nij,nj->ni", laws.attitudes(_Y), momentum)
    return laws.max_abs(
        found["energy"] - 0.5 * np.sum(momentum * omega, axis=-1),
        found["L_squared"] - np.sum(L * L, axis=-1),
        np.stack([found[f"L_world_{k}"] for k in "xyz"], axis=-1) - L,
    )


@SUBJECT.law("rate of the energy invariant with tau . omega", bound=1e-9, why=laws.AS_RHS)
def torque_does_its_work() -> float:
    """T' = tau . omega along simulated motions."""
    motion = laws.stencil(_BODY, _Y, _U)
    power = np.sum(_U * _BODY.omega_body(_Y), axis=-1)
    return laws.max_abs(motion.rate(_BODY.invariants(motion.y)["energy"]) - power)


laws.law_of_order(SUBJECT, _BODY, _Y, _U)


@SUBJECT.law(
    "eigenvalues of linearize with the rates of the theory",
    bound=1e-13,
    why="roundings of a matrix of norm 2",
)
def small_departures_grow_or_oscillate_at_their_rates() -> float:
    """Growth about the intermediate axis, oscillations about the two others."""
    moments, spin = _BODY.moments, 1.5
    A, _ = _BODY.linearize(_BODY.state(omega_body=spin * np.eye(3)))
    about = np.linalg.eigvals(A[:, 4:, 4:])
    slow, fast = theory.oscillation_rates(moments, spin)
    return laws.max_abs(
        np.max(about[1].real) - theory.growth_rate(moments, spin),
        np.max(about[0].imag) - slow,
        np.max(about[2].imag) - fast,
    )


@SUBJECT.law(
    "advance for 100 rad with uniform rotation",
    bound=1e-11,
    why="a thousand steps of 20 turns: 2e4 roundings of the angle, in a random walk or not",
)
def spins_about_e2_and_e3_are_exact() -> float:
    """R = exp(t [omega]), in steps at which the neglected term of the tangent is a rounding."""
    spins = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    end = _BODY.advance(_BODY.state(omega_body=spins), None, 100.0, 1000)
    half = 50.0 * spins
    exact = np.concatenate([np.cos(half.sum(axis=-1, keepdims=True)), np.sin(half)], axis=-1)
    return laws.max_abs(laws.quaternion(end) - exact, _BODY.omega_body(end) - spins)


@SUBJECT.law(
    "simulate with Jacobi's elliptic functions, 20 s",
    bound=1e-8,
    why="1e-11 to 1e-10 per radian, some 100 radians",
)
def free_motion_follows_jacobi() -> float:
    """Rates in the body and quaternions, their sign too, of 20 starts."""
    t = np.linspace(0.0, 20.0, 41)
    motion = _BODY.simulate(_Y, t)
    closed = [
        np.concatenate(
            [
                theory.attitude(t, _BODY.moments, _BODY.omega_body(y), laws.quaternion(y)),
                theory.omega(t, _BODY.moments, _BODY.omega_body(y)),
            ],
            axis=-1,
        )
        for y in _Y
    ]
    return laws.max_abs(motion.y - np.stack(closed, axis=1))


@SUBJECT.law(
    "simulate with the flip interval 2 K / p",
    bound=1e-8,
    why="1e-11 per radian, 200 radians, beside an unstable axis",
)
def a_racket_flips_at_its_interval() -> float:
    """Spun about e2 with a push of 0.01 rad/s: ten flips, at each omega2 turns round."""
    body, omega = FreeBody(1.0, 2.0, 3.0), np.array([0.01, 1.0, 0.01])
    interval = theory.polhode(body.moments, omega).flip_interval
    motion = body.simulate(body.state(omega_body=omega), interval * np.arange(11))
    signs = (-1.0) ** np.arange(11)
    return laws.max_abs(motion["omega_body"][:, 1] - signs, np.abs(motion["omega_body"]) - omega)


@SUBJECT.law("simulate with the two cones of a symmetric body", bound=1e-9, why=laws.RADIANS)
def a_symmetric_body_moves_on_cones() -> float:
    """In the body omega goes round e3, and in space e3 goes round L."""
    body, omega = FreeBody(1.4, 1.4, 0.9), np.array([0.7, -0.4, 1.3])
    t = np.linspace(0.0, 20.0, 21)
    in_body, in_space = theory.symmetric_rates(body.moments, omega)
    motion = body.simulate(body.state(omega_body=omega), t)
    phase = np.exp(1j * in_body * t) * (omega[0] + 1j * omega[1])
    L = motion["L_world"][0] / np.linalg.norm(motion["L_world"][0])
    along = L[2] * L
    across, beside = np.array([0.0, 0.0, 1.0]) - along, np.cross(L, [0.0, 0.0, 1.0])
    turned = np.outer(np.cos(in_space * t), across) + np.outer(np.sin(in_space * t), beside)
    return laws.max_abs(
        motion["omega_body"] - np.stack([phase.real, phase.imag, 0.0 * t + omega[2]], axis=-1),
        motion["R"][:, :, 2] - (along + turned),
    )


@SUBJECT.law(
    "simulate with Newton's law in world axes, by DOP853",
    bound=1e-8,
    why="as against Jacobi; DOP853: 1e-12 per step",
)
def random_torques_act_as_newton_says() -> float:
    """50 torques, each held for 0.1 s."""
    torques = np.random.default_rng(1).uniform(-1.0, 1.0, (50, 3))
    R, omega = laws.integrate_newton(
        *(_BODY.moments, laws.attitudes(_Y[0]), _BODY.omega_body(_Y[0])),
        *(0.1, torques, lambda R, u: R @ u),
    )
    motion = _BODY.simulate(_Y[0], 0.1 * np.arange(51), torques)
    return laws.max_abs(motion["R"][1:] - R, motion["omega_body"][1:] - omega)


@SUBJECT.law("L in space with its start, a hundred thousand steps", bound=1e-11, why=laws.LONG_RUN)
def momentum_in_space_is_kept() -> float:
    """L_world and the length of the quaternion without torque."""
    motion = _long_run()
    L = motion["L_world"]
    return laws.max_abs(L - L[0], np.linalg.norm(motion["q"], axis=-1) - 1.0)


@SUBJECT.law(
    "energy with its start, a hundred thousand steps",
    bound=2e-9,
    why="bounded for ever by some (rate x step)^4: at most 2e-9 at this step",
)
def energy_goes_nowhere() -> float:
    """Kinetic energy without torque, relative."""
    energy = _long_run().invariants["energy"]
    return laws.max_abs(energy / energy[0] - 1.0)
