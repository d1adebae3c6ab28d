"""Homogeneous solids of a given mass, their special axis along z."""

from rigid_envs.bodies._arguments import distance, extent, hollow
from rigid_envs.bodies.body import Body, aligned
from rigid_envs.checks import positive, require

__all__ = [
    "box",
    "capsule",
    "cone",
    "ellipsoid",
    "hemisphere",
    "hollow_cylinder",
    "solid_cylinder",
    "solid_sphere",
    "thick_shell",
    "torus",
]


def box(mass: float, lx: float, ly: float, lz: float) -> Body:
    """Return a cuboid: I_x = m (ly^2 + lz^2) / 12, and so on.

    Args:
        mass: m [kg].
        lx: length along x [m].
        ly: length along y [m].
        lz: length along z [m].

    Returns:
        The body, centred on the origin.

    Raises:
        ValueError: if a number is not positive.

    Source:
        Landau & Lifshitz, Mechanics (3rd ed.), section 32, problem 2d.
    """
    m = positive(mass, "mass", "kg") / 12.0
    sides = {"lx": lx, "ly": ly, "lz": lz}
    x, y, z = (extent(side, name, "a rectangular_lamina") for name, side in sides.items())
    return aligned(mass, m * (y**2 + z**2), m * (z**2 + x**2), m * (x**2 + y**2))


def solid_sphere(mass: float, radius: float) -> Body:
    """Return a ball: I = 2/5 m r^2.

    Args:
        mass: m [kg].
        radius: r [m].

    Returns:
        The body, centred on the origin.

    Raises:
        ValueError: if a number is not positive.

    Source:
        Landau & Lifshitz, Mechanics (3rd ed.), section 32, problem 2b.
    """
    return thick_shell(mass, 0.0, distance(radius, "radius"))


def thick_shell(mass: float, inner_radius: float, outer_radius: float) -> Body:
    """Return a ball with a hole in its middle: I = 2/5 m (b^5 - a^5) / (b^3 - a^3).

    The common factor b - a is divided out: equal radii are the thin shell, no inner one the ball.

    Args:
        mass: m [kg].
        inner_radius: a, from 0 to the outer radius [m].
        outer_radius: b [m].

    Returns:
        The body, centred on the origin.

    Raises:
        ValueError: if the mass or the outer radius is not positive, or the inner one not between.

    Source:
        The difference of two balls of one density: Landau & Lifshitz, section 32, problem 2b.
    """
    a, b = hollow(inner_radius, outer_radius)
    ratio = a / b
    quintic = 1.0 + ratio * (1.0 + ratio * (1.0 + ratio * (1.0 + ratio)))
    moment = 0.4 * positive(mass, "mass", "kg") * b**2 * quintic / (1.0 + ratio * (1.0 + ratio))
    return aligned(mass, moment, moment, moment)


def solid_cylinder(mass: float, radius: float, height: float) -> Body:
    """Return a cylinder along z: I_x = I_y = m (r^2 / 4 + h^2 / 12), I_z = m r^2 / 2.

    Args:
        mass: m [kg].
        radius: r [m].
        height: h [m].

    Returns:
        The body, centred on the origin.

    Raises:
        ValueError: if a number is not positive.

    Source:
        Landau & Lifshitz, Mechanics (3rd ed.), section 32, problem 2c.
    """
    return hollow_cylinder(mass, 0.0, extent(radius, "radius", "a rod"), height)


def hollow_cylinder(mass: float, inner_radius: float, outer_radius: float, height: float) -> Body:
    """Return a thick tube along z: I_z = m (a^2 + b^2) / 2, I_x = I_y = I_z / 2 + m h^2 / 12.

    Args:
        mass: m [kg].
        inner_radius: a, from 0 to the outer radius [m].
        outer_radius: b [m].
        height: h [m].

    Returns:
        The body, centred on the origin.

    Raises:
        ValueError: if mass, outer radius or height is not positive, or the inner radius not
            between.

    Source:
        Meriam & Kraige, Engineering Mechanics: Dynamics, table D/4.
    """
    m, (a, b) = positive(mass, "mass", "kg"), hollow(inner_radius, outer_radius)
    axial = m * (a**2 + b**2) / 2.0
    across = axial / 2.0 + m * extent(height, "height", "a disk or annulus") ** 2 / 12.0
    return aligned(mass, across, across, axial)


def cone(mass: float, radius: float, height: float) -> Body:
    """Return a cone: I_x = I_y = 3/20 m (r^2 + h^2 / 4), I_z = 3/10 m r^2.

    Args:
        mass: m [kg].
        radius: radius of the base [m].
        height: h [m].

    Returns:
        The body, apex in the origin, base in the plane z = h: centre of mass at z = 3/4 h.

    Raises:
        ValueError: if a number is not positive.

    Source:
        Landau & Lifshitz, Mechanics (3rd ed.), section 32, problem 2e.
    """
    m, r, h = (
        positive(mass, "mass", "kg"),
        distance(radius, "radius"),
        distance(height, "height"),
    )
    across = 0.15 * m * (r**2 + h**2 / 4.0)
    return aligned(m, across, across, 0.3 * m * r**2, 0.75 * h)


def hemisphere(mass: float, radius: float) -> Body:
    """Return half a ball: I_x = I_y = 83/320 m r^2, I_z = 2/5 m r^2.

    Args:
        mass: m [kg].
        radius: r [m].

    Returns:
        The body, flat side in the plane z = 0, dome above: centre of mass at z = 3/8 r.

    Raises:
        ValueError: if a number is not positive.

    Source:
        Meriam & Kraige, Engineering Mechanics: Dynamics, table D/4.
    """
    r = distance(radius, "radius")
    square = positive(mass, "mass", "kg") * r**2
    return aligned(mass, 83 / 320 * square, 83 / 320 * square, 0.4 * square, 0.375 * r)


def ellipsoid(mass: float, a: float, b: float, c: float) -> Body:
    """Return an ellipsoid: I_x = m (b^2 + c^2) / 5, and so on.

    Args:
        mass: m [kg].
        a: semi-axis along x [m].
        b: semi-axis along y [m].
        c: semi-axis along z [m].

    Returns:
        The body, centred on the origin.

    Raises:
        ValueError: if a number is not positive.

    Source:
        Landau & Lifshitz, Mechanics (3rd ed.), section 32, problem 2f.
    """
    m = positive(mass, "mass", "kg") / 5.0
    x, y, z = distance(a, "a"), distance(b, "b"), distance(c, "c")
    return aligned(mass, m * (y**2 + z**2), m * (z**2 + x**2), m * (x**2 + y**2))


def torus(mass: float, major_radius: float, minor_radius: float) -> Body:
    """Return a ring of round section: I_z = m (R^2 + 3/4 r^2), I_x = I_y = m (R^2 / 2 + 5/8 r^2).

    Args:
        mass: m [kg].
        major_radius: R, from the axis z to the middle of the section [m].
        minor_radius: r, of the section [m].

    Returns:
        The body, centred on the origin.

    Raises:
        ValueError: if a number is not positive, or r > R, where the ring would cut itself.

    Source:
        Meriam & Kraige, Engineering Mechanics: Dynamics, table D/4.
    """
    m = positive(mass, "mass", "kg")
    R, r = distance(major_radius, "major_radius"), extent(minor_radius, "minor_radius", "a hoop")
    require(r <= R, r, "minor_radius", f"at most major_radius = {R} [m]: swap them")
    across = m * (R**2 / 2.0 + 0.625 * r**2)
    return aligned(m, across, across, m * (R**2 + 0.75 * r**2))


def capsule(mass: float, radius: float, length: float) -> Body:
    """Return a cylinder along z, closed by two half balls of its radius and density.

    Of the mass m the cylinder has c = m 3 ell / (3 ell + 4 r), and the two half balls b = m - c:
    I_z = c r^2 / 2 + 2/5 b r^2, I_x = I_y = c (r^2 / 4 + ell^2 / 12) +
    b (2/5 r^2 + 3/8 ell r + ell^2 / 4).

    Args:
        mass: m [kg].
        radius: r [m].
        length: ell, of the cylinder; the whole is 2 r longer [m].

    Returns:
        The body, centred on the origin.

    Raises:
        ValueError: if a number is not positive.

    Source:
        Landau & Lifshitz, Mechanics (3rd ed.), section 32: problem 2c and eq. 32.12.
    """
    m, r, ell = (
        positive(mass, "mass", "kg"),
        distance(radius, "radius"),
        extent(length, "length", "a solid_sphere"),
    )
    c, b = m * 3.0 * ell / (3.0 * ell + 4.0 * r), m * 4.0 * r / (3.0 * ell + 4.0 * r)
    axial = (c / 2.0 + 0.4 * b) * r**2
    across = c * (r**2 / 4.0 + ell**2 / 12.0) + b * (0.4 * r**2 + 0.375 * ell * r + ell**2 / 4.0)
    return aligned(m, across, across, axial)
