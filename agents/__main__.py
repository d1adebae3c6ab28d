"""`python -m agents`; Ctrl-C ends it without a message, also while it imports."""

import signal
import sys

if __name__ == "__main__":
    try:
        from .cli.command_line import main

        status = main()
    except KeyboardInterrupt:
        status = 128 + signal.SIGINT
    sys.exit(status)
