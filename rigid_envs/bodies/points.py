"""Bodies of points and corners, and bodies of bodies."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.bodies._arguments import attitude_matrix
from rigid_envs.bodies.body import Body
from rigid_envs.checks import Array, exact_array, positive, require

__all__ = ["compose", "point_masses", "tetrahedron"]


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
    tensor: Array = np.trace(second_moments) * np.eye(3) - second_moments
    return tensor


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
