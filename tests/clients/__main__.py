"""Run programs of others on the environments, and write what came of it into docs.

    python -m tests.clients [RECIPE ...]

Without a name all recipes are run, and docs/clients.json and docs/clients.md are written anew; with
names those rows of them. The status is 1 if one fails.
"""

import argparse
import json
import sys
from pathlib import Path

from rigid_envs.base.files import lined_json, write_atomic
from rigid_envs.engine.provenance import provenance
from tests.clients.rows import ROWS, markdown
from tests.clients.running import ROOT, run

DATA = ROOT / "docs" / "clients.json"
_NAMES = tuple(row.recipe for row in ROWS)


def main(argv=None):
    """Run recipes one after the other, and write their rows."""
    parser = argparse.ArgumentParser(prog="python -m tests.clients", description=__doc__)
    parser.add_argument("recipes", nargs="*", metavar="RECIPE", help=f"of {', '.join(_NAMES)}")
    parser.add_argument("--out", type=Path, default=DATA.parent, metavar="FOLDER", help="(docs)")
    options = parser.parse_args(argv)
    if unknown := set(options.recipes) - set(_NAMES):
        parser.error(f"{sorted(unknown)}; expected some of {', '.join(_NAMES)}")
    asked = [row for row in ROWS if row.recipe in (options.recipes or _NAMES)]
    found = _run(asked)
    data = {**(json.loads(DATA.read_text()) if options.recipes else {}), **found}
    kept = {name: data[name] for name in _NAMES if name in data}
    write_atomic(options.out / "clients.json", lined_json(kept))
    write_atomic(options.out / "clients.md", markdown(kept))
    return int(len(found) < len(asked))


def _run(rows):
    """What recipes measured, without those that failed."""
    where, data = provenance(), {}
    for row in rows:
        try:
            data[row.recipe] = {**run(row), "provenance": where}
            print(row.recipe, data[row.recipe]["result"], flush=True)
        except AssertionError as error:
            print(f"{row.recipe} failed: {error}", file=sys.stderr, flush=True)
    return data


if __name__ == "__main__":
    sys.exit(main())
