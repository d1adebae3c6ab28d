"""Balancing heavy tops."""

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.analytic.heavy_top import steady_precession
from rigid_envs.systems import HeavyTop
from rigid_envs.tasks import PivotTop, SleepingTop, TopPrecession, TopRandom
from tests.tasks.controllers.linear import lqr, scheduled, step_jacobian

__all__ = ["balance", "balance_asymmetric", "balance_by_pivot", "precess"]

Array = npt.NDArray[np.float64]
Law = Callable[[Array], Array]
_E_Z = np.array([0.0, 0.0, 1.0])


def axis_state(x: Array, spin: Array | float) -> Array:
    """State of a top from its axis: x = (e, e', pivot, pivot velocity), horizontal parts.

    With the axis e in the world, ``omega = e x e' + spin e``. The phase about e is the one that a
    turn straight from the vertical gives.

    Args:
        x: shape (..., 8); e and e' [rad, rad/s], pivot [m, m/s].
        spin: omega3 [rad/s].

    Returns:
        y, shape (..., 11).
    """
    e = np.stack([x[..., 0], x[..., 1], np.sqrt(1.0 - x[..., 0] ** 2 - x[..., 1] ** 2)], axis=-1)
    fall = -np.sum(x[..., 0:2] * x[..., 2:4], axis=-1) / e[..., 2]
    rate = np.concatenate([x[..., 2:4], fall[..., None]], axis=-1)
    q = np.stack([1.0 + e[..., 2], -e[..., 1], e[..., 0], 0.0 * e[..., 0]], axis=-1)
    q /= np.linalg.norm(q, axis=-1, keepdims=True)
    omega = rotations.rotate_inverse(q, np.cross(e, rate)) + spin * _E_Z
    return np.concatenate([q, omega, x[..., 4:8]], axis=-1)


def axis_of(y: Array) -> Array:
    """The inverse of `axis_state`: horizontal parts of e and e', pivot and its velocity."""
    e = rotations.rotate(y[..., :4], _E_Z)
    rate = np.cross(rotations.rotate(y[..., :4], y[..., 4:7]), e)
    return np.concatenate([e[..., :2], rate[..., :2], y[..., 7:11]], axis=-1)


def balance(task: SleepingTop) -> Law:
    """LQR of the upright top under horizontal torque, for every spin it may have.

    In complex numbers, with e = e_x + i e_y, ``I1 e'' - i I3 omega3 e' - m g ell e = -i tau``.

    Args:
        task: the task; the middle of its ranges counts.

    Returns:
        Actions (N, 2) as a function of states (N, 11).

    Source: Goldstein, Poole & Safko, *Classical Mechanics*, section 5.7.
    """
    weights = np.array([1.0, 1.0, 1.0, 1.0]), np.array([1.0, 1.0])
    return _scheduled_on_spin(task, slice(3, 5), 4, weights, task.torque)


def balance_by_pivot(task: PivotTop) -> Law:
    """LQR of the upright top whose pivot is accelerated, for every spin it may have.

    In complex numbers ``I1 e'' - i I3 omega3 e' - m g ell e = -m ell a`` and ``X'' = a``.

    Args:
        task: the task; the middle of its ranges counts.

    Returns:
        Actions (N, 2) as a function of states (N, 11).
    """
    weights = np.array([1.0, 1.0, 1.0, 1.0, 0.02, 0.02, 0.02, 0.02]), np.array([0.1, 0.1])
    return _scheduled_on_spin(task, slice(6, 8), 8, weights, task.push)


def _scheduled_on_spin(
    task: Any, inputs: slice, n: int, weights: tuple[Array, Array], largest: float
) -> Law:
    """LQR of the first n entries of `axis_of`, by two of the inputs."""
    top = task.system()
    assert isinstance(top, HeavyTop)

    def gain(spin: float) -> Array:
        def advance(x: Array, u: Array) -> Array:
            whole = np.concatenate([x, np.zeros((len(x), 8 - n))], axis=-1)
            held = np.zeros((len(x), 8))
            held[:, inputs] = u
            y = top.advance(axis_state(whole, spin), held, task.dt, task.n_substeps)
            return axis_of(y)[:, :n]

        return lqr(*step_jacobian(advance, np.zeros(n), 2), *weights)

    look_up = scheduled(gain, top.critical_spin * np.linspace(0.0, 1.2, 13))
    return lambda y: (
        -np.einsum("...ij,...j->...i", look_up(y[..., 6]), axis_of(y)[..., :n]) / (largest)
    )


def precess(task: TopPrecession) -> Callable[[Array, Array], Array]:
    """LQR of the steady precession at a tilt, on the task's branch, for every spin.

    The state is (theta - goal, theta', phi' - Omega), the torque is given along the radius n that
    points up and along l = e3 x n, and then in body axes. On a steady root it is zero.

    Returns:
        Actions (N, 2) as a function of states (N, 11) and commanded tilts (N,).

    Source: Goldstein, Poole & Safko, *Classical Mechanics*, section 5.7.
    """
    top = task.system()
    assert isinstance(top, HeavyTop)
    moments = {"i_perp": top.I1, "i3": top.I3, "mgl": top.m * top.g * top.ell}
    branch = 1 if task.branch == "fast" else 0

    def gain(goal: float, spin: float) -> Array:
        steady = np.array([goal, 0.0, steady_precession(goal, spin, **moments)[branch]])

        def advance(x: Array, u: Array) -> Array:
            y = nutating(x, spin)
            held = np.zeros((len(x), 8))
            held[:, :2] = in_body(y, u)
            return nutation_of(top.advance(y, held, task.dt, task.n_substeps))

        weights = np.array([100.0, 10.0, 10.0]), np.array([10.0, 10.0])
        return lqr(*step_jacobian(advance, steady, 2), *weights)

    spins = top.critical_spin * np.linspace(1.0, task.start_spin + task.start_spread, 6)
    goals = np.linspace(task.goal_tilt, task.goal_tilt + max(task.goal_spread, 1e-3), 6)
    look_up = scheduled(gain, goals, spins)

    def law(y: Array, goal: Array) -> Array:
        steady = steady_precession(goal, y[..., 6], **moments)[branch]
        error = nutation_of(y) - np.stack([goal, 0.0 * goal, steady], axis=-1)
        torque = -np.einsum("...ij,...j->...i", look_up(goal, y[..., 6]), error)
        return in_body(y, torque) / task.torque

    return law


def nutating(x: Array, spin: float) -> Array:
    """State of a top of this spin from x = (theta, theta', phi'); phi = psi = 0."""
    zero = np.zeros(x.shape[:-1])
    angles = np.stack([zero, x[..., 0], zero], axis=-1)
    rates = np.stack([x[..., 2], x[..., 1], spin - x[..., 2] * np.cos(x[..., 0])], axis=-1)
    omega = rotations.omega_body_from_euler_rates(angles, rates)
    y = [rotations.quaternion_from_euler(angles), omega, np.zeros((*zero.shape, 4))]
    return np.concatenate(y, axis=-1)


def nutation_of(y: Array) -> Array:
    """The inverse of `nutating`: (theta, theta', phi')."""
    n, sine, cosine = _up(y)
    across = y[..., 4:6]
    rate = np.sum(across * n, axis=-1) / sine
    fall = across[..., 0] * n[..., 1] - across[..., 1] * n[..., 0]
    return np.stack([np.arctan2(sine, cosine), fall, rate], axis=-1)


def in_body(y: Array, u: Array) -> Array:
    """Components along e1 and e2 of a vector ``u[0] n + u[1] l``, l = e3 x n."""
    n, _, _ = _up(y)
    ahead = np.stack([-n[..., 1], n[..., 0]], axis=-1)
    return u[..., :1] * n + u[..., 1:] * ahead


def _up(y: Array) -> tuple[Array, Array, Array]:
    """Direction of the vertical across e3, (n1, n2) in body axes, and sin and cos of theta."""
    G = rotations.rotate_inverse(y[..., :4], _E_Z)
    sine = np.maximum(np.hypot(G[..., 0], G[..., 1]), 1e-9)
    return G[..., :2] / sine[..., None], sine, G[..., 2]


def balance_asymmetric(task: TopRandom) -> Law:
    """LQR of an upright asymmetric top that turns about e3, for every such rate.

    In body axes, with the vertical G = R^T e_z: ``G' = G x omega`` and Euler's equations with the
    torque of gravity m g ell (G2, -G1, 0) are linear in (G1, G2, omega1, omega2), with constant
    coefficients while omega3 is constant. The torque about e3 is left alone.

    Args:
        task: the task; the middle of its ranges counts.

    Returns:
        Actions (N, 3) as a function of states (N, 11).

    Source: Goldstein, Poole & Safko, *Classical Mechanics*, sections 5.5 and 5.7.
    """
    top = task.system()

    def gain(spin: float) -> Array:
        def advance(x: Array, u: Array) -> Array:
            held = np.concatenate([u, np.zeros((len(u), 6))], axis=-1)
            y = leaning(x, spin)
            return vertical_of(top.advance(y, held, task.dt, task.n_substeps))

        return lqr(*step_jacobian(advance, np.zeros(4), 2), np.ones(4), np.ones(2))

    look_up = scheduled(gain, 1.5 * task.start_spin * np.linspace(-1.0, 1.0, 25))

    def law(y: Array) -> Array:
        torque = -np.einsum("...ij,...j->...i", look_up(y[..., 6]), vertical_of(y))
        return np.concatenate([torque, 0.0 * torque[..., :1]], axis=-1) / task.torque

    return law


def leaning(x: Array, spin: float) -> Array:
    """State of a top from x = (G1, G2, omega1, omega2) and omega3, turned straight from upright."""
    G3 = np.sqrt(1.0 - x[..., 0] ** 2 - x[..., 1] ** 2)
    q = np.stack([1.0 + G3, x[..., 1], -x[..., 0], 0.0 * G3], axis=-1)
    q /= np.linalg.norm(q, axis=-1, keepdims=True)
    rest = np.zeros((*G3.shape, 5))
    rest[..., 0] = spin
    return np.concatenate([q, x[..., 2:4], rest], axis=-1)


def vertical_of(y: Array) -> Array:
    """The inverse of `leaning`: (G1, G2, omega1, omega2)."""
    G = rotations.rotate_inverse(y[..., :4], _E_Z)
    return np.concatenate([G[..., :2], y[..., 4:6]], axis=-1)
