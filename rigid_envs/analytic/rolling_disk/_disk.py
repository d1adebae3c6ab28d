"""The mass properties of a disk, checked, in units of its own."""

from dataclasses import dataclass

import numpy as np

from rigid_envs.checks import Array, all_positive, require

__all__ = ["Disk", "disk_of"]


@dataclass(frozen=True)
class Disk:
    """A disk with a thin rim, its moments as multiples of m radius^2.

    So the motion has the same digits in all units of mass and length, also where m radius^2 or a
    product of moments is beyond the range of double precision.

    Attributes:
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A / (m radius^2), A the moment about a diameter.
        i3: C / (m radius^2), C the axial moment.
    """

    m: float
    radius: float
    i_perp: float
    i3: float

    @property
    def axial(self) -> float:
        """B / (m radius^2), B = C + m radius^2 about the parallel to the axis at the contact."""
        return self.i3 + 1.0

    @property
    def tipping(self) -> float:
        """J / (m radius^2), J = A + m radius^2 about the tangent of the rim at the contact."""
        return self.i_perp + 1.0

    def joules(self, energy: float | Array) -> Array:
        """An energy that is given as a multiple of m radius^2 [1/s^2]."""
        return np.asarray(energy * self.radius * self.m * self.radius)


def disk_of(*, m: float, radius: float, i_perp: float, i3: float) -> Disk:
    """The disk with these mass properties.

    Args:
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A, moment about a diameter [kg m^2].
        i3: C, axial moment [kg m^2].

    Raises:
        ValueError: one of them is not positive, or a moment is far from m radius^2.
    """
    all_positive(m=m, radius=radius, i_perp=i_perp, i3=i3)
    moments = {"i_perp": i_perp, "i3": i3}
    ratios = {name: moment / m / radius / radius for name, moment in moments.items()}
    for name, ratio in ratios.items():
        near = 1e-100 < ratio < 1e100
        require(near, moments[name], name, "1e-100 to 1e100 times m radius^2")
    return Disk(m, radius, **ratios)
