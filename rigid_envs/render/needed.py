"""Packages of the extra "render", imported where they are needed."""

import importlib
from typing import Any

from gymnasium.error import DependencyNotInstalled

__all__ = ["needed"]


def needed(module: str, why: str) -> Any:
    """A module of the extra "render".

    Args:
        module: its name.
        why: the begin of the message, as "pictures need Pillow".

    Raises:
        DependencyNotInstalled: it is missing; names the command that installs it.
    """
    try:
        importlib.import_module(module.partition(".")[0])
        return importlib.import_module(module)
    except ImportError as error:
        raise DependencyNotInstalled(f'{why}: pip install "rigid-envs[render]"') from error
