"""Mass properties of homogeneous polyhedra: exact integrals over a closed triangle mesh."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigid_envs.bodies.body import Body
from rigid_envs.bodies.points import inertia_of
from rigid_envs.checks import Array, exact_array, positive, require

__all__ = ["from_mesh"]

Faces = NDArray[np.intp]


def from_mesh(vertices: ArrayLike, faces: ArrayLike, density: float) -> Body:
    """Return the homogeneous body inside a closed triangle mesh.

    It is the signed sum of the tetrahedra between a point and the faces; each has the volume
    V = a . (b x c) / 6 and int r r^T dV = V / 20 (a a^T + b b^T + c c^T + s s^T), s = a + b + c.
    A cavity is a surface inside the other that looks inwards.

    What several surfaces enclose is counted for each of them: parts that overlap count twice where
    they do, which is not detected. Unite them first, or `compose` bodies that do not overlap.

    Args:
        vertices: corners [m], (n, 3); those that no face has do not count.
        faces: rows of three indices of vertices, counter-clockwise seen from outside, (k, 3).
        density: of the solid [kg/m^3].

    Returns:
        The body, in the axes of the vertices.

    Raises:
        ValueError: if the mesh is not closed (an edge has no second face), not consistently
            oriented (two faces run along an edge in the same direction), inside out, or without
            volume; the message names the edge and its faces.

    Source:
        Mirtich, J. Graphics Tools 1(2) (1996) 31, for the integrals; Tonon, J. Math. Stat. 1
        (2005) 8, for a tetrahedron.
    """
    x = exact_array(vertices, "vertices", "n", 3)
    triangles = _triangles(faces, len(x))
    _check_closed(triangles)
    middle = x[np.unique(triangles)].mean(axis=0)  # tetrahedra as large as the body, wherever it is
    corners = x[triangles] - middle
    volumes = _volumes(corners)
    volume = float(volumes.sum())
    _check_volume(volume, corners)
    com = volumes @ corners.sum(axis=1) / (4.0 * volume)
    rho = positive(density, "density", "kg/m^3")
    return Body(rho * volume, rho * inertia_of(_second_moments(corners - com)), middle + com)


def _volumes(corners: Array) -> Array:
    """Return the signed volumes of the tetrahedra between the origin and triangles (k, 3, 3)."""
    a, b, c = np.moveaxis(corners, 1, 0)
    sixfold: Array = np.sum(a * np.cross(b, c), axis=-1)
    return sixfold / 6.0


def _second_moments(corners: Array) -> Array:
    """Return the integral of r r^T over the polyhedron of these triangles, (3, 3)."""
    points = np.concatenate([corners, corners.sum(axis=1, keepdims=True)], axis=1)
    weights = _volumes(corners)[:, None, None] / 20.0
    integral: Array = np.einsum("kpi,kpj->ij", weights * points, points)
    return integral


def _triangles(faces: ArrayLike, n: int) -> Faces:
    """Return faces as indices of n vertices, each triangle with three different ones."""
    rows = exact_array(faces, "faces", "k", 3)
    indices = (rows == np.round(rows)) & (rows >= 0) & (rows < n)
    require(indices, rows, "faces", f"the index of one of {n} vertices, counted from 0")
    triangles = rows.astype(np.intp)
    different = np.all(triangles != np.roll(triangles, 1, axis=1), axis=1)
    expected = "three different vertices: leave it out if it closes nothing"
    require(different, triangles, "faces", expected)
    return triangles


def _check_closed(triangles: Faces) -> None:
    """Refuse a mesh that is not closed and consistently oriented."""
    edges = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    n = edges.max() + 1
    forward, backward = edges @ [n, 1], edges @ [1, n]  # each edge as one number
    values, count = np.unique(forward, return_counts=True)
    if np.any(count > 1):
        row = int(np.argmax(forward == values[np.argmax(count > 1)]))
        sharing = (np.flatnonzero(forward == forward[row]) // 3).tolist()
        expected = (
            f"its edge {edges[row].tolist()} once in each direction, but faces {sharing} have it "
            "in the same one: reverse the order of the vertices of those that look inwards, or "
            "give parts that only touch there vertices of their own"
        )
        require(False, triangles[row // 3], f"faces[{row // 3}]", expected)
    closed = np.isin(forward, backward)
    if not np.all(closed):
        row = int(np.argmin(closed))
        expected = (
            f"a second face that has the edge {edges[row].tolist()}, backwards: close the hole "
            "there, or merge vertices that are one point"
        )
        require(False, triangles[row // 3], f"faces[{row // 3}]", expected)


def _check_volume(volume: float, corners: Array) -> None:
    """Refuse a mesh that is inside out, or flat to rounding."""
    size = float(np.prod(np.linalg.norm(corners, axis=-1), axis=1).sum()) / 6.0
    flat = abs(volume) <= 16 * np.finfo(np.float64).eps * size
    require(not flat, volume, "volume", "more than rounding [m^3]")
    expected = (
        "a positive volume [m^3], of faces counter-clockwise seen from outside: this mesh is "
        "inside out, pass faces[:, ::-1]"
    )
    require(volume > 0.0, volume, "volume", expected)
