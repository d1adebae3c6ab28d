"""Which tests reach which lines: every test file is run once, measured by `coverage`."""

from __future__ import annotations

import hashlib
import json
import sys
import tempfile
from collections import Counter
from pathlib import Path
from typing import NamedTuple

from tests.mutations.warm import Outcome


class Room(NamedTuple):
    """Files in which bugs are planted, and what tests them.

    Attributes:
        files: Patterns of source files, from the package.
        tests: Test files and folders of tests, or patterns of them.
    """

    files: tuple[str, ...]
    tests: tuple[str, ...]


ROOMS = {
    "bodies": Room(
        ("mechanics/bodies/*.py",), ("tests/mechanics/bodies", "tests/mechanics/test_laws.py")
    ),
    "closed forms": Room(
        ("systems/*/closed_forms.py", "mechanics/special.py"),
        (
            *("tests/systems/test_closed_forms.py", "tests/systems/*/test_motion.py"),
            *("tests/systems/rolling_disk/test_euler_disk.py", "tests/mechanics/test_special.py"),
            "tests/mechanics/test_laws.py",
        ),
    ),
    "control": Room(
        (
            *("control/*.py", "systems/*/controllers.py"),
            *("systems/rolling_ball/shortest_path.py", "systems/free_body/saddle.py"),
        ),
        (
            *("tests/control/test_*.py", "tests/systems/*/test_tasks.py"),
            *(
                "tests/systems/free_body/test_spin_controllers.py",
                "tests/systems/rolling_ball/test_[gs]*.py",
            ),
        ),
    ),
    "planning": Room(
        ("control/planning/*.py",), ("tests/control/planning", "tests/scores/test_best.py")
    ),
    "scores": Room(
        ("scores/*.py",),
        (
            *("tests/scores", "tests/leaderboard", "tests/references"),
            *("tests/policies", "tests/sb3/test_exporting.py", "tests/cli/test_mistakes.py"),
            "tests/control/planning",
        ),
    ),
    "references": Room(
        ("systems/*/references.py",),
        (
            *("tests/references", "tests/scores", "tests/control/planning"),
            "tests/systems/*/test_tasks.py",
        ),
    ),
    "replays": Room(("watch/replays/*.py",), ("tests/replays", "tests/cli/test_mistakes.py")),
    "films": Room(("watch/films.py",), ("tests/films", "tests/cli/test_mistakes.py")),
    "datasets": Room(("tools/datasets.py",), ("tests/datasets", "tests/cli/test_mistakes.py")),
    "sb3": Room(("sb3/*.py",), ("tests/sb3", "tests/envs/test_shells.py")),
    "cli": Room(
        ("tools/cli/*.py",),
        (
            *("tests/cli", "tests/scores/test_best.py", "tests/leaderboard", "tests/replays"),
            *("tests/scores/test_records.py", "tests/policies", "tests/gallery"),
            *("tests/datasets", "tests/scores/test_public.py", "tests/films", "tests/play"),
            "tests/test_docs.py",
        ),
    ),
    "envs": Room(
        ("envs/*.py",),
        (
            *("tests/envs", "tests/test_checks.py", "tests/render/test_display.py"),
            *("tests/cli/test_cli.py", "tests/cli/test_mistakes.py", "rigid_envs/testing"),
            "tests/test_registry.py",
        ),
    ),
    "ground": Room(
        (
            *("*.py", "base/*.py", "engine/provenance.py", "engine/threads.py"),
            *("tasks/core.py", "tasks/registry.py"),
        ),
        (
            *("tests/test_checks.py", "tests/test_core.py", "tests/test_files.py"),
            *("tests/test_registry.py", "tests/test_tensorfile.py"),
            *("tests/envs", "tests/tasks", "tests/cli/test_cli.py", "tests/cli/test_verify.py"),
            *("tests/replays/test_format.py", "tests/cli/test_mistakes.py"),
            *("tests/systems/test_closed_forms.py", "tests/frozen/test_frozen.py"),
            *("tests/agents/config", "tests/test_docs.py", "tests/control/test_refusals.py"),
            "rigid_envs/testing",
        ),
    ),
}

CONTRACTS = ("RigidEnvs/BallParkGoal-v0", "RigidEnvs/BallGrid-v0", "RigidEnvs/AxisFlip-v0")
"""Ids for which the contract tests are run: one with goals, one with choices, and one with fast
motion and with a clock of its own, of which a row that has ended shows what no other does."""

_CASES = 4  # of a parametrised test, the quickest: others that reach the line seldom notice more
_FOLDER = Path(tempfile.gettempdir()) / "rigid-envs-reach"
_LIMIT = 1800.0  # [s] for one file; measured lines take up to twice their time


def sources(root, room):
    """Source files of a room in which bugs are planted."""
    package = root / "rigid_envs"
    return sorted(path for pattern in ROOMS[room].files for path in package.glob(pattern))


def words_for(files):
    """Arguments of pytest for test files."""
    files = list(files)
    contracts = any(file.startswith("rigid_envs/testing/") for file in files)
    ids = [word for env_id in CONTRACTS for word in ("--env-id", env_id)]
    return [*files, *(ids if contracts else [])]


class Reach:
    """Tests, their time, and the lines that each one reaches.

    What was measured stays in the temporary folder of the machine, for as long as neither the test
    file nor a source file of the packages is edited.

    Args:
        root: The checkout.
        paths: Test files and folders of tests.
        python: Process in a copy of the checkout.
    """

    def __init__(self, root, paths, python):
        self.seconds = {}
        self._reached = {}
        measured = [f"rigid_envs/{p}" for room in ROOMS.values() for p in room.files]
        for path in _test_files(root, paths):
            file = path.relative_to(root).as_posix()
            kept = _FOLDER / f"{path.stem}-{_digest(root, path)}.json"
            if not kept.exists():
                print(f"measuring {file}", file=sys.stderr, flush=True)
                found = python.run(words_for([file]), _LIMIT, measured=measured)
                if found.late:
                    raise RuntimeError(f"{file} takes longer than {_LIMIT:g} s")
                for test in found.failed:
                    print(f"{test} fails without any bug: it is left out", file=sys.stderr)
                if found.reached:  # else nothing could be measured, which is not to be kept
                    _FOLDER.mkdir(exist_ok=True)
                    kept.write_text(json.dumps(found), encoding="utf-8")
            else:
                found = Outcome(*json.loads(kept.read_text(encoding="utf-8")))
            self.seconds |= {t: s for t, s in found.seconds.items() if t not in found.failed}
            named = {"": file} | {test: test for test in self.seconds}
            for source, lines in found.reached.items():
                by_line = self._reached.setdefault(source, {})
                for line, tests in lines.items():
                    by_line.setdefault(int(line), set()).update(
                        named[t] for t in tests if t in named
                    )

    def tests_of(self, change):
        """Tests that reach a change, the quickest first.

        What runs at an import, or compiled, which is not measured, belongs to all tests that reach
        its file; at an import to all there are if none does.
        """
        found = self._of(change) & set(self.seconds)
        return self._quickest(found if found or change.in_body else self.seconds)

    def beside(self, change):
        """Other tests of the same files, and of those that reach it while they are collected.

        They may use what a first one has left in a cache, or what was made outside of all tests.
        """
        found = self._of(change)
        files = {test.partition("::")[0] for test in found if change.in_body or "::" in test}
        return self._quickest(
            t for t in self.seconds if t.partition("::")[0] in files and t not in found
        )

    def within(self, budget, tests):
        """The first of the tests that take no longer in all [s]; one at least."""
        found, total = [], 0.0
        for test in tests:
            total += self.seconds[test]
            if found and total > budget:
                break
            found.append(test)
        return found

    def _of(self, change):
        """Tests, and files of tests, that reach a change."""
        by_line = self._reached.get(change.file, {})
        first, last = change.lines
        lines = [k for k in by_line if change.in_body and first <= k <= last]
        return set().union(*(by_line[k] for k in lines or by_line))

    def _quickest(self, tests):
        """The tests in the order of their time, but some cases of each before all others."""
        first = []
        others = []
        cases = Counter()
        for test in sorted(tests, key=lambda test: (self.seconds[test], test)):
            name = test.partition("[")[0]
            cases[name] += 1
            (first if cases[name] <= _CASES else others).append(test)
        return first + others


def _test_files(root, paths):
    """Test files of folders, in order."""
    files = []
    for path in (found for pattern in paths for found in sorted(root.glob(pattern))):
        files += sorted(path.rglob("test_*.py")) or [path]
    return files


def _digest(root, test):
    """Hash of a test file and of the sources that are measured."""
    whole = hashlib.sha256()
    for path in [test, *(file for room in ROOMS for file in sources(root, room))]:
        whole.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    return whole.hexdigest()[:16]
