"""All laws of systems, bodies and rotations, and their check."""

from collections.abc import Callable, Sequence

from rigid_envs.mechanics import body_laws as bodies
from rigid_envs.mechanics import rotation_laws as rotations
from rigid_envs.mechanics.laws import Outcome, Subject, check
from rigid_envs.systems import modules_of_all

_MODULES = (rotations, bodies, *modules_of_all("laws"))
SUBJECTS: dict[str, Subject] = {module.SUBJECT.name: module.SUBJECT for module in _MODULES}
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
