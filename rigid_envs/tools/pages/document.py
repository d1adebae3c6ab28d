"""Descriptions of environments: in the terminal, and as a page."""

import inspect
import math
import pprint
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any, NamedTuple

from gymnasium import spaces

from rigid_envs.envs.lookup import checked_id, task_of
from rigid_envs.envs.spaces import action_space
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tasks.task import Rolling, Task
from rigid_envs.tools.pages import tables

# Content of the page of one environment, in the order of Gymnasium's pages.
#
# It is read from the task, its docstring, its fields, the registry and the best known costs.
# `describe` formats it for a terminal, `markdown` for a file.

_ATTITUDES = {
    "matrix": "the 9 entries of R, row by row",
    "rot6d": "its first two columns",
    "quat": "w, x, y, z with w >= 0",
    "euler": "phi, theta, psi about z-x-z, singular at theta = 0",
    "none": "not at all",
}
_REFUSED = (
    "Wrong shapes, NaN and infinity are refused with a `ValueError`, and nothing changes then."
)
_REWARD = (
    "The reward of a step is the sum of weight x term. The weights are arguments; the terms "
    'without their weights are in `info["reward/<term>"]`.'
)
_PHYSICS_ERROR = (
    'It also terminates, without reward and with `info["physics_error"]`, if the motion becomes '
    "too fast for the integrator, which it cannot from a start that is drawn, or if a number "
    "of the state is larger than 1e9 or the reward is not finite."
)
_SLIP = (
    "The motion is that of rolling, whatever friction it needs: `info` says which. With "
    "`end_on_slip=True` an episode terminates, without success and with `slip_penalty` taken off "
    "the reward, in a step at whose end rolling needs more friction than the coefficient `mu` "
    'gives, or the body would leave its ground (`info["slips"]`).'
)
_ARGUMENTS = (
    "Keyword arguments of `gym.make` and `gym.make_vec`. Unknown names and values that are not "
    "allowed are refused with an error that names them."
)
_INFO = "The same keys at every step and reset; at a reset, numbers are 0 and flags are False."
_ACCESS = (
    "`env.unwrapped.system` is this system with the parameters of the episode: `rhs(y, u)`, "
    "`linearize(y, u)`, `invariants(y)`, `simulate(y, t, u)`; `env.unwrapped.y` is its state."
)


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
    return [
        Section("Description", docstring.description),
        Section("Action Space", _action(task)),
        _observation(task),
        *_reduced_frame(env_id, task),
        Section("Rewards", [*sections["Rewards"], _REWARD, tables.term_table(task)]),
        Section("Starting State", [*sections["Starting State"], _options(task)]),
        _episode_end(env_id, task, docstring),
        _arguments(env_id, task, given),
        Section("Info", [_INFO, tables.info_table(task)]),
        _physics(env_id, task, docstring),
        Section(
            "Reference score", [*sections["Reference"], *tables.reference_section(env_id, task)]
        ),
        Section("Version History", sections["Version History"]),
        Section("References", sections["Source"]),
    ]


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
        return [lead, table, "Any other value is refused with a `ValueError`."]
    lead = (
        f"{_array(len(table.rows))}: {what}. The last two columns are what -1 and 1 stand for; "
        "in between it is linear."
    )
    return [lead, table, f'{_clipping(task)} `info["action_clipped"]` tells. {_REFUSED}']


def _clipping(task: Task) -> str:
    """Clipping of actions outside their space; the frame of the entries tells a disk or ball."""
    shapes = {entry.frame.rpartition(", ")[2] for entry in task.actions()}
    if shape := shapes & {"disk", "ball"}:
        return f"Actions form the unit {shape.pop()}: a longer one is shortened to length 1."
    return "Entries outside [-1, 1] are clipped to it, each by itself."


def _array(n: int) -> str:
    return f"An array of shape ({n},) and type float32"


def _observation(task: Task) -> Section:
    title, what, n = "Observation Space", observed(task), task.n_goal
    table, attitude = tables.entry_table(task.observations()[2 * n :]), _attitude(task)
    if not n:
        return Section(title, [f"{_array(len(table.rows))}: {what}.", table, *attitude])
    goal = tables.entry_table(task.observations()[:n])  # the achieved one; the desired one is alike
    lead = (
        f"A dictionary of arrays of type float32: {what}. "
        "`env.unwrapped.compute_reward(achieved_goal, desired_goal, info)` computes rewards anew, "
        "for any number of pairs."
    )
    parts = [
        Section("`observation`", [f"{_array(len(table.rows))}.", table]),
        Section("`achieved_goal` and `desired_goal`", [f"{_array(len(goal.rows))} each.", goal]),
    ]
    return Section(title, [lead, *attitude], parts)


def _attitude(task: Task) -> list[str]:
    """Effect of `rotation` and `observe_params` on the observation."""
    rules = {field.name: field.metadata["rule"] for field in fields(task)}
    options = rules["rotation"].options
    drawn = "`observe_params=True` appends the parameters that are drawn from ranges."
    if len(options) == 1:
        return [drawn]
    ways = "; ".join(f'`"{option}"`, {_ATTITUDES[option]}' for option in options)
    return [f"The attitude, body to world, is shown as `rotation` says: {ways}. {drawn}"]


def _reduced_frame(env_id: str, task: Task) -> list[Section]:
    """The symmetries of the task and its observation in the reduced frame; none undeclared."""
    reduction = task.reduction
    if reduction is None:
        return []
    names = "; ".join(symmetry.name for symmetry in reduction.symmetries)
    goals = " The goals are as above." if task.n_goal else ""
    lead = (
        f'`gym.make("{env_id}", frame="reduced")` observes what no symmetry of the task changes, '
        "and takes actions in a frame that turns with the state, so that a policy learns each "
        f"manoeuvre once. The group is {reduction.group}: {names}. "
        f"The frame: {reduction.frame}"
    )
    after = f"An array of shape ({len(reduction.features)},) and type float32.{goals}"
    formulas = tables.blocks(inspect.cleandoc(reduction.formulas)) if reduction.formulas else []
    table = tables.entry_table(reduction.features)
    return [Section("Reduced Frame", [lead, after, table, *formulas])]


def _options(task: Task) -> str:
    names = ", ".join(f"`{name}`" for name in task.system_type.components)
    parameters = ", ".join(f"`{name}`" for name in task.physical_parameters())
    aux = ", ".join(f"`{name}`" for name in task.aux_names)
    beside = f" Beside the state the task keeps {aux}." if aux else ""
    return (
        f'`reset(options={{"state": {{...}}}})` starts from a state of your own, given by '
        f"components ({names}), or by some of them while the others are drawn; "
        f'`"params"` does so for parameters ({parameters}).{beside}'
    )


def _episode_end(env_id: str, task: Task, docstring: tables.TaskDocstring) -> Section:
    limit = tables.time_limit(env_id, task)
    limit = f"After {limit}; `gym.make(..., max_episode_steps=N)` says otherwise."
    slip = [_SLIP] if isinstance(task, Rolling) else []
    parts = [
        Section("Termination", [*docstring.sections["Episode End"], _PHYSICS_ERROR, *slip]),
        Section("Truncation", [limit]),
    ]
    return Section("Episode End", [], parts)


def _arguments(env_id: str, task: Task, given: Mapping[str, Any]) -> Section:
    words = [f"{key}={value!r}" for key, value in (given or tables.sample_arguments(task)).items()]
    code = f'env = gym.make("{env_id}", {", ".join(words)})'
    table = tables.argument_table(task, given)
    return Section("Arguments", [_ARGUMENTS, table, tables.RANGE_NOTE, Code(code)])


def _physics(env_id: str, task: Task, docstring: tables.TaskDocstring) -> Section:
    system = task.system_type
    part = Section(f"System `{system.__name__}`", [*tables.text_of(system), _ACCESS])
    body = [*docstring.sections["Physics"], *_integrator_step(env_id, task)]
    return Section("Physics", body, [part])


def _integrator_step(env_id: str, task: Task) -> list[str]:
    """The step of the integrator in the stability envelope; empty where any step is stable."""
    limit = ENVIRONMENTS[env_id].max_episode_steps * task.dt
    step, rate = task.dt / task.n_substeps, task.largest_rate(limit)
    envelope = task.largest_turn
    if not math.isfinite(envelope):
        return []
    return [
        f"The integrator step, `dt` / `n_substeps`, is {step:.3g} s. Within the time limit rates "
        f"are at most {rate:.3g} rad/s, {rate * step:.3g} rad per step; at most {envelope:.3g} rad "
        "is accepted."
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
        Section("Example", [Code(example(env_id, config))]),
    ]
    return "\n\n".join(_lines(sections, "="))


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
