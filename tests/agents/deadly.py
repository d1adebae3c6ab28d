"""A module that ends the process that imports it, as a machine without memory would."""

import os
import signal

os.kill(os.getpid(), signal.SIGKILL)
