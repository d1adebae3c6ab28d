"""Reduced coordinates of a roller in a valley: energy and phase of the swing."""

import math
from typing import Any

from rigid_envs.kernels.algebra import Row
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import log, sincos
from rigid_envs.symmetries.rollers import REFLECTION
from rigid_envs.tasks.entries import Entry
from rigid_envs.tasks.reduction import Reduction

__all__ = ["SWING"]

_MOST = 4.0  # bound of amplitudes and energies in those of rest on the rim
_LOG = 10.0  # bound of their logarithm


@scalar
def observe(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Energy and phase, which are even in (s, v).

    A change of the ratio keeps the momentum, so that the present ratio does not matter: the energy
    is that after a change to the least ratio, ``x^2 + w^2``, in that of rest on the rim. The
    action that pumps depends on the sign of x w, the sine of twice the phase.
    """
    low = 1.0 + p.beta
    top = sincos(0.5 * c.rim)[0]
    x = sincos(0.5 * p.curvature * y.s)[0] / top
    momentum = (low + aux.beta_change) * y.v
    w = momentum * math.sqrt(p.curvature / (p.g * low)) * (0.5 / top)
    energy = x * x + w * w
    inverse = 1.0 / max(energy, 1e-12)
    sine = 2.0 * x * w * inverse
    return (
        (x * x - w * w) * inverse,
        sine,
        min(max(4.0 * sine, -1.0), 1.0),
        min(energy, _MOST),
        min(max(-log(max(energy, 1e-12)), -_LOG), _LOG),
    )


SWING = Reduction(
    group="Z2",
    frame="none is needed: the observation is even, and so is the action.",
    symmetries=(REFLECTION,),
    features=(
        Entry("cos 2 phase", "1", "phase 0: turning point", -1.0, 1.0),
        Entry("sin 2 phase", "1", "> 0: ascending", -1.0, 1.0),
        Entry("4 sin 2 phase", "1", "limited", -1.0, 1.0),
        Entry("E / E_rim", "1", "energy at the least ratio", 0.0, _MOST),
        Entry("log(E_rim / E)", "1", "energy at the least ratio", -_LOG, _LOG),
    ),
    observe=observe,
    formulas="""
        With the angle x = curvature s, the momentum P = (1 + beta + addition) v and the least ratio
        beta of the episode: ``a = sin(x / 2) / sin(rim / 2)`` and ``b = P sqrt(curvature / (g (1 +
        beta))) / (2 sin(rim / 2))``; ``E / E_rim = a^2 + b^2``, at least 1e-12 where it divides,
        ``cos 2 phase = (a^2 - b^2) / (a^2 + b^2)`` and ``sin 2 phase = 2 a b / (a^2 + b^2)``, each
        limited to its bounds.
    """,
)
"""Reduction of `RollPump`: the reflection; the action has no direction."""
