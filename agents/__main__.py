"""`python -m agents`; Ctrl-C ends it without a message, also while it imports."""

import signal
import sys

if __name__ == "__main__":
    try:
        from rigid_envs.tools.cli.words import messages

        from .cli.command_line import main

        with messages():
            status = main()
    except KeyboardInterrupt:
        status = 128 + signal.SIGINT
    sys.exit(status)
