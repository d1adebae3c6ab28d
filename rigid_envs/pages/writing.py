"""Pages of the documentation, one for each id, and their index: `rigid-envs docs`."""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces

from rigid_envs import ENVIRONMENTS
from rigid_envs.catalogue import families, task_of
from rigid_envs.envs.boundary import action_space, observation_space
from rigid_envs.files import write_atomic
from rigid_envs.pages.document import document, observed, short
from rigid_envs.pages.listing import size_of, time_limit
from rigid_envs.pages.markdown import markdown, table_lines
from rigid_envs.pages.sections import summary_of
from rigid_envs.pages.task_tables import Table
from rigid_envs.tasks import Task

__all__ = ["INDEX", "file_of", "index", "page", "pages", "write_pages"]

INDEX = "README.md"
_SPACE = "RigidEnvs/"
_DOI = re.compile(r"\bdoi:(10\.[^\s;,]*[^\s;,.])")
_NOTE = "<!-- Written by `rigid-envs docs`, from the docstrings: change those, not this page. -->"
_INTRODUCTION = (
    "The namespace of all ids is `RigidEnvs`. Numbers of the actions and observations are told "
    "before what they are: of a goal environment, those of its `observation` and of each of its "
    "goals. `rigid-envs describe ID` shows a page in the terminal, for any arguments."
)


def file_of(env_id: str) -> str:
    """Name of the file of the page of an id."""
    return env_id.removeprefix(_SPACE).removesuffix("-v0") + ".md"


def pages() -> dict[str, str]:
    """Every file of the documentation of the environments by its name: its text."""
    return {INDEX: index(), **{file_of(env_id): page(env_id) for env_id in ENVIRONMENTS}}


def write_pages(folder: Path) -> tuple[list[str], list[str]]:
    """Write every page, each at once: a reader sees the old or the new one.

    Returns:
        The names of the files that are new or changed, and of pages there that no id has.

    Raises:
        DocstringError: a docstring lacks a section; nothing is written.
    """
    texts = pages()
    folder.mkdir(parents=True, exist_ok=True)
    there = {path.name: path.read_text(encoding="utf-8") for path in sorted(folder.glob("*.md"))}
    changed = [name for name, text in texts.items() if there.get(name) != text]
    for name in changed:
        write_atomic(folder / name, texts[name])
    return changed, [name for name in there if name not in texts]


def page(env_id: str) -> str:
    """The page of an environment.

    Raises:
        UnknownIdError: no such id.
        DocstringError: the docstring of its task lacks a section.
    """
    task, name = task_of(env_id), file_of(env_id).removesuffix(".md")
    parts = [
        summary_of(type(task)),
        _family_of(env_id),
        "\n".join(table_lines(_glance(env_id, task))),
        markdown(document(env_id, task, {})),
    ]
    return "\n\n".join([_NOTE, f"# {name}", *(_linked(part, name) for part in parts)]) + "\n"


def index() -> str:
    """The page that lists all environments by family."""
    parts = [_NOTE, "# Environments", _INTRODUCTION]
    for family, ids in families().items():
        parts += [f"## {family}", "\n".join(table_lines(_family(ids)))]
    return "\n\n".join(parts) + "\n"


def _family_of(env_id: str) -> str:
    (family,) = (name for name, ids in families().items() if env_id in ids)
    return f"One of the [{family}]({INDEX}#{family.lower().replace(' ', '-')}) environments."


def _glance(env_id: str, task: Task) -> Table:
    rows = [
        ("Action Space", _space(action_space(task))),
        ("Observation Space", _space(observation_space(task))),
        ("import", f'gym.make("{env_id}")'),
    ]
    return Table(("id", f"`{env_id}`"), rows, "<=")


def _linked(text: str, name: str) -> str:
    """Text in which every other environment is a link to its page, and every paper one to it."""
    others = {file_of(env_id).removesuffix(".md") for env_id in ENVIRONMENTS} - {name}
    text = re.sub(f"`({'|'.join(sorted(others))})`", r"[`\1`](\1.md)", text)
    return _DOI.sub(r"[doi:\1](https://doi.org/\1)", text)


def _family(ids: Iterable[str]) -> Table:
    rows = []
    for env_id in ids:
        task = task_of(env_id)
        link = f"[`{env_id.removeprefix(_SPACE)}`]({file_of(env_id)})"
        summary = summary_of(type(task))
        rows.append((link, summary, _acts(task), _sees(task), time_limit(env_id, task)))
    return Table(("id", "Task", "Action", "Observation", "Time limit"), rows, "<<<<<")


def _acts(task: Task) -> str:
    return f"{size_of(action_space(task))}: {short(type(task).actions)}"


def _sees(task: Task) -> str:
    return f"{size_of(observation_space(task))}: {observed(task)}"


def _space(space: spaces.Space[Any]) -> str:
    """A space on one line; bounds that differ are those of the table."""
    if isinstance(space, spaces.Dict):
        parts = ", ".join(f"{name}: {_space(part)}" for name, part in space.items())
        return f"Dict({parts})"
    if not isinstance(space, spaces.Box):
        return repr(space)
    low, high = (
        str(bound[0]) if np.all(bound == bound[0]) else name
        for name, bound in (("Min", space.low), ("Max", space.high))
    )
    return f"Box({low}, {high}, {space.shape}, {space.dtype})"
