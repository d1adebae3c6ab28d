"""Progress of a command on the terminal."""

import logging
import sys

__all__ = ["show_messages", "tell"]


def show_messages() -> None:
    """Print what the package logs, such as what it compiles, on standard error."""
    logger = logging.getLogger("rigid_envs")
    if not logger.handlers:
        handler = logging.StreamHandler()
        handler.setFormatter(logging.Formatter("rigid-envs: %(message)s"))
        logger.addHandler(handler)
        logger.setLevel(logging.INFO)


def tell(what: str) -> None:
    """Show progress on one line of standard error, in place of the line before.

    Args:
        what: a few words; an empty text clears the line.
    """
    if sys.stderr.isatty():
        print(f"\r\x1b[K{what}", end="", file=sys.stderr, flush=True)
