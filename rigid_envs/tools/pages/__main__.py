"""`python -m rigid_envs.tools.pages README.md`: write the tables of environments into a README."""

import sys
from pathlib import Path

from rigid_envs.base.files import write_atomic
from rigid_envs.tools.pages.writing import with_tables

for name in sys.argv[1:]:
    write_atomic(Path(name), with_tables(Path(name).read_text(encoding="utf-8")))
