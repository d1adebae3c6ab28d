"""Policies of any kind, made into one: a function from a vector environment to actions in it."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.envs import RigidVectorEnv
from rigid_envs.kernels.layout import CLOCK
from rigid_envs.scores.controllers import (
    ControllerFactory,
    predictive_controllers,
    reference_controllers,
)
from rigid_envs.scores.episodes import ActionFunction, Observations, SupportsPredict
from rigid_envs.scores.random_policy import RandomPolicy
from rigid_envs.scores.sampling import sampling
from rigid_envs.scores.starts import TEST_SEED, row_seeds

__all__ = [
    "PolicyFactory",
    "constant_zero",
    "from_controller",
    "from_function",
    "from_predict",
    "policy_of",
    "recorded",
    "uniform",
    "untrained_policies",
    "untrained_policy",
]


@dataclass(frozen=True)
class PolicyFactory:
    """A policy of any kind, ready to be played.

    Attributes:
        make: Function from a vector environment to a function from the observations of all its rows
            to their actions.
        name: Who acts.
    """

    make: Callable[[Any], ActionFunction]
    name: str = "policy"

    def __call__(self, envs: Any) -> ActionFunction:
        """The actions in an environment."""
        return self.make(envs)


def from_controller(factory: ControllerFactory, name: str = "controller") -> PolicyFactory:
    """A policy of states from a controller.

    Args:
        factory: For example one of `reference_controllers`.
        name: Who acts.
    """

    def make(envs: Any) -> ActionFunction:
        rows = _native(envs, name)
        if rows.task.frame != "world":
            raise ValueError(
                f"frame = {rows.task.frame!r}; expected 'world': {name} acts in the world frame"
            )
        control = factory(rows.task)
        kind = rows.single_action_space.dtype
        return lambda _: np.asarray(control(rows), dtype=kind)

    return PolicyFactory(make, name)


def from_predict(policy: SupportsPredict, name: str = "") -> PolicyFactory:
    """A policy of observations that has `predict`, as models of Stable-Baselines3 have.

    A memory is passed on, if `predict` takes it; so is the scaling of observations (VecNormalize)
    of a model that still has its environment.

    Args:
        policy: The policy.
        name: Who acts; empty for the class of the policy, in small letters.
    """
    takes = inspect.signature(policy.predict).parameters
    scaled = getattr(policy, "get_vec_normalize_env", lambda: None)()

    def make(envs: Any) -> ActionFunction:
        memory: dict[str, Any] = {"state": None, "episode_start": np.ones(envs.num_envs, bool)}
        memory = {key: value for key, value in memory.items() if key in takes}

        def act(observations: Observations) -> npt.NDArray[Any]:
            seen = observations if scaled is None else scaled.normalize_obs(observations)
            actions, state = policy.predict(seen, deterministic=True, **memory)
            if "state" in memory:
                memory["state"] = state
            if "episode_start" in memory:
                memory["episode_start"] = np.zeros(envs.num_envs, bool)
            return _of_all_rows(actions, envs)

        return act

    return PolicyFactory(make, name or type(policy).__name__.lower())


def from_function(function: ActionFunction, name: str = "") -> PolicyFactory:
    """A policy from a function of the observations of all rows, shape (n, ...), to their actions.

    Args:
        function: The policy.
        name: Who acts; empty for the name of the function.
    """

    def make(envs: Any) -> ActionFunction:
        kind = envs.single_action_space.dtype
        return lambda seen: _of_all_rows(np.asarray(function(seen), dtype=kind), envs)

    return PolicyFactory(make, name or getattr(function, "__name__", "function").strip("<>"))


def recorded(actions: npt.NDArray[Any], name: str = "recorded") -> PolicyFactory:
    """Recorded actions, one episode for each row, whatever is observed; the last one stays.

    Args:
        actions: Shape (T, n, m), of choices (T, n).
        name: Who found them.
    """

    def make(envs: Any) -> ActionFunction:
        rows = _native(envs, name)
        if actions.shape[1:] != rows.action_space.shape:
            raise ValueError(
                f"actions have shape {actions.shape}; expected (T, *{rows.action_space.shape})"
            )
        kind = rows.single_action_space.dtype

        def act(_: Observations) -> npt.NDArray[Any]:
            elapsed = rows.get_state()["clock"][:, CLOCK.elapsed].astype(np.int64)
            step = np.minimum(elapsed, len(actions) - 1)
            return np.asarray(actions[step, np.arange(rows.num_envs)], dtype=kind)

        return act

    return PolicyFactory(make, name)


def uniform(seed: int = TEST_SEED) -> PolicyFactory:
    """The random policy, which draws the same actions in every evaluation.

    Args:
        seed: Seed of the starts; the actions are drawn from another stream of it.
    """

    def make(envs: Any) -> ActionFunction:
        stream = np.random.default_rng(row_seeds(seed, 1, "random policy"))
        draw = RandomPolicy(envs.single_action_space, stream)
        return lambda observations: draw.predict(observations)[0]

    return PolicyFactory(make, "random")


def _zero(envs: Any) -> ActionFunction:
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


def untrained_policy(env_id: str, name: str) -> tuple[str, PolicyFactory]:
    """An untrained policy of an id, and its own name.

    Args:
        env_id: Gymnasium's id.
        name: One of `untrained_policies`, or "reference" for the best reference controller.

    Raises:
        ValueError: none of the name; names those that there are.
    """
    policies = untrained_policies(env_id)
    chosen = next(iter(reference_controllers(env_id)), name) if name == "reference" else name
    if chosen not in policies:
        raise ValueError(f"{env_id}: controller = {name!r}; expected one of {list(policies)}")
    return chosen, policies[chosen]


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
        return untrained_policy(env_id, policy)[1]
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
        raise ValueError(
            f"env = {rows}; expected native rows for {name}, which reads states: leave out env"
        )
    return rows
