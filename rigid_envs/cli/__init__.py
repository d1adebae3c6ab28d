"""The command `rigid-envs`."""

from rigid_envs.cli.main import main

__all__ = ["main"]
