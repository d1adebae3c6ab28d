"""Meshes: closed, outside out, and of the volume that the closed form of the solid says."""

import importlib
import importlib.resources
import math

import numpy as np
import pytest

from rigid_envs.watch import meshes
from rigid_envs.watch.scene import Mesh

GREY = (0.5, 0.5, 0.5)
ANGLES = np.linspace(0.0, 2.0 * math.pi, 96, endpoint=False)
CIRCLE = np.stack([np.cos(ANGLES), np.sin(ANGLES), 0.0 * ANGLES], axis=-1)
QUARTER = np.stack([np.cos(ANGLES[:25]), np.sin(ANGLES[:25]), 0.0 * ANGLES[:25]], axis=-1)

# name: mesh, volume; the tessellation error of an inscribed polygon of n sides is below 7 / n^2
SOLIDS = {
    "box": (meshes.box((1.0, 2.0, 3.0), [GREY]), 6.0),
    "ball": (meshes.ball(2.0, GREY, n=40), 32.0 / 3.0 * math.pi),
    "octants": (meshes.octants(1.5, [GREY] * 8, n=20), 4.5 * math.pi),
    "cylinder": (meshes.cylinder(0.5, 3.0, GREY, sides=80), 0.75 * math.pi),
    "cone": (meshes.frustum(1.0, 0.0, 3.0, GREY, sides=80), math.pi),
    "cone upside down": (meshes.frustum(0.0, 1.0, 3.0, GREY, sides=80), math.pi),
    "frustum": (meshes.frustum(2.0, 1.0, 3.0, GREY, sides=80), 7.0 * math.pi),
    "ring": (meshes.ring(1.0, 2.0, 0.5, GREY, sides=80), 1.5 * math.pi),
    "torus": (meshes.loop(2.0 * CIRCLE, 0.5, GREY, sides=80), math.pi**2),
    "bar": (meshes.tube([(0, 0, 0), (1, 2, 2)], 0.5, GREY, sides=80), 0.75 * math.pi),
    "bent bar": (meshes.tube(2.0 * QUARTER, 0.5, GREY, sides=80), 0.25 * math.pi**2),
}
VIEWS = [
    importlib.import_module(f"rigid_envs.systems.{folder.name}.view")
    for folder in importlib.resources.files("rigid_envs.systems").iterdir()
    if (folder / "view.py").is_file()
]
SHAPES = {
    name: shape
    for room in (meshes, *VIEWS)
    for name, shape in vars(room).items()
    if hasattr(shape, "cache_info") and shape.__module__ == room.__name__ and name != "chequers"
}
OPEN = {"arrow_head", "arrow_shaft", "edge_ring", "goal_cone", "goal_ring"}


def signed_volume(mesh: Mesh) -> float:
    a, b, c = np.moveaxis(mesh.vertices.astype(np.float64)[mesh.triangles], 1, 0)
    return float(np.sum(a * np.cross(b, c)) / 6.0)


def is_closed(mesh: Mesh) -> bool:
    """Whether every edge, between places, is there once in each direction."""
    _, place = np.unique(np.round(mesh.vertices, 5) + 0.0, axis=0, return_inverse=True)
    rows = place.reshape(-1)[mesh.triangles]
    edges = np.stack([rows, np.roll(rows, -1, axis=1)], axis=-1).reshape(-1, 2)
    edges = edges[edges[:, 0] != edges[:, 1]]
    there, back = (sorted(map(tuple, part.tolist())) for part in (edges, edges[:, ::-1]))
    return there == back


def check_normals(mesh: Mesh) -> None:
    """Unit normals, on the outer side of every triangle that they belong to."""
    assert np.allclose(np.linalg.norm(mesh.normals, axis=-1), 1.0, atol=1e-5)
    a, b, c = np.moveaxis(mesh.vertices.astype(np.float64)[mesh.triangles], 1, 0)
    face = np.cross(b - a, c - a)
    face /= np.linalg.norm(face, axis=-1, keepdims=True)
    cosines = np.einsum("kvi,ki->kv", mesh.normals.astype(np.float64)[mesh.triangles], face)
    assert cosines.min() > 0.45, "a normal is more than 63 degrees off its triangle"


@pytest.mark.parametrize("name", SOLIDS)
def test_solids_are_closed_and_outside_out_with_the_volume_of_the_closed_form(name: str) -> None:
    mesh, volume = SOLIDS[name]
    assert is_closed(mesh)
    check_normals(mesh)
    assert volume * (1.0 - 7.0 / 40**2) <= signed_volume(mesh) <= volume * (1.0 + 1e-5)


@pytest.mark.parametrize("name", SHAPES)
def test_shapes_are_closed_and_outside_out(name: str) -> None:
    mesh = SHAPES[name]()
    check_normals(mesh)
    assert mesh.vertices.dtype == mesh.normals.dtype == np.float32
    assert mesh.colors.dtype == np.uint8 and mesh.triangles.dtype == np.int32
    assert len(mesh.vertices) <= 3000
    assert mesh is SHAPES[name](), "made once in a process"
    if name not in OPEN:
        assert is_closed(mesh)
        assert signed_volume(mesh) > 0.0


def test_a_moved_mesh_is_still_closed_and_outside_out() -> None:
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    mesh = meshes.moved(SOLIDS["frustum"][0], (1.0, 2.0, 3.0), turn, (2.0, 0.5, 1.5))
    check_normals(mesh)
    assert signed_volume(mesh) == pytest.approx(1.5 * signed_volume(SOLIDS["frustum"][0]), rel=1e-5)


def test_octants_have_the_colour_of_their_signs() -> None:
    colors = [(0.1 * k, 0.0, 0.0) for k in range(8)]
    mesh = meshes.octants(1.0, colors)
    middle = mesh.vertices[mesh.triangles].mean(axis=1)
    k = (middle < 0.0) @ np.array([1, 2, 4])
    red = mesh.colors[mesh.triangles[:, 0], 0]
    assert np.array_equal(red, np.round(255.0 * (0.1 * k)))


def test_octants_of_a_chequered_ball_have_two_colours_in_turn() -> None:
    mesh = meshes.chequered_ball()
    odd = np.prod(mesh.vertices[mesh.triangles].mean(axis=1), axis=-1) < 0.0
    for here, color in ((odd, meshes.PALE), (~odd, meshes.WARM)):
        assert np.all(mesh.colors[mesh.triangles[here]] == np.round(255.0 * np.array(color)))


def test_each_normal_of_a_smooth_side_is_that_of_the_surface() -> None:
    mesh = meshes.ball(3.0, GREY)
    assert np.allclose(mesh.normals, mesh.vertices / 3.0, atol=1e-6)
    torus = meshes.loop(2.0 * CIRCLE, 0.5, GREY)
    flat = torus.vertices * (1.0, 1.0, 0.0)
    centre = 2.0 * flat / np.linalg.norm(flat, axis=-1, keepdims=True)
    assert np.allclose(torus.normals, (torus.vertices - centre) / 0.5, atol=1e-5)
