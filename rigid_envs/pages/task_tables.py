"""Tables of a task: entries, reward terms, arguments and info keys, read from its fields."""

from collections.abc import Mapping, Sequence
from dataclasses import Field, dataclass, fields
from typing import Any

from gymnasium import spaces

from rigid_envs.envs.task_spaces import action_space, info_flags
from rigid_envs.tasks import Entry, Task
from rigid_envs.tasks.fields import Choice, Flag, Integer, Number
from rigid_envs.tasks.ground import Rolling

__all__ = [
    "RANGE_NOTE",
    "Table",
    "action_table",
    "argument_table",
    "goal_table",
    "info_table",
    "observation_table",
    "reduced_table",
    "sample_arguments",
    "term_table",
]

RANGE_NOTE = "~ or a pair `(low, high)`, from which every reset draws."
_FLAGS = {
    "is_success": "the step is a success",
    "action_clipped": "the action was outside its space",
    "physics_error": "the motion left what the integrator resolves, which ended the episode",
    "slips": "needed_friction is larger than mu",
}
_GRIP = {
    "normal_force": "force of the ground along its normal [N]; the body would lift off below 0",
    "needed_friction": "least coefficient of friction without slip; infinite without contact",
}


@dataclass(frozen=True)
class Table:
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
    """Entries of the action: bounds of the space, and the physical values at these."""
    space = action_space(task)
    ends = (0, task.n_choices - 1) if isinstance(space, spaces.Discrete) else (-1, 1)
    rows = [
        (*_names(k, entry), *map(str, ends), *_bounds(entry))
        for k, entry in enumerate(task.actions())
    ]
    bounds = ("Control Min", "Control Max", "Value at Min", "Value at Max")
    return Table(("Num", "Action", "Unit", "Frame", *bounds), rows, ">=<<>>>>")


def observation_table(task: Task) -> Table:
    """Entries of the observation, without those of the goals."""
    return _entries(task.observations()[2 * task.n_goal :])


def reduced_table(task: Task) -> Table:
    """Entries of the observation in the reduced frame, without those of the goals."""
    assert task.reduction is not None
    return _entries(task.reduction.features)


def goal_table(task: Task) -> Table:
    """Entries of the achieved goal; those of the desired one are the same."""
    return _entries(task.observations()[: task.n_goal])


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
    """Every argument, those of this task first; given values are in the column Here."""
    rows = []
    for field in _ordered(task):
        rule, value = field.metadata["rule"], getattr(task, field.name)
        here = [_written(value) if field.name in given else ""] if given else []
        default = _written(field.default)
        rows.append((field.name, *here, default, rule.unit, _allowed(rule), rule.text))
    columns = ("Argument", *(["Here"] if given else []), "Default", "Unit", "Allowed", "Meaning")
    return Table(columns, rows, "=>><=<" if given else "=><=<")


def info_table(task: Task) -> Table:
    """Keys of info with their types."""
    rows = [
        ("cost", "float", f"{task.cost_unit}, of this step"),
        *(
            (f"reward/{term}", "float", f"the term {term} without its weight")
            for term in task.terms
        ),
        *((key, "float", _GRIP[key]) for key in task.episode.ground.names),
        *((key, "bool", _FLAGS[key]) for key in info_flags(task)),
    ]
    return Table(("Key", "Type", "Meaning"), rows, "==<")


def sample_arguments(task: Task) -> dict[str, Any]:
    """Arguments for an example: a range for a parameter, if none has one, and `observe_params`."""
    name, *_ = task.physical_parameters()
    value, drawn = getattr(task, name), any(low < high for low, high in task.ranges().values())
    ranges = {} if drawn else {name: (value, round(1.1 * value, 6))}
    return {**ranges, "observe_params": True}


def _entries(entries: Sequence[Entry]) -> Table:
    rows = [(*_names(k, entry), *_bounds(entry)) for k, entry in enumerate(entries)]
    return Table(("Num", "Observation", "Unit", "Frame", "Min", "Max"), rows, ">=<<>>")


def _names(k: int, entry: Entry) -> tuple[str, ...]:
    return str(k), entry.symbol, entry.unit, entry.frame


def _bounds(entry: Entry) -> tuple[str, str]:
    return f"{entry.low:.6g}", f"{entry.high:.6g}"


def _ordered(task: Task) -> list[Field[Any]]:
    common = {
        field.name: rank for rank, kind in ((1, Rolling), (2, Task)) for field in fields(kind)
    }
    return sorted(fields(task), key=lambda field: common.get(field.name, 0))


def _written(value: Any) -> str:
    if isinstance(value, tuple):
        return f"({', '.join(map(_written, value))})"
    if not isinstance(value, float):
        return str(value)
    short = f"{value:.6g}"
    return short if float(short) == value else repr(value)


def _allowed(rule: Number | Integer | Choice | Flag) -> str:
    """The allowed values, in short."""
    if isinstance(rule, Choice):
        return ", ".join(rule.options)
    if isinstance(rule, Flag):
        return "True, False"
    if rule.low == rule.high:
        return f"{rule.low:g}"
    return f"{rule.low:g} .. {rule.high:g}" + (" ~" if rule.drawn else "")
