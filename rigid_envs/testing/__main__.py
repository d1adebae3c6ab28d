"""Run the contract tests: ``python -m rigid_envs.testing [--env-id MODULE:ID]... [pytest's]``."""

import sys
from pathlib import Path

import pytest

# given by its path, the folder has its conftest.py loaded before the options are read
_DEFAULTS = ("--import-mode=importlib", "-m", "not long", str(Path(__file__).parent))

if __name__ == "__main__":
    sys.exit(pytest.main([*_DEFAULTS, *sys.argv[1:]]))
