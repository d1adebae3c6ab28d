"""Nonlinear model predictive control: optimal control problems over a horizon, solved by IPOPT."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from rigid_envs.checks import exact_array, positive, positive_array
from rigid_envs.symbolic import casadi

__all__ = ["Prediction", "PredictiveControl", "PredictiveProblem", "doubling"]

Array = npt.NDArray[np.float64]
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
