"""A disk that rolls without slip on its thin rim: steady circles, stability, and the falling disk.

The disk has z-x-z Euler angles phi, theta, psi: theta is the angle of its axis e3 from the
vertical, 0 lying flat and pi / 2 upright. Its angular velocity along the horizontal diameter, the
steepest radius and the axis is

    (theta', phi' sin(theta), omega3),    omega3 = psi' + phi' cos(theta).

Moments about the centre are A = i_perp (about a diameter) and C = i3 (axial); B = C + m radius^2
and J = A + m radius^2 are those about axial and horizontal lines through the contact. With
p = phi' sin(theta) Newton's and Euler's laws leave

    J theta'' = -B p omega3 + A p^2 cot(theta) - m g radius cos(theta),
    dp / dtheta = -p cot(theta) + C / A omega3,    domega3 / dtheta = m radius^2 / B p.

Sources: Routh, Dynamics of a System of Rigid Bodies, Advanced Part, par. 244; Appell (1900), Rend.
Circ. Mat. Palermo 14:1; Korteweg (1900), ibid. 14:7; O'Reilly (1996), The dynamics of rolling
disks and sliding disks, Nonlinear Dynamics 10:287.
"""

from rigid_envs.analytic.rolling_disk._fall import Fall, fall
from rigid_envs.analytic.rolling_disk._integrals import (
    effective_potential,
    legendre_constants,
    spins,
)
from rigid_envs.analytic.rolling_disk._steady_disk import (
    SteadyCircle,
    lean_frequency_squared,
    stationary_centre_precession,
    steady_circle,
    steady_precession,
)
from rigid_envs.analytic.rolling_disk._thresholds import (
    rolling_exponent,
    rolling_threshold,
    spinning_exponent,
    spinning_threshold,
)

__all__ = [
    "Fall",
    "SteadyCircle",
    "effective_potential",
    "fall",
    "lean_frequency_squared",
    "legendre_constants",
    "rolling_exponent",
    "rolling_threshold",
    "spinning_exponent",
    "spinning_threshold",
    "spins",
    "stationary_centre_precession",
    "steady_circle",
    "steady_precession",
]
