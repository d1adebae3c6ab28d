"""Closed-form solutions: the oracles that the simulated systems are checked against.

Everything here is evaluated, at most by a quadrature, from NumPy and SciPy alone; no equation of
motion is stepped through time. No formula is shared with the kernels, and nothing else of this
package is imported: an agreement between the two is an agreement of two independent routes.

Modules:
    ball_on_plate: ball with inertia on a turntable, a tilted or a shaken plate.
    brackets: Lie brackets of control fields and growth vectors of rolling bodies.
    elliptic: Jacobi functions and the integrals of motion, exact up to the separatrix.
    free_body: torque-free rotation of any body: attitude, flips, Poinsot's construction, cones.
    heavy_top: symmetric top in gravity: attitude, nutation, precession, the sleeping top.
    roller: descent on an incline, swings in a valley, the cycloid, sliding that ends in rolling.
    rolling_ball: attitude of a ball after straight, polygonal, circular rolls and whole clothoids.
    rolling_disk: steady circles, upright stability, and the nodding of the falling disk.
    upright_coin: paths of a coin held upright, free, driven and on an incline.

Quaternions are (w, x, y, z), unit, body to world, as everywhere in the package.
"""

from rigid_envs.analytic import (
    ball_on_plate,
    brackets,
    elliptic,
    free_body,
    heavy_top,
    roller,
    rolling_ball,
    rolling_disk,
    upright_coin,
)

__all__ = [
    "ball_on_plate",
    "brackets",
    "elliptic",
    "free_body",
    "heavy_top",
    "roller",
    "rolling_ball",
    "rolling_disk",
    "upright_coin",
]
