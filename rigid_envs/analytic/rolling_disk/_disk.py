"""The mass properties of a disk, checked, and its moments about the contact."""

from dataclasses import dataclass

from rigid_envs.checks import all_positive

__all__ = ["Disk"]


@dataclass(frozen=True)
class Disk:
    """A disk with a thin rim.

    Attributes:
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A, moment about a diameter [kg m^2].
        i3: C, axial moment [kg m^2].

    Raises:
        ValueError: one of them is not positive.
    """

    m: float
    radius: float
    i_perp: float
    i3: float

    def __post_init__(self) -> None:
        """Check the parameters."""
        all_positive(m=self.m, radius=self.radius, i_perp=self.i_perp, i3=self.i3)

    @property
    def steiner(self) -> float:
        """The term m radius^2 of Steiner's theorem [kg m^2]."""
        return self.m * self.radius * self.radius

    @property
    def axial(self) -> float:
        """B = C + m radius^2, about the line through the contact along the axis [kg m^2]."""
        return self.i3 + self.steiner

    @property
    def tipping(self) -> float:
        """J = A + m radius^2, about the tangent of the rim at the contact [kg m^2]."""
        return self.i_perp + self.steiner
