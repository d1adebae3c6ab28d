"""A ball with inertia that rolls without slip on a plate that turns, leans or is shaken.

The centre keeps the height radius over the plate. The plate's axes X, Y, n are the world's turned
by the tilt about +x, so that downhill is -Y; a turntable turns about n through their origin, and
the axes do not follow it. Vectors are given in world axes, places on the plate in plate axes.

With k = beta / (1 + beta), 2/7 for a solid sphere, and complex numbers z = X + i Y, v = z' for
vectors along the plate, rolling and the contact force leave

    v' = i k Omega v - i g sin(tilt) / (1 + beta),  omega_X + i omega_Y = (Omega z + i v) / radius,

and a constant spin omega_n: on a turntable the ball is an electron in a magnetic field.

Sources: Neimark & Fufaev, Dynamics of Nonholonomic Systems, ch. III; Weltner (1979), Am. J. Phys.
47:984, doi:10.1119/1.11602.
"""

from rigid_envs.analytic.ball_on_plate._ball_attitude import roll_round_axis, stand_in_space
from rigid_envs.analytic.ball_on_plate._motion import Rolled
from rigid_envs.analytic.ball_on_plate._plate import (
    TurntableCircle,
    drift_across_slope,
    roll_on_plate,
    turntable_circle,
)
from rigid_envs.analytic.ball_on_plate._shaken import roll_on_shaken_plate

__all__ = [
    "Rolled",
    "TurntableCircle",
    "drift_across_slope",
    "roll_on_plate",
    "roll_on_shaken_plate",
    "roll_round_axis",
    "stand_in_space",
    "turntable_circle",
]
