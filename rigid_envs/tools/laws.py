"""All laws of systems, bodies and rotations, and their check."""

import inspect
import math
import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from rigid_envs.engine.provenance import heading, provenance
from rigid_envs.mechanics import body_laws as bodies
from rigid_envs.mechanics import rotation_laws as rotations
from rigid_envs.mechanics.laws import Outcome, Subject, check
from rigid_envs.systems import modules_of_all
from rigid_envs.tools.pages.tables import paragraphs, table

_MODULES = (rotations, bodies, *modules_of_all("laws"))
SUBJECTS: dict[str, Subject] = {
    each.name: each
    for module in _MODULES
    for each in vars(module).values()
    if isinstance(each, Subject)
}
"""All laws by subject, in the order in which they are checked."""


def check_all(
    names: Sequence[str] = (), progress: Callable[[str], None] = lambda _: None
) -> list[Outcome]:
    """Check every law of some subjects.

    Args:
        names: subjects; all of them if empty.
        progress: called with "subject: law" before each law.

    Returns:
        One outcome per law, in the order of the subjects.
    """
    outcomes = []
    for subject in (SUBJECTS[name] for name in names or SUBJECTS):
        for law in subject.laws:
            progress(f"{subject.name}: {law.name}")
            outcomes.append(check(law))
    return outcomes


# `rigid-envs verify`: the laws checked, as text for people and as JSON for programs.

_LONGEST = 300  # characters of an error message that are shown: those of compilers fill pages


class Verdict(NamedTuple):
    """The outcomes of all laws that were checked.

    Attributes:
        provenance: versions, machine and date, see `provenance`.
        outcomes: one per law, in the order of the subjects.
        seconds: wall-clock time of all checks, compilation included [s].
    """

    provenance: dict[str, Any]
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
        for name in dict.fromkeys(outcome.law.subject for outcome in self.outcomes):
            found = [outcome for outcome in self.outcomes if outcome.law.subject == name]
            title = f"{name}: {SUBJECTS[name].title}"
            parts.append(f"{title}\n{'=' * len(title)}\n{_rows(found)}")
        parts += [_failure(outcome) for outcome in self.failures]
        n, broken = len(self.outcomes), len(self.failures)
        held = f"All {n} laws hold" if not broken else f"{broken} of {n} laws FAIL"
        return "\n\n".join([*parts, f"{held} ({self.seconds:.0f} s)."])


def verify(names: Sequence[str] = (), progress: Callable[[str], None] = lambda _: None) -> Verdict:
    """Check the laws of some subjects.

    Args:
        names: subjects; all of them if empty.
        progress: see `check_all`.
    """
    where, start = provenance(), time.perf_counter()
    outcomes = check_all(names, progress)
    return Verdict(where, outcomes, time.perf_counter() - start)


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
