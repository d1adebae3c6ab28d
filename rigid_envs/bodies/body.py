"""The mass properties of one rigid body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.bodies._arguments import attitude_matrix
from rigid_envs.bodies.principal import (
    NOTHING,
    TOLERANCE,
    InertiaEllipsoid,
    Kind,
    PrincipalAxes,
    check_moments,
    check_symmetric,
    inertia_ellipsoid,
    kind_of,
    principal_axes,
)
from rigid_envs.checks import Array, array, exact_array, positive, require
from rigid_envs.rotations import transform_tensor
from rigid_envs.rotations.vectors import direction

__all__ = ["Body"]

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
        moment: Array = _contract(n, self.inertia, n) + self.mass * np.sum(arm**2, axis=-1)
        return moment

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
        momentum: Array = array(omega_body, "omega_body", 3) @ self.inertia
        return momentum

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
        return principal_axes(self.inertia)

    def kind(self, tolerance: float = TOLERANCE) -> Kind:
        """Classify the body by equal principal moments.

        Args:
            tolerance: difference that counts as none, of the largest moment.

        Returns:
            "spherical" if all are, "symmetric_prolate" for I1 < I2 = I3, "symmetric_oblate" for
            I1 = I2 < I3, else "asymmetric". A line is prolate, a point spherical.
        """
        return kind_of(self.principal().moments, positive(tolerance, "tolerance", "1"))

    def inertia_ellipsoid(self) -> InertiaEllipsoid:
        """Return the ellipsoid x . I x = 1 about the centre of mass.

        Returns:
            Semi-axes 1 / sqrt(moment) (3,) [kg^-1/2 m^-1], longest first, infinite for a moment
            that rounding of the largest cannot tell from 0; and the principal axes, (3, 3).

        Source:
            Goldstein, Poole & Safko, Classical Mechanics (3rd ed.), section 5.4.
        """
        return inertia_ellipsoid(self.principal())


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
