"""Mutation test of `agents`: the tests of its subject must notice each planted bug.

Run from the checkout: ``python -m tests.mutations.application [--only WORD] [--jobs 2]``. Each bug
is planted in a copy of the checkout, where the tests that are named beside it run until one fails:
ten seconds to a minute. Prints a table; the status is 1 if a bug survives that is not argued away,
or if one that is argued away no longer survives.
"""

import argparse
import shutil
import sys
import tempfile
from pathlib import Path

from tests.mutations.known import BUGS
from tests.mutations.process import run_copy, shared_among

ROOT = Path(__file__).parents[2]
COPIED = ("agents", "configs", "docs", "rigid_envs", "tests", "pyproject.toml", "README.md")
_LIMIT = 600.0  # [s] a bug that takes so long makes something wait for ever: it counts as noticed
_PASSED, _FAILED = 0, 1  # statuses of pytest


class Checkout:
    """A copy of the checkout, or of a part of it, in a temporary folder."""

    def __init__(self, root=ROOT, parts=COPIED):
        self.folder = Path(tempfile.mkdtemp(prefix="bugs-"))
        for name in parts:
            if (root / name).is_dir():
                ignored = shutil.ignore_patterns("__pycache__")
                shutil.copytree(root / name, self.folder / name, ignore=ignored)
            else:
                shutil.copy(root / name, self.folder / name)

    def close(self):
        """Remove it."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def trial(self, bug):
        """The test that notices a bug; empty if all pass."""
        path = self.folder / bug.file
        source = path.read_text(encoding="utf-8")
        path.write_text(bug.planted(source), encoding="utf-8")
        try:
            return self._failing(bug.tests)
        finally:
            path.write_text(source, encoding="utf-8")

    def _failing(self, tests):
        """The first test that fails; empty if none does."""
        # one that is named is meant, long or not
        marked = ["-m", "long or not long"] if all("::" in test for test in tests) else []
        words = ["-x", "-q", "--no-header", "--tb=no", "-p", "no:cacheprovider", *marked, *tests]
        done = run_copy(self.folder, ["-m", "pytest", *words], _LIMIT)
        if done is None:
            return f"none: {_LIMIT:g} s are up"
        if done.returncode == _PASSED:
            return ""
        named = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
        if done.returncode != _FAILED and not named:
            raise RuntimeError(f"no tests ran: {done.stdout[-2000:]}{done.stderr[-2000:]}")
        return named[0].split(" - ")[0].rpartition("::")[2].partition("[")[0]


def main(argv=None):
    """Plant the bugs, run the tests, and print the table."""
    parser = argparse.ArgumentParser("tests.mutations.application", allow_abbrev=False)
    parser.add_argument("--only", metavar="WORD", default="", help="those with it in file or words")
    parser.add_argument("--jobs", type=int, default=1, help="copies at a time")
    options = parser.parse_args(argv)
    chosen = [bug for bug in BUGS if options.only in f"{bug.file} {bug.what}"]
    found = _try_all(chosen, options.jobs)
    print("| bug | file | noticed by |\n|---|---|---|")
    for bug, test in zip(chosen, found, strict=True):
        print(f"| {bug.what} | {bug.file} | {_verdict(bug, test)} |")
    wrong = [bug for bug, test in zip(chosen, found, strict=True) if bool(test) == bool(bug.why)]
    print(
        f"\n{len(chosen)} bugs, {sum(map(bool, found))} noticed, {len(wrong)} not as they should."
    )
    return 1 if wrong else 0


def _verdict(bug, test):
    survived = f"nothing: {bug.why}" if bug.why else "NOTHING"
    return test or survived


def _try_all(chosen, jobs):
    copies = [Checkout() for _ in range(jobs)]

    def one(copy, bug):
        test = copy.trial(bug)
        print(f"{bug.what}: {_verdict(bug, test)}", file=sys.stderr, flush=True)
        return test

    try:
        return list(shared_among(copies, chosen, one))
    finally:
        for copy in copies:
            copy.close()


if __name__ == "__main__":
    sys.exit(main())
