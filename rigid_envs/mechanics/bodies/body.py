"""A rigid body: mass, centre of mass, inertia tensor, principal axes; points."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.base import checks
from rigid_envs.base.checks import Array, array, exact_array, positive, require
from rigid_envs.mechanics.rotations import direction, matrix_from_quaternion, transform_tensor

# Arguments of several constructors: the radii of a hollow body, an attitude.

_LONGEST = 1e100  # [m]; the fourth power would leave double precision


def extent(value: float, name: str, thin: str) -> float:
    """Positive length of a solid; the refusal names the body that is left where it is 0."""
    try:
        return distance(value, name)
    except ValueError as error:
        raise ValueError(f"{error}, or for 0 {thin}") from None


def distance(value: float, name: str) -> float:
    """Positive length whose square double precision has."""
    checked = checks.positive(value, name, "m")
    checks.require(checked <= _LONGEST, value, name, f"a length of at most {_LONGEST:g} m")
    return checked


def hollow(inner_radius: float, outer_radius: float) -> tuple[float, float]:
    """Radii of a hollow body, 0 <= inner <= outer: from solid to a thin shell."""
    inner = checks.non_negative(inner_radius, "inner_radius", "m")
    outer = distance(outer_radius, "outer_radius")
    expected = f"from 0 to outer_radius = {outer} [m]: check their order and units"
    checks.require(inner <= outer, inner, "inner_radius", expected)
    return inner, outer


def attitude_matrix(attitude: ArrayLike, name: str) -> checks.Array:
    """Rotation matrix of a unit quaternion, or the one nearest to a matrix."""
    rows = checks.array(attitude, name)
    if rows.shape == (4,):
        return matrix_from_quaternion(checks.unit_quaternion(rows, name))
    if rows.shape != (3, 3):
        raise ValueError(
            f"{name} has shape {rows.shape}; expected (4,) or (3, 3): a quaternion (w, x, y, z) or "
            "a rotation matrix"
        )
    R = checks.rotation_matrix(rows, name)
    for _ in range(2):  # Newton's iteration for the polar factor: an error of 1e-6 becomes 1e-24
        R = R @ (1.5 * np.eye(3) - 0.5 * R.T @ R)
    return R


# Principal moments and axes of an inertia tensor: checks, diagonalisation, classification.

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


def _projector(orthonormal: Array) -> Array:
    """Return the projection on the span of these columns: it does not depend on their choice."""
    return np.asarray(orthonormal @ orthonormal.T)


def _nearest_to_a_coordinate_axis(projector: Array) -> Array:
    """Return the projected unit vector that is nearest to an axis of ours, the first if several."""
    lengths = np.linalg.norm(projector, axis=0)
    nearest = projector[:, np.argmax(lengths >= lengths.max() * (1.0 - TOLERANCE))]
    return np.asarray(nearest / np.linalg.norm(nearest))


# The mass properties of one rigid body.

ORIGIN = (0.0, 0.0, 0.0)


@dataclass(frozen=True, init=False, eq=False)
class Body:
    """Mass, centre of mass and inertia tensor, in the axes in which the body was constructed.

    I_ij = sum m (r^2 d_ij - r_i r_j), r from the centre of mass.

    Bodies never change: arrays are read-only for good, and what moves a body returns a new one.
    Two are equal, and have the same hash, if all their numbers are; for bodies equal to rounding
    compare the arrays with np.allclose.

    A tensor is that of some body if its principal moments I1 <= I2 <= I3 are at least 0 and
    I3 <= I1 + I2. All of this is allowed: I3 = I1 + I2 for a flat body, (0, I, I) for a straight
    line, and no inertia at all for a point. Errors of 1e-9 of the largest moment pass, as do those
    of 1e-9 of the largest entry against symmetry, which are averaged away.

    Attributes:
        mass: m [kg].
        inertia: inertia tensor about the centre of mass, construction axes [kg m^2], (3, 3).
        com: centre of mass in construction axes [m], (3,).

    Raises:
        ValueError: mass not positive, inertia not symmetric or not that of any body, or what is
            not finite or of another shape.

    Source:
        Landau & Lifshitz, Mechanics (3rd ed.), section 32.
    """

    mass: float
    inertia: Array
    com: Array

    def __init__(self, mass: float, inertia: ArrayLike, com: ArrayLike = ORIGIN) -> None:
        """Check the three and keep copies."""
        tensor = exact_array(inertia, "inertia", 3, 3)
        check_symmetric(tensor)
        tensor = 0.5 * tensor + 0.5 * tensor.T
        check_moments(tensor)
        object.__setattr__(self, "mass", positive(mass, "mass", "kg"))
        object.__setattr__(self, "inertia", _immutable(tensor))
        object.__setattr__(self, "com", _immutable(exact_array(com, "com", 3)))

    def __eq__(self, other: object) -> bool:
        """Tell whether all numbers are equal."""
        return self._numbers() == other._numbers() if isinstance(other, Body) else NotImplemented

    def __hash__(self) -> int:
        """Hash the numbers."""
        return hash(self._numbers())

    def __reduce__(self) -> tuple[Any, ...]:
        """Copy and unpickle through the constructor: NumPy alone would make arrays writable."""
        return Body, (self.mass, self.inertia, self.com)

    def _numbers(self) -> tuple[float, ...]:
        return (self.mass, *self.inertia.ravel().tolist(), *self.com.tolist())

    def about(self, point: ArrayLike) -> Array:
        """Return the inertia tensor about a point: I + m (c^2 1 - c c^T), c from it to the com.

        The theorem holds from the centre of mass only; that is where `inertia` is kept.

        Args:
            point: in construction axes [m], (..., 3).

        Returns:
            Tensor in construction axes [kg m^2], (..., 3, 3).

        Source:
            Landau & Lifshitz, Mechanics (3rd ed.), eq. 32.12 (Steiner).
        """
        c = self.com - array(point, "point", 3)
        square = np.sum(c**2, axis=-1)[..., None, None]
        shift: Array = square * np.eye(3) - c[..., :, None] * c[..., None, :]
        return self.inertia + self.mass * shift

    def about_axis(self, point: ArrayLike, direction: ArrayLike) -> Array:
        """Return the moment of inertia about an axis, n . I n + m |n x c|^2.

        Args:
            point: any point of the axis in construction axes [m], (..., 3).
            direction: along the axis, of any length but 0, construction axes, (..., 3).

        Returns:
            Moment of inertia [kg m^2], (...).

        Raises:
            ValueError: if a direction is zero.
        """
        n = _unit(direction)
        arm = np.cross(n, self.com - array(point, "point", 3))
        return np.asarray(_contract(n, self.inertia, n) + self.mass * np.sum(arm**2, axis=-1))

    def rotated(self, attitude: ArrayLike) -> Body:
        """Turn the body about the origin of its construction axes: R I R^T, R com.

        Args:
            attitude: rotation matrix R, (3, 3), or unit quaternion (w, x, y, z), (4,); the
                points of the body go from x to R x. A matrix is first made orthonormal.

        Returns:
            The turned body.

        Raises:
            ValueError: if it is no attitude to 1e-6.
        """
        R = attitude_matrix(attitude, "attitude")
        return Body(self.mass, transform_tensor(R, self.inertia), R @ self.com)

    def translated(self, displacement: ArrayLike) -> Body:
        """Move the body: com + d.

        Args:
            displacement: d in construction axes [m], (3,).

        Returns:
            The moved body.
        """
        moved = self.com + exact_array(displacement, "displacement", 3)
        return Body(self.mass, self.inertia, moved)

    def angular_momentum(self, omega_body: ArrayLike) -> Array:
        """Return the angular momentum about the centre of mass, L = I omega.

        Args:
            omega_body: angular velocity in construction axes [rad/s], (..., 3).

        Returns:
            L in construction axes [N m s], (..., 3).
        """
        return np.asarray(array(omega_body, "omega_body", 3) @ self.inertia)

    def kinetic_energy(self, omega_body: ArrayLike) -> Array:
        """Return the energy of the rotation about the centre of mass, omega . I omega / 2.

        Args:
            omega_body: angular velocity in construction axes [rad/s], (..., 3).

        Returns:
            Kinetic energy [J], (...).
        """
        omega = array(omega_body, "omega_body", 3)
        return 0.5 * _contract(omega, self.inertia, omega)

    def angular_acceleration(self, omega_body: ArrayLike, tau_body: ArrayLike = ORIGIN) -> Array:
        """Return omega' of Euler's equation, I omega' + omega x I omega = tau.

        Args:
            omega_body: angular velocity in construction axes [rad/s], (..., 3).
            tau_body: torque about the centre of mass, construction axes [N m], (..., 3).

        Returns:
            Angular acceleration in construction axes [rad/s^2], (..., 3).

        Raises:
            ValueError: for a line or a point, which has no moment about some axis.

        Source:
            Landau & Lifshitz, Mechanics (3rd ed.), section 36.
        """
        moments = self.principal().moments
        expected = (
            "positive principal moments, as a torque has no finite effect about an axis without "
            "one: give the body a width"
        )
        require(bool(moments[0] > NOTHING * moments[2]), moments, "moments", expected)
        omega = array(omega_body, "omega_body", 3)
        net = array(tau_body, "tau_body", 3) - np.cross(omega, self.angular_momentum(omega))
        return np.asarray(np.linalg.solve(self.inertia, net[..., None])[..., 0])

    def principal(self) -> PrincipalAxes:
        """Return the principal moments, ascending, and the principal axes.

        Axes follow from the tensor alone, also where moments are repeated (to 1e-12 of the
        largest) and any direction of a plane or of space would do: e1, then e2, is the direction
        nearest to a construction axis, on its positive side, of those that are principal axes of
        its moment and orthogonal to the ones before; e3 = e1 x e2. So the axes of a diagonal
        tensor with ascending entries are the construction axes.

        Returns:
            Moments (3,) [kg m^2], below 0 in rounding set to 0, and axes, the columns of (3, 3).
        """
        moments, vectors = np.linalg.eigh(self.inertia)
        equal = np.abs(moments[:, None] - moments) <= REPEATED * moments[2]
        e1 = _nearest_to_a_coordinate_axis(_projector(vectors[:, equal[0]]))
        rest = _projector(vectors[:, equal[1]])
        e2 = _nearest_to_a_coordinate_axis(rest - np.outer(e1, e1 @ rest))
        axes = np.stack([e1, e2, np.cross(e1, e2)], axis=-1)
        return PrincipalAxes(np.maximum(moments, 0.0), axes)

    def kind(self, tolerance: float = TOLERANCE) -> Kind:
        """Classify the body by equal principal moments.

        Args:
            tolerance: difference that counts as none, of the largest moment.

        Returns:
            "spherical" if all are, "symmetric_prolate" for I1 < I2 = I3, "symmetric_oblate" for
            I1 = I2 < I3, else "asymmetric". A line is prolate, a point spherical.
        """
        moments = self.principal().moments
        low, high = np.diff(moments) <= positive(tolerance, "tolerance", "1") * moments[2]
        if low and high:
            return "spherical"
        if low or high:
            return "symmetric_oblate" if low else "symmetric_prolate"
        return "asymmetric"

    def inertia_ellipsoid(self) -> InertiaEllipsoid:
        """Return the ellipsoid x . I x = 1 about the centre of mass.

        Returns:
            Semi-axes 1 / sqrt(moment) (3,) [kg^-1/2 m^-1], longest first, infinite for a moment
            that rounding of the largest cannot tell from 0; and the principal axes, (3, 3).

        Source:
            Goldstein, Poole & Safko, Classical Mechanics (3rd ed.), section 5.4.
        """
        moments, axes = self.principal()
        some = np.where(moments > NOTHING * moments[2], moments, np.nan)
        semi_axes = np.where(np.isnan(some), np.inf, 1.0 / np.sqrt(some))
        return InertiaEllipsoid(semi_axes, axes)


def aligned(mass: float, I1: float, I2: float, I3: float, height: float = 0.0) -> Body:
    """Return a body with these moments about the construction axes, its com on the third."""
    return Body(mass, np.diag([I1, I2, I3]), [0.0, 0.0, height])


def _immutable(array: Array) -> Array:
    """Copy to memory that NumPy can never be asked to make writable."""
    return np.frombuffer(array.tobytes()).reshape(array.shape)


def _unit(value: ArrayLike) -> Array:
    """Return directions of any length but 0 with length 1."""
    rows = array(value, "direction", 3)
    expected = "a direction, so not all zero: any length will do"
    require(np.any(rows != 0.0, axis=-1), rows, "direction", expected)
    return direction(rows)


def _contract(u: Array, tensor: Array, v: Array) -> Array:
    """Return u . T v of rows."""
    return np.asarray(np.einsum("...i,ij,...j->...", u, tensor, v))


# Bodies of points and corners, and bodies of bodies.


def point_masses(masses: ArrayLike, positions: ArrayLike) -> Body:
    """Return point masses in rigid connection: M = sum m, M com = sum m x.

    Args:
        masses: positive masses [kg], (n,).
        positions: where they are [m], (n, 3).

    Returns:
        The body, in the axes of the positions.

    Raises:
        ValueError: if there is no point, a mass is not positive, or there are not as many.

    Source:
        Landau & Lifshitz, Mechanics (3rd ed.), section 32.
    """
    x = exact_array(positions, "positions", "n", 3)
    m = exact_array(masses, "masses", len(x))
    require(m > 0.0, m, "masses", "positive masses [kg]: leave out what has none")
    total = float(m.sum())
    com = x[0] + m @ (x - x[0]) / total  # from a point of the body, however far it is away
    return Body(total, inertia_of((x - com).T @ (m[:, None] * (x - com))), com)


def inertia_of(second_moments: Array) -> Array:
    """Return the inertia tensor tr(C) 1 - C of C = sum m r r^T."""
    return np.asarray(np.trace(second_moments) * np.eye(3) - second_moments)


def tetrahedron(mass: float, vertices: ArrayLike) -> Body:
    """Return a homogeneous tetrahedron: sum r r^T = m / 20 (r1 r1^T + ... + r4 r4^T).

    The r are those of the vertices from the centre of mass, which is their mean.

    Args:
        mass: m [kg].
        vertices: its corners in any order [m], (4, 3), one a row.

    Returns:
        The body, in the axes of the vertices.

    Raises:
        ValueError: if the mass is not positive, or the corners are in a plane.

    Source:
        Tonon, J. Math. Stat. 1 (2005) 8; doi:10.3844/jmssp.2005.8.11.
    """
    return simplex(mass, vertices, 4, "four corners that are not in a plane")


def simplex(mass: float, vertices: ArrayLike, n: int, expected: str) -> Body:
    """Return a homogeneous simplex of n corners: sum r r^T = m / (n (n + 1)) sum of r_i r_i^T."""
    x = exact_array(vertices, "vertices", n, 3)
    independent = bool(np.linalg.matrix_rank(x[1:] - x[0]) == n - 1)
    require(independent, x, "vertices", f"{expected}: move one of them")
    com = x.mean(axis=0)
    outer = (x - com).T @ (x - com)
    return Body(mass, inertia_of(positive(mass, "mass", "kg") / (n * (n + 1)) * outer), com)


def compose(parts: Iterable[tuple[Body, ArrayLike, ArrayLike]]) -> Body:
    """Join bodies rigidly: I = sum of the tensors of the parts about the common centre of mass.

    Args:
        parts: (body, attitude, position) of each: the point x of the part comes to
            R x + position. The attitude is R, (3, 3), or a unit quaternion, (4,); the position
            is where the origin of its construction axes comes to [m], (3,).

    Returns:
        The whole body, in the axes of the positions.

    Raises:
        ValueError: if there is no part, or a pose is none.

    Source:
        Landau & Lifshitz, Mechanics (3rd ed.), eq. 32.12.
    """
    placed = [
        body.rotated(attitude_matrix(attitude, f"parts[{i}].attitude")).translated(
            exact_array(position, f"parts[{i}].position", 3)
        )
        for i, (body, attitude, position) in enumerate(parts)
    ]
    require(bool(placed), [], "parts", "one (body, attitude, position) or more")
    com = point_masses([part.mass for part in placed], [part.com for part in placed]).com
    inertia = np.sum([part.about(com) for part in placed], axis=0)
    return Body(sum(part.mass for part in placed), inertia, com)
