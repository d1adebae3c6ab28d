"""Insets of a replay page: Poinsot's construction of a free body, the axis of a top on a sphere."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.moment import Moment
from rigid_envs.render.scene import (
    Arrow,
    Camera,
    Floor,
    Frame,
    Mesh,
    Part,
    Pose,
    Scene,
    Trace,
)
from rigid_envs.replays.panels import Panel
from rigid_envs.systems import FreeBody, HeavyTop, System

__all__ = ["insets"]

Array = npt.NDArray[np.float64]

_BLUE, _RED, _GREEN = (0.0, 0.447, 0.698), (0.835, 0.369, 0.0), (0.0, 0.62, 0.451)
_PALE, _WARM, _INK = (0.80, 0.86, 0.92), (0.93, 0.89, 0.82), (0.42, 0.46, 0.52)
_LIFT = 1.01  # of lines above the surface that they are drawn on
_REST = 1e-9  # rad/s; a body that turns more slowly has no axis of rotation


def insets(system: System, moments: Sequence[Moment], driven: bool) -> list[Panel]:
    """What is shown beside the motion of a system.

    Args:
        system: The system.
        moments: Moments of the episode.
        driven: Whether inputs act: without them, the inertia ellipsoid rolls on a plane.
    """
    times = np.array([moment.time for moment in moments])
    y = np.array([moment.y for moment in moments])
    if isinstance(system, HeavyTop):
        return [_axis_sphere(y, times)]
    if not isinstance(system, FreeBody):
        return []
    if np.linalg.norm(system.omega_body(y), axis=-1).min() < _REST:
        return [_polhode(system, y, times)]
    return [_polhode(system, y, times) if driven else _poinsot(system, y, times)]


def _poinsot(body: FreeBody, y: Array, times: Array) -> Panel:
    """The inertia ellipsoid rolls on the invariable plane: polhode on it, herpolhode below.

    ``rho = omega / sqrt(2 T)`` is on the ellipsoid ``rho . I rho = 1``, whose tangent plane
    there is normal to L at the distance ``sqrt(2 T) / |L|`` from the centre. The world is turned
    so that L points down. Lengths are in units of the largest semi-axis.

    Source: Goldstein, Poole & Safko, *Classical Mechanics*, section 5.6.
    """
    size = float(np.sqrt(body.moments.min()))
    root = np.sqrt(2.0 * body.kinetic_energy(y))
    L = body.L_world(y[0])
    q = rotations.multiply(_turn_down(L), rotations.normalize(y[:, :4]))
    rho = size * body.omega_body(y) / root[:, None]
    contact = rotations.rotate(q, rho)
    height = -size * float(root[0] / np.linalg.norm(L))
    scene = Scene(
        parts={"ellipsoid": Part(_ball(), opacity=0.34)},
        camera=Camera((0.0, 0.0, 0.4 * height), 4.8, -60.0, 24.0, 32.0),
        arrows={"omega": Arrow(_GREEN, 0.035, "\u03c9")},
        traces={
            "separatrices": Trace(_INK, 0.012, "ellipsoid"),
            "polhode": Trace(_BLUE, 0.05, "ellipsoid"),
            "herpolhode": Trace(_RED, 0.05),
        },
        floor=Floor(height, 4.4, 0.4),
    )
    semi = _semi_axes(body)
    frames = [
        Frame(
            {"ellipsoid": Pose(q=attitude, scale=semi)},
            {"omega": ((0.0, 0.0, 0.0), point)},
            {"polhode": inside / semi * _LIFT, "herpolhode": (*point[:2], height + 0.012)},
        )
        for attitude, point, inside in zip(q, contact, rho, strict=True)
    ]
    title = "Polhode and herpolhode"
    return Panel(title, scene, frames, times, {"separatrices": _separatrices(body)})


def _polhode(body: FreeBody, y: Array, times: Array) -> Panel:
    """Path of the axis of rotation on the inertia ellipsoid, in body axes."""
    semi = _semi_axes(body)
    omega = body.omega_body(y)
    rate = np.linalg.norm(omega, axis=-1)
    root = np.sqrt(2.0 * body.kinetic_energy(y))
    turning = rate > _REST
    rho = np.full_like(omega, np.nan)
    rho[turning] = omega[turning] / root[turning, None] * np.sqrt(body.moments.min())
    scene = Scene(
        parts={"ellipsoid": Part(_ball(), opacity=0.45)},
        camera=Camera((0.0, 0.0, 0.12), 5.0, 40.0, 22.0, 32.0),
        arrows={"omega": Arrow(_GREEN, 0.035, "\u03c9"), **_axes()},
        traces={
            "separatrices": Trace(_INK, 0.012, "ellipsoid"),
            "polhode": Trace(_BLUE, 0.05, "ellipsoid"),
        },
    )
    axes = {
        f"e{k + 1}": (semi[k] * np.eye(3)[k], (0.28 + 0.0 * semi[k]) * np.eye(3)[k])
        for k in range(3)
    }
    pose = {"ellipsoid": Pose(scale=semi)}
    frames = [
        Frame(pose, {**axes, "omega": ((0.0, 0.0, 0.0), 1.25 * point)}, {"polhode": point / semi})
        for point in _LIFT * rho
    ]
    title = "\u03c9 on the inertia ellipsoid"
    return Panel(title, scene, frames, times, {"separatrices": _separatrices(body)})


def _axis_sphere(y: Array, times: Array) -> Panel:
    """Path of the axis e3 of a top on the unit sphere, in world axes."""
    q = rotations.normalize(y[:, :4])
    axis = rotations.rotate(q, np.array([0.0, 0.0, 1.0]))
    scene = Scene(
        parts={"sphere": Part(_ball(), opacity=0.55)},
        camera=Camera((0.0, 0.0, 0.18), 4.8, -60.0, 38.0, 32.0),
        arrows={"e3": Arrow(_BLUE, 0.04, "e\u2083")},
        traces={"axis": Trace(_RED, 0.045), "equator": Trace(_INK, 0.012)},
    )
    angle = np.linspace(0.0, 2.0 * np.pi, 97)
    equator = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=-1)
    pose = {"sphere": Pose()}
    frames = [
        Frame(pose, {"e3": ((0.0, 0.0, 0.0), 1.15 * point)}, {"axis": _LIFT * point})
        for point in axis
    ]
    title = "Axis e\u2083 on the sphere"
    return Panel(title, scene, frames, times, {"equator": _LIFT * equator})


def _semi_axes(body: FreeBody) -> tuple[float, float, float]:
    """Semi-axes of the inertia ellipsoid, in units of the largest."""
    a, b, c = np.sqrt(body.moments.min() / body.moments)
    return float(a), float(b), float(c)


def _separatrices(body: FreeBody) -> Array:
    """Both separatrices on the unit sphere that the ellipsoid is made from, (n, 3); broken by NaN.

    Polhodes of ``L^2 / (2 T) = I_2``, the middle moment: two ellipses through the middle axis, in
    the planes ``rho_1 sqrt(I_1 (I_2 - I_1)) = +- rho_3 sqrt(I_3 (I_3 - I_2))``. None where two
    moments are equal.
    """
    order = np.argsort(body.moments)
    low, middle, high = body.moments[order]
    if low == middle or middle == high:
        return np.zeros((0, 3))
    across = np.array([np.sqrt(high - middle), np.sqrt(middle - low)])  # in sphere coordinates
    across /= np.linalg.norm(across)
    angle = np.linspace(0.0, 2.0 * np.pi, 121)
    lines = np.full((2, 122, 3), np.nan)
    for line, sign in zip(lines, (1.0, -1.0), strict=True):
        line[:-1, order[0]] = across[0] * np.sin(angle)
        line[:-1, order[1]] = np.cos(angle)
        line[:-1, order[2]] = sign * across[1] * np.sin(angle)
    return (_LIFT - 0.004) * lines.reshape(-1, 3)


def _axes() -> dict[str, Arrow]:
    names = ("e\u2081", "e\u2082", "e\u2083")
    return {f"e{k + 1}": Arrow(_INK, 0.02, name) for k, name in enumerate(names)}


def _turn_down(direction: Array) -> Array:
    """Quaternion of the shortest turn of a direction to straight down; about x if it points up."""
    x, y, z = direction / np.linalg.norm(direction)
    q = np.array([1.0 - z, -y, x, 0.0])
    return rotations.normalize(q) if np.linalg.norm(q) > 1e-6 else np.array([0.0, 1.0, 0.0, 0.0])


def _ball(n: int = 24) -> Mesh:
    """Unit sphere whose octants have two colours in turn."""
    polar = np.linspace(0.0, np.pi, n + 1)
    azimuth = np.linspace(0.0, 2.0 * np.pi, 2 * n + 1)
    theta, phi = np.meshgrid(polar, azimuth, indexing="ij")
    grid = np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1
    )
    corners = np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=2)
    vertices = corners.reshape(-1, 3)
    middle = corners.mean(axis=2).reshape(-1, 3)
    odd = np.prod(np.sign(middle), axis=-1) < 0.0
    colors = np.where(np.repeat(odd, 4)[:, None], _PALE, _WARM)
    first = 4 * np.arange(len(middle))[:, None]
    triangles = np.concatenate([first + np.array((0, 1, 2)), first + np.array((0, 2, 3))])
    return Mesh(
        vertices.astype(np.float32),
        vertices.astype(np.float32),
        np.round(255 * colors).astype(np.uint8),
        triangles.astype(np.int32),
    )
