"""The page of one environment for a terminal: `rigid-envs describe`."""

import pprint
import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

from rigid_envs.catalogue import checked_id, task_of
from rigid_envs.pages.document import Code, Section, document
from rigid_envs.pages.sections import summary_of
from rigid_envs.pages.tables import WIDTH, paragraphs, table
from rigid_envs.pages.task_tables import Table
from rigid_envs.registry import ENVIRONMENTS

__all__ = ["describe", "example"]

_SIDES = str.maketrans("=", "<")
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
        Section(env_id, [summary_of(type(task))]),
        *document(env_id, task, config),
        Section("Example", [Code(example(env_id, config))]),
    ]
    return "\n\n".join(_lines(sections, "="))


def example(env_id: str, config: Mapping[str, Any]) -> str:
    """An example program that runs the environment with these hyperparameters."""
    given = pprint.pformat(dict(config), width=WIDTH - 12, sort_dicts=False)
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


def _block(block: str | Table | Code) -> str:
    if isinstance(block, Table):
        return table(block.header, block.rows, block.kinds.translate(_SIDES))
    if isinstance(block, Code):
        return textwrap.indent(block.text.rstrip(), "  ")
    return paragraphs(block)
