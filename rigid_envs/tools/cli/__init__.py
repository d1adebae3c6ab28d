"""The command `rigid-envs`."""

import signal
from collections.abc import Sequence

__all__ = ["main"]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; Ctrl-C ends it without a message.

    Args:
        argv: arguments; None takes those of the process.

    Returns:
        Exit status: see `rigid_envs.tools.cli.command_line.run`; 130 after Ctrl-C.
    """
    try:
        from rigid_envs.tools.cli.command_line import run  # imports for a second

        return run(argv)
    except KeyboardInterrupt:
        return 128 + signal.SIGINT
