"""Contract tests: what every environment of this library does, whoever wrote its task.

They run over the ids of this package, or over those that are given, each with the module that
registers it::

    python -m rigid_envs.testing --env-id my_package:MyPackage/Task-v0

An id that is given is run with each of its kernels: plain, with noise and delay, and reduced. Other
arguments are those of pytest (``-x``, ``-k``, ``-n 2``). They need the packages of the extra
``test``; importing `rigid_envs` imports none of them.

`deep_check` and `fingerprint` are for any Gymnasium environment, and need no extra.
"""

from rigid_envs.testing.deep import DeepCheckError, deep_check
from rigid_envs.testing.fingerprints import fingerprint

__all__ = ["DeepCheckError", "deep_check", "fingerprint"]
