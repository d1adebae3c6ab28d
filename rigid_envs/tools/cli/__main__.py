"""`python -m rigid_envs.tools.cli`: the command without an installation."""

import sys

from rigid_envs.tools.cli import main

sys.exit(main())
