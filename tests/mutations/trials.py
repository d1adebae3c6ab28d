"""Mutants in a copy of the package, and the laws checked against it."""

import json
import shutil
from dataclasses import dataclass
from pathlib import Path

from tests.mutations.application import Checkout
from tests.mutations.mutants import Mutant
from tests.mutations.process import run_copy

_LIMIT = 300.0  # [s] a mutant that takes so long does not end: it counts as noticed
_QUICK = 4  # laws of a subject that are tried interpreted: a step takes a thousand times as long
# Checks laws until one fails; prints the file of the package, to prove that it is the copy.
_PROGRAM = """
import json, sys
import rigid_envs
from rigid_envs.tools.laws import SUBJECTS, check
broken, count = None, int(sys.argv[1])
for law in (law for name in sys.argv[2:] for law in SUBJECTS[name].laws[:count]):
    outcome = check(law)
    if not outcome.holds:
        broken = [law.subject, law.name, outcome.error, outcome.message]
        break
print(json.dumps([rigid_envs.__file__, broken]))
"""
# Kernels run without compilation, except for the functions that read and write rows.
_INTERPRETED_ROWS = """
import numba

if numba.config.DISABLE_JIT:

    def load(array, start, like, stride):
        numbers = array.reshape(-1)[start : start + len(like) * stride : stride].tolist()
        return type(like)(*numbers) if hasattr(like, "_fields") else tuple(numbers)

    def store(array, start, values, stride):
        array.reshape(-1)[start : start + len(values) * stride : stride] = values

    def place(base, slot, lane):
        return base + slot * LANES + lane

    def get(array, base, slot, lane, like):
        return load(array, place(base, slot, lane), like, LANES)

    def put(array, base, slot, lane, values):
        store(array, place(base, slot, lane), values, LANES)
"""


@dataclass(frozen=True)
class Trial:
    """Result of the laws for one mutant.

    Attributes:
        source: file of compiled functions, from the package, without its suffix.
        mutant: the wrong sign.
        law: the first law that failed, "subject: name"; empty if all hold.
        error: its error, or the exception.
    """

    source: str
    mutant: Mutant
    law: str
    error: str

    @property
    def is_void(self):
        """Whether the term is no number, so that the mutant does not compile."""
        return self.error.startswith(("TypeError: bad operand", "TypingError", "LoweringError"))


class PackageCopy(Checkout):
    """A copy of the package in a temporary folder; the checkout is never changed."""

    def __init__(self):
        super().__init__(parts=("rigid_envs",))
        with self._path("engine/rows").open("a", encoding="utf-8") as rows:
            rows.write(_INTERPRETED_ROWS)

    def source(self, name):
        """Text of a file, named from the package without its suffix."""
        return self._path(name).read_text(encoding="utf-8")

    def first_broken(self, subjects):
        """The first law that fails in the copy as it is, and its error; empty if none does.

        A few laws are checked with interpreted kernels, which takes a second; if they hold, all
        laws with compiled kernels.

        Raises:
            RuntimeError: the process failed.
        """
        quick = self._check(subjects, _QUICK, {"NUMBA_DISABLE_JIT": "1"})
        return quick if quick[0] else self._check(subjects, 1000, {})

    def _check(self, subjects, count, settings):
        """Check the first laws of subjects in a new process."""
        cache = self.folder / "cache"
        settings |= {
            "NUMBA_CACHE_DIR": str(cache),
            "NUMBA_OPT": "0",  # the same numbers, compiled in less time
            "OMP_NUM_THREADS": "1",
        }
        words = ["-P", "-c", _PROGRAM, str(count), *subjects]
        try:
            done = run_copy(self.folder, words, _LIMIT, **settings)
        finally:
            shutil.rmtree(cache, ignore_errors=True)
        if done is None:
            return "none: the time is up", f"{_LIMIT:g} s"
        if done.returncode != 0:
            raise RuntimeError(f"the laws could not be checked: {done.stderr[-2000:]}")
        return self._failed_law(done.stdout)

    def _failed_law(self, said):
        """The law that failed and its error, from the last line of the output."""
        file, broken = json.loads(said.splitlines()[-1])
        if not Path(file).is_relative_to(self.folder):
            raise RuntimeError(f"{file} was checked and not the copy in {self.folder}")
        if broken is None:
            return "", ""
        subject, name, error, message = broken
        return f"{subject}: {name}", message.splitlines()[0] if message else f"{error:.1e}"

    def mutated(self, name, mutant, subjects):
        """Put a mutant into the file `name`, check the laws, and restore the file."""
        path, source = self._path(name), self.source(name)
        path.write_text(mutant.planted(source), encoding="utf-8")
        try:
            return Trial(name, mutant, *self.first_broken(subjects))
        finally:
            path.write_text(source, encoding="utf-8")

    def _path(self, name):
        return self.folder / "rigid_envs" / f"{name}.py"
