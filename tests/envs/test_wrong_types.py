"""Arguments of any type are taken or refused by name, by each public method."""

from collections.abc import Callable, Iterator
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from rigid_envs.sb3.adapter import GymnasiumVecEnv
from rigid_envs.testing.environments import single, vector

QUICK = ("RigidEnvs/Reorient-v0", "RigidEnvs/BallGrid-v0")


class Hostile:
    """An object all of whose own code fails."""

    def _fail(self, *_: Any) -> Any:
        raise RuntimeError

    __repr__ = __eq__ = __hash__ = __bool__ = __index__ = __float__ = __array__ = _fail


VALUES: list[Any] = [
    *(None, True, "", "left", "\ud800", b"x", bytearray(b"x"), 1j, object(), object, len, ...),
    *([], [None], [[1], [1, 2]], [Hostile()], (), {}, {1: 2}, {"q": Hostile()}, set(), {1}),
    *(-1, 8, 10**400, -(2**63), 0.5, 1e300, float("nan"), float("inf"), np.int8(-1)),
    *(np.zeros(0), np.zeros((2, 2, 2)), np.array(1), np.array("a"), np.array([None, 1])),
    *(np.datetime64("NaT"), range(9), slice(1), iter([1]), memoryview(b"ab"), Hostile()),
]
Calls = Iterator[tuple[str, Callable[[Any], object]]]


def of_both(env: Any, make: Callable[..., Any]) -> Calls:
    """Methods and arguments that single and vector environments share."""
    state = env.get_state()
    for name in ("render_mode", "width", "height", "camera", "dt", "rotation", "action_delay"):
        yield name, lambda v, name=name: make(**{name: v})
    yield "follow", lambda v: make(camera={"follow": v})
    yield "action", env.step
    yield "eed", lambda v: env.reset(seed=v)  # Seed, as Gymnasium says it
    yield "options", lambda v: env.reset(options=v)
    for name in ("state", "params", "reset_mask"):
        yield name, lambda v, name=name: env.reset(options={name: v})
    yield "state", env.set_state
    for name in state:
        yield name, lambda v, name=name: env.set_state({**state, name: v})
    yield "name", env.auxiliary
    if env.task.n_goal:
        goal = np.zeros(env.task.n_goal)
        yield "goal", lambda v: env.compute_reward(v, goal, {})
        yield "goal", lambda v: env.compute_reward(goal, v, {})


def of_one(env_id: str) -> Calls:
    """Those of a single environment."""
    env = single(env_id)
    env.reset(seed=0)
    task = env.spec.kwargs["task"]  # Gymnasium's own `make` fails on most types of render_mode
    yield from of_both(env, lambda **settings: type(env)(task, **settings))


def of_rows(env_id: str) -> Calls:
    """Those of a vector environment."""
    envs = vector(env_id, 2)
    envs.reset(seed=0)
    task = envs.spec.kwargs["task"]
    yield from of_both(envs, lambda **settings: type(envs)(task, **settings))
    names = ("num_envs", "max_episode_steps", "autoreset_mode", "num_threads")
    for name in (*names, "infos_on_request", "render_rows"):
        yield name, lambda v, name=name: type(envs)(task, **{name: v})
    yield "row", envs.moment
    yield "attribute", envs.call


def of_adapter(env_id: str) -> Calls:
    """Those of the adapter for Stable-Baselines3."""
    envs = GymnasiumVecEnv(vector(env_id, 2, autoreset_mode="SameStep"))
    envs.reset()
    yield "venv", GymnasiumVecEnv
    yield "eed", lambda v: (envs.seed(v), envs.reset())
    yield "options", lambda v: (envs.set_options(v), envs.reset())
    yield "action", envs.step
    yield "attribute", envs.get_attr
    yield "attribute", lambda v: envs.set_attr(v, 1)
    yield "method", envs.env_method
    yield "wrapper_class", envs.env_is_wrapped
    for call in (envs.get_attr, envs.env_method):
        yield "indices", lambda v, call=call: call("get_state", indices=v)
    yield "indices", lambda v: envs.env_is_wrapped(object, v)


@pytest.mark.parametrize("calls", [of_one, of_rows, of_adapter])
@pytest.mark.parametrize("env_id", QUICK)
def test_what_is_wrong_is_refused_by_name(env_id, calls):
    unnamed = []
    for name, call in calls(env_id):
        for value in VALUES:
            try:
                call(value)
            except (ValueError, TypeError, AttributeError, gym.error.Error) as error:
                if name not in str(error):
                    unnamed.append((name, type(value), error))
            except Exception as error:
                unnamed.append((name, type(value), error))
    assert not unnamed


@pytest.mark.parametrize("row", [-1, -2, 2, 8, 5000, 0.0, True, None, "0", [0]])
def test_a_moment_is_that_of_a_row(row):
    envs = vector(QUICK[0], 2)
    envs.reset(seed=0)
    with pytest.raises(ValueError, match=r"row = .*; expected an integer from 0 to 1"):
        envs.moment(row)
    for good in (0, 1, np.int64(1)):
        assert (envs.moment(good).y == envs.y[good]).all()
