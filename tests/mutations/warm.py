"""Runs of tests in a copy of the project, each in a process of its own that is there at once.

A process imports what no change of the project touches, pytest, NumPy, SciPy, Numba, Gymnasium
and Hypothesis, and waits. Each run is a fork of it: it saves seconds of imports, and what a run
leaves behind ends with it.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import pytest

_PYTEST = ("-q", "--no-header", "--tb=line", "-p", "no:cacheprovider")
_PAUSE = 0.02  # [s] between two looks at a process that runs


class Outcome(NamedTuple):
    """What came of some tests.

    Attributes:
        failed: First test that failed, or file that could not be imported; empty if none did.
        seconds: Time that each test took [s].
        reached: Tests by line, by file from the root of the copy; empty if nobody asked. The test
            "" is what runs outside of all, while they are collected.
        passed: Number of tests that passed.
        late: Whether the time was up.
        said: End of what pytest printed.
    """

    failed: list[str]
    seconds: dict[str, float]
    reached: dict[str, dict[str, list[str]]]
    passed: int
    late: bool
    said: str


class WarmPython:
    """A process in a copy of the project that forks for each run of tests.

    Args:
        folder: The copy.
    """

    def __init__(self, folder):
        settings = {"PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"}
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tests.mutations.warm"],
            cwd=folder,
            env={**os.environ, **settings},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def run(self, words, limit, order=None, measured=()):
        """Run tests in the copy.

        Args:
            words: Arguments of pytest.
            limit: Time that they may take [s].
            order: Tests to run, in this order, of all that the arguments name; None for all.
            measured: Patterns of files of which the lines that each test reaches are noted.
        """
        request = {"words": [*_PYTEST, *words], "limit": limit, "order": order}
        self._process.stdin.write(json.dumps({**request, "measured": list(measured)}) + "\n")
        self._process.stdin.flush()
        answer = self._process.stdout.readline()
        if not answer:
            raise RuntimeError("the process that runs the tests has ended")
        return Outcome(**json.loads(answer))

    def close(self):
        """End it."""
        self._process.stdin.close()
        self._process.stdout.close()
        self._process.wait()


def _serve():
    """Fork for each line of the input; answer in a line."""
    import gymnasium  # noqa: F401
    import hypothesis  # noqa: F401
    import numba  # noqa: F401
    import scipy.integrate
    import scipy.optimize
    import scipy.spatial
    import scipy.special  # noqa: F401

    for line in sys.stdin:
        request = json.loads(line)
        with tempfile.TemporaryDirectory(prefix="run-") as folder:
            answer = _forked(request, Path(folder))
        print(json.dumps(answer._asdict()), flush=True)


def _forked(request, folder):
    """The outcome of a request, by a child; it leaves it in a file."""
    result, said = folder / "outcome.json", folder / "said"
    child = os.fork()
    if child == 0:
        os.setsid()
        output = os.open(said, os.O_WRONLY | os.O_CREAT)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(output, 1)
        os.dup2(output, 2)
        try:
            result.write_text(json.dumps(_run(request)._asdict()), encoding="utf-8")
        finally:
            os._exit(0)
    end = time.monotonic() + request["limit"]
    while os.waitpid(child, os.WNOHANG) == (0, 0):
        if time.monotonic() > end:
            os.killpg(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return Outcome([], {}, {}, 0, True, "")
        time.sleep(_PAUSE)
    text = said.read_text(encoding="utf-8", errors="replace")[-2000:]
    if not result.exists():  # the interpreter itself was killed
        return Outcome(["none: the process died"], {}, {}, 0, False, text)
    return Outcome(**json.loads(result.read_text(encoding="utf-8")))._replace(said=text)


def _run(request):
    """Run pytest, measured if that is asked for."""
    import coverage

    files = [str(Path(pattern).absolute()) for pattern in request["measured"]]
    measure = coverage.Coverage(data_file=None, config_file=False, include=files or None)
    seen = _Seen(request["order"], measure if files else None)
    if files:
        measure.start()
    pytest.main(request["words"], plugins=[seen])
    reached = {}
    if files:
        measure.stop()
        data = measure.get_data()
        for file in data.measured_files():
            lines = data.contexts_by_lineno(file)
            reached[os.path.relpath(file)] = {str(line): tests for line, tests in lines.items()}
    return Outcome(seen.failed, seen.seconds, reached, seen.passed, False, "")


class _Seen:
    """A plugin of pytest: chooses the tests, and notes what comes of them."""

    def __init__(self, order, measure):
        self._order = None if order is None else {test: k for k, test in enumerate(order)}
        self._measure = measure
        self.failed = []
        self.seconds = {}
        self.passed = 0

    def pytest_configure(self):
        """The same examples in each run, and no search for the simplest that fails."""
        from hypothesis import HealthCheck, Phase, settings

        settings.register_profile(
            "mutants",
            deadline=None,
            suppress_health_check=[HealthCheck.too_slow],
            derandomize=True,
            database=None,
            phases=[Phase.explicit, Phase.generate],
        )
        settings.load_profile("mutants")

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items):
        """Only the chosen tests, in their order."""
        if self._order is not None:
            order = self._order
            items[:] = [item for item in items if item.nodeid in order]
            items.sort(key=lambda item: order[item.nodeid])

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item):
        """Note the time of a test, and the lines that it reaches."""
        if self._measure is not None:
            self._measure.switch_context(item.nodeid)
        start = time.perf_counter()
        outcome = yield
        self.seconds[item.nodeid] = time.perf_counter() - start
        if self._measure is not None:
            self._measure.switch_context("")
        return outcome

    def pytest_runtest_logreport(self, report):
        """Count what passed, and note what failed."""
        if report.failed:
            self.failed.append(report.nodeid)
        elif report.when == "call" and report.passed:
            self.passed += 1

    def pytest_collectreport(self, report):
        """A file that cannot be imported has noticed something, too."""
        if report.failed:
            self.failed.append(f"import of {report.nodeid}")


if __name__ == "__main__":
    _serve()
