"""What a law is, where it is written down, and what checking one gives."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field

__all__ = ["Law", "Outcome", "Subject", "check"]

Measure = Callable[[], float]


@dataclass(frozen=True)
class Law:
    """A statement of physics that is measured.

    Attributes:
        subject: name of the subject that it belongs to.
        name: the claim.
        compared: what is compared with what.
        bound: largest error with which it holds.
        why: where the bound comes from.
        measure: returns the error.
    """

    subject: str
    name: str
    compared: str
    bound: float
    why: str
    measure: Measure


@dataclass(frozen=True)
class Outcome:
    """What became of a law.

    Attributes:
        law: which.
        error: the measured error, NaN where there is none.
        seconds: time it took [s].
        message: what was raised on the way; empty where nothing was.
    """

    law: Law
    error: float
    seconds: float
    message: str = ""

    @property
    def holds(self) -> bool:
        """Whether the error is within the bound; an error that is not a number never is."""
        return not self.message and self.error <= self.law.bound


@dataclass(frozen=True)
class Subject:
    """Laws about one thing; the file of that name writes them down with `law`.

    Attributes:
        name: as on the command line.
        title: what the laws are about.
        laws: in the order in which they are checked, cheap ones first.
    """

    name: str
    title: str
    laws: list[Law] = field(default_factory=list)

    def law(self, compared: str, *, bound: float, why: str) -> Callable[[Measure], Measure]:
        """Write down that the decorated function measures a law; its name is the claim.

        Args:
            compared: what is compared with what.
            bound: largest error with which it holds.
            why: where the bound comes from.
        """

        def write_down(measure: Measure) -> Measure:
            claim = measure.__name__.replace("_", " ")
            self.laws.append(Law(self.name, claim, compared, bound, why, measure))
            return measure

        return write_down


def check(law: Law) -> Outcome:
    """Measure a law; whatever it raises is its failure."""
    start = time.perf_counter()
    error, message = float("nan"), ""
    try:
        error = float(law.measure())
    except Exception as raised:
        message = f"{type(raised).__name__}: {raised}"
    return Outcome(law, error, time.perf_counter() - start, message)
