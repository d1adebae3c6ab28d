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


EQUIVALENTS: tuple[Equivalent, ...] = (
    Equivalent(
        "free_body",
        "free_rotation",
        "q, w1, w2 = _turn_about_3(q, (omega[0], w2, w3), 0.5 * h * k3 * w3, r12, r21)",
        "w3",
        0,
        "a turn about e3 keeps omega3 and does not read it; its angle is another argument",
    ),
    Equivalent(
        "free_body",
        "free_rotation",
        "q, w2, w3 = _turn_about_1(q, (w1, w2, w3), 0.25 * h * k1 * w1, r23, r32)",
        "w1",
        0,
        "a turn about e1 keeps omega1 and does not read it; its angle is another argument",
    ),
)
