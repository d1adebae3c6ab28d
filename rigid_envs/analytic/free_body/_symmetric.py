"""The free symmetric top: two cones that roll on each other, and the wobble of the Earth.

With the moment I3 about the axis, I1 across it and the axial rate omega3, omega, L and the axis lie
in one plane at all times. The body cone, which omega runs through about the axis, rolls without
slip on the space cone, which omega runs through about L.

Sources: Landau & Lifshitz, Mechanics, par. 33; Goldstein, Classical Mechanics, sec. 5.6.
"""

import math
from dataclasses import dataclass
from typing import Literal

from numpy.typing import ArrayLike

from rigid_envs.checks import (
    Array,
    all_positive,
    exact_array,
    number,
    positive_array,
    require,
)

__all__ = ["Cones", "chandler_period", "chandler_turns", "symmetric_cones", "symmetric_rates"]


@dataclass(frozen=True)
class Cones:
    """The two cones of a free symmetric top.

    Attributes:
        axis: body axis (0, 1, 2) of symmetry; 2 for a sphere, which has none of its own.
        body_angle: half angle of the body cone, between omega and the axis line [rad].
        space_angle: half angle of the space cone, between omega and L [rad].
        tilt: between the axis line and L, half angle of the cone of the axis in space [rad]:
            body_angle + space_angle if prolate, body_angle - space_angle if oblate.
        body_rate: of omega about the axis in the body, positive by the right hand about the body
            axis [rad/s].
        space_rate: of omega and of the axis about L in space [rad/s].
        space_cone: where it lies: "outside" the body cone (prolate, I3 < I1), "inside" it (oblate,
            I3 > I1), or "none" (sphere: it is a line).
    """

    axis: int
    body_angle: float
    space_angle: float
    tilt: float
    body_rate: float
    space_rate: float
    space_cone: Literal["outside", "inside", "none"]


def symmetric_cones(moments: ArrayLike, omega0: ArrayLike) -> Cones:
    """Find the cones on which the motion of a free symmetric top rolls.

    With the part w of omega across the axis,

        tan body_angle = w / omega3,    tan tilt = I1 w / (I3 omega3),
        tan space_angle = abs(I3 - I1) w omega3 / (I1 w^2 + I3 omega3^2).

    Args:
        moments: principal moments of inertia, shape (3,), two of them equal [kg m^2], any order.
        omega0: angular velocity, shape (3,) [rad/s], principal body axes.

    Raises:
        ValueError: no two moments are equal, or bad numbers as in `polhode`.

    Source: Goldstein, sec. 5.6; Landau & Lifshitz, par. 33.
    """
    inertia, rates, axis = _symmetric(moments, omega0)
    axial, transverse = float(inertia[axis]), float(inertia[axis - 1])
    along, across = abs(float(rates[axis])), math.hypot(rates[axis - 1], rates[axis - 2])
    # Of unit size: squares of slow rates underflow.
    size = math.hypot(along, across) or 1.0
    cos, sin = along / size, across / size
    body_rate, space_rate = symmetric_rates(moments, omega0)
    return Cones(
        axis=axis,
        body_angle=math.atan2(across, along),
        space_angle=math.atan2(
            abs(axial - transverse) * sin * cos, transverse * sin * sin + axial * cos * cos
        ),
        tilt=math.atan2(transverse * across, axial * along),
        body_rate=body_rate,
        space_rate=space_rate,
        space_cone=(
            "outside" if axial < transverse else "inside" if axial > transverse else "none"
        ),
    )


def symmetric_rates(moments: ArrayLike, omega0: ArrayLike) -> tuple[float, float]:
    """Rates of the two cones of a free symmetric top, axis I3 and transverse moment I1.

    Args:
        moments: principal moments of inertia, shape (3,), two of them equal [kg m^2], any order.
        omega0: angular velocity, shape (3,) [rad/s], principal body axes.

    Returns:
        (I3 - I1) / I1 omega3, at which omega turns about the symmetry axis in the body
        (positive by the right hand), and L / I1, at which the symmetry axis turns about L in
        space [rad/s].

    Raises:
        ValueError: no two moments are equal, or bad numbers as in `polhode`.

    Source: Landau & Lifshitz, par. 33; Goldstein, sec. 5.6.
    """
    inertia, rates, axis = _symmetric(moments, omega0)
    axial, transverse = float(inertia[axis]), float(inertia[axis - 1])
    across = math.hypot(rates[axis - 1], rates[axis - 2])
    space_rate = math.hypot(across, axial / transverse * float(rates[axis]))
    return (axial - transverse) / transverse * float(rates[axis]), space_rate


def chandler_period(omega3: float, *, i_perp: float, i3: float) -> float:
    """Period in which the pole of a rigid oblate body runs round its axis, in the body [s].

    2 pi I1 / ((I3 - I1) omega3), Euler's free precession: 304 days for a rigid Earth. (Chandler's
    433 days are the same motion of the elastic one.)

    Args:
        omega3: rate about the axis of symmetry, not 0 [rad/s].
        i_perp: transverse moment I1 [kg m^2].
        i3: axial moment I3, above i_perp [kg m^2].

    Raises:
        ValueError: a body that is not oblate, or one that does not turn.

    Source: Goldstein, sec. 5.6; Landau & Lifshitz, par. 33.
    """
    rate = abs(number(omega3, "omega3"))
    require(rate > 0.0, omega3, "omega3", "a rate other than 0 [rad/s]")
    return 2.0 * math.pi * chandler_turns(i_perp=i_perp, i3=i3) / rate


def chandler_turns(*, i_perp: float, i3: float) -> float:
    """The same period in turns of the body about its axis: I1 / (I3 - I1).

    Args:
        i_perp: transverse moment I1 [kg m^2].
        i3: axial moment I3, above i_perp [kg m^2].

    Raises:
        ValueError: a body that is not oblate.

    Source: Goldstein, sec. 5.6.
    """
    all_positive(i_perp=i_perp, i3=i3)
    require(i3 > i_perp, i3, "i3", f"above i_perp = {i_perp}: use symmetric_rates")
    return i_perp / (i3 - i_perp)


def _symmetric(moments: ArrayLike, omega0: ArrayLike) -> tuple[Array, Array, int]:
    """Moments and rates, checked, and the body axis of symmetry."""
    inertia = positive_array(moments, "moments", "kg m^2", 3)
    rates = exact_array(omega0, "omega0", 3)
    axes = [k for k in (2, 1, 0) if inertia[k - 2] == inertia[k - 1]]
    require(bool(axes), inertia, "moments", "two equal: use polhode instead")
    return inertia, rates, axes[0]
