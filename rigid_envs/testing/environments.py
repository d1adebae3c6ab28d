"""Ids and settings that the contracts use."""

from collections.abc import Iterable
from dataclasses import fields
from functools import cache
from typing import Any, cast

import gymnasium as gym
import numpy as np
import numpy.typing as npt
import pytest

from rigid_envs.base.checks import ConfigError
from rigid_envs.envs import lookup
from rigid_envs.envs.shells import RigidEnv, RigidVectorEnv
from rigid_envs.mechanics.equations import RollingContact
from rigid_envs.tasks.fields import span
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tasks.task import Task
from rigid_envs.testing.deep import difference
from rigid_envs.testing.ids import OWN, are_named, chosen

# What every contract needs: the ids, environments to run, actions to try, bits to compare.
#
# What the contracts count (steps, episodes, drawn settings) is counted over all ids of this package
# together, and each id gets its `share`; the long versions give it all to each.

IDS = chosen()

# settings under which an episode may also end before its time, for the tasks that can end
EARLY_ENDS: dict[str, dict[str, Any]] = {
    env_id: dict(ENVIRONMENTS[env_id].early_end) for env_id in IDS if ENVIRONMENTS[env_id].early_end
}

HORIZON = 4  # steps of the episodes in which they do


def about_early_end(env_id: str, seen: str) -> str:
    """What is wrong with the settings that an id is registered with, in words."""
    return (
        f"early_end = {dict(ENVIRONMENTS[env_id].early_end)} of {env_id}; expected settings under "
        f"which random actions end some episodes within {HORIZON} steps and others not, or {{}} "
        f"where nothing ends an episode before its time limit: {seen}. It is an argument of "
        "rigid_envs.register"
    )


def single(env_id: str, **config: Any) -> RigidEnv:
    """The environment itself, without the time limit around it."""
    return cast(RigidEnv, gym.make(env_id, **config).unwrapped)


def vector(env_id: str, n: int, /, **config: Any) -> RigidVectorEnv:
    """N native rows."""
    envs: Any = gym.make_vec(env_id, num_envs=n, vectorization_mode="vector_entry_point", **config)
    return cast(RigidVectorEnv, envs.unwrapped)


def fresh(env: Any, seed: int = 0) -> Any:
    """The environment in the first episode of a seed."""
    env.reset(seed=seed)
    return env


@cache
def task_of(env_id: str) -> Task:
    """The task with its default settings."""
    return lookup.task_of(env_id)


DISCRETE = tuple(env_id for env_id in IDS if task_of(env_id).n_choices)
CONTINUOUS = tuple(env_id for env_id in IDS if not task_of(env_id).n_choices)
GOALS = tuple(env_id for env_id in IDS if task_of(env_id).n_goal)
ROLLING = tuple(env_id for env_id in IDS if issubclass(task_of(env_id).system_type, RollingContact))
ATTITUDES = tuple(env_id for env_id in IDS if "q" in task_of(env_id).system_type.components)


def examples_of_all() -> tuple[str, ...]:
    """The first id of each system, the first goal and the first discrete one."""
    systems: dict[type, str] = {}
    for env_id in IDS:
        systems.setdefault(task_of(env_id).system_type, env_id)
    return tuple(dict.fromkeys([*systems.values(), *GOALS[:1], *DISCRETE[:1]]))


FULL = IDS if are_named() else examples_of_all()
"""Ids whose three kernels are run: plain, with noise and delay, and reduced; of others the plain.

Each takes seconds to compile. Ids that are given are run in full; of those of this package, which
share the code that disturbs and reduces, some at every push, and all where a test is long.
"""

NOISY = {"observation_noise": 0.02, "action_delay": (0, 3)}
REDUCED = {"frame": "reduced"}
OF_KERNELS = {*NOISY, *REDUCED, "action_noise"}
"""Settings by which another kernel is run than the plain one."""
KERNELS = (
    *((env_id, {}) for env_id in IDS),
    *((env_id, NOISY) for env_id in FULL),
    *((env_id, REDUCED) for env_id in FULL if task_of(env_id).reduction),
)
"""Id and settings of each kernel that the contracts run."""


def in_full(ids: Iterable[str]) -> pytest.MarkDecorator:
    """Give a test that needs another kernel than the plain one the ids in full, others if long."""
    params = (pytest.param(i, marks=() if i in FULL else pytest.mark.long) for i in ids)
    return pytest.mark.parametrize("env_id", list(params))


PUSH = (pytest.mark.long, pytest.mark.push)
"""Of a long test that is run at every push."""


def share(total: int) -> int:
    """What falls to one id of a total over all of this package, rounded up."""
    return -(-total // len(OWN))


def counted(name: str, total: int, first: int = 1) -> pytest.MarkDecorator:
    """Give a test its share of a total; its long version all of it, for each id.

    Args:
        name: Of the parameter.
        total: Over all ids of this package.
        first: By how much less is enough in the command of the README; the rest is for every push.
    """
    shares = {f"{total / first:g} in all": pytest.param(share(-(-total // first)))}
    if first > 1:
        shares[f"{total:g} in all"] = pytest.param(share(total), marks=PUSH)
    shares[f"{total:g} each"] = pytest.param(total, marks=pytest.mark.long)
    return pytest.mark.parametrize(name, [*shares.values()], ids=[*shares])


@cache
def rules(env_id: str) -> dict[str, Any]:
    """What each setting may be."""
    return {field.name: field.metadata["rule"] for field in fields(task_of(env_id))}


@cache
def ranges(env_id: str) -> dict[str, tuple[float, float]]:
    """A range of a tenth around as many physical parameters as the task allows at once.

    Parameters that are drawn from a range by default keep it.
    """
    chosen: dict[str, tuple[float, float]] = {}
    for name in task_of(env_id).physical_parameters():
        low, high = span(getattr(task_of(env_id), name))
        room = 0.0 if low < high else 0.1 * abs(low) or 0.01
        for pair in ((low - room, high + room), (low, high + room), (low - room, high)):
            try:
                lookup.task_of(env_id, {**chosen, name: pair})
            except ConfigError:
                continue
            chosen[name] = pair
            break
    assert chosen, f"no physical parameter of {env_id} can be a range"
    return chosen


def representations(env_id: str) -> tuple[str, ...]:
    """The ways in which an environment can show its attitude; "none" is one of them."""
    return tuple(rules(env_id)["rotation"].options)


def quiet(env_id: str) -> dict[str, Any]:
    """Drawn parameters that are observed, and an attitude, in another way for each id."""
    shown = representations(env_id)
    rotation = shown[IDS.index(env_id) % len(shown)]
    return {**ranges(env_id), "observe_params": True, "rotation": rotation}


def noisy(env_id: str) -> dict[str, Any]:
    """Noise wherever it can be, and delay."""
    return NOISY | ({} if env_id in DISCRETE else {"action_noise": (0.0, 0.2)})


def rich(env_id: str) -> dict[str, Any]:
    """Settings that use everything a task has; noise and delay only of ids in `FULL`."""
    return quiet(env_id) | (noisy(env_id) if env_id in FULL else {})


def ending(env_id: str) -> dict[str, Any]:
    """The same, and episodes that may also end before their time where the task can end."""
    return {**rich(env_id), **EARLY_ENDS.get(env_id, {})}


def n_actions(env_id: str) -> int:
    """Length of an action; 1 for a choice."""
    return len(task_of(env_id).actions())


def is_round(env_id: str) -> bool:
    """Whether actions are clipped by their norm: a disk, a ball."""
    frame = task_of(env_id).actions()[0].frame
    return "disk" in frame or "ball" in frame


def actions(env_id: str, n_steps: int, n_rows: int, seed: int = 0) -> npt.NDArray[Any]:
    """Actions of shape (n_steps, n_rows, n_action), a few of them outside the space.

    Of a discrete environment: choices, of shape (n_steps, n_rows).
    """
    rng = np.random.default_rng(seed)
    if n_choices := task_of(env_id).n_choices:
        return rng.integers(0, n_choices, (n_steps, n_rows))
    shape = (n_steps, n_rows, n_actions(env_id))
    return rng.uniform(-1.2, 1.2, shape).astype(np.float32)


def still(env_id: str, n_rows: int) -> npt.NDArray[Any]:
    """The action 0 for every row: in the middle of the space, or the first choice."""
    return np.zeros_like(actions(env_id, 1, n_rows)[0])


def flat(observation: Any) -> npt.NDArray[np.float32]:
    """All entries of an observation in the order of ``task.observations()``, goals first."""
    if isinstance(observation, dict):
        parts = ("achieved_goal", "desired_goal", "observation")
        return np.concatenate([observation[part] for part in parts], axis=-1)
    return np.asarray(observation)


def bounds(space: gym.Space[Any]) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    """Lower and upper bound of every entry of `flat` observations."""
    boxes = space.spaces if isinstance(space, gym.spaces.Dict) else {"observation": space}
    low, high = (
        {name: getattr(box, end) for name, box in boxes.items()} for end in ("low", "high")
    )
    return (flat(low), flat(high)) if len(boxes) > 1 else (low["observation"], high["observation"])


def pick(result: Any, rows: Any) -> Any:
    """Some rows of a result: of an array, or of every array of a dictionary."""
    if isinstance(result, dict):
        return {key: pick(part, rows) for key, part in result.items()}
    return result[rows]


def assert_same_bits(a: Any, b: Any, where: str = "") -> None:
    """Two results, however nested, are of the same types and equal in every bit."""
    told = difference(a, b, where)
    assert told is None, told


def assert_refused(env: Any, action: Any, *names: str) -> None:
    """An action is refused, naming the id and `names`; the state keeps every bit."""
    before = env.unwrapped.get_state()
    with pytest.raises(ValueError) as refusal:
        env.step(action)
    for name in (env.spec.id, *names):
        assert name in str(refusal.value)
    assert "in shape ()" not in str(refusal.value)  # one number has no shape to tell
    assert_same_bits(env.unwrapped.get_state(), before)


def row_of(infos: dict[str, Any], row: int) -> dict[str, Any]:
    """What a single environment would have in its info."""
    return {
        key: value[row].item()
        for key, value in infos.items()
        if not key.startswith("_") and not key.startswith("final_")
    }


def weights(task: Task) -> dict[str, float]:
    """Weight of each reward term, from the fields that are documented to hold it."""
    assert {f"weight_{term}" for term in task.terms} <= {field.name for field in fields(task)}
    return {term: getattr(task, f"weight_{term}") for term in task.terms}


def free_entries(task: Task) -> list[int]:
    """Places of the state that the task does not hold at 0."""
    system = task.system_type
    places = range(len(system.state_entries))
    fixed = {k for name in task.fixed_components for k in places[system.components[name]]}
    return [k for k in places if k not in fixed]


def break_physics(env: RigidEnv | RigidVectorEnv, row: int = 0) -> None:
    """Put a state into a row that no physics leads to; the next step ends its episode."""
    state = env.get_state()
    y = state["y"][row] if isinstance(env, RigidVectorEnv) else state["y"]
    y[free_entries(env.task)] = 1e300
    env.set_state(state)
