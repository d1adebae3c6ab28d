"""Symmetries of a body of revolution on a plane with friction."""

from rigid_envs.base.checks import Array
from rigid_envs.tasks import symmetry

_HORIZONTAL = (("X", "Y"), ("VX", "VY"), ("FX", "FY"))
_ACROSS = (("omega1", "omega2"), ("tau1", "tau2"))
# the mirror y = 0: of polar vectors it reverses y, of axial ones x and z
_REVERSED = ("x", "z", "Y", "VY", "FY", "omega1", "omega3", "tau1", "tau3")


def _reflect(point: symmetry.Point, sign: Array) -> symmetry.Point:
    return symmetry.everywhere(point, lambda row: symmetry.reversed_in(row, _REVERSED, sign))


TURN = symmetry.Symmetry(
    "turn about the vertical", symmetry.turn_of_space(_HORIZONTAL), symmetry.angles
)
PHASE = symmetry.Symmetry(
    "turn of the marks on the body about its axis",
    symmetry.turn_of_body(_ACROSS),
    symmetry.angles,
)
REFLECTION = symmetry.Symmetry(
    "reflection of the world in a vertical plane and of the body in the plane of $e1$ and $e3$",
    _reflect,
    symmetry.signs,
)
