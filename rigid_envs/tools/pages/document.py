"""Descriptions of environments: in the terminal, and as a page."""

import inspect
import math
import pprint
import re
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from gymnasium import spaces

from rigid_envs.envs.lookup import checked_id, task_of
from rigid_envs.envs.spaces import action_space
from rigid_envs.mechanics.system import System
from rigid_envs.scores.starts import FLOOR, METRICS
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tasks.task import Task
from rigid_envs.tools.pages import tables

# Content of the page of one environment, in the order of Gymnasium's pages.
#
# It is read from the task, its docstring, its fields, the registry and the best known costs.
# `describe` formats it for a terminal, `markdown` for a file.

SHARED = "What all environments share"
_COMMON = Path(__file__).with_name("common.md")  # what holds for all, said once


class Code(NamedTuple):
    """A block of Python."""

    text: str


class Section(NamedTuple):
    """A section: title, blocks and subsections."""

    title: str
    body: Sequence[str | tables.Table | Code]
    parts: Sequence["Section"] = ()


def document(env_id: str, task: Task, given: Mapping[str, Any]) -> list[Section]:
    """The sections of the page of an environment.

    Args:
        env_id: Gymnasium's id.
        task: Its task.
        given: Hyperparameters that differ from their defaults.

    Raises:
        DocstringError: the docstring of the task lacks a section.
    """
    docstring = tables.docstring_of(type(task))
    sections = docstring.sections
    found = [
        Section("Description", docstring.description),
        Section("Action Space", _action(task)),
        _observation(task),
        Section("Reduced Frame", _reduced_frame(task)),
        Section("Rewards", [*sections["Rewards"], tables.term_table(task)]),
        Section("Starting State", [*sections["Starting State"], *_kept(task)]),
        _episode_end(env_id, task, docstring),
        _arguments(env_id, task, given),
        Section("Info", [f"- `cost` (float): {task.cost_unit}, of this step."]),
        _physics(env_id, task, docstring),
        Section(
            "Reference score", [*sections["Reference"], *tables.reference_section(env_id, task)]
        ),
        Section("Version History", sections["Version History"]),
        Section("References", sections["Source"]),
    ]
    return [section for section in found if section.body or section.parts]


def short(method: Any) -> str:
    """Summary line of the docstring of a method, without capital and full stop."""
    text = (inspect.getdoc(method) or "").partition("\n")[0].rstrip(".")
    return text[:1].lower() + text[1:]


def observed(task: Task) -> str:
    """Summary of the entries of an observation."""
    attitude = ", attitude" if task.rotation != "none" else ""
    return short(type(task).features) + attitude


def _action(task: Task) -> list[str | tables.Table | Code]:
    what, table = short(type(task).actions), tables.action_table(task)
    if isinstance(action_space(task), spaces.Discrete):
        lead = f"An integer, one of {task.n_choices} choices: {what}."
        return [lead, table]
    return [f"{_shape(table)}: {what}.", table]


def _shape(table: tables.Table) -> str:
    return f"Shape ({len(table.rows)},)"


def _observation(task: Task) -> Section:
    title, what, n = "Observation Space", observed(task), task.n_goal
    table = tables.entry_table(task.observations()[2 * n :])
    if not n:
        return Section(title, [f"{_shape(table)}: {what}.", table])
    goal = tables.entry_table(task.observations()[:n])  # the achieved one; the desired one is alike
    lead = (
        f"A dictionary of arrays: {what}. "
        "`env.unwrapped.compute_reward(achieved_goal, desired_goal, info)` computes rewards anew, "
        "for any number of pairs."
    )
    parts = [
        Section("`observation`", [f"{_shape(table)}.", table]),
        Section("`achieved_goal` and `desired_goal`", [f"{_shape(goal)} each.", goal]),
    ]
    return Section(title, [lead], parts)


def _reduced_frame(task: Task) -> list[str | tables.Table | Code]:
    """The symmetries of the task and its observation in the reduced frame; none undeclared."""
    reduction = task.reduction
    if reduction is None:
        return []
    names = "; ".join(symmetry.name for symmetry in reduction.symmetries)
    table = tables.entry_table(reduction.features)
    goals = " The goals are as above." if task.n_goal else ""
    lead = f"{_shape(table)}.{goals} Frame: {reduction.frame}"
    formulas = tables.blocks(inspect.cleandoc(reduction.formulas)) if reduction.formulas else []
    return [lead, table, *formulas, f"Group ${reduction.group}$: {names}."]


def _kept(task: Task) -> list[str]:
    """Names of what the task keeps beside the state; empty where it keeps nothing."""
    return [f"The task keeps {_listed(task.aux_names)}."] if task.aux_names else []


def _listed(names: Iterable[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def _episode_end(env_id: str, task: Task, docstring: tables.TaskDocstring) -> Section:
    limit = tables.time_limit(env_id, task)
    parts = [
        Section("Termination", docstring.sections["Episode End"]),
        Section("Truncation", [f"After {limit}."]),
    ]
    return Section("Episode End", [], parts)


def _arguments(env_id: str, task: Task, given: Mapping[str, Any]) -> Section:
    words = [f"{key}={value!r}" for key, value in (given or tables.sample_arguments(task)).items()]
    code = f'env = gym.make("{env_id}", {", ".join(words)})'
    table = tables.argument_table(task, given)
    return Section("Arguments", [table, Code(code)])


def _physics(env_id: str, task: Task, docstring: tables.TaskDocstring) -> Section:
    lead = f"Equations of motion: `{task.system_type.__name__}`."
    return Section("Physics", [lead, *docstring.sections["Physics"], *_rates(env_id, task)])


def system_section(system: type[System]) -> Section:
    """A physical system: its equations, state and input, its parameters."""
    names = f"Components of the state by name: {_listed(system.components)}."
    return Section(f"System `{system.__name__}`", [*tables.text_of(system), names])


def common() -> list[Section]:
    """What all environments share: a step, starts and ends, arguments, `info`, scores."""
    _, *found = re.split(r"^### (.+)\n\n", _COMMON.read_text(encoding="utf-8"), flags=re.MULTILINE)
    metrics = [f"- `{name}`: {metric.text}." for name, metric in METRICS.items()]
    least = f"A cost counts as at least {FLOOR:g} of its unit, a time as at least `dt`."
    more: dict[str, list[Any]] = {"Arguments": [tables.shared_table()], "Scores": [*metrics, least]}
    whole = [
        Section(title, [*text.strip().split("\n\n"), *more.get(title, [])])
        for title, text in zip(found[::2], found[1::2], strict=True)
    ]
    return [Section(SHARED, [], whole)]


def _rates(env_id: str, task: Task) -> list[str]:
    """Rates, and what the integrator accepts; empty where any step is stable."""
    if not math.isfinite(task.largest_turn):
        return []
    rate = task.largest_rate(ENVIRONMENTS[env_id].max_episode_steps * task.dt)
    return [
        f"Rates are at most {rate:.3g} rad/s within the time limit; {task.largest_turn:.3g} rad "
        "per step of the integrator are accepted."
    ]


# The page of one environment for a terminal: `rigid-envs describe`.

_EXAMPLE = """\
import gymnasium as gym
import {package}

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
    """The page of an environment as text for a terminal.

    Args:
        env_id: Gymnasium's id.
        config: Hyperparameters that differ from their defaults.

    Raises:
        UnknownIdError: no such id.
        ConfigError: unknown key or bad value.
        DocstringError: the docstring of the task lacks a section.
    """
    env_id = checked_id(env_id)
    task = task_of(env_id, config)
    sections = [
        Section(env_id, [tables.summary_of(type(task))]),
        *document(env_id, task, config),
        system_section(task.system_type),
        Section("Example", [Code(example(env_id, config))]),
        *common(),
    ]
    return "\n\n".join(_lines(sections, "=")).replace("$", "`")  # marks of formulas


def example(env_id: str, config: Mapping[str, Any]) -> str:
    """An example program that runs the environment with these hyperparameters."""
    given = pprint.pformat(dict(config), width=tables.WIDTH - 12, sort_dicts=False)
    settings = f"settings = {given}\n" if config else ""
    package = ENVIRONMENTS[env_id].task.partition(":")[0].partition(".")[0]
    given = ", **settings" if config else ""
    return _EXAMPLE.format(env_id=env_id, package=package, settings=settings, given=given)


def _lines(sections: Sequence[Section], rule: str) -> list[str]:
    """Headings and blocks; headings of subsections have a lighter rule."""
    found = []
    for section in sections:
        title = section.title.replace("`", "")
        blocks = [f"{title}\n{rule * len(title)}", *map(_block, section.body)]
        # what belongs to a heading follows it at once
        found += ["\n".join(blocks[:2]), *blocks[2:], *_lines(section.parts, "-")]
    return found


def _block(block: str | tables.Table | Code) -> str:
    if isinstance(block, tables.Table):
        return tables.table(block.header, block.rows, block.kinds.translate(tables.SIDES))
    if isinstance(block, Code):
        return textwrap.indent(block.text.rstrip(), "  ")
    return tables.paragraphs(block)
