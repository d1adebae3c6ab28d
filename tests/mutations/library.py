"""Mutation test of the library's plain Python: its tests must notice each planted bug.

Run from the checkout: ``python -m tests.mutations.library [--sample 320 --seed 0] [--only WORD]
[--jobs 2] [--seconds 60]``. The bugs (`operators.py`) are drawn in equal shares from the rooms of
`reach.ROOMS`. Every test file is run once, measured; then for each bug the tests that reach its
line run in a copy of the checkout, the quickest first, until one fails: seconds each. Prints a
table; the status is 1 if a bug survives that is not argued away in `library.toml`, or if one that
is argued away no longer survives.
"""

import argparse
import sys
from math import inf
from typing import NamedTuple

from tests.mutations.application import ROOT, Checkout
from tests.mutations.known import LIBRARY_EQUIVALENTS
from tests.mutations.operators import Change, changes_of, sampled
from tests.mutations.process import shared_among
from tests.mutations.reach import ROOMS, Reach, sources, words_for
from tests.mutations.warm import WarmPython

_FACTOR, _START = 5.0, 60.0  # a bug that takes so many times its tests, and [s] more, never ends


class Trial(NamedTuple):
    """What came of a bug.

    Attributes:
        change: The bug.
        test: The test that noticed it, or how else it was noticed; empty if nothing did.
        reached: Number of tests that reach it.
    """

    change: Change
    test: str
    reached: int


class LibraryCopy(Checkout):
    """A copy of the checkout, and a process in it that is ready to run tests."""

    def __init__(self, root=ROOT):
        super().__init__(root)
        self.python = WarmPython(self.folder)

    def close(self):
        """End the process and remove the copy."""
        self.python.close()
        super().close()

    def noticed(self, change, reach, budget=inf):
        """Plant a bug, run the tests that reach it, and restore the source.

        Args:
            change: The bug.
            reach: Tests, and the lines that they reach.
            budget: Time that tests may have taken without the bug, all in all [s].
        """
        tests = reach.tests_of(change)
        chosen = reach.within(budget, [*tests, *reach.beside(change)])
        path = self.folder / change.file
        source = path.read_text(encoding="utf-8")
        path.write_text(change.planted(source), encoding="utf-8")
        try:
            return Trial(change, self._failing_of(chosen, reach), len(tests))
        finally:
            path.write_text(source, encoding="utf-8")

    def _failing_of(self, tests, reach):
        """The first of the tests that fails; empty if none does."""
        if not tests:
            return ""
        limit = _FACTOR * sum(reach.seconds[test] for test in tests) + _START
        files = dict.fromkeys(test.partition("::")[0] for test in tests)
        found = self.python.run(["-x", *words_for(files)], limit, order=tests)
        if found.late:
            return f"none: {limit:.0f} s are up"
        if not found.failed and found.passed == 0:  # they all ran without the bug
            return "none: no test can be run"
        return found.failed[0].rpartition("::")[2].partition("[")[0] if found.failed else ""


def all_changes(room):
    """Every bug that can be planted in a room."""
    return [
        change
        for path in sources(ROOT, room)
        for change in changes_of(
            path.read_text(encoding="utf-8"), path.relative_to(ROOT).as_posix()
        )
    ]


def main(argv=None):
    """Plant the bugs, run the tests, and print the table."""
    options = _options(argv)
    chosen = _chosen(options)
    copies = [LibraryCopy() for _ in range(options.jobs)]
    try:
        tried = {
            room: _try_all(room, changes, copies, options.seconds)
            for room, changes in chosen.items()
        }
    finally:
        for copy in copies:
            copy.close()
    trials = [trial for here in tried.values() for trial in here]
    argued = {equivalent.key: equivalent.why for equivalent in LIBRARY_EQUIVALENTS}
    print("| bug | where | noticed by |\n|---|---|---|")
    for trial in trials:
        change = trial.change
        print(f"| `{change.what}` | {_place(change)} | {_verdict(trial, argued)} |")
    print("\n| room | bugs | noticed | argued | survived |\n|---|---:|---:|---:|---:|")
    for room, here in tried.items():
        verdicts = [_verdict(trial, argued).partition(":")[0] for trial in here]
        counts = verdicts.count("ARGUED"), verdicts.count("SURVIVED")
        print(f"| {room} | {len(here)} | {len(here) - sum(counts)} | {counts[0]} | {counts[1]} |")
    wrong = [t for t in trials if bool(t.test) == (t.change.key in argued)]
    print(f"\n{len(trials)} bugs, {len(wrong)} not as they should.")
    return 1 if wrong else 0


def _options(argv):
    parser = argparse.ArgumentParser("tests.mutations.library", allow_abbrev=False)
    parser.add_argument("--sample", type=int, default=320, help="so many bugs, in equal shares")
    parser.add_argument("--seed", type=int, default=0, help="of the sample")
    parser.add_argument("--only", metavar="WORD", default="", help="those with it in their file")
    parser.add_argument("--jobs", type=int, default=1, help="copies at a time")
    parser.add_argument(
        "--seconds", type=float, default=60.0, help="of tests for each bug, the quickest first"
    )
    return parser.parse_args(argv)


def _chosen(options):
    """The sample of each room; rooms without any are left out."""
    shares = {
        room: options.sample // len(ROOMS) + (k < options.sample % len(ROOMS))
        for k, room in enumerate(ROOMS)
    }
    chosen = {
        room: [
            change
            for change in sampled(all_changes(room), share, options.seed)
            if options.only in change.file
        ]
        for room, share in shares.items()
    }
    return {room: changes for room, changes in chosen.items() if changes}


def _try_all(room, changes, copies, seconds):
    """Trials of a room."""
    reach = Reach(ROOT, ROOMS[room].tests, copies[0].python)

    def one(copy, change):
        trial = copy.noticed(change, reach, seconds)
        said = trial.test or "SURVIVED"
        print(f"{_place(change)} {change.what}: {said}", file=sys.stderr, flush=True)
        return trial

    return list(shared_among(copies, changes, one))


def _place(change):
    return f"{change.file}:{change.line}"


def _verdict(trial, argued):
    if trial.test:
        return trial.test
    if trial.change.key in argued:
        return f"ARGUED: {argued[trial.change.key]}"
    return f"SURVIVED: {trial.reached} tests reach it"


if __name__ == "__main__":
    sys.exit(main())
