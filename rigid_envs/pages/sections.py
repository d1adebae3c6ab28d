"""Sections of the docstring of a task, which its page and `rigid-envs describe` show.

A docstring has this form. The paragraphs of a section are indented; one may be an item of a list,
which begins with "- ". A subclass writes its summary, description and reference, and those other
sections in which it differs from its parent.

    One-line summary.

    Description: paragraphs without a heading.

    Physics:
        ...

    Rewards:
        ...

and so on, through all `SECTIONS`.
"""

import inspect
import re
import textwrap
from collections.abc import Mapping
from dataclasses import dataclass

from rigid_envs.tasks import Task

__all__ = [
    "SECTIONS",
    "DocstringError",
    "TaskDocstring",
    "blocks",
    "docstring_of",
    "summary_of",
    "text_of",
]

SECTIONS = (
    "Physics",
    "Rewards",
    "Starting State",
    "Episode End",
    "Reference",
    "Version History",
    "Source",
)
"""Sections of a docstring, in their order, after the description."""

_OWN = "Reference"  # the section that is not inherited
_HEADING = re.compile(r"^(\w[\w ]*):$\n?", re.MULTILINE)


class DocstringError(ValueError):
    """The docstring of a task lacks the form that its page is made from."""


@dataclass(frozen=True)
class TaskDocstring:
    """A parsed docstring: summary line, paragraphs of the description, and of each section."""

    summary: str
    description: list[str]
    sections: Mapping[str, list[str]]


def docstring_of(kind: type[Task]) -> TaskDocstring:
    """The docstring of a task; sections that it leaves out are those of its parents.

    Raises:
        DocstringError: names the class and what is missing or out of order.
    """
    own, *bases = [base for base in kind.__mro__ if issubclass(base, Task)]
    others = [base for base in bases if not inspect.isabstract(base)]
    docstring = _read(own)
    if _OWN not in docstring.sections:
        raise _refusal(own, f"has no section {_OWN!r} of its own")
    sections = dict(docstring.sections)
    for base in others:
        sections = {**_read(base).sections, **sections}
    for name in SECTIONS:
        if name not in sections:
            raise _refusal(own, f"has no section {name!r}")
    return TaskDocstring(docstring.summary, docstring.description, sections)


def summary_of(kind: type[object]) -> str:
    """The first line of the docstring of a class."""
    return text_of(kind)[0]


def text_of(kind: type[object]) -> list[str]:
    """Paragraphs of the docstring of any class, without its lists of attributes and errors."""
    parts = blocks(inspect.cleandoc(kind.__doc__ or ""))
    return [part for part in parts if not part.startswith(("Attributes: ", "Raises: "))]


def blocks(text: str) -> list[str]:
    """Paragraphs and items of lists, each on one line; code stands between single backticks."""
    parts = re.split(r"\n\s*\n|\n(?=- )", text.strip())
    return [" ".join(part.replace("``", "`").split()) for part in parts]


def _read(kind: type[Task]) -> TaskDocstring:
    """The sections that the docstring of this very class has."""
    text = inspect.cleandoc(kind.__doc__ or "")
    summary, _, rest = text.partition("\n\n")
    description, *parts = _HEADING.split(rest)
    if not summary.endswith(".") or "\n" in summary:
        raise _refusal(kind, f"begins with {summary!r}, which is no sentence on one line")
    if not description.strip():
        raise _refusal(kind, "has no description after the summary")
    names, bodies = parts[::2], parts[1::2]
    if names != [name for name in SECTIONS if name in names]:
        raise _refusal(kind, f"has the sections {', '.join(names)}")
    for name, body in zip(names, bodies, strict=True):
        _check_body(kind, name, body)
    sections = {
        name: blocks(textwrap.dedent(body)) for name, body in zip(names, bodies, strict=True)
    }
    return TaskDocstring(summary, blocks(description), sections)


def _check_body(kind: type[Task], name: str, body: str) -> None:
    if not body.strip():
        raise _refusal(kind, f"has nothing in its section {name!r}")
    for line in body.splitlines():
        if line and not line.startswith("    "):
            raise _refusal(kind, f"has the line {line!r}, not indented, in its section {name!r}")


def _refusal(kind: type[Task], what: str) -> DocstringError:
    return DocstringError(
        f"the docstring of {kind.__name__} {what}; expected a summary on one line, a description, "
        f"and the sections {', '.join(SECTIONS)}, in this order"
    )
