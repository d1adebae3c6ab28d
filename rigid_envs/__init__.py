"""rigid-envs: Gymnasium environments for rigid-body rotation.

Importing the package registers its ids, ``RigidEnvs/<Name>-v0``::

    import gymnasium as gym
    import rigid_envs
    env = gym.make("RigidEnvs/BallPark-v0")
    envs = gym.make_vec("RigidEnvs/BallPark-v0", num_envs=256)
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

import gymnasium

from rigid_envs.tasks.registry import ENVIRONMENTS, EnvironmentRecord, add
from rigid_envs.tasks.registry import load as load_object

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from rigid_envs.scores.comparison import Comparison
    from rigid_envs.scores.references import Reference
    from rigid_envs.scores.result import Evaluation
    from rigid_envs.scores.trained import CompiledPolicy

__all__ = ["ENVIRONMENTS", "__version__", "compare", "evaluate", "load", "reference", "register"]

__version__ = "0.1.0"

_HANDED_ON = {
    **{"bodies": "mechanics.bodies", "rotations": "mechanics.rotations", "systems": "systems"},
    **{"sb3": "sb3", "extending": "extending", "testing": "testing", "scores": "scores"},
    **{"control": "control", "replays": "watch.replays", "films": "watch.films"},
}


def register(
    env_id: str,
    task: str,
    max_episode_steps: int,
    *,
    family: str = "Other",
    goal: bool | None = None,
    **more: Any,
) -> EnvironmentRecord:
    """Register an environment of another package, in its single and its vector form.

    From then on it is one of `ENVIRONMENTS`, as those of this package are: it can be described,
    gets a page, is scored and is tested by the contracts.

    Args:
        env_id: Gymnasium's id, ``Namespace/Name-v0``.
        task: Task class, as "module:Class".
        max_episode_steps: Time limit in steps.
        family: Heading under which tables and pages list it.
        goal: Whether it is a goal environment; None asks the task class, whose module is then
            imported at once.
        **more: Other attributes of `rigid_envs.tasks.registry.EnvironmentRecord`.

    Raises:
        ConfigError: a wrong task name or time limit, or an id that is registered already.
    """
    if goal is None:
        goal = bool(load_object(task).episode.Goal._fields)
    record = EnvironmentRecord(env_id, task, max_episode_steps, family, goal, **more)
    add(record)
    _register(record)
    return record


def evaluate(env_id: str, policy: Any, **options: Any) -> Evaluation:
    """Play a policy from the 500 fixed starts of an id, and measure success and efficiency.

    ``print(result)`` is a small table, ``result.save("row.json")`` writes a row of the leaderboard.

    Args:
        env_id: Gymnasium's id.
        policy: A model with `predict`, as Stable-Baselines3 has it, or `load` gives it; a function
            from the observations of all rows to their actions; or the name of a reference
            controller.
        **options: ``n``, ``seed``, ``config``, ``env``, ``name``: see `rigid_envs.scores.evaluate`.
    """
    scores = importlib.import_module("rigid_envs.scores")
    found: Evaluation = scores.evaluate(env_id, policy, **options)
    return found


def compare(env_id: str, policies: Mapping[str, Any], **options: Any) -> Comparison:
    """Play several policies from the same 500 starts, and compare them in pairs.

    ``print(result)`` is a table, ``result.latex()`` one for LaTeX, and
    ``result.figure("NAME.pdf")`` a figure of profiles and means.

    Args:
        env_id: Gymnasium's id.
        policies: By name, each as `evaluate` takes it, or what `evaluate` gave of it.
        **options: ``n``, ``seed``, ``config``: see `rigid_envs.scores.compare`.
    """
    scores = importlib.import_module("rigid_envs.scores")
    found: Comparison = scores.compare(env_id, policies, **options)
    return found


def load(name: str | Path) -> CompiledPolicy:
    """A trained policy that runs without torch, to the same bits on every x86-64 processor.

    Its ``predict`` is that of Stable-Baselines3; `evaluate` plays it in the frame that it knows.

    Args:
        name: A published one, "BallPark" or "RigidEnvs/BallPark-v0"; or the path of a
            ``policy.safetensors``, as `rigid_envs.sb3.export` writes it.

    Raises:
        ConfigError: none of that name; names those that there are.
    """
    found: CompiledPolicy = importlib.import_module("rigid_envs.scores.trained").load(name)
    return found


def reference(env_id: str, name: str | None = None, **settings: Any) -> Reference:
    """A reference controller as an agent, which acts on observations as a trained policy does.

    Its ``predict`` is that of Stable-Baselines3, with ``state`` and ``episode_start`` as recurrent
    policies have them; it acts in single, vector and wrapped environments. Of parameters that are
    drawn and not observed it takes the middle of the range.

    Args:
        env_id: Gymnasium's id, also in short: "BallPark".
        name: One of the id's controllers; None takes the best.
        **settings: Of the environment in which it is to act.

    Raises:
        ConfigError: An unknown id, name or setting, or a setting that hides what the controller
            needs; names it.
    """
    references = importlib.import_module("rigid_envs.scores.references")
    found: Reference = references.reference(env_id, name, **settings)
    return found


def _register(record: EnvironmentRecord) -> None:
    """Register an id with Gymnasium; again is harmless."""
    if record.id in gymnasium.registry:
        return
    kind = "RigidGoal" if record.goal else "Rigid"
    gymnasium.register(
        record.id,
        entry_point=f"rigid_envs.envs:{kind}Env",
        vector_entry_point=f"rigid_envs.envs:{kind}VectorEnv",
        max_episode_steps=record.max_episode_steps,
        kwargs={"task": record.task},
        # the environments refuse bad actions and a missing reset themselves
        disable_env_checker=True,
        order_enforce=False,
    )


def __getattr__(name: str) -> Any:
    """The modules that are used most, wherever they live; imported when they are asked for."""
    if name in _HANDED_ON:
        return importlib.import_module(f"rigid_envs.{_HANDED_ON[name]}")
    raise AttributeError(f"module 'rigid_envs' has no attribute {name!r}")


for _record in ENVIRONMENTS.values():
    _register(_record)
del _record
