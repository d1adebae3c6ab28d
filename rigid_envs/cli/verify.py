"""`rigid-envs verify`: the laws checked, as text for people and as JSON for programs."""

import inspect
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from rigid_envs import laws
from rigid_envs.cli.progress import tell
from rigid_envs.laws import Outcome, Subject
from rigid_envs.pages.tables import paragraphs, table
from rigid_envs.provenance import heading, provenance

__all__ = ["Verdict", "verify"]

_LONGEST = 300  # characters of an error message that are shown: those of compilers fill pages


@dataclass(frozen=True)
class Verdict:
    """The outcomes of all laws that were checked.

    Attributes:
        provenance: versions, machine and date, see `provenance`.
        subjects: subjects that were checked.
        outcomes: one per law, in the order of the subjects.
        seconds: wall-clock time of all checks, compilation included [s].
    """

    provenance: dict[str, Any]
    subjects: Sequence[Subject]
    outcomes: Sequence[Outcome]
    seconds: float

    @property
    def failures(self) -> list[Outcome]:
        """Outcomes of the laws that do not hold."""
        return [outcome for outcome in self.outcomes if not outcome.holds]

    def as_json(self) -> dict[str, Any]:
        """JSON values; an error that is not finite is null."""
        return {
            "provenance": self.provenance,
            "holds": not self.failures,
            "seconds": self.seconds,
            "laws": [_entry(outcome) for outcome in self.outcomes],
        }

    def as_text(self) -> str:
        """One table per subject, 100 columns wide, then the laws that fail."""
        parts = [heading(self.provenance)]
        for subject in self.subjects:
            found = [o for o in self.outcomes if o.law.subject == subject.name]
            title = f"{subject.name}: {subject.title}"
            parts.append(f"{title}\n{'=' * len(title)}\n{_rows(found)}")
        parts += [_failure(outcome) for outcome in self.failures]
        return "\n\n".join([*parts, self._summary()])

    def _summary(self) -> str:
        n, broken = len(self.outcomes), len(self.failures)
        held = f"All {n} laws hold" if not broken else f"{broken} of {n} laws FAIL"
        return f"{held} ({self.seconds:.0f} s)."


def verify(names: Sequence[str] = ()) -> Verdict:
    """Check the laws of some subjects.

    Args:
        names: subjects; all of them if empty.
    """
    where, start = provenance(), time.perf_counter()
    outcomes = laws.check_all(names, tell)
    tell("")
    subjects = [laws.SUBJECTS[name] for name in names or laws.SUBJECTS]
    return Verdict(where, subjects, outcomes, time.perf_counter() - start)


def _entry(outcome: Outcome) -> dict[str, Any]:
    law = outcome.law
    return {
        "subject": law.subject,
        "name": law.name,
        "statement": inspect.getdoc(law.measure),
        "compared": law.compared,
        "error": outcome.error if math.isfinite(outcome.error) else None,
        "bound": law.bound,
        "why": law.why,
        "holds": outcome.holds,
        "seconds": outcome.seconds,
        "message": outcome.message,
    }


def _rows(outcomes: Sequence[Outcome]) -> str:
    rows = [
        (
            outcome.law.name,
            outcome.law.compared,
            f"{outcome.error:.1e}",
            f"{outcome.law.bound:.0e}",
            "holds" if outcome.holds else "FAILS",
        )
        for outcome in outcomes
    ]
    return table(("law", "compared", "error", "bound", ""), rows, "<<>>")


def _failure(outcome: Outcome) -> str:
    law = outcome.law
    said = outcome.message or f"error {outcome.error:.3g}, bound {law.bound:.3g}: {law.why}"
    if len(said) > _LONGEST:
        said = said[:_LONGEST] + " ..."
    return paragraphs(f"FAILS: {law.subject}: {law.name}. {said}", 0)
