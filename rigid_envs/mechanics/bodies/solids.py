"""Bodies of simple shapes: solids, laminae, thin bodies."""

from numpy.typing import ArrayLike

from rigid_envs.base.checks import positive, require
from rigid_envs.mechanics.bodies.body import Body, aligned, distance, extent, hollow, simplex

# Homogeneous solids of a given mass, their special axis along z.


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
    m, r, h = positive(mass, "mass", "kg"), distance(radius, "radius"), distance(height, "height")
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
    m, r = positive(mass, "mass", "kg"), distance(radius, "radius")
    ell = extent(length, "length", "a solid_sphere")
    c, b = m * 3.0 * ell / (3.0 * ell + 4.0 * r), m * 4.0 * r / (3.0 * ell + 4.0 * r)
    axial = (c / 2.0 + 0.4 * b) * r**2
    across = c * (r**2 / 4.0 + ell**2 / 12.0) + b * (0.4 * r**2 + 0.375 * ell * r + ell**2 / 4.0)
    return aligned(m, across, across, axial)


# Homogeneous flat bodies of a given mass in the plane z = 0, and the perpendicular-axis theorem.
#
# A flat body needs no thickness: its moment about the normal is the sum of those about any two
# orthogonal axes in its plane.


def disk(mass: float, radius: float) -> Body:
    """Return a thin round disk: I_z = m r^2 / 2, I_x = I_y = I_z / 2.

    Args:
        mass: m [kg].
        radius: r [m].

    Returns:
        The body, centred on the origin.

    Raises:
        ValueError: if a number is not positive.

    Source:
        Landau & Lifshitz, Mechanics (3rd ed.), section 32, problem 2c, height 0.
    """
    return annulus(mass, 0.0, distance(radius, "radius"))


def annulus(mass: float, inner_radius: float, outer_radius: float) -> Body:
    """Return a thin disk with a round hole: I_z = m (a^2 + b^2) / 2, I_x = I_y = I_z / 2.

    Args:
        mass: m [kg].
        inner_radius: a, from 0 to the outer radius [m].
        outer_radius: b [m].

    Returns:
        The body, centred on the origin.

    Raises:
        ValueError: if the mass or the outer radius is not positive, or the inner one not between.

    Source:
        The difference of two disks of one density.
    """
    a, b = hollow(inner_radius, outer_radius)
    axial = positive(mass, "mass", "kg") * (a**2 + b**2) / 2.0
    return aligned(mass, axial / 2.0, axial / 2.0, axial)


def rectangular_lamina(mass: float, lx: float, ly: float) -> Body:
    """Return a thin rectangle: I_x = m ly^2 / 12, I_y = m lx^2 / 12, I_z = I_x + I_y.

    Args:
        mass: m [kg].
        lx: length along x [m].
        ly: length along y [m].

    Returns:
        The body, centred on the origin.

    Raises:
        ValueError: if a number is not positive.

    Source:
        Landau & Lifshitz, Mechanics (3rd ed.), section 32, problem 2d, one side 0.
    """
    m = positive(mass, "mass", "kg") / 12.0
    x, y = m * distance(ly, "ly") ** 2, m * distance(lx, "lx") ** 2
    return aligned(mass, x, y, x + y)


def elliptic_lamina(mass: float, a: float, b: float) -> Body:
    """Return a thin ellipse: I_x = m b^2 / 4, I_y = m a^2 / 4, I_z = I_x + I_y.

    Args:
        mass: m [kg].
        a: semi-axis along x [m].
        b: semi-axis along y [m].

    Returns:
        The body, centred on the origin.

    Raises:
        ValueError: if a number is not positive.

    Source:
        A round disk, stretched along its axes.
    """
    m = positive(mass, "mass", "kg") / 4.0
    x, y = m * distance(b, "b") ** 2, m * distance(a, "a") ** 2
    return aligned(mass, x, y, x + y)


def triangular_lamina(mass: float, vertices: ArrayLike) -> Body:
    """Return a thin triangle, anywhere in space: sum r r^T = m / 12 (r1 r1^T + r2 r2^T + r3 r3^T).

    The r are those of the vertices from the centre of mass, which is their mean.

    Args:
        mass: m [kg].
        vertices: its corners [m], (3, 3), one a row.

    Returns:
        The body, in the axes of the vertices.

    Raises:
        ValueError: if the mass is not positive, or the corners are in line.

    Source:
        Routh, Dynamics of a System of Rigid Bodies, elementary part, on equimomental bodies.
    """
    return simplex(mass, vertices, 3, "three corners that are not in line")


def perpendicular_axis(body: Body) -> float:
    """Return the residual of the perpendicular-axis theorem: I3 - (I1 + I2) = -2 sum m z^2.

    I1 <= I2 <= I3 are the principal moments and z is the distance from the plane through the
    centre of mass across the third axis, so that it is 0 for what is flat (a lamina in any
    attitude, a hoop, a line) and else negative: minus twice the moment that the thickness adds.

    Args:
        body: any body.

    Returns:
        The residual [kg m^2]; for flat bodies 0 to rounding of I3.

    Source:
        Landau & Lifshitz, Mechanics (3rd ed.), eq. 32.9.
    """
    I1, I2, I3 = body.principal().moments.tolist()
    return float(I3 - (I1 + I2))


# Homogeneous thin bodies of a given mass: rod, hoop and shells.


def rod(mass: float, length: float) -> Body:
    """Return a thin straight rod along z: I_x = I_y = m ell^2 / 12, I_z = 0.

    Args:
        mass: m [kg].
        length: ell [m].

    Returns:
        The body, centred on the origin.

    Raises:
        ValueError: if a number is not positive.

    Source:
        Landau & Lifshitz, Mechanics (3rd ed.), section 32, problem 2a.
    """
    across = positive(mass, "mass", "kg") * distance(length, "length") ** 2 / 12.0
    return aligned(mass, across, across, 0.0)


def hoop(mass: float, radius: float) -> Body:
    """Return a thin ring around z: I_z = m r^2, I_x = I_y = I_z / 2.

    Args:
        mass: m [kg].
        radius: r [m].

    Returns:
        The body, centred on the origin.

    Raises:
        ValueError: if a number is not positive.

    Source:
        All mass is at the distance r, and the perpendicular-axis theorem.
    """
    axial = positive(mass, "mass", "kg") * distance(radius, "radius") ** 2
    return aligned(mass, axial / 2.0, axial / 2.0, axial)


def hollow_sphere(mass: float, radius: float) -> Body:
    """Return a thin sphere: I = 2/3 m r^2.

    Args:
        mass: m [kg].
        radius: r [m].

    Returns:
        The body, centred on the origin.

    Raises:
        ValueError: if a number is not positive.

    Source:
        Meriam & Kraige, Engineering Mechanics: Dynamics, table D/4.
    """
    r = distance(radius, "radius")
    return thick_shell(mass, r, r)


def cylindrical_shell(mass: float, radius: float, height: float) -> Body:
    """Return a thin open tube along z: I_z = m r^2, I_x = I_y = m (r^2 / 2 + h^2 / 12).

    Args:
        mass: m [kg].
        radius: r [m].
        height: h [m].

    Returns:
        The body, centred on the origin.

    Raises:
        ValueError: if a number is not positive.

    Source:
        Meriam & Kraige, Engineering Mechanics: Dynamics, table D/4.
    """
    r = distance(radius, "radius")
    return hollow_cylinder(mass, r, r, height)


def conical_shell(mass: float, radius: float, height: float) -> Body:
    """Return the thin side of a cone, no base: I_z = m r^2 / 2, I_x = I_y = m (r^2 / 4 + h^2 / 18).

    Args:
        mass: m [kg].
        radius: radius at the open end [m].
        height: h [m].

    Returns:
        The body, apex in the origin, open at z = h: centre of mass at z = 2/3 h.

    Raises:
        ValueError: if a number is not positive.

    Source:
        Meriam & Kraige, Engineering Mechanics: Dynamics, table D/4.
    """
    m, r, h = positive(mass, "mass", "kg"), distance(radius, "radius"), distance(height, "height")
    across = m * (r**2 / 4.0 + h**2 / 18.0)
    return aligned(m, across, across, m * r**2 / 2.0, 2.0 * h / 3.0)
