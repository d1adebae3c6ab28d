"""Bugs to plant by hand, and bugs that no test can notice: what the `.toml` files here say."""

import tomllib
from pathlib import Path
from typing import NamedTuple


class Bug(NamedTuple):
    """A change of the source of `agents` that is a mistake; its fields are told in the file."""

    what: str
    file: str
    old: str
    new: str
    tests: tuple[str, ...]
    why: str = ""

    def planted(self, source):
        """A source with this bug.

        Raises:
            ValueError: The text to change is not there, or more than once.
        """
        if source.count(self.old) != 1:
            raise ValueError(f"{self.what}: {self.file} has {self.old!r} not once")
        return source.replace(self.old, self.new)


class Equivalent(NamedTuple):
    """A mutant of a kernel that gives the same motion."""

    source: str
    function: str
    text: str
    term: str
    nth: int
    reason: str

    @property
    def key(self):
        """Identifies the mutant in its file, as `Mutant.key`."""
        return self.function, self.text, self.term, self.nth


class LibraryEquivalent(NamedTuple):
    """A change of the library that makes no difference that a user could see."""

    file: str
    function: str
    text: str
    what: str
    why: str

    @property
    def key(self):
        """Identifies the change, as `Change.key`."""
        return self[:4]


def _read(name, table):
    entries = tomllib.loads((Path(__file__).parent / name).read_text(encoding="utf-8"))[table]
    return [entry | {"tests": tuple(entry["tests"])} if "tests" in entry else entry
            for entry in entries]  # fmt: skip


BUGS = tuple(Bug(**entry) for entry in _read("bugs.toml", "bug"))
EQUIVALENTS = tuple(Equivalent(**entry) for entry in _read("kernels.toml", "equivalent"))
LIBRARY_EQUIVALENTS = tuple(
    LibraryEquivalent(**entry) for entry in _read("library.toml", "equivalent")
)
