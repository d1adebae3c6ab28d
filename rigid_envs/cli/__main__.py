"""`python -m rigid_envs.cli`: the command without an installation."""

import sys

from rigid_envs.cli import main

sys.exit(main())
