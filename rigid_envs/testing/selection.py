"""Ids that the contract tests run over, known before the tests are imported."""

from collections.abc import Iterable

from rigid_envs.catalogue import checked_id
from rigid_envs.registry import ENVIRONMENTS

__all__ = ["OWN", "choose", "chosen"]

OWN = tuple(env_id for env_id in ENVIRONMENTS if env_id.startswith("RigidEnvs/"))
"""Ids of this package."""

_chosen: list[str] = list(OWN)


def choose(names: Iterable[str]) -> None:
    """Take these ids instead of those of this package.

    Args:
        names: Ids, or "module:id" where importing the module registers the id.

    Raises:
        UnknownIdError: an id that is not registered, or a module that cannot be imported.
    """
    _chosen[:] = dict.fromkeys(map(checked_id, names))


def chosen() -> tuple[str, ...]:
    """The ids."""
    return tuple(_chosen)
