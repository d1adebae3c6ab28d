"""Pages of environments and the tables of README."""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, fields
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces

from rigid_envs.base.checks import ConfigError
from rigid_envs.base.files import markdown_table, write_atomic
from rigid_envs.envs.lookup import checked_id, families, task_of
from rigid_envs.envs.spaces import action_space, observation_space
from rigid_envs.scores.best import best_known
from rigid_envs.scores.optima import stored_optima
from rigid_envs.scores.proof import bounds_of
from rigid_envs.scores.starts import TEST_SEED, cost_of
from rigid_envs.tasks.fields import Entry, attitude_entries
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tasks.task import Task
from rigid_envs.tools.pages.document import (
    SHARED,
    Code,
    Section,
    common,
    document,
    observed,
    short,
    system_section,
)
from rigid_envs.tools.pages.formulas import with_latex
from rigid_envs.tools.pages.tables import (
    SIDES,
    Table,
    shared_table,
    size_of,
    summary_of,
    text_of,
    time_limit,
)

# Sections as Markdown, in the dialect of GitHub.


def markdown(sections: Sequence[Section], level: int = 2) -> str:
    """Headings from the given level on; every paragraph is one line."""
    parts = []
    for section in sections:
        parts += [f"{'#' * level} {section.title}", *map(_block, section.body)]
        parts += [markdown(section.parts, level + 1)] if section.parts else []
    return "\n\n".join(parts)


def as_markdown(table: Table) -> str:
    """Header, rule and rows of a table."""
    rows = [[_cell(*each) for each in zip(row, table.kinds, strict=True)] for row in table.rows]
    return markdown_table(table.header, rows, table.kinds.translate(SIDES))


_MATRIX = "`, `".join(entry.symbol for entry in attitude_entries("matrix"))


def _brief(table: Table) -> Table:
    """A table of a page: entries that are alike in one row; of terms what the text does not say."""
    if table.header[0] == "Term":
        weights = [(argument, weight) for _, weight, argument, _ in table.rows]
        return Table(("Argument", "Weight"), weights, "=>")
    if table.header[0] != "Num":
        return table
    rows: list[Sequence[str]] = []
    for alike, entries in groupby(table.rows, lambda row: tuple(row[2:])):
        numbers, names = zip(*(row[:2] for row in entries), strict=True)
        span = " .. ".join(dict.fromkeys((numbers[0], numbers[-1])))
        listed = "`, `".join(names).replace(_MATRIX, "R11` .. `R33")
        rows.append((span, listed, *map(_rounded, alike)))
    return table._replace(rows=rows)


def _rounded(text: str) -> str:
    """A number of many digits in four."""
    return f"{float(text):.4g}" if re.fullmatch(r"-?\d+\.\d{4,}", text) else text


def _block(block: str | Table | Code) -> str:
    if isinstance(block, Table):
        return as_markdown(_brief(block))
    return f"```python\n{block.text}\n```" if isinstance(block, Code) else block


def _cell(text: str, kind: str) -> str:
    """A cell with bars escaped: a bar would end the cell, also between backticks."""
    escaped = text.replace("|", r"\|")
    return f"`{escaped}`" if kind == "=" and text else escaped


# Table of the best known costs beside what theory allows, for a page of the documentation.

PROVEN = 0.02
"""Gap up to which the best known is called the optimum, by proof or by numerics."""


def best_costs() -> str:
    """Table of the ids of this package: mean best known cost, bound, optimum, gap, who found it."""
    rows = []
    for env_id in ENVIRONMENTS:
        known, cost = best_known(env_id), cost_of(env_id, task_of(env_id))
        if known is None or not env_id.startswith("RigidEnvs/"):
            continue
        bounds, stored = bounds_of(env_id, len(known.costs), TEST_SEED, {}), stored_optima(env_id)
        mean = float(np.nanmean(known.costs))
        limits = bounds, None if stored is None else stored.costs
        gap, verdict = "", "no bound is known"
        for claim, limit in zip(("proven", "numerics"), limits, strict=True):
            if limit is not None and verdict != "proven":
                least = float(limit.mean())
                gap = "" if least <= 0.0 else f"{max(100.0 * (mean / least - 1.0), 0.0):.1f} %"
                verdict = claim if mean <= (1.0 + PROVEN) * least else "open"
        bound, optimum = ("" if each is None else f"{each.mean():.4g}" for each in limits)
        shares = ", ".join(f"`{name}` {count}" for name, count in known.shares.items())
        name = env_id.removeprefix("RigidEnvs/").removesuffix("-v0")
        link = f"[`{name}`](environments/{name}.md)"
        rows.append((link, cost.title, f"{mean:.4g}", bound, optimum, gap, verdict, shares))
    names = ("id", "cost", "best known", "bound", "optimum", "gap", "", "found by, of the starts")
    return as_markdown(Table(names, rows, "<<>>>><<"))


# Environments as JSON values, for programs: `rigid-envs list --json` and `describe --json`.


def overview_as_data(env_id: str) -> dict[str, Any]:
    """What a list of environments says of an id.

    Args:
        env_id: Gymnasium's id.
    """
    record, task = ENVIRONMENTS[env_id], task_of(env_id)
    return {
        "id": env_id,
        "summary": summary_of(type(task)),
        "family": record.family,
        "goal": record.goal,
        "max_episode_steps": record.max_episode_steps,
        "dt": task.dt,
        "cost": task.cost_unit,
        "metrics": list(record.metrics),
        "controllers": list(record.controllers),
    }


def description(env_id: str, config: Mapping[str, Any]) -> dict[str, Any]:
    """Spaces, rewards and arguments of an environment.

    Args:
        env_id: Gymnasium's id.
        config: Hyperparameters that differ from their defaults.

    Raises:
        UnknownIdError: no such id.
        ConfigError: unknown key or bad value.
    """
    env_id = checked_id(env_id)
    task = task_of(env_id, config)
    seen, n = task.observations(), task.n_goal
    reduced = [] if task.reduction is None else task.reduction.features
    return overview_as_data(env_id) | {
        "dt": task.dt,
        "action": _entries(task.actions()),
        "choices": task.n_choices,
        "observation": _entries(seen[2 * n :]),
        "goal_entries": _entries(seen[:n]),
        "reduced_observation": _entries(reduced),
        "reward": dict(zip(task.terms, task.weights(), strict=True)),
        "arguments": [_argument(task, field) for field in fields(task)],
    }


def _entries(entries: Sequence[Entry]) -> list[dict[str, Any]]:
    return [asdict(entry) for entry in entries]


def _argument(task: Task, field: Any) -> dict[str, Any]:
    rule = field.metadata["rule"]
    return {
        "name": field.name,
        "value": getattr(task, field.name),
        "default": field.default,
        "unit": rule.unit,
        "allowed": str(rule),
        "meaning": rule.text,
    }


# Pages of the documentation, one for each id, and their index: `rigid-envs docs`.

INDEX = "README.md"
FILMS = "films"
_FILM = f"![A reference controller in {{name}}]({FILMS}/{{file}})"
_SMALL = 120  # pixels, in the README
_SPACE = "RigidEnvs/"
_DOI = re.compile(r"\bdoi:(10\.[^\s;,]*[^\s;,.])")
_GROUP = re.compile(r"^(Group \$.+?\$): .+", re.MULTILINE)  # and its symmetries
_NOTE = "<!-- Written by `rigid-envs docs`: change docstrings and registry, not this page. -->"
_INTRODUCTION = (
    "The numbers before actions and observations are their sizes; a goal environment has those of "
    "its `observation` and of each of its goals. `rigid-envs describe ID` shows a page in the "
    "terminal, for any arguments; with `--json`, all digits of numbers that are rounded here."
)
_COMMAND = "python -m rigid_envs.tools.pages"
_FROM_DOCS = "environments"
_PHYSICAL = "1e-09 .. 1e+06 ~"  # what is allowed of parameters of bodies, as the index says


def file_of(env_id: str) -> str:
    """Name of the file of the page of an id."""
    return env_id.removeprefix(_SPACE).removesuffix("-v0").replace("/", "-") + ".md"


def pages(ids: Iterable[str] | None = None) -> dict[str, str]:
    """Text of the index and of the page of each id, by the name of the file.

    Args:
        ids: Gymnasium's ids; None takes those of this package.
    """
    ids = _own_ids() if ids is None else list(ids)
    return {INDEX: index(ids), **{file_of(env_id): page(env_id) for env_id in ids}}


def write_pages(folder: Path, ids: Iterable[str] | None = None) -> tuple[list[str], list[str]]:
    """Write the index and the page of each id, each file atomically.

    Args:
        folder: Made if it is not there.
        ids: Gymnasium's ids; None takes those of this package.

    Returns:
        Names of the files that are new or changed, and of pages in the folder that no id has.

    Raises:
        DocstringError: a docstring lacks a section; nothing is written.
    """
    texts = pages(ids)
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
    task, name, own = task_of(env_id), file_of(env_id).removesuffix(".md"), _own_ids()
    parts = [
        summary_of(type(task)),
        *([_FILM.format(name=_name(env_id), file=film_of(env_id))] if env_id in own else []),
        _family_of(env_id),
        as_markdown(_glance(env_id, task)),
        *_content(env_id, task),
    ]
    text = "\n\n".join([_NOTE, f"# {name}", *(_linked(part, env_id) for part in parts)])
    return with_latex(text) + "\n"


def index(ids: Iterable[str]) -> str:
    """The page that lists environments by family."""
    parts = [_NOTE, "# Environments", _INTRODUCTION]
    for family, members in families(ids).items():
        parts += [f"## {family}", as_markdown(_family(members))]
        systems = dict.fromkeys(task_of(env_id).system_type for env_id in members)
        parts += [markdown(list(map(system_section, systems)), 3)]
    return with_latex("\n\n".join([*parts, markdown(common())])) + "\n"


def overview(folder: str = "docs/environments") -> str:
    """Short tables of the environments of this package by family, for a README.

    Args:
        folder: Path from the README to the pages.
    """
    parts = []
    for family, members in families(_own_ids()).items():
        rows = []
        for env_id in members:
            task = task_of(env_id)
            link = f"[`{_name(env_id)}`]({folder}/{file_of(env_id)})"
            film = f'<img src="{folder}/{FILMS}/{film_of(env_id)}" width="{_SMALL}" alt="film">'
            row = (film, link, summary_of(type(task)), short(type(task).actions), observed(task))
            rows.append(row)
        header = ("", family, "task", "action", "observation")
        parts.append(as_markdown(Table(header, rows, "<<<<<")))
    return "\n\n".join(parts)


def groups() -> str:
    """Table of the symmetries of the environments of this package; one row for those alike."""
    links: dict[tuple[str, str, str], list[str]] = {}
    for env_id in _own_ids():
        reduction = task_of(env_id).reduction
        assert reduction is not None
        names = "; ".join(symmetry.name for symmetry in reduction.symmetries)
        alike = links.setdefault((f"${reduction.group}$", names, reduction.frame), [])
        place = "#reduced-frame" if "\n## Reduced Frame\n" in page(env_id) else ""  # or a parent's
        alike.append(f"[`{_name(env_id)}`]({_FROM_DOCS}/{file_of(env_id)}{place})")
    rows = [(", ".join(found), *cells) for cells, found in links.items()]
    table = Table(("id", "group", "generated by", "reduced frame"), rows, "<<<<")
    return with_latex(as_markdown(table))


def with_tables(text: str) -> str:
    """A README, or another page with a pair of marks, with the tables between them made anew.

    Raises:
        ConfigError: there are no such marks.
    """
    kinds: dict[tuple[str, str], Callable[[], str]] = {
        marks("environments", f"{_COMMAND} README.md"): overview,
        marks("groups", f"{_COMMAND} docs/symmetry.md"): groups,
        marks("costs", f"{_COMMAND} docs/best_known.md"): best_costs,
    }
    for pair, tables in kinds.items():
        if (made := between(text, pair, tables)) is not None:
            return made
    expected = ", or ".join(map(" and ".join, kinds))
    raise ConfigError(f"the page has no marks for its tables; expected {expected}")


def marks(part: str, command: str) -> tuple[str, str]:
    """The comments around a part of a page that a command writes."""
    return f"<!-- {part}: written by `{command}` -->", f"<!-- end of {part} -->"


def between(page: str, pair: tuple[str, str], content: Callable[[], str]) -> str | None:
    """A page with what is between a pair of marks made anew; None where it has no such marks."""
    begin, end = pair
    before, _, rest = page.partition(begin)
    _, found, after = rest.partition(end)
    return f"{before}{begin}\n\n{content()}\n\n{end}{after}" if found else None


def film_of(env_id: str) -> str:
    """Name of the file of the film of an id; see `rigid_envs.tools.pages.films`."""
    return file_of(env_id).removesuffix(".md") + ".webp"


def _own_ids() -> list[str]:
    return [env_id for env_id in ENVIRONMENTS if env_id.startswith(_SPACE)]


def _name(env_id: str) -> str:
    """An id without its namespace and the first version."""
    return env_id.rpartition("/")[2].removesuffix("-v0")


def _family_of(env_id: str) -> str:
    family = ENVIRONMENTS[env_id].family
    return f"Family: [{family}]({_place(family)}). See also [{SHARED.lower()}]({_place(SHARED)})."


def _content(env_id: str, task: Task) -> list[str]:
    """Sections of the page, without what the page of a parent has."""
    package = env_id.partition("/")[0] + "/"
    classes = {type(task_of(other)): other for other in ENVIRONMENTS if other.startswith(package)}
    parent = next((classes[kind] for kind in type(task).__mro__[1:] if kind in classes), None)
    there = document(parent, task_of(parent), {}) if parent else []
    known = {section.title: section.body for section in there}
    sections = document(env_id, task, {})
    same = [section.title for section in sections if section in there]
    own = [
        _own(section, known.get(section.title, ()), task)
        for section in sections
        if section not in there
    ]
    if parent is None:
        return [markdown(own)]
    lead = f"The same as in `{_name(parent)}`: {', '.join(same)}; and what is not listed here."
    return [lead, markdown(own)]


def _own(section: Section, known: Sequence[Any], task: Task) -> Section:
    """A section without the paragraphs, or arguments, that are known."""
    body: Sequence[Any] = section.body
    if section.title == "Arguments":
        table, code = body
        rows = [row for row in table.rows if not known or row not in known[0].rows]
        return section._replace(body=[*_arguments(table._replace(rows=rows), task), code])
    whole = any(isinstance(block, Table) for block in body)  # a table keeps its paragraphs
    return section._replace(body=[block for block in body if whole or block not in known])


def _arguments(table: Table, task: Task) -> list[Table | str]:
    """Arguments of the body and those that all tasks have by their defaults; others in a table."""
    system = task.system_type
    body = {part.split("`")[1] for part in text_of(system) if part.startswith("- ")}
    alike = {(row[0], *row[2:]) for row in shared_table().rows}
    short = {
        f"the body]({_place('System ' + system.__name__)})": [
            row for row in table.rows if row[0] in body and row[3] == _PHYSICAL
        ],
        f"the arguments that all have]({_place('Arguments')})": [
            row for row in table.rows if (row[0], *row[2:]) in alike
        ],
    }
    lines = [
        f"Of [{place}: {', '.join(f'`{row[0]}` = {row[1]}' for row in rows)}."
        for place, rows in short.items()
        if rows
    ]
    others = [row for row in table.rows if not any(row in rows for rows in short.values())]
    return [*([table._replace(rows=others)] if others else []), *lines]


def _place(heading: str) -> str:
    """Link to a heading of the index."""
    return f"{INDEX}#{heading.lower().replace(' ', '-')}"


def _glance(env_id: str, task: Task) -> Table:
    rows = [
        ("Action Space", _space(action_space(task))),
        ("Observation Space", _space(observation_space(task))),
        ("import", f'gym.make("{env_id}")'),
    ]
    return Table(("id", f"`{env_id}`"), rows, "<=")


def _linked(text: str, env_id: str) -> str:
    """Text with links to environments of the same package, to the system, to papers by DOI."""
    space = env_id.partition("/")[0] + "/"
    pages = {_name(other): file_of(other) for other in ENVIRONMENTS if other.startswith(space)}
    del pages[_name(env_id)]
    system = task_of(env_id).system_type.__name__
    pages[system] = _place(f"System {system}")
    pattern = f"`({'|'.join(sorted(pages))})`"
    text = re.sub(pattern, lambda found: f"[{found[0]}]({pages[found[1]]})", text)
    if space == _SPACE:
        text = _GROUP.sub(r"\1 ([its symmetries](../symmetry.md#the-group-of-every-task)).", text)
    return _DOI.sub(r"[doi:\1](https://doi.org/\1)", text)


def _family(ids: Iterable[str]) -> Table:
    rows = []
    for env_id in ids:
        task = task_of(env_id)
        link = f"[`{env_id.removeprefix(_SPACE)}`]({file_of(env_id)})"
        summary = summary_of(type(task))
        acts = f"{size_of(action_space(task))}: {short(type(task).actions)}"
        sees = f"{size_of(observation_space(task))}: {observed(task)}"
        rows.append((link, summary, acts, sees, time_limit(env_id, task)))
    return Table(("id", "Task", "Action", "Observation", "Time limit"), rows, "<<<<<")


def _space(space: spaces.Space[Any]) -> str:
    """A space on one line; bounds that differ by entry are named as in the table."""
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
