"""Tasks of thrown bodies."""

from rigid_envs.systems.thrown_body.tasks.racket_catch import RacketCatch

__all__ = ["RacketCatch"]
