"""The versions of numba that the kernels are tested with, and what is said of any other.

The kernels use parts of numba that are not public: the way they are compiled and kept on disk. Any
minor version may change these parts.
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
        importlib.import_module("rigid_envs.kernels.compiler")
    except Exception as error:  # of attributes, imports, arguments
        raise ImportError(f"{said}: {mend} ({error})", name="numba") from error
    _log.warning("%s, with which this package was tested: if anything fails, %s", said, mend)
