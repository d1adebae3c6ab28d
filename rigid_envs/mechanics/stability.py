"""Lyapunov exponents and Poincare sections of motions without closed form."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, positive, require
from rigid_envs.mechanics.events import EventFunction, checked_events
from rigid_envs.mechanics.integration import Input
from rigid_envs.mechanics.system import System

_TURN = 1.0 / 16.0  # rad of the fastest rate in a step of the linearised equations
_BETWEEN = 16  # steps between two orthogonalisations: a growth of e at most, typically
_CHUNK = 4096  # steps whose Jacobians are kept at once


def lyapunov_exponents(
    system: System, y0: npt.ArrayLike, duration: float, u: npt.ArrayLike | None = None
) -> Array:
    """Mean rates at which neighbouring motions separate along a motion, the largest first.

    Benettin's method: orthonormal departures from the motion obey d' = A(y(t)) d with the Jacobian
    A of `linearize`; a QR decomposition every second radian keeps them apart, and the logarithms
    of the diagonal of R add up. Departures are those of states: the one along the unit quaternion,
    which is none, is left out. The motion is that of `simulate`, the departures are integrated by
    the classical Runge-Kutta method of fourth order.

    They converge slowly: a motion that is not chaotic has exponents near ln(T) / T after a time T.
    Compare two durations.

    Args:
        system: any.
        y0: state at t = 0, shape (n_state,).
        duration: T [s].
        u: input that is held, shape (n_input,); zero if left out.

    Returns:
        Exponents [1/s], shape (n_state,), or (n_state - 1,) where a quaternion is part of y.

    Raises:
        ValueError: bad shapes or numbers, as `simulate`.

    Source:
        Benettin, Galgani, Giorgilli & Strelcyn 1980, Meccanica 15:9 and 15:21,
        doi:10.1007/BF02128236, doi:10.1007/BF02128237.
    """
    y, time = system.checked_state(y0), positive(duration, "duration", "s")
    require(y.ndim == 1, list(y.shape), "shape of y0", "one state")
    basis, now = _tangent(system, y), 0.0
    logs = np.zeros(basis.shape[1])
    while now < time:
        y, basis, grown, span = _stretched(system, y, basis, u, time - now)
        logs, now = logs + grown, now + span
    return np.asarray(np.sort(logs / time)[::-1])


def poincare_section(
    system: System,
    y0: npt.ArrayLike,
    section: EventFunction,
    duration: float,
    u: Input | None = None,
) -> tuple[Array, Array]:
    """Times and states at which a motion passes a section, in the direction of the event.

    Args:
        system: any.
        y0: state at t = 0, shape (n_state,).
        section: function g(t, y) that is 0 on the section, as `crossing` makes them.
        duration: of the motion [s].
        u: input as of `simulate`: none, a row held for ever or a function of time.

    Returns:
        Times [s], (K,), exact to rounding, and states, (K, n_state).

    Raises:
        ValueError: bad shapes or numbers, as `simulate`; a motion that ends by itself.
    """
    event = dataclasses.replace(checked_events(section)[0], terminal=False)
    times = [0.0, positive(duration, "duration", "s")]
    motion = system.simulate(y0, times, u, events=event)
    require(motion.status == 0, motion.message, "motion", "one that lasts for the duration")
    return motion.t_events[0], motion.y_events[0]


def _tangent(system: System, y: Array) -> Array:
    """Orthonormal departures from a state, shape (n_state, k)."""
    basis = np.eye(len(y))
    if "q" not in system.components:
        return basis
    where = system.components["q"]
    frame = np.linalg.qr(np.column_stack([y[where], np.eye(4)]))[0]
    basis[where, where] = frame
    return np.delete(basis, where.start, axis=1)


def _level(system: System, y: Array, basis: Array) -> Array:
    """Departures without their part along the quaternion.

    That is rounding, but it neither grows nor shrinks, and would take the place of what shrinks.
    """
    if "q" in system.components:
        where = system.components["q"]
        basis[where] -= np.outer(y[where], y[where] @ basis[where])
    return basis


def _stretched(
    system: System, y: Array, basis: Array, u: npt.ArrayLike | None, left: float
) -> tuple[Array, Array, Array, float]:
    """State, departures, logarithms of their growth and time [s] after some of the motion."""
    row = system.checked_input(u)
    rate = system.rate_bound(y, np.abs(row), 0.0)
    span = min(left, _CHUNK * _TURN / rate if rate > 0.0 else left, system.horizon(y, np.abs(row)))
    n = max(1, int(np.ceil(span * rate / _TURN)))
    h, motion = span / n, system.simulate(y, np.linspace(0.0, span, 2 * n + 1), u).y
    A, logs = system.linearize(motion, u)[0], np.zeros(basis.shape[1])
    for k in range(n):
        basis = _runge_kutta(A[2 * k], A[2 * k + 1], A[2 * k + 2], basis, h)
        if k % _BETWEEN == _BETWEEN - 1 or k == n - 1:
            basis, R = np.linalg.qr(_level(system, motion[2 * k + 2], basis))
            logs += np.log(np.abs(np.diag(R)))
    return motion[-1], basis, logs, span


def _runge_kutta(start: Array, middle: Array, end: Array, d: Array, h: float) -> Array:
    """One step of d' = A(t) d, with A at its beginning, middle and end."""
    k1 = start @ d
    k2 = middle @ (d + 0.5 * h * k1)
    k3 = middle @ (d + 0.5 * h * k2)
    k4 = end @ (d + h * k3)
    moved: Array = d + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
    return moved
