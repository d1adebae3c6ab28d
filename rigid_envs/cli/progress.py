"""Progress of a command on the terminal."""

import logging
import sys
import time

__all__ = ["show_messages", "tell"]


class _Pace:
    """When a line is due where none can be written over: after 10 s, then ever more seldom."""

    _LEAST, _SHARE = 10.0, 0.1  # [s], and of the time since the beginning

    def __init__(self) -> None:
        self.begin()

    def begin(self) -> None:
        self._begin = self._last = time.monotonic()

    def is_due(self) -> bool:
        now = time.monotonic()
        due = now - self._last >= max(self._LEAST, self._SHARE * (now - self._begin))
        self._last = now if due else self._last
        return due


_pace = _Pace()


def show_messages() -> None:
    """Print what the package logs, such as what it compiles, on standard error.

    Every command begins with it.
    """
    _pace.begin()
    logger = logging.getLogger("rigid_envs")
    if not logger.handlers:
        handler = logging.StreamHandler()
        handler.setFormatter(logging.Formatter("rigid-envs: %(message)s"))
        logger.addHandler(handler)
        logger.setLevel(logging.INFO)


def tell(what: str) -> None:
    """Show progress on standard error.

    On a terminal it is one line, in place of the line before. Elsewhere it is a line now and then.

    Args:
        what: a few words; an empty text clears the line.
    """
    if sys.stderr.isatty():
        print(f"\r\x1b[K{what}", end="", file=sys.stderr, flush=True)
    elif what and _pace.is_due():
        print(what, file=sys.stderr, flush=True)
