"""Search ten times more for the best known costs of 50 starts, and say how much lower they are.

    python -m tests.benchmarks.more_search [ID ...]

One search is what `rigid-envs best ID --plan` does, drawn anew; ten of an id take minutes to two
hours of one core. Writes docs/more_search.json, the table of docs/best_known.md, and better plans.
"""

import json
import sys
import time
from pathlib import Path

from rigid_envs.base.files import lined_json, markdown_table, write_atomic
from rigid_envs.engine.provenance import provenance
from rigid_envs.envs.lookup import checked_id
from rigid_envs.scores import best, finding
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools.pages.writing import between, marks

DOCS = Path(__file__).resolve().parents[2] / "docs"
DATA, PAGE = DOCS / "more_search.json", DOCS / "best_known.md"

_N = 50  # starts, the first of the evaluation set
_SEEDS = range(100, 110)  # of the searches, one after the other


def searched(env_id):
    """Figures of ten more searches; what is better is stored."""
    found, began = finding.stored(env_id, _N), time.process_time()
    before, means = found.best.costs, [found.best.costs.mean()]
    for seed in _SEEDS:
        *_, found = finding.search(found, (), seed)
        means.append(found.best.costs.mean())
        print(env_id, seed, means[-1], round(time.process_time() - began), "s", flush=True)
    seconds = time.process_time() - began
    whole = finding.stored(env_id).and_plans(found.actions, found.best.finders)
    best.write_plans(best.file_of_plans(env_id), whole.actions)
    best.write_best(best.file_of(env_id), whole.told(finding.played(env_id)).best)
    return {
        "means": means,
        "lower": int((found.best.costs < before).sum()),
        "cpu_seconds": seconds,
        "provenance": provenance(),
    }


def table(data):
    """The table of the page."""
    rows = []
    for env_id in (each for each in ENVIRONMENTS if each in data):
        start, first, *_, last = data[env_id]["means"]
        rows.append((
            f"`{env_id.rpartition('/')[2].removesuffix('-v0')}`",
            *(f"{mean:.5g}" for mean in (start, first, last)),
            f"{100.0 * (1.0 - first / start):.2f}",
            f"{100.0 * (1.0 - last / start):.2f}",
            f"{data[env_id]['lower']}",
            f"{data[env_id]['cpu_seconds'] / 60.0:.0f}",
        ))  # fmt: skip
    header = ("id", "before", "after 1", "after 10", "by 1 [%]", "by 10 [%]", "starts", "CPU min")
    return markdown_table(header, rows, "<>>>>>>>")


def page(text, data):
    """The page with its table made of the data."""
    command = "python -m tests.benchmarks.more_search"
    return between(text, marks("more search", command), lambda: table(data))


def main():
    """Search, and write data, plans and page after each id."""
    for name in sys.argv[1:] or filter(finding.is_planned, ENVIRONMENTS):
        env_id = checked_id(name)
        found = searched(env_id)
        data = json.loads(DATA.read_text(encoding="utf-8")) if DATA.exists() else {}
        write_atomic(DATA, lined_json(data | {env_id: found}))
        write_atomic(PAGE, page(PAGE.read_text(encoding="utf-8"), data | {env_id: found}))


if __name__ == "__main__":
    main()
