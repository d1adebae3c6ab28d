"""Environments by id, and the adapter of a training: what is refused, listed and continued."""

from collections.abc import Iterator
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import tests.agents.drift  # noqa: F401, registers the environment
from agents.environments import make
from agents.training.rows import TrainingRows
from tests.sb3.script import Script, steps


def test_ended_episodes_are_listed_once() -> None:
    env = TrainingRows(Script())
    env.reset()
    steps(env, 3)
    n, one, *two = env.num_envs, *env.pop_episodes()
    assert (one["t"], one["r"]) == (2 * n, 3.0)
    told = [(each["t"], each["l"], each["is_success"]) for each in two]
    assert told == [(3 * n, 3, 0), (3 * n, 3, 1)]
    assert env.pop_episodes() == []


@pytest.mark.parametrize("env_id", ["Drift-v0", "RigidEnvs/BallParkGoal-v0"])
def test_continuation_from_a_state_is_bitwise(env_id: str) -> None:
    env, other = (TrainingRows(make(env_id, {}, 5)) for _ in range(2))
    env.seed(1)
    env.reset()
    other.reset()
    push = np.full((5, 2), 0.3, np.float32)
    for _ in range(70):
        env.step(push)
    other.set_state(env.get_state())
    for _ in range(70):
        ours, theirs = env.step(push), other.step(push)
        seen, again = (each[0] if isinstance(each[0], dict) else {"": each[0]}
                       for each in (ours, theirs))  # fmt: skip
        for name in seen:
            np.testing.assert_array_equal(seen[name], again[name])
        for mine, other_s in zip(ours[1:3], theirs[1:3], strict=True):
            np.testing.assert_array_equal(mine, other_s)
        assert str(ours[3]) == str(theirs[3])


TASKS = "rigid_envs.systems.free_body.tasks"
NO_SETTINGS = {
    "render_mode": "human",
    "wrappers": ["a:b"],
    "num_envs": 3,
    "autoreset_mode": "Disabled",
    "vectorization_mode": "sync",
    "vector_kwargs": {},
}


@pytest.fixture(autouse=True)
def raw() -> Iterator[None]:
    """An environment of our class that is not registered by `rigid_envs.register`."""
    gym.register(
        "Raw-v0",
        vector_entry_point="rigid_envs.envs:RigidVectorEnv",
        kwargs={"task": f"{TASKS}:Detumble"},
    )
    yield
    del gym.registry["Raw-v0"]


@pytest.mark.parametrize(
    ("env_id", "kwargs", "message"),
    [
        ("Drift-v1", {}, r"^config\.env_id: .* did you mean 'Drift-v0'\?"),
        ("nowhere:Drift-v0", {}, r"^config\.env_id: .* --allow-import nowhere"),
        ("CartPole-v2", {}, r"^config\.env_id: .*did you mean 'CartPole-v1'"),
        ("Drift-v0", {"noise": 7}, r"^config\.env_kwargs\.noise: expected a number in \[0, 1\]"),
        ("Drift-v0", {"nose": 7}, r"^config\.env_kwargs: .*nose"),
        *(
            (env_id, {key: value}, rf"^config\.env_kwargs\.{key}: ")
            for env_id in ("Drift-v0", "RigidEnvs/Detumble-v0")
            for key, value in NO_SETTINGS.items()
        ),
        ("RigidEnvs/Detumble-v0", {"task": f"{TASKS}:Detumble"}, r"^config\.env_kwargs\.task"),
        ("Raw-v0", {"task": f"{TASKS}:Reorient"}, r"^config\.env_kwargs\.task"),
    ],
)
def test_an_environment_that_cannot_be_is_refused_by_key(
    env_id: str, kwargs: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        make(env_id, kwargs, 2)
