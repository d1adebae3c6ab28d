"""Checks of any Gymnasium environment, beyond `gymnasium.utils.env_checker.check_env`.

They need nothing but gymnasium and numpy.
"""

from rigid_envs.testing.deep.checking import DeepCheckError, deep_check

__all__ = ["DeepCheckError", "deep_check"]
