"""A physical law as a claim with an error bound, and the outcome of its check."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field

__all__ = ["Law", "Outcome", "Subject", "check"]

Measure = Callable[[], float]


@dataclass(frozen=True)
class Law:
    """A physical claim whose error is measured.

    Attributes:
        subject: name of its subject.
        name: the claim, in words.
        compared: the two sides that are compared.
        bound: largest error with which the law holds.
        why: reason for the bound.
        measure: computes the error; its docstring is the statement.
    """

    subject: str
    name: str
    compared: str
    bound: float
    why: str
    measure: Measure


@dataclass(frozen=True)
class Outcome:
    """Result of the check of a law.

    Attributes:
        law: the law that was checked.
        error: measured error; NaN if an exception was raised.
        seconds: wall-clock time of the check [s].
        message: the exception that was raised; empty if none was.
    """

    law: Law
    error: float
    seconds: float
    message: str = ""

    @property
    def holds(self) -> bool:
        """Whether the error is within the bound; NaN never is."""
        return not self.message and self.error <= self.law.bound


@dataclass(frozen=True)
class Subject:
    """Laws about one system or module; the file of the same name adds them with `law`.

    Attributes:
        name: name on the command line.
        title: one line of description.
        laws: in the order of the checks, fast ones first.
    """

    name: str
    title: str
    laws: list[Law] = field(default_factory=list)

    def law(self, compared: str, *, bound: float, why: str) -> Callable[[Measure], Measure]:
        """Decorator: add a law. The function measures its error, the function's name is the claim.

        Args:
            compared: the two sides that are compared.
            bound: largest error with which the law holds.
            why: reason for the bound.
        """

        def add(measure: Measure) -> Measure:
            claim = measure.__name__.replace("_", " ")
            self.laws.append(Law(self.name, claim, compared, bound, why, measure))
            return measure

        return add


def check(law: Law) -> Outcome:
    """Measure the error of a law; an exception counts as a failure."""
    start = time.perf_counter()
    error, message = float("nan"), ""
    try:
        error = float(law.measure())
    except Exception as raised:
        message = f"{type(raised).__name__}: {raised}"
    return Outcome(law, error, time.perf_counter() - start, message)
