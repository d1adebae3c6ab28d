"""CasADi, and what of it stands for our own elementary functions."""

from __future__ import annotations

import importlib
import math
from collections.abc import Mapping
from typing import Any

from rigid_envs.errors import MissingPackageError
from rigid_envs.kernels import elementary, roller

__all__ = ["casadi", "elements"]


def casadi() -> Any:
    """The package CasADi, of the extra "control".

    Raises:
        MissingPackageError: it is not installed; names the command that installs it.
    """
    try:
        return importlib.import_module("casadi")
    except ImportError as error:
        message = 'symbolic models need CasADi: pip install "rigid-envs[control]"'
        raise MissingPackageError(message, name="casadi") from error


def elements() -> Mapping[Any, Any]:
    """The function of CasADi for each elementary function that compiled code uses.

    Raises:
        MissingPackageError: CasADi is not installed.
    """
    ca = casadi()
    return {
        elementary.atan2: ca.atan2,
        elementary.cbrt: lambda x: x ** (1.0 / 3.0),
        elementary.expm1: ca.expm1,
        elementary.log: ca.log,
        elementary.select: ca.if_else,
        elementary.sincos: lambda x: (ca.sin(x), ca.cos(x)),
        elementary.sqrt: ca.sqrt,
        elementary.tanh: ca.tanh,
        roller.ratio: lambda x: ca.if_else(x == 0.0, 1.0, ca.sin(x) / ca.if_else(x == 0.0, 1.0, x)),
        math.sqrt: ca.sqrt,
        min: ca.fmin,
        max: ca.fmax,
    }
