"""Predictive control: by sampling and by optimal control of a model."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import (
    Array,
    Integers,
    exact_array,
    integer,
    non_negative,
    positive,
    positive_array,
    require,
)
from rigid_envs.mechanics.symbolic import casadi

# Sampling model predictive control: path integrals, for any system that can be rolled out.


def weights(costs: npt.ArrayLike, temperature: float) -> Array:
    """Importance weights of rollouts: w_k ~ exp(-(S_k - min S) / lambda), with sum 1.

    lambda is `temperature` times the span of the least twentieth of the costs S: their unit does
    not matter, nor do the largest of them. Rollouts that all cost the same count
    the same.

    Args:
        costs: shape (..., K).
        temperature: towards 0 only the best counts.
    """
    S = np.asarray(costs, dtype=np.float64)
    n = max(1, S.shape[-1] // 20)
    best = S.min(axis=-1, keepdims=True)
    span = np.partition(S, n, axis=-1)[..., n : n + 1] - best
    w = np.exp((best - S) / np.maximum(temperature * span, 1e-300))
    return np.asarray(w / w.sum(axis=-1, keepdims=True))


@dataclass(frozen=True)
class PathIntegral:
    """Model predictive path integral control: a plan moved to the weighted mean of sampled ones.

    Around the plan u, K plans ``v_k = clip(u + s_k e_k)`` are drawn, e_k Gaussian with the
    deviation `spread` and from one step to the next the `correlation`, and s_k from 1 down
    to `finest` in equal ratios: coarse samples explore, fine ones refine. Each is rolled
    out, to the cost S_k, and the plan becomes

        u <- sum_k w_k v_k,   w_k ~ exp(-S_k / lambda)   (see `weights`).

    Among the K is the plan itself. The plan stays inside the box [-1, 1], which is convex. There is
    no proof that it converges to the best plan, except where the cost is quadratic and nothing is
    clipped: there the best plan is the fixed point of the expected update.

    Attributes:
        n_samples: K.
        horizon: T, number of steps of a plan.
        spread: standard deviation of the samples from the plan [actions].
        temperature: see `weights`.
        correlation: of e between neighbouring steps, in [0, 1).
        finest: the least s_k, in (0, 1].

    Raises:
        ValueError: numbers outside their range.

    Source: Williams et al. 2017, doi:10.1109/ICRA.2017.7989202, algorithm 2, without its control
    cost, which belongs to the rollout.
    """

    n_samples: int
    horizon: int
    spread: float = 0.5
    temperature: float = 0.2
    correlation: float = 0.0
    finest: float = 0.03

    def __post_init__(self) -> None:
        """Check the numbers."""
        _check_sizes(self.n_samples, self.horizon, self.temperature)
        positive(self.spread, "spread")
        correlated = non_negative(self.correlation, "correlation") < 1.0
        require(correlated, self.correlation, "correlation", "a number in [0, 1)")
        require(positive(self.finest, "finest") <= 1.0, self.finest, "finest", "a number in (0, 1]")

    def start(self, lead: tuple[int, ...], n_action: int) -> Array:
        """Plans of zero actions, shape (T, *lead, m)."""
        return np.zeros((self.horizon, *lead, n_action))

    def draw(self, rng: np.random.Generator, n_action: int) -> Array:
        """Perturbations s_k e_k of a plan, shape (T, K, m); zero in the first of the K."""
        e = rng.standard_normal((self.horizon, self.n_samples, n_action))
        fresh = np.sqrt(1.0 - self.correlation**2)
        for t in range(1, self.horizon):
            e[t] = self.correlation * e[t - 1] + fresh * e[t]
        scales = self.spread * np.geomspace(1.0, self.finest, self.n_samples)
        scales[0] = 0.0
        return scales[:, None] * e

    def sample(self, plan: Array, draws: Array) -> Array:
        """Plans to roll out, shape (T, ..., K, m), of plans (T, ..., m); the first is the plan."""
        return np.clip(plan[..., None, :] + _beside(draws, plan.ndim - 2), -1.0, 1.0)

    def improve(self, samples: Array, costs: npt.ArrayLike) -> Array:
        """The new plan, shape (T, ..., m), of rolled out plans (T, ..., K, m), costs (..., K)."""
        share = weights(costs, self.temperature)
        return np.asarray((share[..., None, :] @ samples)[..., 0, :])

    def shift(self, plan: Array) -> Array:
        """The plan one step later; its last action is held."""
        return np.concatenate([plan[1:], plan[-1:]])


@dataclass(frozen=True)
class CrossEntropyChoices:
    """Cross-entropy method for plans of choices, with probabilities p of each choice in each step.

    K sequences are drawn from p, each step by itself, and rolled out; then

        p <- (1 - mixing) sum_k w_k [choice of k] + mixing / n,

    so that every choice keeps a probability.

    Attributes:
        n_samples: K.
        horizon: T, number of steps of a plan.
        n_choices: n.
        temperature: see `weights`.
        mixing: share of the uniform distribution.

    Raises:
        ValueError: numbers outside their range.

    Source: Rubinstein & Kroese 2004, *The Cross-Entropy Method*, chapter 4, with exponential
    weights in place of an elite.
    """

    n_samples: int
    horizon: int
    n_choices: int
    temperature: float = 0.2
    mixing: float = 0.1

    def __post_init__(self) -> None:
        """Check the numbers."""
        _check_sizes(self.n_samples, self.horizon, self.temperature)
        integer(self.n_choices, "n_choices", 2)
        require(positive(self.mixing, "mixing") <= 1.0, self.mixing, "mixing", "a number in (0, 1]")

    def start(self, lead: tuple[int, ...], n_action: int = 1) -> Array:
        """Uniform probabilities, shape (T, *lead, n)."""
        return np.full((self.horizon, *lead, self.n_choices), 1.0 / self.n_choices)

    def draw(self, rng: np.random.Generator, n_action: int = 1) -> Array:
        """Uniform random numbers in [0, 1), one for each choice, shape (T, K)."""
        return rng.random((self.horizon, self.n_samples))

    def sample(self, plan: Array, draws: Array) -> Integers:
        """Sequences to roll out, shape (T, ..., K, 1), of plans (T, ..., n)."""
        below = np.cumsum(plan, axis=-1)[..., :-1, None] <= _beside(draws, plan.ndim - 1)
        return np.asarray(below.sum(axis=-2)[..., None])

    def improve(self, samples: Integers, costs: npt.ArrayLike) -> Array:
        """The new plan, shape (T, ..., n), of sequences (T, ..., K, 1) and their costs (..., K)."""
        chosen = samples == np.arange(self.n_choices)
        share = (weights(costs, self.temperature)[..., None, :] @ chosen)[..., 0, :]
        return np.asarray((1.0 - self.mixing) * share + self.mixing / self.n_choices)

    def shift(self, plan: Array) -> Array:
        """The plan one step later; its last step is uniform."""
        return np.concatenate([plan[1:], np.full_like(plan[-1:], 1.0 / self.n_choices)])


def _beside(draws: Array, n_lead: int) -> Array:
    """Draws (T, ...) with axes of length 1 after the first, for those of the plans."""
    return draws.reshape(len(draws), *(1,) * n_lead, *draws.shape[1:])


def _check_sizes(n_samples: int, horizon: int, temperature: float) -> None:
    integer(n_samples, "n_samples", 2)
    integer(horizon, "horizon", 1)
    positive(temperature, "temperature")


# Nonlinear model predictive control: optimal control problems over a horizon, solved by IPOPT.

Symbols = Any  # casadi.SX, a column
_OPTIONS = {"print_time": False, "error_on_fail": False}
_IPOPT = {"print_level": 0, "sb": "yes", "tol": 1e-4, "max_iter": 100}


class PredictiveProblem(Protocol):
    """What is controlled, and at which cost, in coordinates x of the motion.

    Actions are those of an environment: inside the box [-1, 1].
    """

    @property
    def sizes(self) -> tuple[int, int, int]:
        """Number of coordinates, of entries of an action, and of a goal."""

    def coordinates(self, y: npt.ArrayLike) -> Array:
        """Coordinates x of states of the system, shape (..., n)."""

    def step(self, x: Symbols, a: Symbols, h: float) -> Symbols:
        """The coordinates after a time h [s] under an action."""

    def cost(self, x: Symbols, a: Symbols, goal: Symbols) -> Symbols:
        """Rate of the cost [1/s]."""

    def limits(self, x: Symbols, a: Symbols) -> Symbols:
        """A column whose entries may not be above 0, of an action and of what it leads to."""


class Prediction(NamedTuple):
    """Actions over the horizon and the motion that they lead to.

    Attributes:
        actions: Shape (K, m).
        states: Coordinates at the ends of the intervals, shape (K + 1, n).
        is_solved: Whether the conditions of optimality hold.
    """

    actions: Array
    states: Array
    is_solved: bool


@dataclass(frozen=True)
class PredictiveControl:
    """Plans that minimise a cost over a horizon of K intervals, in each of which the action holds.

        min  sum_k h_k l(x_k, a_k) + tail l(x_K, 0)
        over x_1 .. x_K, a_0 .. a_(K-1)  with  x_(k+1) = F(x_k, a_k, h_k),  c(x_(k+1), a_k) <= 0

    F is the integrator step of the environments, so that a plan is what happens. All x_k are
    unknowns (multiple shooting), and all derivatives exact. The solver finds a local minimum,
    IPOPT's interior point (Waechter & Biegler 2006, doi:10.1007/s10107-004-0559-y); there is no
    proof that it is the global one, nor that the closed loop is stable.

    Attributes:
        problem: what is controlled, and at which cost.
        intervals: h_k [s].
        tail: time for which the last state counts [s].

    Raises:
        ValueError: times that are not positive.
        MissingPackageError: CasADi is not installed, when a plan is made.

    Source: Rawlings, Mayne & Diehl, *Model Predictive Control*, second edition, section 8.5.
    """

    problem: PredictiveProblem
    intervals: tuple[float, ...]
    tail: float = 10.0

    def __post_init__(self) -> None:
        """Check the times."""
        positive_array(self.intervals, "intervals", "s", len(self.intervals))
        positive(self.tail, "tail", "s")

    def plan(
        self, y: npt.ArrayLike, goal: npt.ArrayLike = (), near: Prediction | None = None
    ) -> Prediction:
        """The plan from a state of the system.

        Args:
            y: state, shape (n_state,).
            goal: numbers that the cost depends on, shape (n_goal,).
            near: plan to begin the search with; None for no actions and no motion.

        Raises:
            ValueError: bad states or goals.
        """
        n, m, n_goal = self.problem.sizes
        K, x = len(self.intervals), self.problem.coordinates(exact_array(y, "y", "n_state"))
        states = np.tile(x, (K + 1, 1)) if near is None else near.states
        actions = np.zeros((K, m)) if near is None else near.actions
        limit = np.concatenate([np.full(n * K, np.inf), np.ones(m * K)])
        solve, bounds = self._solver
        found = solve(
            x0=np.concatenate([x, states[1:].ravel(), actions.ravel()]),
            lbx=np.concatenate([x, -limit]),
            ubx=np.concatenate([x, limit]),
            p=exact_array(goal, "goal", n_goal),
            **bounds,
        )
        states, actions = np.split(np.array(found["x"])[:, 0], [n * (K + 1)])
        inside = np.clip(actions.reshape(K, m), -1.0, 1.0)
        return Prediction(inside, states.reshape(K + 1, n), bool(solve.stats()["success"]))

    def later(self, plan: Prediction, time: float) -> Prediction:
        """A plan some time [s] later: what is left of it; its end is held."""
        ends = np.concatenate([[0.0], np.cumsum(self.intervals)])
        moved = [np.interp(ends + time, ends, entry) for entry in plan.states.T]
        at = np.searchsorted(ends[:-1], ends[:-1] + time + 1e-9, side="right") - 1
        return Prediction(plan.actions[at], np.stack(moved, axis=-1), False)

    @cached_property
    def _solver(self) -> tuple[Any, dict[str, Array]]:
        """IPOPT for the problem, and the bounds of its constraints."""
        ca, problem, K = casadi(), self.problem, len(self.intervals)
        n, m, n_goal = problem.sizes
        X, A, goal = (ca.SX.sym(*of) for of in (("x", n, K + 1), ("a", m, K), ("goal", n_goal)))
        cost = self.tail * problem.cost(X[:, K], ca.SX.zeros(m), goal)
        gaps, limits = [], []
        for k, h in enumerate(self.intervals):
            cost += h * problem.cost(X[:, k], A[:, k], goal)
            gaps.append(problem.step(X[:, k], A[:, k], h) - X[:, k + 1])
            limits.append(problem.limits(X[:, k + 1], A[:, k]))
        unknowns, g = ca.veccat(X, A), ca.vertcat(*gaps, *limits)
        nlp = {"x": unknowns, "p": goal, "f": cost, "g": g}
        lowest = np.where(np.arange(g.numel()) < n * K, 0.0, -np.inf)
        solve = ca.nlpsol("plan", "ipopt", nlp, {**_OPTIONS, "ipopt": _IPOPT})
        return solve, {"lbg": lowest, "ubg": np.zeros(g.numel())}


def doubling(dt: float, *counts: int) -> tuple[float, ...]:
    """Intervals of a horizon [s]: so many of length dt, then of 2 dt, 4 dt and so on."""
    return tuple(dt * 2.0**k for k, count in enumerate(counts) for _ in range(count))


# Problems for predictive control: a spin about the middle axis, a top on its pivot, a ball.


def size(a: Symbols, rounding: float = 0.01) -> Symbols:
    """Length of a vector, rounded off at 0 so that it has derivatives there."""
    ca = casadi()
    return ca.sqrt(ca.sumsqr(a) + rounding**2)
