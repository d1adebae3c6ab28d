"""Times of pictures as tables: in the terminal, and in the page about pictures."""

from collections.abc import Mapping
from typing import Any

from rigid_envs.errors import ConfigError
from rigid_envs.pages.markdown import table_lines
from rigid_envs.pages.tables import table
from rigid_envs.pages.task_tables import Table
from rigid_envs.provenance import heading

__all__ = ["as_text", "with_table"]

_HEADER = ("id", "picture", "without shadows", "first of a process")
_BEGIN = "<!-- times: written by `rigid-envs frames --page docs/rendering.md` -->"
_END = "<!-- end of times -->"


def as_text(data: Mapping[str, Any]) -> str:
    """Table of times, with where they were measured.

    Args:
        data: `provenance`, `frames` (times of each id) and `bytes` (of each package).
    """
    return "\n\n".join(
        [heading(data["provenance"]), table(_HEADER, _rows(data), "<>>>"), _size(data)]
    )


def with_table(page: str, data: Mapping[str, Any]) -> str:
    """A page with the table between its two marks made anew.

    Raises:
        ConfigError: there are no such marks.
    """
    before, begin, rest = page.partition(_BEGIN)
    _, end, after = rest.partition(_END)
    if not begin or not end:
        raise ConfigError(f"page has no marks for the table; expected {_BEGIN} and {_END}")
    lines = "\n".join(table_lines(Table(_HEADER, _rows(data), "<>>>")))
    cpu = data["provenance"]["cpu"]
    return f"{before}{begin}\n\n{lines}\n\nOn one core of {cpu}. {_size(data)}\n\n{end}{after}"


def _rows(data: Mapping[str, Any]) -> list[tuple[str, ...]]:
    return [
        (
            times["env_id"].removeprefix("RigidEnvs/"),
            f"{1e3 * times['frame']:.1f} ms",
            f"{1e3 * times['without_shadows']:.1f} ms",
            f"{times['first']:.2f} s",
        )
        for times in data["frames"]
    ]


def _size(data: Mapping[str, Any]) -> str:
    sizes = sorted(data["bytes"].items(), key=lambda item: -item[1])
    each = ", ".join(f"{name} {size / 1e6:.0f} MB" for name, size in sizes)
    total = sum(size for _, size in sizes) / 1e6
    return f"The extra `render` takes {total:.0f} MB: {each}."
