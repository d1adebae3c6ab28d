"""The page docs/clients.md, from docs/clients.json."""

from collections.abc import Mapping
from typing import Any

from rigid_envs.tools.pages.tables import Table
from rigid_envs.tools.pages.writing import as_markdown
from tests.clients.rows import ROWS, Row

_SOURCES = "https://github.com/rigid-envs/rigid-envs/blob/main/tests/clients"
_HEAD = f"""\
<!-- Written by `python -m tests.clients`. -->

# Clients

Third-party programs, each run with settings that its documentation names, on environments that it
opens by their ids. Every row is a script of some thirty lines in
[tests/clients/recipes]({_SOURCES}/recipes), and a test:

```bash
python -m tests.clients             # all of them, and this page
python -m tests.clients sb3_by_id   # one
```

Programs that need other packages than the tests have an environment of their own, which is made
once and kept ([tests/clients/requirements]({_SOURCES}/requirements)). Seconds are those of a
processor, imports included: they say that a recipe is short, not how fast a program is. A script
fails if what it trains does not get better, or if what should be equal is not.
"""


def markdown(data: Mapping[str, Mapping[str, Any]]) -> str:
    """The page.

    Args:
        data: what `running.run` found, by the name of the recipe.
    """
    head = ("program", "Gymnasium", "what is run", "result", "CPU s")
    table = Table(
        head, [_cells(row, data[row.recipe]) for row in ROWS if row.recipe in data], "<<<<>"
    )
    return f"{_HEAD}\n{as_markdown(table)}\n"


def _cells(row: Row, found: Mapping[str, Any]) -> tuple[str, ...]:
    return (
        f"[{row.program}]({_SOURCES}/recipes/{row.recipe}.py) {found['version']}",
        found["gymnasium"],
        row.what,
        "; ".join(f"{name} {_number(value)}" for name, value in found["result"].items()),
        f"{found['processor_seconds']:.0f}",
    )


def _number(value: float) -> str:
    return f"{value:,}" if isinstance(value, int) else f"{value:.4g}"
