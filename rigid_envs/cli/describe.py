"""All that a newcomer wants to know of one environment: `rigid-envs describe`.

Everything is read off the task, its fields and the registry: nothing about a task is written here.
"""

import inspect
import pprint
import sys
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

from gymnasium import spaces

from rigid_envs.cli.catalogue import size_of, story, task_of, time_limit
from rigid_envs.cli.tables import WIDTH, paragraphs, table
from rigid_envs.envs.boundary import action_space, info_keys, observation_space
from rigid_envs.tasks import Entry, Task
from rigid_envs.tasks.fields import Choice, Flag, Integer, Number

__all__ = ["describe", "example"]

_EXAMPLE = """\
import gymnasium as gym
import rigid_envs

{settings}env = gym.make("{env_id}"{given})
observation, info = env.reset(seed=0)
terminated = truncated = False
while not (terminated or truncated):
    action = env.action_space.sample()
    observation, reward, terminated, truncated, info = env.step(action)
print(info)

envs = gym.make_vec("{env_id}", num_envs=256{given})
observations, infos = envs.reset(seed=0)
"""


def describe(env_id: str, config: Mapping[str, Any]) -> str:
    """What an environment asks, shows, pays and takes.

    Args:
        env_id: id of the environment.
        config: hyperparameters that are not to have their defaults.

    Raises:
        UnknownIdError: no such id.
        ConfigError: unknown key or bad value.
    """
    task = task_of(env_id, config)
    system = task.system_type
    sections = {
        env_id: paragraphs("\n\n".join(story(type(task)))),
        f"System: {system.__name__}": paragraphs("\n\n".join(story(system))),
        _heading("Action", action_space(task)): _actions(task),
        _heading("Observation", observation_space(task)): _observations(task),
        "Reward: the sum of weight x term": _terms(task),
        "Episode": _episode(env_id, task),
        "Hyperparameters: keyword arguments of gym.make": _hyperparameters(task, config),
        "Example": "\n".join(f"  {line}".rstrip() for line in example(env_id, config).splitlines()),
    }
    return "\n\n".join(f"{title}\n{'=' * len(title)}\n{text}" for title, text in sections.items())


def example(env_id: str, config: Mapping[str, Any]) -> str:
    """A program that runs the environment with these hyperparameters."""
    given = pprint.pformat(dict(config), width=WIDTH - 12, sort_dicts=False)
    settings = f"settings = {given}\n" if config else ""
    return _EXAMPLE.format(env_id=env_id, settings=settings, given=", **settings" if config else "")


def _heading(name: str, space: spaces.Space[Any]) -> str:
    if isinstance(space, spaces.Dict):
        return f"{name}: a dictionary of {', '.join(space)}"
    if isinstance(space, spaces.Discrete):
        return f"{name}: one of {size_of(space)}, {space.dtype}"
    return f"{name}: {size_of(space)} number{'s' * (space.shape != (1,))}, {space.dtype}"


def _actions(task: Task) -> str:
    ends = ("first", "last") if task.n_choices else ("at -1", "at +1")
    return _entries(task.actions(), *ends)


def _observations(task: Task) -> str:
    entries, n = task.observations(), task.n_goal
    text = _entries(entries[2 * n :], "low", "high")
    if not n:
        return text
    goal = _entries(entries[n : 2 * n], "low", "high")
    return f"  observation\n\n{text}\n\n  achieved_goal and desired_goal\n\n{goal}"


def _entries(entries: Sequence[Entry], low: str, high: str) -> str:
    rows = [
        (str(k), entry.symbol, entry.unit, entry.frame, f"{entry.low:.6g}", f"{entry.high:.6g}")
        for k, entry in enumerate(entries)
    ]
    return table(("index", "symbol", "unit", "frame", low, high), rows, "><<<>>")


def _terms(task: Task) -> str:
    weights = task.constants()[: len(task.terms)]  # the weights come first
    meaning = {field.name: field.metadata["rule"].text for field in fields(task)}
    rows = [
        (term, f"{weight:g}", f"weight_{term}", meaning.get(f"weight_{term}", ""))
        for term, weight in zip(task.terms, weights, strict=True)
    ]
    return table(("term", "weight", "set by", "meaning"), rows, "<><<")


def _episode(env_id: str, task: Task) -> str:
    # beside the kernel, which a subclass in another file takes over
    start = inspect.getdoc(sys.modules[task.reset.__module__].start) or ""
    rows = [
        ("start", " ".join(start.split())),
        ("step", f"{task.dt:g} s, in {task.n_substeps} integrator step(s)"),
        ("truncated", f"after {time_limit(env_id, task)}"),
        ("terminated", "where the task says so above, or with physics_error"),
        ('info["cost"]', task.cost_unit),
        ("info", ", ".join(info_keys(task))),
    ]
    return table(("what", "value"), rows)


def _hyperparameters(task: Task, config: Mapping[str, Any]) -> str:
    rows = []
    for field in fields(task):
        rule, value = field.metadata["rule"], getattr(task, field.name)
        here = [_written(value) if field.name in config else ""] if config else []
        default = _written(field.default)
        rows.append((field.name, *here, default, rule.unit, _allowed(rule), rule.text))
    header = ("key", *(["here"] if config else []), "default", "unit", "allowed", "meaning")
    text = table(header, rows, "<>>" if config else "<>")
    return text + "\n\n  ~ or a pair (low, high), from which every reset draws"


def _written(value: Any) -> str:
    if isinstance(value, tuple):
        return f"({', '.join(map(_written, value))})"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _allowed(rule: Number | Integer | Choice | Flag) -> str:
    """The allowed values in as few signs as possible."""
    if isinstance(rule, Choice):
        return ", ".join(rule.options)
    if isinstance(rule, Flag):
        return "True, False"
    if rule.low == rule.high:
        return f"{rule.low:g}"
    return f"{rule.low:g} .. {rule.high:g}" + (" ~" if rule.drawn else "")
