"""Homogeneous flat bodies of a given mass in the plane z = 0, and the perpendicular-axis theorem.

A flat body needs no thickness: its moment about the normal is the sum of those about any two
orthogonal axes in its plane.
"""

from numpy.typing import ArrayLike

from rigid_envs.bodies._arguments import distance, hollow
from rigid_envs.bodies.body import Body, aligned
from rigid_envs.bodies.points import simplex
from rigid_envs.checks import positive

__all__ = [
    "annulus",
    "disk",
    "elliptic_lamina",
    "perpendicular_axis",
    "rectangular_lamina",
    "triangular_lamina",
]


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
