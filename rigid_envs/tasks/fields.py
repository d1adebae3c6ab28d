"""Fields of a task: hyperparameters, each with the rule that checks its value."""

from typing import Any

from rigid_envs.rules import Choice, Flag, Integer, Number
from rigid_envs.settings import Settings, check_fields, from_config, setting

__all__ = [
    "Choice",
    "Flag",
    "Integer",
    "Number",
    "Range",
    "Settings",
    "check_fields",
    "from_config",
    "physical",
    "setting",
    "span",
]

Range = float | tuple[float, float]


def physical(default: Range, text: str, unit: str) -> Any:
    """A positive physical parameter: a number, or a range from which it is drawn at reset.

    Within the bounds 1e-9 and 1e6 no product or quotient of parameters overflows.
    """
    return setting(default, Number(text, unit, 1e-9, 1e6, drawn=True))


def span(value: Range) -> tuple[float, float]:
    """Lower and upper end of a number or range."""
    return value if isinstance(value, tuple) else (value, value)
