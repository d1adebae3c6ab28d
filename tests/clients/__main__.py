"""Run programs of others on the environments, and write what came of it into docs.

    python -m tests.clients [RECIPE ...]

Without a name all recipes are run, and docs/clients.json and docs/clients.md are written anew; with
names those rows of them. The status is 1 if one fails.
"""

import argparse
import json
import sys

from rigid_envs.files import lined_json, write_atomic
from rigid_envs.provenance import provenance
from tests.clients.page import markdown
from tests.clients.rows import ROWS
from tests.clients.running import ROOT, run

DATA = ROOT / "docs" / "clients.json"


def main() -> int:
    """Run recipes one after the other."""
    parser = argparse.ArgumentParser(prog="python -m tests.clients", description=__doc__)
    parser.add_argument("recipes", nargs="*", metavar="RECIPE", help="(all)")
    names = parser.parse_args().recipes
    unknown = set(names) - {row.recipe for row in ROWS}
    if unknown:
        parser.error(f"{sorted(unknown)}; expected some of {[row.recipe for row in ROWS]}")
    data = json.loads(DATA.read_text()) if names else {}
    where, failed = provenance(), []
    for row in ROWS:
        if names and row.recipe not in names:
            continue
        try:
            data[row.recipe] = {**run(row), "provenance": where}
            print(row.recipe, data[row.recipe]["result"], flush=True)
        except AssertionError as error:
            failed.append(row.recipe)
            print(f"{row.recipe} failed: {error}", file=sys.stderr, flush=True)
    if failed:
        return 1
    write_atomic(DATA, lined_json({row.recipe: data[row.recipe] for row in ROWS}))
    write_atomic(ROOT / "docs" / "clients.md", markdown(data))
    return 0


if __name__ == "__main__":
    sys.exit(main())
