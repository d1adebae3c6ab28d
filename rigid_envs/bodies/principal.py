"""Principal moments and axes of an inertia tensor: checks, diagonalisation, classification."""

from typing import Literal, NamedTuple

import numpy as np

from rigid_envs.checks import Array, require

__all__ = ["InertiaEllipsoid", "Kind", "PrincipalAxes"]

Kind = Literal["spherical", "symmetric_prolate", "symmetric_oblate", "asymmetric"]

TOLERANCE = 1e-9  # admits moments written with ten digits, as the system FreeBody does
REPEATED = 1e-12  # of the largest: what thousands of roundings leave of two equal moments
NOTHING = 16 * np.finfo(np.float64).eps  # of the largest: the rounding of one tensor


class PrincipalAxes(NamedTuple):
    """Principal moments, and the frame in which the tensor is diagonal.

    Attributes:
        moments: I1 <= I2 <= I3 [kg m^2], (3,).
        axes: proper rotation matrix whose columns are the axes, in construction axes, (3, 3):
            inertia = axes diag(moments) axes^T, v_construction = axes v_principal.
    """

    moments: Array
    axes: Array


class InertiaEllipsoid(NamedTuple):
    """The surface x . I x = 1; the moment about a unit axis n is 1 / |x|^2 where n pierces it.

    Attributes:
        semi_axes: 1 / sqrt(moment) [kg^-1/2 m^-1], longest first, infinite for no moment, (3,).
        axes: their directions, the principal axes, as columns in construction axes, (3, 3).
    """

    semi_axes: Array
    axes: Array


def check_symmetric(inertia: Array) -> None:
    """Refuse a tensor whose transpose differs by more than TOLERANCE of its largest entry."""
    difference = np.abs(inertia - inertia.T)
    if np.max(difference) > TOLERANCE * np.max(np.abs(inertia)):
        i, j = np.unravel_index(np.argmax(difference), difference.shape)
        expected = (
            f"inertia[{j}, {i}] = {inertia[j, i]}, as the tensor is symmetric: if it is so but for "
            "errors, take (I + I.T) / 2"
        )
        require(False, inertia[i, j], f"inertia[{i}, {j}]", expected)


def check_moments(inertia: Array) -> None:
    """Refuse a symmetric tensor that no distribution of mass has.

    Source: Landau & Lifshitz, Mechanics (3rd ed.), section 32.
    """
    I1, I2, I3 = np.linalg.eigvalsh(inertia).tolist()
    allowed = TOLERANCE * max(I3, -I1)
    expected = (
        f"principal moments of at least 0, and I1 = {I1:.9g} kg m^2: check that the products of "
        "inertia are -sum m x y, and that the tensor was not shifted past the centre of mass"
    )
    require(I1 >= -allowed, inertia, "inertia", expected)
    excess = I3 - (I1 + I2)
    expected = (
        f"I3 <= I1 + I2 of the principal moments, as any distribution of mass has, and I3 = "
        f"{I3:.9g} is above {I1:.9g} + {I2:.9g} by {excess:.3g} kg m^2: lower I3 or raise the "
        "others by that much"
    )
    require(excess <= allowed, inertia, "inertia", expected)


def principal_axes(inertia: Array) -> PrincipalAxes:
    """Diagonalise a physical tensor, the axes by the rule that `Body.principal` states."""
    moments, vectors = np.linalg.eigh(inertia)
    equal = np.abs(moments[:, None] - moments) <= REPEATED * moments[2]
    e1 = _nearest_to_a_coordinate_axis(_projector(vectors[:, equal[0]]))
    rest = _projector(vectors[:, equal[1]])
    e2 = _nearest_to_a_coordinate_axis(rest - np.outer(e1, e1 @ rest))
    axes = np.stack([e1, e2, np.cross(e1, e2)], axis=-1)
    return PrincipalAxes(np.maximum(moments, 0.0), axes)


def _projector(orthonormal: Array) -> Array:
    """Return the projection on the span of these columns: it does not depend on their choice."""
    onto: Array = orthonormal @ orthonormal.T
    return onto


def _nearest_to_a_coordinate_axis(projector: Array) -> Array:
    """Return the projected unit vector that is nearest to an axis of ours, the first if several."""
    lengths = np.linalg.norm(projector, axis=0)
    nearest = projector[:, np.argmax(lengths >= lengths.max() * (1.0 - TOLERANCE))]
    unit: Array = nearest / np.linalg.norm(nearest)
    return unit


def inertia_ellipsoid(principal: PrincipalAxes) -> InertiaEllipsoid:
    """Return the ellipsoid of these moments; NOTHING of the largest one counts as none."""
    moments = principal.moments
    some = np.where(moments > NOTHING * moments[2], moments, np.nan)
    semi_axes = np.where(np.isnan(some), np.inf, 1.0 / np.sqrt(some))
    return InertiaEllipsoid(semi_axes, principal.axes)


def kind_of(moments: Array, tolerance: float) -> Kind:
    """Classify a body by which of its ascending moments are equal."""
    low, high = np.diff(moments) <= tolerance * moments[2]
    if low and high:
        return "spherical"
    if low or high:
        return "symmetric_oblate" if low else "symmetric_prolate"
    return "asymmetric"
