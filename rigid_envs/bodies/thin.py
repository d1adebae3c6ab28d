"""Homogeneous thin bodies of a given mass: rod, hoop and shells."""

from rigid_envs.bodies._arguments import distance
from rigid_envs.bodies.body import Body, aligned
from rigid_envs.bodies.solids import hollow_cylinder, thick_shell
from rigid_envs.checks import positive

__all__ = ["conical_shell", "cylindrical_shell", "hollow_sphere", "hoop", "rod"]


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
    m, r, h = (
        positive(mass, "mass", "kg"),
        distance(radius, "radius"),
        distance(height, "height"),
    )
    across = m * (r**2 / 4.0 + h**2 / 18.0)
    return aligned(m, across, across, m * r**2 / 2.0, 2.0 * h / 3.0)
