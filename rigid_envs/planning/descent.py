"""Sequential convex programming: plans that cost less and less, and succeed."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from rigid_envs.planning.model import Linear, Model, Motion, Tracking, tracking_gains
from rigid_envs.planning.subproblem import Subproblem

__all__ = ["Plans", "improve"]

Array = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

_STIFF = 10.0  # first weight of the distance from a plan, in costs of a unit of action
_LEAST, _MOST = 1e-4, 1e7  # of that weight
_ROOM = 1.3  # an error may grow so much: the ball of errors is a box in it, at its edge a plate
_ACROSS = 0.5  # largest half width of a plate
_SETTLED = 1e-4  # relative gain over `_PATIENCE` rounds below which a row is left
_PATIENCE = 8


@dataclass
class Plans:
    """The best plans found.

    Attributes:
        actions: Shape (T, N, m), float32.
        costs: Infinite where none succeeds, shape (N,).
    """

    actions: npt.NDArray[np.float32]
    costs: Array

    def keep(self, rows: Integers, motion: Motion) -> None:
        """Take over what succeeded and cost less."""
        better = motion.successes & (motion.costs < self.costs[rows])
        self.actions[:, rows[better]] = motion.actions[:, better]
        self.costs[rows[better]] = motion.costs[better]


class Rows(NamedTuple):
    """Entries of errors that are looked at, at some steps.

    Attributes:
        steps: Number of the step before, shape (N, R).
        directions: What is looked at, a unit vector among all errors, shape (N, R, q).
        values: Entry of the errors in this direction, shape (N, R).
        bounds: What it may be at most, either way, shape (N, R).
        excess: Sum of what the largest errors are above 1, shape (N,).
    """

    steps: Integers
    directions: Array
    values: Array
    bounds: Array
    excess: Array


def looked_at(
    errors: Array, groups: Sequence[Integers], first: Integers, n_parts: int, across: Array
) -> Rows:
    """Each error at the ends of the time in which it must hold, and its largest in equal parts.

    Args:
        errors: Shape (T, N, q).
        groups: Places of the entries of each error.
        first: Number of the first step of that time, shape (N,).
        n_parts: Number of parts.
        across: How far an error at its tolerance may move sideways, shape (N,).
    """
    T, n, q = errors.shape
    t, row = np.arange(T)[:, None], np.arange(n)
    excess = np.zeros(n)
    steps, directions, values, bounds = [], [], [], []
    for group in groups:
        size = np.where(t >= first - 1, np.linalg.norm(errors[..., group], axis=-1), 0.0)
        excess += np.maximum(size.max(axis=0) - 1.0, 0.0)
        looks = [np.full(n, T - 1)]
        if (first < T).any():
            edges = np.linspace(first, T - 1, n_parts + 1).round().astype(int)
            parts = ((t >= low) & (t < high) for low, high in itertools.pairwise(edges))
            largest = (np.where(part, size, -1.0).argmax(axis=0) for part in parts)
            looks += [first - 1, *(np.maximum(at, first - 1) for at in largest)]  # 0 if none
        for at in looks:
            edge = np.sqrt(1.0 - (len(group) - 1) * across**2)
            along = np.minimum(np.maximum(len(group) ** -0.5, _ROOM * size[at, row]), edge)
            aside = np.sqrt((1.0 - along**2) / max(len(group) - 1, 1))
            for k, direction in enumerate(axes_along(errors[at, row][:, group]).swapaxes(0, 1)):
                whole = np.zeros((n, q))
                whole[:, group] = direction
                steps.append(at)
                directions.append(whole)
                values.append((whole * errors[at, row]).sum(axis=1))
                bounds.append(aside if k else along)
    return Rows(
        np.stack(steps, axis=1),
        np.stack(directions, axis=1),
        np.stack(values, axis=1),
        np.stack(bounds, axis=1),
        excess,
    )


def axes_along(e: Array) -> Array:
    """Orthonormal axes, the first along vectors e (N, q), as rows: Householder, (N, q, q)."""
    first = np.eye(e.shape[1])[0]
    unit = e / np.maximum(np.linalg.norm(e, axis=1, keepdims=True), 1e-300)
    sign = np.where(unit[:, :1] >= 0.0, 1.0, -1.0)
    normal = unit + sign * first
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    return np.asarray(np.eye(e.shape[1]) - 2.0 * normal[:, :, None] * normal[:, None, :])


def condense(linear: Linear, rows: Rows) -> Array:
    """Derivatives of what is looked at by all actions, shape (N, R, T, m), from the end back."""
    T, n, states, m = linear.B.shape
    G = np.zeros((n, rows.steps.shape[1], T, m))
    P = np.zeros((n, rows.steps.shape[1], states))
    for t in range(T - 1, -1, -1):
        G[:, :, t] = P @ linear.B[t]
        P = P @ linear.A[t]
        hit = rows.steps == t
        if hit.any():
            looked = np.where(hit[..., None], rows.directions, 0.0)
            G[:, :, t] += looked @ linear.Ea[t]
            P += looked @ linear.Ey[t]
    return G


def improve(
    model: Model,
    actions: npt.NDArray[np.floating],
    n_rounds: int,
    price: float = 2.0,
) -> Plans:
    """Improve plans until they settle.

    Args:
        model: Of the rows.
        actions: Plans to begin with, shape (T, N, m).
        n_rounds: At most so many linearisations.
        price: Of a violation, a part of the first cost.
    """
    plans = Plans(np.array(actions, dtype=np.float32), np.full(model.n_rows, np.inf))
    rows = np.arange(model.n_rows)
    search = Search(model, np.asarray(actions, dtype=np.float64), price)
    plans.keep(rows, search.motion)
    for k in range(n_rounds):
        motion = search.step()
        plans.keep(rows, motion)
        if k % _PATIENCE == _PATIENCE - 1:
            going = search.going()
            if not going.any():
                break
            rows = rows[going]
            search = search.part(np.nonzero(going)[0])
    return plans


class Search:
    """State of the method in rows of a model.

    Attributes:
        motion: Of the plans that the next step begins with.
    """

    def __init__(self, model: Model, actions: Array, price: float) -> None:
        """Roll out the first plans."""
        self._model = model
        self.motion = model.roll(actions)
        unit = np.maximum(model.weights, 1e-3)
        self._rho = _STIFF * unit
        self._mu = price * np.maximum(self.motion.costs, 0.1)
        self._n_parts = model.n_parts
        self._across = np.full(model.n_rows, _ACROSS)
        self._merit, self._rows = self._judge(self.motion)
        self._prices = np.zeros(self._rows.values.shape)
        self._linear: Linear | None = None
        self._before = np.full(model.n_rows, np.inf)

    def part(self, rows: Integers) -> Search:
        """The same in some of the rows."""
        part = Search.__new__(Search)
        part._model = self._model.part(rows)
        part.motion = take(self.motion, rows)
        part._rho, part._mu, part._n_parts = self._rho[rows], self._mu[rows], self._n_parts
        part._merit, part._prices = self._merit[rows], self._prices[rows]
        looked: list[Any] = [each[rows] for each in self._rows]
        part._rows = Rows(*looked)
        part._linear, part._before = None, self._before[rows]
        part._across = self._across[rows]
        return part

    def going(self) -> npt.NDArray[np.bool_]:
        """Whether rows have gained something since this was asked last."""
        going = self._merit < self._before - _SETTLED * np.abs(self._merit)
        self._before = self._merit.copy()
        return going

    def step(self) -> Motion:
        """One linearisation, one convex problem and one rollout in every row."""
        model = self._model
        if self._linear is None:
            self._linear = model.linearise(self.motion)
        a = np.asarray(self.motion.actions, dtype=np.float64).swapaxes(0, 1)
        G = condense(self._linear, self._rows)
        problem = Subproblem(
            model.limits,
            a,
            G,
            self._rows.values,
            self._rows.bounds,
            model.weights,
            self._rho,
            self._mu,
        )
        v, self._prices = problem.solve(self._prices)
        cost = model.weights * model.limits.length(v).sum(axis=1)
        expected = self._merit - cost - self._mu * problem.violation(v)
        d = (v - a).swapaxes(0, 1)
        gains = tracking_gains(self._linear)
        tracking = Tracking(gains, self._targets(d))
        motion = model.roll(v.swapaxes(0, 1), tracking)
        merit = self._judge(motion)[0]
        gained = self._merit - merit
        good = (gained > 0.1 * expected) & (gained > 0.0)
        better = gained > 0.0
        self._rho = np.where(good & (gained > 0.5 * expected), self._rho / 3.0, self._rho)
        self._rho = np.where(~good, self._rho * 3.0, self._rho)
        unit = np.maximum(model.weights, 1e-3)
        self._rho = np.clip(self._rho, _LEAST * unit, _MOST * unit)
        self._across = np.clip(np.where(good, 1.5, 0.4) * self._across, 0.01, _ACROSS)
        if better.any():
            self.motion = merge(better, motion, self.motion)
            self._linear = None
        self._merit, self._rows = self._judge(self.motion)
        return motion

    def _targets(self, d: Array) -> Array:
        """Coordinates that the linearisation expects after changes d of the actions."""
        assert self._linear is not None
        A, B = self._linear.A, self._linear.B
        change, targets = np.zeros(A.shape[1:3]), []
        for t, step in enumerate(d):
            targets.append(self._model.coordinates(self.motion.y[t]) + change)
            change = (A[t] @ change[..., None] + B[t] @ step[..., None])[..., 0]
        return np.stack(targets)

    def _judge(self, motion: Motion) -> tuple[Array, Rows]:
        """Cost and priced violations, and the conditions that are looked at."""
        rows = looked_at(
            motion.errors, self._model.groups, self._model.first, self._n_parts, self._across
        )
        used = np.asarray(motion.actions, dtype=np.float64).swapaxes(0, 1)
        cost = self._model.weights * self._model.limits.length(used).sum(axis=1)
        return cost + self._mu * rows.excess, rows


def take(motion: Motion, rows: Integers) -> Motion:
    """Some rows of a motion."""
    parts: list[Any] = [part[rows] if part.ndim == 1 else part[:, rows] for part in motion]
    return Motion(*parts)


def merge(which: npt.NDArray[np.bool_], new: Motion, old: Motion) -> Motion:
    """One motion where `which` is true, the other one elsewhere."""
    parts: list[Any] = []
    pairs: list[tuple[Any, Any]] = list(zip(new, old, strict=True))
    for a, b in pairs:
        shape = (-1,) if a.ndim == 1 else (1, -1, *(1,) * (a.ndim - 2))
        parts.append(np.where(which.reshape(shape), a, b))
    return Motion(*parts)
