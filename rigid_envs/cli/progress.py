"""Progress of a command on the terminal."""

import sys

__all__ = ["tell"]


def tell(what: str) -> None:
    """Show progress on one line of standard error, in place of the line before.

    Args:
        what: a few words; an empty text clears the line.
    """
    if sys.stderr.isatty():
        print(f"\r\x1b[K{what}", end="", file=sys.stderr, flush=True)
