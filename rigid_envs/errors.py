"""Errors about what a user asked for. A refusal reads ``name = value; expected what it can be``."""

__all__ = ["ConfigError", "MissingPackageError", "UnknownKeywordError"]


class ConfigError(ValueError):
    """A hyperparameter or setting that is unknown or outside its range."""


class MissingPackageError(ImportError):
    """A package of an extra that is not installed."""


class UnknownKeywordError(ConfigError, TypeError):
    """A keyword that an environment does not take.

    It is a `TypeError` too, as for any Python call: programs that probe what an environment takes
    (Stable-Baselines3 with ``render_mode``, TorchRL with ``frameskip``) go on without the keyword.
    """
