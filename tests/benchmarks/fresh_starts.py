"""Play policies from 20,000 fresh starts, beside the 500 of the evaluation set.

    python -m tests.benchmarks.fresh_starts [ID ...]

For every id, or those named, the published policy and a reference controller: writes
docs/fresh_starts.json, and the tables of docs/policies.md and docs/scoring.md from it. All ids take
half an hour of one core.
"""

import json
import sys
from pathlib import Path

import numpy as np

from rigid_envs.base.files import lined_json, markdown_table, write_atomic
from rigid_envs.engine.provenance import provenance
from rigid_envs.envs.lookup import checked_id
from rigid_envs.scores.evaluation import evaluate
from rigid_envs.scores.policies import reference_controllers
from rigid_envs.scores.starts import N_STARTS
from rigid_envs.scores.trained import load
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools.pages.writing import between, marks

DOCS = Path(__file__).resolve().parents[2] / "docs"
DATA = DOCS / "fresh_starts.json"
PAGES = {"policies": DOCS / "policies.md", "references": DOCS / "scoring.md"}
"""Page of each table."""

_SEED, _N = 2026, 20_000  # a seed that nothing else has
_QUICK = "three_rolls"  # where the first reference takes half a second a start


def reference(env_id):
    """Name of a controller that is quick enough for so many starts."""
    names = list(reference_controllers(env_id))
    return _QUICK if _QUICK in names else names[0]


def beside(env_id, policy):
    """Figures of a policy from both sets, and how far apart they are.

    `apart` is the difference of the means in standard errors of the mean over so many drawn starts
    as the set has; of the cost it is of the successes.
    """
    few, many = evaluate(env_id, policy), evaluate(env_id, policy, n=_N, seed=_SEED)
    row = {"env_id": env_id, "policy": few.policy, "apart": {}}
    for name, found in (("set", few), ("fresh", many)):
        row[name] = {"starts": found.n, "success_rate": found.success.mean}
    for of in ("cost", "return"):
        a, b = (_samples(found)[of] for found in (few, many))
        for name, values in (("set", a), ("fresh", b)):
            row[name] |= {of: float(values.mean()), f"{of}_sd": float(values.std())}
        row["apart"][of] = float((a.mean() - b.mean()) / (b.std() / np.sqrt(len(a))))
    return row


def _samples(found):
    return {"cost": found.costs[found.successes], "return": found.values["return"]}


def table(rows):
    """The table of a page."""
    lines = []
    for row in rows:
        few, many = row["set"], row["fresh"]
        lines.append((
            f"`{row['env_id'].rpartition('/')[2].removesuffix('-v0')}`",
            f"`{row['policy']}`",
            *(f"{100.0 * each['success_rate']:.2f}" for each in (few, many)),
            *(f"{each['cost']:.4g}" for each in (few, many)),
            *(f"{row['apart'][of]:+.2f}" for of in ("cost", "return")),
        ))  # fmt: skip
    header = ("id", "policy", "success [%]", "fresh", "cost", "fresh", "apart", "of return")
    return markdown_table(header, lines, "<<>>>>>>")


def page(kind, text, data):
    """A page with its table made of the data."""
    return between(
        text, marks(kind, "python -m tests.benchmarks.fresh_starts"), lambda: table(data[kind])
    )


def main():
    """Measure, and write data and pages."""
    data = json.loads(DATA.read_text(encoding="utf-8"))
    for env_id in [checked_id(name) for name in sys.argv[1:]] or ENVIRONMENTS:
        for kind, policy in (("policies", load), ("references", reference)):
            row = beside(env_id, policy(env_id)) | {"provenance": provenance()}
            rows = {each["env_id"]: each for each in data[kind]} | {env_id: row}
            data[kind] = [rows[each] for each in ENVIRONMENTS if each in rows]
            print(kind, env_id, row["apart"], flush=True)
        write_atomic(DATA, lined_json(data | {"seed": _SEED, "starts": [N_STARTS, _N]}))
    write_pages()


def write_pages():
    """Write the tables of the pages from the data."""
    data = json.loads(DATA.read_text(encoding="utf-8"))
    for kind, file in PAGES.items():
        write_atomic(file, page(kind, file.read_text(encoding="utf-8"), data))


if __name__ == "__main__":
    sys.exit(main())
