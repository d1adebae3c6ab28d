"""The function `deep_check`: all checks, and one error with all that they found."""

import random
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from itertools import islice
from typing import Any

import gymnasium as gym
import numpy as np

from rigid_envs.testing.deep import copies, endings, ownership, pictures, repetition, results, rows
from rigid_envs.testing.deep.subject import Check, Subject

__all__ = ["DeepCheckError", "deep_check"]

CHECKS: tuple[Check, ...] = (*results.CHECKS, *ownership.CHECKS, *endings.CHECKS, *pictures.CHECKS)
"""What every environment does."""

REPRODUCIBLE: tuple[Check, ...] = (
    *repetition.CHECKS,
    *copies.CHECKS,
    *pictures.REPRODUCIBLE,
    *rows.CHECKS,
)
"""What every environment does whose specification does not say that it is nondeterministic."""

STRICT: tuple[Check, ...] = (*ownership.STRICT, *results.STRICT, *rows.STRICT)
"""What good environments do, and some of Gymnasium's own do not."""

_FINDINGS_OF_A_CHECK = 3


class DeepCheckError(AssertionError):
    """An environment does what no correct one does.

    Attributes:
        findings: All that was found, each as a sentence that begins with the name of the check.
    """

    def __init__(self, findings: Iterable[str]) -> None:
        """Make the message: one finding in a line."""
        self.findings = tuple(findings)
        count = len(self.findings)
        super().__init__("\n- ".join([f"{count} finding{'s'[: count > 1]}:", *self.findings]))


def deep_check(
    env_id: str | Callable[..., gym.Env[Any, Any]],
    /,
    *,
    seed: int = 0,
    strict: bool = False,
    options: dict[str, Any] | None = None,
    **kwargs: Any,
) -> None:
    """Check any Gymnasium environment beyond `gymnasium.utils.env_checker.check_env`.

    Episodes of random actions are the same in every bit for the same seed, however they are run;
    results are of the declared kind and belong to the caller; what the caller gives is not changed;
    the time limit truncates; copies go on as the original; pictures change nothing. An environment
    whose specification says ``nondeterministic`` is not asked for the same bits. The global random
    generators are left as they are.

    Args:
        env_id: Gymnasium's id, or a callable that makes an environment.
        seed: seed of the episodes that are looked at, from 0.
        strict: also what some of Gymnasium's own environments do not do: observations can be
            written into without harm, NaN in an action is refused or harmless, and row i of the
            environment's own vector form, if it has one, is the single environment seeded s + i.
        options: options of a reset that the environment accepts, to see that they are not changed.
        **kwargs: arguments of `gymnasium.make`, or of the callable.

    Raises:
        DeepCheckError: with all findings, each a sentence.
        Exception: whatever making an environment raises.
    """
    subject = Subject(env_id, kwargs, seed, options or {})
    with _generators_kept():
        is_random = subject.spec is not None and bool(subject.spec.nondeterministic)
        findings = list(_attempt(_first_episode, subject))
        if not findings:
            checks = CHECKS + (() if is_random else REPRODUCIBLE) + STRICT * strict
            findings = [told for check in checks for told in _attempt(check, subject)]
    if findings:
        raise DeepCheckError(findings)


def _first_episode(subject: Subject) -> Iterator[str]:
    """It can be reset, and stepped with actions of its space; else no check has a sense."""
    assert subject.reference
    yield from ()


def _attempt(check: Check, subject: Subject) -> Iterator[str]:
    """Findings of a check; an exception is one too."""
    name = check.__name__.strip("_")
    try:
        for told in islice(check(subject), _FINDINGS_OF_A_CHECK):
            yield f"{name}: {told}"
    except Exception as error:
        yield f"{name}: {type(error).__name__} was raised, expected none: {error}"


@contextmanager
def _generators_kept() -> Iterator[None]:
    """Leave the global generators of Python and NumPy as they are found."""
    states = random.getstate(), np.random.get_state()  # noqa: NPY002 - others use it
    try:
        yield
    finally:
        random.setstate(states[0])
        np.random.set_state(states[1])  # noqa: NPY002
