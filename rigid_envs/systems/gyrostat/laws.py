"""Laws of a gyrostat: Newton's law, wheels that turn freely or are driven, what is conserved."""

import itertools
from dataclasses import replace

import numpy as np

from rigid_envs.mechanics import laws
from rigid_envs.mechanics.integration import Trajectory
from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.systems.gyrostat import closed_forms as theory
from rigid_envs.systems.gyrostat.system import Gyrostat

SUBJECT = laws.Subject("gyrostat", "a satellite with reaction wheels")

_SATELLITE = Gyrostat(1.1, 1.7, 2.3, J1=0.1, J2=0.25, J3=0.2)
_Y, _U = laws.random_states(_SATELLITE, 20)

_LOCKED = laws.RigidBodyModel(
    mass=1.0,
    moments=_SATELLITE.moments,
    centre=lambda y: np.zeros((*y.shape[:-1], 3)),
    force=laws.constant(0.0, 0.0, 0.0),
    torque=lambda y, u: np.einsum("...ij,...j->...i", laws.attitudes(y), u[..., 3:]),
    displacements=lambda y: (np.zeros((3, 1, 3)), laws.VIRTUAL_ROTATIONS),
)


@SUBJECT.law(
    "simulate with the momentum of all mass points",
    bound=1e-9,
    why="second differences in steps of 0.01 s: roundings 1e-14 / 1e-4, truncation 1e-11",
)
def momentum_changes_by_the_torque_on_the_carrier() -> float:
    """The rate of what the locked body has, and the wheels have more, is the torque: no motor's."""
    motion = laws.stencil(_SATELLITE, _Y, _U)
    more = _SATELLITE.wheel_moments * motion.y[..., 7:]
    wheels = motion.rate(np.einsum("...ij,...j->...i", laws.attitudes(motion.y), more))
    return laws.max_abs(laws.constraint_wrench(_LOCKED, motion)[1] + wheels)


@SUBJECT.law("simulate with J (omega + wheel)' = u", bound=1e-9, why=laws.AS_RHS)
def motors_turn_their_wheels() -> float:
    """A wheel is turned in space, about its axis, by its motor alone."""
    motion = laws.stencil(_SATELLITE, _Y, _U)
    omega = np.einsum("...ij,...i->...j", laws.attitudes(motion.middle), motion.omega())
    rates = motion.rate(motion.y[..., 4:7] + motion.y[..., 7:])
    torque = _SATELLITE.wheel_moments * rates
    return laws.max_abs(torque - _U[:, :3], motion.middle[..., 4:7] - omega)


laws.laws_of_every_system(SUBJECT, _SATELLITE, _Y, _U)


@SUBJECT.law("invariants with T, R L and l of NumPy", bound=1e-13, why=laws.ten_roundings(50))
def invariants_are_energy_and_momenta() -> float:
    """T and L of the locked body and what the wheels add, l = J (omega + wheel), at 20 states."""
    omega, wheels, found = _Y[:, 4:7], _Y[:, 7:], _SATELLITE.invariants(_Y)
    I, J = _SATELLITE.moments, _SATELLITE.wheel_moments  # noqa: E741
    momentum = omega * I + wheels * J
    L = np.einsum("nij,nj->ni", laws.attitudes(_Y), momentum)
    energy = 0.5 * np.sum(I * omega**2 + J * wheels**2, axis=-1) + np.sum(
        J * omega * wheels, axis=-1
    )
    return laws.max_abs(
        found["energy"] - energy,
        _SATELLITE.kinetic_energy(_Y) - energy,
        found["L_squared"] - np.sum(L * L, axis=-1),
        np.stack([found[f"L_world_{k}"] for k in "xyz"], axis=-1) - L,
        np.stack([found[f"spin_momentum{k}"] for k in "123"], axis=-1) - J * (omega + wheels),
    )


@SUBJECT.law("rate of the energy with tau . omega + u . wheel", bound=1e-9, why=laws.AS_RHS)
def torques_do_their_work() -> float:
    """T' = tau . omega + u . wheel: a motor works on the rate between carrier and wheel."""
    motion = laws.stencil(_SATELLITE, _Y, _U)
    power = np.sum(_U[:, 3:] * _Y[:, 4:7] + _U[:, :3] * _Y[:, 7:], axis=-1)
    return laws.max_abs(motion.rate(_SATELLITE.invariants(motion.y)["energy"]) - power)


laws.law_of_order(SUBJECT, _SATELLITE, _Y, _U)


@SUBJECT.law("simulate with a free body's, 5 s", bound=1e-9, why=laws.RADIANS)
def without_wheels_it_is_a_free_body() -> float:
    """J = 0: q and omega are those of a `FreeBody`, and the rates of no wheels stay."""
    lone, body, t = Gyrostat(1.1, 1.7, 2.3, 0.0, 0.0, 0.0), FreeBody(1.1, 1.7, 2.3), np.arange(6.0)
    found, free = (
        lone.simulate(_Y, t, np.stack(5 * [_U])).y,
        body.simulate(_Y[:, :7], t, np.stack(5 * [_U[:, 3:]])).y,
    )
    return laws.max_abs(found[..., :7] - free, found[..., 7:] - _Y[:, 7:])


@SUBJECT.law(
    "simulate with Volterra's solution, 20 s",
    bound=1e-8,
    why="1e-11 to 1e-10 per radian, some 100 radians",
)
def a_gyrostat_with_one_wheel_follows_volterra() -> float:
    """Rates of carrier and wheel, and the quaternion, its sign too: a wheel along each axis."""
    t, found = np.linspace(0.0, 20.0, 41), []
    for axis, row in itertools.product(range(3), _Y[:7]):
        J = np.where(np.arange(3) == axis, _SATELLITE.wheel_moments, 0.0)
        one, y = Gyrostat(*_SATELLITE.moments, *J), np.where(np.arange(10) < 7, row, 0.0)
        y[7 + axis] = row[7 + axis]
        given = _SATELLITE.moments, J, y[4:7], y[7 + axis]
        motion = one.simulate(y, t).y
        found += [
            motion[:, :4] - theory.attitude(t, *given, y[:4]),
            motion[:, 4:7] - theory.omega(t, *given),
            motion[:, 7 + axis] - theory.wheel_rate(t, *given),
        ]
    return laws.max_abs(*found)


@SUBJECT.law(
    "linearize with the growth of the theory",
    bound=1e-13,
    why="roundings of a matrix of norm 2",
)
def a_turning_wheel_makes_a_spin_stable_or_unstable() -> float:
    """Squares of the transverse eigenvalues about a spin about e3, at seven rates of its wheel."""
    one, spin = replace(_SATELLITE, J1=0.0, J2=0.0), 0.9
    rates = np.linspace(-10.0, 4.0, 7)
    wheels = np.multiply.outer(rates, [0.0, 0.0, 1.0])
    A, _ = one.linearize(one.state(omega_body=[0.0, 0.0, spin], wheel_rates=wheels))
    across = A[:, 4:6, 4:6]  # of omega1 and omega2, which turn into one another
    given = one.moments, one.wheel_moments, spin
    growth = np.array([theory.transverse_growth(*given, rate) for rate in rates])
    return laws.max_abs(across @ across - growth[:, None, None] * np.eye(2))


def _long_run() -> Trajectory:
    """A satellite with turning wheels, at 5001 times of 5000 s."""
    start = _SATELLITE.state(omega_body=(0.1, 0.5, 0.2), wheel_rates=(1.0, -0.6, 1.5))
    return _SATELLITE.simulate(start, np.linspace(0.0, 5000.0, 5001), max_step=0.05)


@SUBJECT.law(
    "advance for 100 rad with uniform rotation",
    bound=1e-11,
    why="a thousand steps of 20 turns: 2e4 roundings of the angle, in a random walk or not",
)
def spins_about_the_axes_of_wheels_are_exact() -> float:
    """R = exp(t [omega]), in steps at which the neglected term of the tangent is a rounding."""
    spins = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]])
    start = _SATELLITE.state(omega_body=spins, wheel_rates=-3.0 * spins)
    end = _SATELLITE.advance(start, None, 100.0, 1000)
    half = 50.0 * spins
    exact = np.concatenate([np.cos(half.sum(axis=-1, keepdims=True)), np.sin(half)], axis=-1)
    return laws.max_abs(laws.quaternion(end) - exact, end[:, 4:] - start[:, 4:])


@SUBJECT.law(
    "L in space and l with their start, a hundred thousand steps", bound=1e-11, why=laws.LONG_RUN
)
def momenta_are_kept() -> float:
    """L_world and the spin momenta without torques."""
    motion = _long_run()
    L, spins = motion["L_world"], motion["spin_momenta"]
    return laws.max_abs(L - L[0], spins - spins[0], np.linalg.norm(motion["q"], axis=-1) - 1.0)


@SUBJECT.law(
    "energy with its start, a hundred thousand steps",
    bound=2e-9,
    why="bounded for ever by some (rate x step)^4: at most 2e-9 at this step",
)
def energy_goes_nowhere() -> float:
    """Energy without torques, relative."""
    energy = _long_run().invariants["energy"]
    return laws.max_abs(energy / energy[0] - 1.0)
