"""The convex problem that a linearisation leaves, solved through its dual by Newton's method."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, Bools, Integers
from rigid_envs.control.planning.model import (
    Limits,
    Linear,
    Model,
    Motion,
    Tracking,
    tracking_gains,
)

# The convex problem that a linearisation leaves, solved through its dual by Newton's method.

_N_NEWTON = 60
_DAMPING = 1e-3  # first part of the diagonal of a Hessian that is added to it
_LEAST_DAMPING, _MOST_DAMPING = 1e-18, 1e12  # of that part
_PARTS = 1.0, 0.3, 0.05  # of a step that are tried, one after the other
_WITHIN = 1.0 - 1e-5  # plans end so far within the tolerances: actions and goals are float32
_EQUAL = 1e-11  # relative difference of values that may be rounding
_SOLVED = 1e-6  # duality gap that counts as solved, a part of the value


class Subproblem(NamedTuple):
    """Proximal problems of N rows with plans a of T actions and R linearised conditions.

        min_v  sum_t w |v_t| + rho / 2 sum_t |v_t - a_t|^2 + mu sum_r max(0, |e_r| - b_r),
        e = c + G (v - a)

    over v within the limits. Its dual has R variables from -mu to mu, whatever T is: given them,
    each v_t is known in closed form (`Limits.shrink`).

    Attributes:
        limits: Of the actions.
        a: Plans, shape (N, T, m).
        G: Derivatives of the errors by the actions, shape (N, R, T, m).
        c: Errors over their tolerances, shape (N, R).
        b: Bounds of the errors, shape (N, R).
        w: Cost of a unit of action, shape (N,).
        rho: Weight of the distance from a, shape (N,).
        mu: Price of a violation, shape (N,).
    """

    limits: Limits
    a: Array
    G: Array
    c: Array
    b: Array
    w: Array
    rho: Array
    mu: Array

    def solve(self, prices: Array) -> tuple[Array, Array]:
        """Plans v, shape (N, T, m), and the prices of the conditions, shape (N, R).

        Args:
            prices: Where to begin, shape (N, R).
        """
        plans, solved = np.empty_like(self.a), np.empty_like(prices)
        rows, problem = np.arange(len(prices)), self
        prices = np.clip(prices, -self.mu[:, None], self.mu[:, None])
        found: tuple[Array, ...]
        found = (prices, *self._dual(prices), np.full(len(prices), _DAMPING))
        for k in range(_N_NEWTON + 1):
            prices, value, v, _, e, _ = found
            open_ = problem._gap(prices, e) > _SOLVED * np.abs(value) + 1e-12
            done = ~open_ if k < _N_NEWTON else np.ones_like(open_)
            plans[rows[done]], solved[rows[done]] = v[done], prices[done]
            if done.any():
                rows, problem = rows[~done], Subproblem(problem.limits, *_part(problem[1:], ~done))
                found = _part(found, ~done)
            if not len(rows):
                break
            found = problem._newton_step(*found)
        return plans, solved

    def _newton_step(
        self, prices: Array, value: Array, v: Array, slope: Array, e: Array, damping: Array
    ) -> tuple[Array, ...]:
        """The same after a step of Newton's method, in rows that it makes better.

        A step ends where the first price becomes 0 or reaches its limit: errors that grow make
        prices depend on one another, so that the others would go astray without it. If that is not
        better, parts of the step are tried.
        """
        mu, bound = self.mu[:, None], _WITHIN * self.b
        side = np.where(prices == 0.0, np.sign(e), np.sign(prices))
        rest = e - bound * side
        fixed = (prices == 0.0) & (np.abs(e) <= bound)
        fixed |= (np.abs(prices) >= mu) & (rest * side >= 0.0)
        step = self._newton(slope, rest, fixed, damping)
        ends = np.where(step * side < 0.0, 0.0, mu * side)
        until = np.divide(ends - prices, step, out=np.full_like(step, np.inf), where=step != 0.0)
        share = np.minimum(np.where(until > 0.0, until, 1.0).min(axis=1), 1.0)[:, None]
        problem, taken, rows = self, np.zeros(len(prices)), np.arange(len(prices))
        for part in _PARTS:
            if not rows.size:
                break
            size = part * share[rows]
            trial = prices[rows] + size * step[rows]
            trial = np.where(until[rows] <= size, ends[rows], trial)
            new = problem._dual(trial)
            equal = np.abs(new[0] - value[rows]) <= _EQUAL * np.abs(value[rows])
            nearer = problem._gap(trial, new[3]) < problem._gap(prices[rows], e[rows])
            better = np.where(equal, nearer, new[0] > value[rows])
            found, rows = rows[better], rows[~better]
            for before, now in zip((prices, value, v, slope, e), (trial, *new), strict=True):
                before[found] = now[better]
            taken[found] = size[better, 0]
            problem = Subproblem(self.limits, *_part(self[1:], rows))
        damping = damping * 10.0 ** (1.0 - 2.0 * taken)
        return prices, value, v, slope, e, np.clip(damping, _LEAST_DAMPING, _MOST_DAMPING)

    def violation(self, v: Array) -> Array:
        """Sum of what the linearised errors of plans v are above their bounds, shape (N,)."""
        return np.asarray(np.maximum(np.abs(self._errors(v)) - self.b, 0.0).sum(axis=1))

    def _gap(self, prices: Array, e: Array) -> Array:
        """Difference of the primal and the dual value, shape (N,)."""
        bound = _WITHIN * self.b
        over = self.mu[:, None] * np.maximum(np.abs(e) - bound, 0.0)
        return np.asarray((over + bound * np.abs(prices) - prices * e).sum(axis=1))

    def _errors(self, v: Array) -> Array:
        flat = self.G.reshape(*self.c.shape, -1)
        return self.c + (flat @ (v - self.a).reshape(len(v), -1, 1))[..., 0]

    def _dual(self, prices: Array) -> tuple[Array, Array, Array, Array]:
        """Value (N,), minimiser, its slopes, and its errors, shape (N, R)."""
        n, t, m = self.a.shape
        pull = (prices[:, None] @ self.G.reshape(*self.c.shape, -1)).reshape(n, t, m)
        z = self.a - pull / self.rho[:, None, None]
        v, slope = self.limits.shrink(z, np.broadcast_to((self.w / self.rho)[:, None], (n, t)))
        e = self._errors(v)
        cost = self.w * self.limits.length(v).sum(axis=1)
        value = cost + 0.5 * self.rho * ((v - self.a) ** 2).sum(axis=(1, 2))
        return value + (prices * e - _WITHIN * self.b * np.abs(prices)).sum(axis=1), v, slope, e

    def _newton(
        self, slope: Array, rest: Array, fixed: npt.NDArray[np.bool_], damping: Array
    ) -> Array:
        """Newton's step of the prices that are not fixed, damped in the scale of each.

        The Hessian is G S G^T with S = F F^T. It is factorised as a product: an error that grows
        makes the rows of G so nearly parallel that G S G^T itself has no digits left.
        """
        n, r = self.c.shape
        factor = square_root(slope)
        steps = (self.G[..., j, None] * factor[:, None, :, j] for j in range(self.a.shape[2]))
        bent = sum(steps, start=np.zeros(())).reshape(n, r, -1)
        scale = np.linalg.norm(self.G.reshape(n, r, -1), axis=2) / np.sqrt(self.rho)[:, None]
        scale = 1.0 / np.maximum(scale, 1e-300)
        weight = np.where(fixed, 0.0, scale / np.sqrt(self.rho)[:, None])
        below = np.eye(r) * np.where(fixed, 1.0, np.sqrt(damping)[:, None])[:, None]
        both = np.concatenate([(bent * weight[..., None]).swapaxes(1, 2), below], axis=1)
        upper: Any = np.linalg.qr(both, mode="r")
        right = np.where(fixed, 0.0, scale * rest)[..., None]
        step = np.linalg.solve(upper, np.linalg.solve(upper.swapaxes(1, 2), right))
        return np.asarray(scale * step[..., 0])


def square_root(S: Array) -> Array:
    """Lower triangular F with F F^T = S, of symmetric matrices that may be singular."""
    m = S.shape[-1]
    F = np.zeros_like(S)
    for j in range(m):
        left = S[..., j, j] - (F[..., j, :j] ** 2).sum(axis=-1)
        F[..., j, j] = np.sqrt(np.maximum(left, 0.0))
        for i in range(j + 1, m):
            rest = S[..., i, j] - (F[..., i, :j] * F[..., j, :j]).sum(axis=-1)
            F[..., i, j] = rest / np.where(left > 1e-14, F[..., j, j], np.inf)
    return F


def _part(arrays: Sequence[Any], rows: Bools | Integers) -> Any:
    return tuple(each[rows] for each in arrays)


# Sequential convex programming: plans that cost less and less, and succeed.

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
    stacked: list[Any] = [np.stack(each, axis=1) for each in (steps, directions, values, bounds)]
    stacked.append(excess)
    return Rows(*stacked)


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
    model: Model, actions: npt.NDArray[np.floating], n_rounds: int, price: float = 2.0
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
    search = PlanSearch(model, np.asarray(actions, dtype=np.float64), price)
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


class PlanSearch:
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
        self._across = np.full(model.n_rows, _ACROSS)
        self._merit, self._rows = self._judge(self.motion)
        self._prices = np.zeros(self._rows.values.shape)
        self._linear: Linear | None = None
        self._before = np.full(model.n_rows, np.inf)

    def part(self, rows: Integers) -> PlanSearch:
        """The same in some of the rows."""
        part = PlanSearch.__new__(PlanSearch)
        part._model = self._model.part(rows)
        part.motion = take(self.motion, rows)
        part._rho, part._mu = self._rho[rows], self._mu[rows]
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
        targets, change = self._model.path(self.motion)[:-1], np.zeros(A.shape[1:3])
        for t, step in enumerate(d):
            targets[t] += change
            change = (A[t] @ change[..., None] + B[t] @ step[..., None])[..., 0]
        return targets

    def _judge(self, motion: Motion) -> tuple[Array, Rows]:
        """Cost and priced violations, and the conditions that are looked at."""
        model = self._model
        n_parts = model.conditions.n_parts
        rows = looked_at(motion.errors, model.groups, model.first, n_parts, self._across)
        used = np.asarray(motion.actions, dtype=np.float64).swapaxes(0, 1)
        cost = model.weights * model.limits.length(used).sum(axis=1)
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
