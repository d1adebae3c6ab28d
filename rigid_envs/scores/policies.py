"""What acts: functions, reference controllers, random and recorded actions."""

import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from rigid_envs.base.checks import Array, Bools, require
from rigid_envs.control import predictive
from rigid_envs.engine.layout import CLOCK, FLAGS
from rigid_envs.envs.shells import RigidVectorEnv
from rigid_envs.mechanics.system import System
from rigid_envs.scores import starts
from rigid_envs.tasks.core import Core
from rigid_envs.tasks.registry import ENVIRONMENTS, load
from rigid_envs.tasks.task import Task

# The random policy: actions drawn uniformly from the action space.


class RandomPolicy:
    """Actions drawn uniformly from the action space: the baseline that has score 0."""

    def __init__(self, action_space: spaces.Space[Any], rng: np.random.Generator) -> None:
        """Draw from a space.

        Args:
            action_space: A box or a discrete space, of one row.
            rng: Source of the draws.
        """
        self._space, self._rng = action_space, rng

    def predict(
        self, observation: starts.Observations, *, deterministic: bool = True
    ) -> tuple[npt.NDArray[Any], None]:
        """Draw an action for each observation.

        Args:
            observation: Shape (N, ...), or a dictionary of such.
            deterministic: Ignored.
        """
        part = next(iter(observation.values())) if isinstance(observation, dict) else observation
        n, space = len(part), self._space
        if isinstance(space, spaces.Discrete):
            return self._rng.integers(space.start, space.start + space.n, n), None
        assert isinstance(space, spaces.Box)
        actions = self._rng.uniform(space.low, space.high, (n, *space.shape))
        return actions.astype(space.dtype), None


# Controllers of all rows of an environment: those of each id.


class States(Protocol):
    """What a controller reads of N rows: native rows have it, and so has a decoded observation."""

    @property
    def y(self) -> npt.NDArray[np.float64]:
        """Physical states, shape (N, n_state)."""

    @property
    def systems(self) -> Sequence[System]:
        """The physical system of every row."""

    def auxiliary(self, *names: str) -> npt.NDArray[np.float64]:
        """Parts of the auxiliary state, by name: shape (N,), or (N, k) of k > 1 names."""


Controller = Callable[[Any], npt.NDArray[Any]]
"""Actions (N, n_action) of all rows, or choices (N,), from their `States`.

One that reads more takes a `RigidVectorEnv`, and acts in native rows only.
"""


def system_of(task: Task) -> Any:
    """The system of a task, of the class that its controllers take: the middle of each range."""
    return task.system()


def feedback(law: Callable[..., npt.NDArray[Any]], *names: str) -> Controller:
    """A controller by a function of the state, and of named parts of the auxiliary state."""
    if not names:
        return lambda states: law(states.y)
    return lambda states: law(states.y, states.auxiliary(*names))


ControllerFactory = Callable[[Any], Controller]
"""A function from a task, with its settings, to a controller of its rows."""


def reference_controllers(env_id: str) -> dict[str, ControllerFactory]:
    """The reference controllers of an id by name, the best first; none for an unknown id."""
    record = ENVIRONMENTS.get(env_id)
    return {} if record is None else {key: load(code) for key, code in record.controllers.items()}


def predictive_controllers(env_id: str) -> dict[str, ControllerFactory]:
    """The predictive controller of an id, "nmpc", if it has one; it needs the extra "control"."""
    record = ENVIRONMENTS.get(env_id)
    return {"nmpc": load(record.predictive)} if record is not None and record.predictive else {}


# Open-loop plans, made for each row at the start of its episode.

AnyArray = npt.NDArray[Any]
Rows = npt.NDArray[np.int64]

Plan = Callable[[Any, Rows], npt.NDArray[np.float64]]
"""From `States` and the indices of n rows their entries for each step from now on, (T, n, ...).

The last entry stays.
"""


class Memory(NamedTuple):
    """The plans of N rows.

    Attributes:
        entries: Shape (T, N, ...).
        age: Steps since the plan of each row was made, shape (N,).
    """

    entries: AnyArray
    age: Rows


class Script:
    """A controller by plans: that of each row is made when its episode begins.

    Rows may begin at any time: it also works across automatic resets. A row that `play` counts no
    more keeps its last plan, for planning may take long.
    """

    def __init__(
        self,
        plan: Plan,
        follow: Callable[[Any, AnyArray], AnyArray] = lambda states, due: due,
        period: float = math.inf,
    ) -> None:
        """A script without plans.

        Args:
            plan: Makes the plans of rows.
            follow: Actions from `States` and the entries that are due; those entries, if left out.
            period: Number of steps after which a row's plan is made again.
        """
        self._plan, self._follow, self._period = plan, follow, period
        self._memory: Memory | None = None

    def act(self, states: States, memory: Memory | None, begins: Bools) -> tuple[AnyArray, Memory]:
        """Actions of all rows, and the plans that they follow.

        Args:
            states: Of the rows.
            memory: From the step before; None where there was none. It is left as it is.
            begins: Rows whose episode begins, shape (N,).
        """
        n = len(begins)
        if memory is None:
            memory, begins = Memory(np.zeros((0, n)), np.zeros(n, np.int64)), np.ones(n, np.bool_)
        entries, age = memory
        new = np.flatnonzero(begins | (age >= self._period))
        if len(new):
            entries = _written(entries, np.asarray(self._plan(states, new)), new)
            age = age.copy()
            age[new] = 0
        due = entries[np.minimum(age, len(entries) - 1), np.arange(n)]
        return np.asarray(self._follow(states, due)), Memory(entries, age + 1)

    def __call__(self, envs: Any) -> AnyArray:
        """Actions of native rows, whose clocks say when episodes begin; it keeps the plans."""
        begins = envs.get_state()["clock"][:, CLOCK.elapsed] == 0
        over = getattr(envs, "uncounted", None)
        begins = begins if over is None else begins & ~over
        actions, self._memory = self.act(envs, self._memory, begins)
        return actions


def _written(entries: AnyArray, new: AnyArray, rows: Rows) -> AnyArray:
    """Entries with those of some rows replaced; the shorter ones go on with their last."""
    length = max(len(entries), len(new))
    if not len(entries):
        entries = np.zeros((1, entries.shape[1], *new.shape[2:]))
    written = _prolonged(entries, length)
    written[:, rows] = _prolonged(new, length)
    return written


def _prolonged(entries: AnyArray, n: int) -> AnyArray:
    """The last entry repeated up to n of them, in a new array."""
    more = np.repeat(entries[-1:], n - len(entries), axis=0)
    return np.concatenate([entries, more])


# Predictive control of the rows of an environment: plans that are made anew as time goes on.


def predicting(
    law: predictive.PredictiveControl,
    dt: float,
    period: int,
    goals: Callable[[RigidVectorEnv], npt.NDArray[Any]] = lambda envs: np.zeros((envs.num_envs, 0)),
) -> Controller:
    """A controller that plans every row anew after some steps, beginning with its last plan.

    Args:
        law: The plans; their first `period` intervals are control periods.
        dt: Control period [s].
        period: Number of steps after which a row is planned again.
        goals: Numbers that the cost of each row depends on, shape (N, n_goal).
    """
    plans: dict[int, predictive.Prediction] = {}

    def plan(envs: RigidVectorEnv, rows: Rows) -> Array:
        y, goal = envs.y, goals(envs)
        begins = envs.get_state()["clock"][:, CLOCK.elapsed] == 0
        for row in rows:
            last = None if begins[row] or row not in plans else plans[row]
            near = None if last is None else law.later(last, period * dt)
            plans[row] = law.plan(y[row], goal[row], near)
        return np.stack([plans[row].actions[:period] for row in rows], axis=1)

    return Script(plan, period=period)


# Predictive controllers; of drawn parameters they know the middle. They need CasADi.

PREDICTION_PERIOD = 4


# Sampling model predictive control of any environment: its own kernels are the model.
#
# Every decision copies the state of a row K times, rolls out K plans, and takes the first step of
# the plan improved by their costs. The copies are stepped and rewarded by the functions that step
# and reward the rows.

_COPIES = 8192  # rows that are rolled out together: they stay in the cache


class Rollouts:
    """Copies of rows, for the costs of plans from their states.

    A copy goes on as its row would, with the same parameters and the same noise. Its cost is the
    negative sum of its rewards until its episode ends; in a goal task, where the reward says
    nothing on the way, each step also costs the squared distance of the achieved goal from the
    desired one.
    """

    def __init__(self, task: Task, n_rows: int, n_samples: int) -> None:
        """Make room for copies.

        Args:
            task: Task of the rows.
            n_rows: Number of rows N.
            n_samples: Copies of each row K.
        """
        self._task, self._k = task, n_samples
        self._core = Core(task, n_rows * n_samples)

    def __call__(self, state: Mapping[str, Array], actions: npt.NDArray[Any]) -> Array:
        """Costs of plans, shape (N, K).

        Args:
            state: From `RigidVectorEnv.get_state`, of N rows.
            actions: Shape (T, N, K, m).
        """
        core = self._core
        core.set_state({key: part.repeat(self._k, axis=0) for key, part in state.items()})
        cost, alive = np.zeros(core.n_rows), np.ones(core.n_rows, dtype=bool)
        for action in actions.reshape(len(actions), *core.actions.shape):
            core.actions[...] = action
            core.step()
            cost -= np.where(alive, core.results[-1] - self._distance(), 0.0)
            alive &= ~core.flags[FLAGS.terminated]
        return cost.reshape(-1, self._k)

    def _distance(self) -> Array:
        n = self._task.n_goal  # 0 without a goal: no entries, and no distance
        off = self._core.observations[:, :n] - self._core.observations[:, n : 2 * n]
        return np.asarray(np.sum(off.astype(np.float64) ** 2, axis=-1))


class SamplingController:
    """Sampling controller of the rows of any task.

    The same draws are added to the plans of all rows: what a row does is what it would do alone.

    Attributes:
        planner: Method by which plans are drawn and improved.
    """

    def __init__(
        self,
        planner: predictive.PathIntegral | predictive.CrossEntropyChoices,
        rng: np.random.Generator,
    ) -> None:
        """Plan nothing yet.

        Args:
            planner: Method by which plans are drawn and improved.
            rng: Generator of the random draws.
        """
        self.planner, self._rng = planner, rng
        self._plan = np.zeros((0, 0, 0))
        self._blocks: list[slice] = []
        self._rollouts: dict[int, Rollouts] = {}

    def __call__(self, envs: RigidVectorEnv) -> npt.NDArray[Any]:
        """Actions of all rows; a row at its first step gets a new plan."""
        task, n, m = envs.task, envs.num_envs, len(envs.task.actions())
        state = envs.get_state()
        fresh = state["clock"][:, CLOCK.elapsed] == 0
        if self._plan.shape[1] != n:
            self._make_room(task, n)
            fresh[:] = True
        self._plan[:, fresh] = self.planner.start((int(fresh.sum()),), m)
        draws = self.planner.draw(self._rng, m)
        for block in self._blocks:
            samples: Any = self.planner.sample(self._plan[:, block], draws)
            rollouts = self._rollouts[samples.shape[1]]
            costs = rollouts({key: part[block] for key, part in state.items()}, samples)
            self._plan[:, block] = self.planner.improve(samples, costs)
        due = self._plan[0]
        self._plan = self.planner.shift(self._plan)
        return np.asarray(np.argmax(due, axis=-1) if task.n_choices else due)

    def _make_room(self, task: Task, n: int) -> None:
        """Plans of n rows, and copies of as many of them at a time as stay in the cache."""
        self._plan = self.planner.start((n,), len(task.actions()))
        size = max(1, _COPIES // self.planner.n_samples)
        self._blocks = [slice(k, min(k + size, n)) for k in range(0, n, size)]
        sizes = {block.stop - block.start for block in self._blocks}
        self._rollouts = {size: Rollouts(task, size, self.planner.n_samples) for size in sizes}


def sampling(task: Task) -> Controller:
    """Sampling model predictive control of any task: in each step 256 plans of 3 s, or 30 steps.

    Args:
        task: Any task, with its settings.
    """
    horizon = max(30, round(3.0 / task.dt))
    planner: predictive.PathIntegral | predictive.CrossEntropyChoices
    if task.n_choices:
        planner = predictive.CrossEntropyChoices(256, horizon, task.n_choices, temperature=0.2)
    else:
        planner = predictive.PathIntegral(
            256, horizon, spread=1.0, temperature=0.2, correlation=0.8
        )
    return SamplingController(planner, np.random.default_rng(0))


# Policies of any kind, made into one: a function from a vector environment to actions in it.


@dataclass(frozen=True)
class PolicyFactory:
    """A policy of any kind, ready to be played.

    Attributes:
        make: Function from a vector environment to a function from the observations of all its rows
            to their actions.
        name: Who acts.
    """

    make: Callable[[Any], starts.ActionFunction]
    name: str = "policy"

    def __call__(self, envs: Any) -> starts.ActionFunction:
        """The actions in an environment."""
        return self.make(envs)


def from_controller(factory: ControllerFactory, name: str = "controller") -> PolicyFactory:
    """A policy of states from a controller.

    Args:
        factory: For example one of `reference_controllers`.
        name: Who acts.
    """

    def make(envs: Any) -> starts.ActionFunction:
        rows = _native(envs, name)
        expected = f"'world': {name} acts in the world frame"
        require(rows.task.frame == "world", rows.task.frame, "frame", expected)
        control = factory(rows.task)
        kind = rows.single_action_space.dtype
        return lambda _: np.asarray(control(rows), dtype=kind)

    return PolicyFactory(make, name)


def from_predict(policy: starts.SupportsPredict, name: str = "") -> PolicyFactory:
    """A policy of observations that has `predict`, as models of Stable-Baselines3 have.

    A memory is passed on, if `predict` takes it; so is the scaling of observations (VecNormalize)
    of a model that still has its environment.

    Args:
        policy: The policy.
        name: Who acts; empty for the class of the policy, in small letters.
    """
    takes = inspect.signature(policy.predict).parameters
    scaled = getattr(policy, "get_vec_normalize_env", lambda: None)()

    def make(envs: Any) -> starts.ActionFunction:
        memory: dict[str, Any] = {"state": None, "episode_start": np.ones(envs.num_envs, bool)}
        memory = {key: value for key, value in memory.items() if key in takes}

        def act(observations: starts.Observations) -> npt.NDArray[Any]:
            seen = observations if scaled is None else scaled.normalize_obs(observations)
            actions, state = policy.predict(seen, deterministic=True, **memory)
            if "state" in memory:
                memory["state"] = state
            if "episode_start" in memory:
                memory["episode_start"] = np.zeros(envs.num_envs, bool)
            return _of_all_rows(actions, envs)

        return act

    return PolicyFactory(make, name or type(policy).__name__.lower())


def from_function(function: starts.ActionFunction, name: str = "") -> PolicyFactory:
    """A policy from a function of the observations of all rows, shape (n, ...), to their actions.

    Args:
        function: The policy.
        name: Who acts; empty for the name of the function.
    """

    def make(envs: Any) -> starts.ActionFunction:
        kind = envs.single_action_space.dtype
        return lambda seen: _of_all_rows(np.asarray(function(seen), dtype=kind), envs)

    return PolicyFactory(make, name or getattr(function, "__name__", "function").strip("<>"))


def recorded(actions: npt.NDArray[Any], name: str = "recorded") -> PolicyFactory:
    """Recorded actions, one episode for each row, whatever is observed; the last one stays.

    Args:
        actions: Shape (T, n, m), of choices (T, n) or (T, n, 1).
        name: Who found them.
    """

    def make(envs: Any) -> starts.ActionFunction:
        rows = _native(envs, name)
        given = actions[..., 0] if rows.task.n_choices and actions.ndim == 3 else actions
        if given.shape[1:] != rows.action_space.shape:
            expected = f"(T, *{rows.action_space.shape})"
            raise ValueError(f"actions have shape {actions.shape}; expected {expected}")
        kind = rows.single_action_space.dtype

        def act(_: starts.Observations) -> npt.NDArray[Any]:
            step = _steps(rows, len(given))
            return np.asarray(given[step, np.arange(rows.num_envs)], dtype=kind)

        return act

    return PolicyFactory(make, name)


def resting(policy: PolicyFactory, acts: npt.NDArray[np.bool_]) -> PolicyFactory:
    """A policy that acts at some times alone, and takes the action 0 else.

    Args:
        policy: The policy.
        acts: Whether it acts in each step of a row, shape (T, n).
    """

    def make(envs: Any) -> starts.ActionFunction:
        rows, act = _native(envs, policy.name), policy(envs)

        def acting(seen: starts.Observations) -> npt.NDArray[Any]:
            on = acts[_steps(rows, len(acts)), np.arange(rows.num_envs)]
            actions = act(seen)
            return np.where(on.reshape(-1, *[1] * (actions.ndim - 1)), actions, 0)

        return acting

    return PolicyFactory(make, policy.name)


def _steps(rows: RigidVectorEnv, limit: int) -> npt.NDArray[np.int64]:
    """Number of the step that each row is about to make, below a limit."""
    elapsed = rows.get_state()["clock"][:, CLOCK.elapsed].astype(np.int64)
    return np.minimum(elapsed, limit - 1)


def uniform(seed: int = starts.TEST_SEED) -> PolicyFactory:
    """The random policy, which draws the same actions in every evaluation.

    Args:
        seed: Seed of the starts; the actions are drawn from another stream of it.
    """

    def make(envs: Any) -> starts.ActionFunction:
        stream = np.random.default_rng(starts.row_seeds(seed, 1, "random policy"))
        draw = RandomPolicy(envs.single_action_space, stream)
        return lambda observations: draw.predict(observations)[0]

    return PolicyFactory(make, "random")


def _zero(envs: Any) -> starts.ActionFunction:
    space = envs.action_space
    actions = np.zeros(space.shape, dtype=space.dtype)
    return lambda _: actions.copy()


constant_zero = PolicyFactory(_zero, "zero")
"""The policy whose action is 0, the middle of a box or the first choice, in every step."""


def untrained_policies(env_id: str) -> dict[str, PolicyFactory]:
    """Policies of an id by name.

    Its reference controllers, "nmpc" if it has a predictive controller, "sampling", "zero" and
    "random".
    """
    controllers = reference_controllers(env_id) | predictive_controllers(env_id)
    return {
        **{name: from_controller(factory, name) for name, factory in controllers.items()},
        "sampling": from_controller(sampling, "sampling"),
        "zero": constant_zero,
        "random": uniform(),
    }


def untrained_policy(env_id: str, name: str) -> PolicyFactory:
    """An untrained policy of an id.

    Args:
        env_id: Gymnasium's id.
        name: One of `untrained_policies`, or "reference" for the best reference controller.

    Raises:
        ValueError: none of the name; names those that there are.
    """
    policies = untrained_policies(env_id)
    chosen = next(iter(reference_controllers(env_id)), name) if name == "reference" else name
    require(chosen in policies, name, f"{env_id}: controller", f"one of {list(policies)}")
    return policies[chosen]


def policy_of(env_id: str, policy: Any) -> PolicyFactory:
    """A policy of any kind as a `PolicyFactory`.

    Args:
        env_id: Gymnasium's id.
        policy: A name of `untrained_policies` or "reference"; what has `predict`; a function of the
            observations of all rows; or a `PolicyFactory`.

    Raises:
        ValueError: None of these.
    """
    if isinstance(policy, PolicyFactory):
        return policy
    if isinstance(policy, str):
        return untrained_policy(env_id, policy)
    if callable(getattr(policy, "predict", None)):
        name = getattr(policy, "name", "")
        return from_predict(policy, name if isinstance(name, str) else "")
    if callable(policy):
        return from_function(policy)
    raise ValueError(
        f"policy = {policy!r:.100}; expected the name of a controller, a model with `predict`, a "
        "function from observations (n, ...) to actions (n, ...), or `from_controller(factory)`"
    )


def _of_all_rows(actions: npt.NDArray[Any], envs: Any) -> npt.NDArray[Any]:
    expected = envs.action_space.shape  # None where actions have several parts
    if expected is not None and np.shape(actions) != expected:
        raise ValueError(
            f"actions of the policy have shape {np.shape(actions)}; expected {expected}: it is "
            "given the observations of all rows at once, and gives an action for each"
        )
    return actions


def _native(envs: Any, name: str) -> RigidVectorEnv:
    rows = envs.unwrapped
    if not isinstance(rows, RigidVectorEnv):
        expected = f"native rows for {name}, which reads states: leave out env"
        raise ValueError(f"env = {rows}; expected {expected}")
    return rows
