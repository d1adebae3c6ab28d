"""Modules that register environments: the only code that a command imports by its name."""

from __future__ import annotations

import importlib
from collections.abc import Sequence

__all__ = ["import_allowed"]


def import_allowed(modules: Sequence[str]) -> None:
    """Import modules that --allow_import names, which register environments of their own.

    Args:
        modules: Their names.

    Raises:
        ImportError: There is no such module.
    """
    for module in modules:
        importlib.import_module(module)
