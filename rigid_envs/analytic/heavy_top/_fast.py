"""The fast top: precession and nutation to first order in the weight."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.checks import Array, all_positive, array, require

__all__ = ["FastTop", "fast_top"]


@dataclass(frozen=True)
class FastTop:
    """Motion of a fast top whose axis is let go at rest.

    Attributes:
        precession: mean rate, mgl / (I3 omega3) [rad/s].
        nutation: angular frequency, I3 omega3 / I [rad/s].
        amplitude: of the nutation, half of theta_max - theta_min, I mgl sin theta / (I3 omega3)^2
            [rad].
    """

    precession: Array
    nutation: Array
    amplitude: Array


def fast_top(
    theta: ArrayLike, omega3: ArrayLike, *, i_perp: float, i3: float, mgl: float
) -> FastTop:
    """Approximate the motion of a fast top, (I3 omega3)^2 much above 4 I mgl.

    Relative errors are of the order of I mgl / (I3 omega3)^2.

    Args:
        theta: tilt at which the axis is let go, any shape [rad].
        omega3: axial angular velocity, not 0, broadcast with theta [rad/s].
        i_perp: transverse moment about the pivot [kg m^2].
        i3: axial moment [kg m^2].
        mgl: weight times distance of the centre of mass [N m].

    Returns:
        Rates of the common shape of theta and omega3.

    Raises:
        ValueError: an omega3 of 0, a parameter that is not positive, or a number not finite.

    Source: Goldstein, sec. 5.7, "the fast top".
    """
    all_positive(i_perp=i_perp, i3=i3, mgl=mgl)
    tilt, rates = np.broadcast_arrays(array(theta, "theta"), array(omega3, "omega3"))
    require(rates != 0.0, rates, "omega3", "a spin other than 0 [rad/s]")
    spin, fall = i3 / i_perp * rates, mgl / i_perp  # in units of I
    return FastTop(
        precession=fall / spin,
        nutation=np.abs(spin),
        amplitude=fall * np.sin(tilt) / (spin * spin),
    )
