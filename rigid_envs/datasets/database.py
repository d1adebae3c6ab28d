"""Minari, and the folder where its data sets lie."""

from __future__ import annotations

import contextlib
import importlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from gymnasium.error import DependencyNotInstalled

from rigid_envs.errors import ConfigError

__all__ = ["check_name", "database", "minari_of"]

_PLACE = "MINARI_DATASETS_PATH"


def minari_of() -> Any:
    """The module `minari`, with what it stores files by.

    Raises:
        DependencyNotInstalled: it is missing; names the command that installs it.
    """
    try:
        import h5py  # noqa: F401
        import minari
        import PIL  # noqa: F401
    except ImportError as error:
        raise DependencyNotInstalled(
            f'data sets need Minari: pip install "rigid-envs[dataset]" ({error})'
        ) from error
    return minari


@contextlib.contextmanager
def database(folder: Path | None) -> Iterator[Path]:
    """The folder of all data sets, which Minari reads from the environment of the process.

    Args:
        folder: Takes its place meanwhile; None leaves it: MINARI_DATASETS_PATH, or
            ~/.minari/datasets.
    """
    before = os.environ.get(_PLACE)
    if folder is not None:
        os.environ[_PLACE] = str(folder)
    try:
        yield Path(os.environ.get(_PLACE) or Path.home() / ".minari" / "datasets")
    finally:
        os.environ.pop(_PLACE, None)
        if before is not None:
            os.environ[_PLACE] = before


def check_name(name: str) -> None:
    """Refuse the name of a data set that Minari does not take.

    Raises:
        ConfigError: It is none.
    """
    parse = importlib.import_module("minari.dataset.minari_dataset").parse_dataset_id
    try:
        parse(name)
    except (TypeError, ValueError):
        raise ConfigError(
            f"name = {name!r}; expected NAMESPACE/NAME-vN of letters, digits, - and _"
        ) from None
