"""The laws of the physics, as `rigid-envs verify` checks them.

One file of laws for each subject; a law compares what the public interface gives with a source
that shares no formula with it: closed forms, conserved quantities, Newton's law in world axes.
"""

import difflib
import time
from collections.abc import Sequence

from rigid_envs.cli.progress import tell
from rigid_envs.cli.verify import (
    bodies,
    dynamic_ball,
    free_body,
    heavy_top,
    roller,
    rolling_ball,
    rolling_disk,
    rotations,
    upright_coin,
)
from rigid_envs.cli.verify.laws import Outcome, Subject, check
from rigid_envs.cli.verify.report import Verdict
from rigid_envs.provenance import provenance

__all__ = ["SUBJECTS", "UnknownSubjectError", "Verdict", "checked_subject", "verify"]

_MODULES = (
    rotations,
    bodies,
    free_body,
    heavy_top,
    rolling_ball,
    dynamic_ball,
    rolling_disk,
    upright_coin,
    roller,
)
SUBJECTS: dict[str, Subject] = {module.SUBJECT.name: module.SUBJECT for module in _MODULES}


class UnknownSubjectError(ValueError):
    """There are no laws about that."""


def checked_subject(name: str) -> str:
    """The name itself.

    Raises:
        UnknownSubjectError: names the nearest one and lists all.
    """
    if name in SUBJECTS:
        return name
    (near,) = difflib.get_close_matches(name.lower(), SUBJECTS, n=1, cutoff=0.0)
    raise UnknownSubjectError(
        f"there are no laws about {name!r}; did you mean {near!r}? All: {', '.join(SUBJECTS)}"
    )


def verify(names: Sequence[str] = ()) -> Verdict:
    """Check all laws.

    Args:
        names: the subjects to look at; all of them if there are none.
    """
    where, start = provenance(), time.perf_counter()
    subjects = [SUBJECTS[name] for name in names or SUBJECTS]
    outcomes: list[Outcome] = []
    for subject in subjects:
        for law in subject.laws:
            tell(f"{subject.name}: {law.name}")
            outcomes.append(check(law))
    tell("")
    return Verdict(where, subjects, outcomes, time.perf_counter() - start)
