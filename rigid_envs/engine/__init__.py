"""The compiled machine: all functions that run per row, and the loops that call them.

Every function here is written on scalars and tuples of scalars with ``+ - * / sqrt`` and fused
multiply-add only. No call to the C mathematics library and no ``fastmath``: the same input gives
the same bits on any x86-64 processor, at any number of rows and threads. Rows are `NamedTuple`s
and are read by name.

Parts of numba that are not public are used here: the way functions are compiled and kept on disk.
Any minor version may change these parts, so the versions that were tested are named below.
"""

import importlib
import logging

import numba

__all__ = ["NEXT", "OLDEST", "check"]

OLDEST = (0, 61)
NEXT = (0, 69)
"""The minor version after the newest that CI has run; `pyproject.toml` has the same range."""

_log = logging.getLogger(__name__)


def check() -> None:
    """Import what uses such parts, and name the range where the version is not in it.

    Raises:
        ImportError: A part that is needed is missing or changed; says what to install. Where all
            are there, one warning does.
    """
    version = tuple(part or 0 for part in numba.version_info.short)  # None of a build of its own
    if OLDEST <= version < NEXT:
        return
    wanted = "numba>={}.{},<{}.{}".format(*OLDEST, *NEXT)
    said = f"numba = {numba.__version__}; expected {wanted}"
    mend = f'pip install "{wanted}"'
    try:
        importlib.import_module("rigid_envs.engine.compiler")
    except Exception as error:  # of attributes, imports, arguments
        raise ImportError(f"{said}: {mend} ({error})", name="numba") from error
    _log.warning("%s, with which this package was tested: if anything fails, %s", said, mend)


check()
