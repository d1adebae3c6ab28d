"""`python -m rigid_envs.pages README.md`: write the tables of environments into a README."""

import sys
from pathlib import Path

from rigid_envs.files import write_atomic
from rigid_envs.pages.writing import with_tables

for name in sys.argv[1:]:
    write_atomic(Path(name), with_tables(Path(name).read_text(encoding="utf-8")))
