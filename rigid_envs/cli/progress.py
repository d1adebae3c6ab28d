"""What a command is at, for somebody who waits."""

import sys

__all__ = ["tell"]


def tell(what: str) -> None:
    """Progress on one line of a terminal, in place of what was told before."""
    if sys.stderr.isatty():
        print(f"\r\x1b[K{what}", end="", file=sys.stderr, flush=True)
