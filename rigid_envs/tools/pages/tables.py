"""Tables of tasks, of what is known of them, and of all ids."""

import inspect
import math
import re
import shutil
import sys
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import Field, fields
from typing import Any, NamedTuple

from gymnasium import spaces

from rigid_envs.base.settings import Choice, Flag, Integer, Number
from rigid_envs.envs.lookup import task_of
from rigid_envs.envs.spaces import action_space, observation_space
from rigid_envs.scores.best import Best, best_known, limit_of
from rigid_envs.scores.optima import stored_optima
from rigid_envs.scores.result import rates_of
from rigid_envs.scores.starts import METRICS, Cost
from rigid_envs.tasks.fields import Entry
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tasks.task import Rolling, Task

# Tables and paragraphs of plain text, of limited width.

WIDTH = 100
_GAP = 2


def line_width() -> int:
    """Largest length of a line: `WIDTH`, or that of the terminal if it is narrower."""
    if not sys.stdout.isatty():
        return WIDTH
    return min(WIDTH, max(shutil.get_terminal_size().columns, 40))


def table(
    header: Sequence[str],
    rows: Sequence[Sequence[str]],
    align: str = "",
    indent: int = 2,
    width: int | None = None,
) -> str:
    """Aligned columns under a ruled header; cells that are too long are wrapped between words.

    Where a line has no room for a word of each column, a row is one line for each cell instead.

    Args:
        header: Titles of the columns.
        rows: Cells, one sequence per row.
        align: "<" or ">" for each column; "<" where it is too short.
        indent: Blanks before every line.
        width: Largest length of a line; None for `line_width`.
    """
    width = line_width() if width is None else width
    cells = [list(header), *map(list, rows)]
    sizes = [max(len(row[k]) for row in cells) for k in range(len(header))]
    words = [
        max(len(word) for row in cells for word in row[k].split() or [""])
        for k in range(len(header))
    ]
    room = width - indent - _GAP * (len(header) - 1)
    margin = " " * indent
    if sum(words) > room:
        label = max(map(len, header))
        pair = label, width - indent - _GAP - label
        parts = (
            [line for each in zip(header, row, strict=True) for line in _lines(each, pair, "<<")]
            for row in rows
        )
        return "\n\n".join("\n".join((margin + line).rstrip() for line in part) for part in parts)
    while sum(sizes) > room:  # the widest column that can be wrapped between words
        sizes[max(range(len(header)), key=lambda k: (sizes[k] > words[k], sizes[k]))] -= 1
    sides = align.ljust(len(header), "<")
    lines = [line for row in cells for line in _lines(row, sizes, sides)]
    n_header = len(_lines(cells[0], sizes, sides))
    lines.insert(n_header, (" " * _GAP).join("-" * size for size in sizes))
    return "\n".join((margin + line).rstrip() for line in lines)


def paragraphs(text: str, indent: int = 2) -> str:
    """Text with its paragraphs filled to `line_width`; an item of a list hangs from its dash."""
    margin = " " * indent
    return "\n\n".join(
        textwrap.fill(
            " ".join(part.split()),
            line_width(),
            initial_indent=margin,
            subsequent_indent=margin + "  " * part.startswith("- "),
        )
        for part in text.split("\n\n")
    )


def _lines(row: Sequence[str], sizes: Sequence[int], sides: str) -> list[str]:
    """The lines of one row of cells."""
    wrapped = [
        textwrap.wrap(cell, size, break_on_hyphens=False) or [""]
        for cell, size in zip(row, sizes, strict=True)
    ]
    height = max(map(len, wrapped))
    return [
        (" " * _GAP).join(
            f"{part[k] if k < len(part) else '':{side}{size}}"
            for part, size, side in zip(wrapped, sizes, sides, strict=True)
        )
        for k in range(height)
    ]


# Sections of the docstring of a task, which its page and `rigid-envs describe` show.
#
# A docstring has this form. The paragraphs of a section are indented; one may be an item of a list,
# which begins with "- ". A subclass writes its summary, description and reference, and those other
# sections in which it differs from its parent. `name` is code; a formula stands between dollars,
# `$|theta_x| <= sqrt(2)$`: see `formulas`.
#
#     One-line summary.
#
#     Description: paragraphs without a heading.
#
#     Physics:
#         ...
#
#     Rewards:
#         ...
#
# and so on, through all `SECTIONS`; the version history only if there is more than a first version.

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


class TaskDocstring(NamedTuple):
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
    others = [base for base in bases if f" {_OWN}:\n" in (base.__doc__ or "")]
    docstring = _read(own)
    if _OWN not in docstring.sections:
        raise _refusal(own, f"has no section {_OWN!r} of its own")
    sections = dict(docstring.sections)
    for base in others:
        sections = {**_read(base).sections, **sections}
    sections.setdefault("Version History", [])  # until something changes
    for name in SECTIONS:
        if name not in sections:
            raise _refusal(own, f"has no section {name!r}")
    return TaskDocstring(docstring.summary, docstring.description, sections)


def summary_of(kind: type[object]) -> str:
    """The first line of the docstring of a class."""
    return text_of(kind)[0]


def text_of(kind: type[object]) -> list[str]:
    """Paragraphs of the docstring of any class, its attributes as a list, without its errors."""
    text = re.sub(r"\nRaises:\n(    .+\n)+", "", inspect.cleandoc(kind.__doc__ or ""))
    return blocks(re.sub(r"^    (\w+): ", r"\n- `\1`: ", text, flags=re.MULTILINE))


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


# Tables of a task: entries, reward terms, arguments and info keys, read from its fields.

_STEPS = ("dt", "n_substeps")
_COLUMNS = ("Argument", "Default", "Unit", "Allowed", "Meaning")

SIDES = str.maketrans("=", "<")
"""Sides of columns by their kinds."""


class Table(NamedTuple):
    """Rows under a header.

    Attributes:
        header: Titles of the columns.
        rows: Cells, one sequence per row.
        kinds: One sign per column: "<" words, ">" numbers, "=" symbols and code.
    """

    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    kinds: str


def action_table(task: Task) -> Table:
    """Entries of the action, and their physical values at the bounds of the space."""
    ends = (0, task.n_choices - 1) if task.n_choices else (-1, 1)
    rows = [(*_names(k, entry), *_bounds(entry)) for k, entry in enumerate(task.actions())]
    values = (f"Value at {end}" for end in ends)
    return Table(("Num", "Action", "Unit", "Frame", *values), rows, ">=<<>>")


def term_table(task: Task) -> Table:
    """The reward terms with their weights and the arguments that set these."""
    weights = task.weights()
    meaning = {field.name: field.metadata["rule"].text for field in fields(task)}
    rows = [
        (term, f"{weight:g}", f"weight_{term}", meaning.get(f"weight_{term}", ""))
        for term, weight in zip(task.terms, weights, strict=True)
    ]
    return Table(("Term", "Weight", "Argument", "Meaning"), rows, "=>=<")


def argument_table(task: Task, given: Mapping[str, Any]) -> Table:
    """Arguments of this task, without weights and those that all tasks share with their default.

    The steps in time are always there. Given values are in the column Here.
    """
    shared = {field.name: field.default for field in fields(Task) if field.name not in _STEPS}
    rows = []
    for field in _ordered(task):
        if field.name not in given and (
            field.name.startswith("weight_") or shared.get(field.name) == field.default
        ):
            continue
        name, *others = _argument(field)
        here = [_written(getattr(task, name)) if name in given else ""] if given else []
        rows.append((name, *here, *others))
    first, *others = _COLUMNS
    columns = (first, *(["Here"] if given else []), *others)
    return Table(columns, rows, "=>><=<" if given else "=><=<")


def sample_arguments(task: Task) -> dict[str, Any]:
    """Arguments for an example: a range for a parameter, if none has one, and `observe_params`."""
    name, *_ = task.physical_parameters()
    value, drawn = getattr(task, name), any(low < high for low, high in task.ranges().values())
    ranges = {} if drawn else {name: (value, round(1.1 * value, 6))}
    return {**ranges, "observe_params": True}


def entry_table(entries: Sequence[Entry]) -> Table:
    """Entries of an observation, or of a goal, with their bounds."""
    rows = [(*_names(k, entry), *_bounds(entry)) for k, entry in enumerate(entries)]
    return Table(("Num", "Observation", "Unit", "Frame", "Min", "Max"), rows, ">=<<>>")


def _names(k: int, entry: Entry) -> tuple[str, ...]:
    return str(k), entry.symbol, entry.unit, entry.frame


def _bounds(entry: Entry) -> tuple[str, str]:
    return f"{entry.low:.6g}", f"{entry.high:.6g}"


def shared_table() -> Table:
    """Arguments that all tasks share."""
    return Table(_COLUMNS, list(map(_argument, fields(Task))), "=><=<")


def _argument(field: Field[Any]) -> tuple[str, ...]:
    """Cells of an argument, in the order of `_COLUMNS`."""
    rule = field.metadata["rule"]
    return field.name, _written(field.default), rule.unit, _allowed(rule), rule.text


def _ordered(task: Task) -> list[Field[Any]]:
    common = {
        field.name: rank for rank, kind in ((1, Rolling), (2, Task)) for field in fields(kind)
    }
    return sorted(fields(task), key=lambda field: common.get(field.name, 0))


def _written(value: Any) -> str:
    """A default in the digits that it needs, or as what it is computed from."""
    if isinstance(value, tuple):
        return f"({', '.join(map(_exact, value))})"
    if not isinstance(value, float):
        return str(value)
    exact = _exact(value)
    return exact if "/" not in exact else f"{exact} = {value:.4g}"


def _exact(value: float) -> str:
    """A number by Python's means: `0.1`, `pi/8`, `1/9.81` (lengths over gravity)."""
    if float(f"{value:.6g}") == value:
        return f"{value:.6g}"
    known = {math.pi: "pi", math.pi / 2: "pi/2", math.pi / 8: "pi/8", 2 / 3: "2/3"}
    weight = round(9.81 * value, 2)
    return known.get(value, f"{weight:g}/9.81" if weight / 9.81 == value else repr(value))


def _allowed(rule: Number | Integer | Choice | Flag) -> str:
    """The allowed values, in short."""
    if isinstance(rule, Choice):
        return ", ".join(rule.options)
    if isinstance(rule, Flag):
        return "True, False"
    if rule.low == rule.high:
        return f"{rule.low:g}"
    return f"{rule.low:g} .. {_exact(rule.high)}" + (" ~" if rule.drawn else "")


# Success, efficiency and cost of the untrained policies of an environment, from its data.


def reference_section(env_id: str, task: Task) -> list[str | Table]:
    """Table of the untrained policies, and what its columns are; empty for an id without data.

    Args:
        env_id: Gymnasium's id.
        task: Its task.
    """
    found = best_known(env_id)
    if found is None:
        return []
    names = [name for name in ENVIRONMENTS[env_id].metrics if name != "success"]
    error = ENVIRONMENTS[env_id].error
    meaning = [] if error is None else [f"`error` is that of the {error.text}."]
    return [*_scores(task, names, found), *meaning, _known(found), *_bound(env_id, found)]


def _scores(task: Task, names: list[str], found: Best) -> list[str | Table]:
    """One row for each policy that succeeds, and the returns of those that never do."""
    rows = []
    failed: dict[str, list[str]] = {}  # by their interval
    for policy, summary in found.policies.items():
        success, interval, efficiency, other = rates_of(summary)
        if not summary["successes"]:
            line = f"`{policy}`, return {short_figure(summary['return_mean'])}"
            failed.setdefault(interval, []).append(line)
            continue
        rates = f"{success.removesuffix(' %')} ({interval})", f"{efficiency} ({other})"
        rows.append((policy, *rates, *(short_figure(summary["metrics"][name]) for name in names)))
    titles = (Cost(name, METRICS[name].unit(task), 0.0).title for name in names)
    header = ("Policy", "success (95 %)", "efficiency (95 %)", *titles)
    lines = [f"No success ({rate} %): {'; '.join(each)}." for rate, each in failed.items()]
    return [Table(header, rows, "=" + ">" * (len(header) - 1)), *lines]


def short_figure(value: float | None) -> str:
    """A number in four digits, a dash for none."""
    return "-" if value is None else f"{value:.4g}"


def _known(found: Best) -> str:
    finders = ", ".join(f"`{name}` ({count})" for name, count in found.shares.items()) or "nobody"
    return f"The best known `{found.cost}` of the {len(found.costs)} starts is by {finders}."


def _bound(env_id: str, found: Best) -> list[str]:
    """What theory says of the cost, beside the best known; empty where it says nothing."""
    limit = limit_of(env_id, found.cost)
    # the best of the reference controllers stands for all: its successes have the mean bound
    first = next(iter(found.policies.values()))
    if limit is None or first["bound_mean"] is None:
        return []
    bound, best = first["bound_mean"], first["best_mean"]
    gap = f", a gap of {max(100.0 * (best / bound - 1.0), 0.0):.1f} %" if bound > 0.0 else ""
    name, text = "The optimum" if limit.kind == "exact" else "A lower bound", limit.text
    if (stored := stored_optima(env_id)) is not None and stored.proven.any():
        text += ", or what is proven of a start (docs/best_known.md)"
    return [
        f"{name} of `{found.cost}`, {text}: {bound:.4g} where `{next(iter(found.policies))}` "
        f"succeeds; the best known is {best:.4g}{gap}."
    ]


# All environments in two tables: `rigid-envs list`.


def size_of(space: spaces.Space[Any]) -> str:
    """Size of a space: entries of a box, number of choices, or entries beside those of a goal."""
    if isinstance(space, spaces.Discrete):
        return f"{space.n} choices"
    if isinstance(space, spaces.Dict):
        return f"{size_of(space['observation'])}, goal {size_of(space['desired_goal'])}"
    return ", ".join(map(str, space.shape or ()))


def time_limit(env_id: str, task: Task) -> str:
    """Time limit of an id in steps and in seconds."""
    steps = ENVIRONMENTS[env_id].max_episode_steps
    return f"{steps} steps ({steps * task.dt:g} s)"


def list_all() -> str:
    """Every id with its summary, then with its sizes, time limit and cost."""
    tasks = {env_id: task_of(env_id) for env_id in ENVIRONMENTS}
    summaries = [(env_id, summary_of(type(task))) for env_id, task in tasks.items()]
    header = ("id", "action", "observation", "time limit", "cost")
    rows = [
        (
            env_id,
            size_of(action_space(task)),
            size_of(observation_space(task)),
            f"{ENVIRONMENTS[env_id].max_episode_steps} x {task.dt:g} s",
            task.cost_unit,
        )
        for env_id, task in tasks.items()
    ]
    parts = (table(("id", "task"), summaries, indent=0), table(header, rows, "<>>>", indent=0))
    return "\n\n".join(parts)
