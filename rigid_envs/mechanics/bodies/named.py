"""Bodies of everyday things, with published mass properties or from a model of stated sizes."""

import math

import numpy as np

from rigid_envs.base.checks import positive
from rigid_envs.mechanics.bodies.body import Body, aligned, compose, distance
from rigid_envs.mechanics.bodies.solids import box, hoop, rod, solid_cylinder

UPRIGHT = np.eye(3)
ALONG_X = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])  # takes z to x
ALONG_Y = ALONG_X @ ALONG_X  # takes z to y


def t_handle(
    crossbar_radius: float = 0.006,
    crossbar_length: float = 0.1,
    stem_radius: float = 0.006,
    stem_length: float = 0.06,
    density: float = 2700.0,
) -> Body:
    """Return the T-handle that turns over and over when spun about its stem in free fall.

    Two solid cylinders: the crossbar along x, centred on the origin, and the stem along y, from
    y = crossbar_radius on. It turns over if the moment about the stem is the middle one, so the
    stem must not be much longer than the crossbar. The default sizes are ours: an aluminium
    handle that fits a hand.

    Args:
        crossbar_radius: radius of the crossbar [m].
        crossbar_length: length of the crossbar [m].
        stem_radius: radius of the stem [m].
        stem_length: length of the stem [m].
        density: density of both [kg/m^3].

    Returns:
        The body; its principal axes are along x, y and z.

    Raises:
        ValueError: if a number is not positive.
    """
    r1, h1 = (
        distance(crossbar_radius, "crossbar_radius"),
        distance(crossbar_length, "crossbar_length"),
    )
    r2, h2 = distance(stem_radius, "stem_radius"), distance(stem_length, "stem_length")
    rho = positive(density, "density", "kg/m^3")
    crossbar = solid_cylinder(rho * math.pi * r1**2 * h1, r1, h1)
    stem = solid_cylinder(rho * math.pi * r2**2 * h2, r2, h2)
    middle_of_stem = [0.0, r1 + h2 / 2.0, 0.0]
    return compose([(crossbar, ALONG_X, [0.0, 0.0, 0.0]), (stem, ALONG_Y, middle_of_stem)])


def tennis_racket() -> Body:
    """Return a tennis racket as a uniform rod with a hoop: 320 g, 68.5 cm, balanced at 33 cm.

    Handle and throat are a rod of 39.5 cm and 196 g along y from the butt, which is the origin;
    the head is a hoop of radius 14.5 cm and 124 g in the plane z = 0 beyond it. These sizes are
    ours; the model has a swing-weight (moment about an axis along x at y = 10 cm) of
    0.030 kg m^2 and a twist-weight (moment about y) of 0.0013 kg m^2.

    Returns:
        The body; least moment about y, middle one about x, largest about z.

    Source:
        What is measured on rackets: Spurr et al., Procedia Engineering 72 (2014) 569;
        doi:10.1016/j.proeng.2014.06.098.
    """
    length, radius = 0.395, 0.145
    handle = rod(0.196, length)
    head = hoop(0.124, radius)
    in_the_middle, beyond = [0.0, length / 2.0, 0.0], [0.0, length + radius, 0.0]
    return compose([(handle, ALONG_Y, in_the_middle), (head, UPRIGHT, beyond)])


def book() -> Body:
    """Return a hardback, kept shut: a uniform box of 16 x 24 x 3 cm and 0.9 kg; sizes are ours.

    Returns:
        The body, width along x, height along y, thickness along z: the middle moment is about x.
    """
    return box(0.9, 0.16, 0.24, 0.03)


def american_football() -> Body:
    """Return an American football: a thin uniform spheroid, 411 g, 28.3 cm long, 53.7 cm round.

    The skin is a stack of hoops at the nodes of a Gauss quadrature over its area. Sizes are in
    the middle of what the rules allow; seams, laces and bladder are left out.

    Returns:
        The body, centred on the origin, long axis along z; prolate.

    Source:
        Official Playing Rules of the NFL, rule 2: long axis 11 to 11.25 inches, short
        circumference 21 to 21.25 inches, 14 to 15 ounces.
    """
    mass, half_length, radius = 0.411, 0.1413, 0.5366 / (2.0 * math.pi)
    nodes, weights = np.polynomial.legendre.leggauss(24)  # exact to rounding for this shape
    t = 0.5 * math.pi * nodes
    height, width = half_length * np.sin(t), radius * np.cos(t)
    area = weights * width * np.hypot(half_length * np.cos(t), radius * np.sin(t))
    masses = mass * area / area.sum()
    stack = zip(masses.tolist(), width.tolist(), height.tolist(), strict=True)
    return compose([(hoop(m, r), UPRIGHT, [0.0, 0.0, z]) for m, r, z in stack])


def frisbee() -> Body:
    """Return a flying disk for Ultimate, 175 g, with measured moments.

    Returns:
        The body, centre of mass in the origin, axis z; oblate, and by its rim not flat.

    Source:
        Hummel, Frisbee Flight Simulation and Throw Biomechanics, thesis, University of California
        Davis (2003): 0.001219 and 0.002352 kg m^2.
    """
    return aligned(0.175, 0.001219, 0.001219, 0.002352)


def coin() -> Body:
    """Return a coin of 1 euro: a uniform cylinder, 23.25 mm wide, 2.33 mm thick, 7.5 g.

    Its two alloys, of nearly one density, and its relief are left out.

    Returns:
        The body, centred on the origin, axis z.

    Source:
        Council Regulation (EU) No 729/2014, annex I.
    """
    return solid_cylinder(0.0075, 0.02325 / 2.0, 0.00233)


def earth() -> Body:
    """Return the Earth, axisymmetric: C - A = J2 M a^2, and C = (C - A) / H.

    J2 is measured by the orbits of satellites and H by the precession of the equinoxes. A is the
    mean of the equatorial moments, which differ by 7e-6 M a^2.

    Returns:
        The body, centre of mass in the origin, axis z; oblate, A / (C - A) = 304.5.

    Source:
        IERS Conventions (2010), Technical Note 36, table 1.1: GM, G, J2, a and the dynamical
        flattening H = (C - A) / C.
    """
    mass = 3.986004418e14 / 6.67428e-11
    H = 3273795e-9
    C = 1.0826359e-3 * mass * 6378136.6**2 / H
    return aligned(mass, C * (1.0 - H), C * (1.0 - H), C)
