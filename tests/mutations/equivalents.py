"""Mutants that change nothing, each with the reason why."""

from typing import NamedTuple

__all__ = ["EQUIVALENTS", "Equivalent"]


class Equivalent(NamedTuple):
    """A wrong sign that is none.

    Attributes:
        source: name of the source file.
        function: in which function.
        text: the line as it is written, without blanks at its ends.
        term: the term on that line.
        nth: which of the equal terms of the line, from 0.
        reason: why the negated term gives the same motion.
    """

    source: str
    function: str
    text: str
    term: str
    nth: int
    reason: str


EQUIVALENTS: tuple[Equivalent, ...] = ()
