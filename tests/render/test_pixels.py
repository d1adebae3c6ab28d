"""Meshes are closed and outside out; each is drawn where a camera model puts it."""

import importlib
import importlib.resources
import math
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from rigid_envs.watch import meshes
from rigid_envs.watch.drawing import Drawing, Look
from rigid_envs.watch.meshes import ball as ball_of_one_colour
from rigid_envs.watch.meshes import octants
from rigid_envs.watch.pictures import tiled, write
from rigid_envs.watch.views import Arrow, Camera, Floor, Part, Pose, Scene, SceneFrame, Trace
from tests.from_pages.attitudes import matrix
from tests.systems.measures import random_attitude

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
    if hasattr(shape, "cache_info") and shape.__module__ == room.__name__
}
ARGUMENTS = {"wheel": (1,), "bar": (2,), "earth": (0.9,)}
OPEN = {"arrow_head", "arrow_shaft", "earth", "edge_ring", "goal_cone", "goal_ring"}


def signed_volume(mesh):
    a, b, c = np.moveaxis(mesh.vertices.astype(np.float64)[mesh.triangles], 1, 0)
    return float(np.sum(a * np.cross(b, c)) / 6.0)


def is_closed(mesh):
    """Whether every edge, between places, is there once in each direction."""
    _, place = np.unique(np.round(mesh.vertices, 5) + 0.0, axis=0, return_inverse=True)
    rows = place.reshape(-1)[mesh.triangles]
    edges = np.stack([rows, np.roll(rows, -1, axis=1)], axis=-1).reshape(-1, 2)
    edges = edges[edges[:, 0] != edges[:, 1]]
    there, back = (sorted(map(tuple, part.tolist())) for part in (edges, edges[:, ::-1]))
    return there == back


def check_normals(mesh):
    """Unit normals, on the outer side of every triangle that they belong to."""
    assert np.allclose(np.linalg.norm(mesh.normals, axis=-1), 1.0, atol=1e-5)
    a, b, c = np.moveaxis(mesh.vertices.astype(np.float64)[mesh.triangles], 1, 0)
    face = np.cross(b - a, c - a)
    face /= np.linalg.norm(face, axis=-1, keepdims=True)
    cosines = np.einsum("kvi,ki->kv", mesh.normals.astype(np.float64)[mesh.triangles], face)
    assert cosines.min() > 0.45, "a normal is more than 63 degrees off its triangle"


@pytest.mark.parametrize("name", SOLIDS)
def test_solids_are_closed_and_outside_out_with_the_volume_of_the_closed_form(name):
    mesh, volume = SOLIDS[name]
    assert is_closed(mesh)
    check_normals(mesh)
    assert volume * (1.0 - 7.0 / 40**2) <= signed_volume(mesh) <= volume * (1.0 + 1e-5)


@pytest.mark.parametrize("name", SHAPES)
def test_shapes_are_closed_and_outside_out(name):
    mesh = SHAPES[name](*ARGUMENTS.get(name, ()))
    check_normals(mesh)
    assert mesh.vertices.dtype == mesh.normals.dtype == np.float32
    assert mesh.colors.dtype == np.uint8 and mesh.triangles.dtype == np.int32
    assert len(mesh.vertices) <= 3000
    assert mesh is SHAPES[name](*ARGUMENTS.get(name, ())), "made once in a process"
    if name not in OPEN:
        assert is_closed(mesh)
        assert signed_volume(mesh) > 0.0


def test_a_moved_mesh_is_still_closed_and_outside_out():
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    mesh = meshes.moved(SOLIDS["frustum"][0], (1.0, 2.0, 3.0), turn, (2.0, 0.5, 1.5))
    check_normals(mesh)
    assert signed_volume(mesh) == pytest.approx(1.5 * signed_volume(SOLIDS["frustum"][0]), rel=1e-5)


def test_octants_have_the_colour_of_their_signs():
    colors = [(0.1 * k, 0.0, 0.0) for k in range(8)]
    mesh = meshes.octants(1.0, colors)
    middle = mesh.vertices[mesh.triangles].mean(axis=1)
    k = (middle < 0.0) @ np.array([1, 2, 4])
    red = mesh.colors[mesh.triangles[:, 0], 0]
    assert np.array_equal(red, np.round(255.0 * (0.1 * k)))


def test_octants_of_a_chequered_ball_have_two_colours_in_turn():
    mesh = meshes.chequered_ball()
    odd = np.prod(mesh.vertices[mesh.triangles].mean(axis=1), axis=-1) < 0.0
    for here, color in ((odd, meshes.PALE), (~odd, meshes.WARM)):
        assert np.all(mesh.colors[mesh.triangles[here]] == np.round(255.0 * np.array(color)))


def test_each_normal_of_a_smooth_side_is_that_of_the_surface():
    mesh = meshes.ball(3.0, GREY)
    assert np.allclose(mesh.normals, mesh.vertices / 3.0, atol=1e-6)
    torus = meshes.loop(2.0 * CIRCLE, 0.5, GREY)
    flat = torus.vertices * (1.0, 1.0, 0.0)
    centre = 2.0 * flat / np.linalg.norm(flat, axis=-1, keepdims=True)
    assert np.allclose(torus.normals, (torus.vertices - centre) / 0.5, atol=1e-5)


SIZE = 240
RADIUS = 1.0
CAMERA = Camera(target=(0.2, -0.1, 0.3), distance=6.0, azimuth=35.0, elevation=28.0)
HUES = [
    (200, 40, 40), (40, 200, 40), (40, 40, 200), (200, 200, 40),
    (40, 200, 200), (200, 40, 200), (200, 110, 40), (120, 120, 120),
]  # fmt: skip
SIGNS = [(sx, sy, sz) for sz in (1, -1) for sy in (1, -1) for sx in (1, -1)]  # as `octants`
COLORS = dict(zip(SIGNS, HUES, strict=True))


def drawing(scene, width=SIZE, height=SIZE, shadows=True):
    """Of a scene whose moments are frames."""
    view = SimpleNamespace(scene=scene, frame=lambda frame: frame)
    return Drawing(view, Look(width, height, shadows=shadows))


def eye_and_axes(camera):
    """Pinhole camera: position, and the directions right, up and back."""
    azimuth, elevation = math.radians(camera.azimuth), math.radians(camera.elevation)
    back = np.array(
        [
            math.cos(elevation) * math.cos(azimuth),
            math.cos(elevation) * math.sin(azimuth),
            math.sin(elevation),
        ]
    )
    right = np.cross((0.0, 0.0, 1.0), back)
    right /= np.linalg.norm(right)
    return np.array(camera.target) + camera.distance * back, right, np.cross(back, right), back


def pixel(point, camera, width=SIZE, height=SIZE):
    """Line and column of the pixel in which a point of the world is seen."""
    eye, right, up, back = eye_and_axes(camera)
    sight = np.asarray(point) - eye
    depth = -sight @ back
    focus = 0.5 * height / math.tan(math.radians(0.5 * camera.field_of_view))
    return (
        int(0.5 * height - focus * (sight @ up) / depth),
        int(0.5 * width + focus * (sight @ right) / depth),
    )


def hue(color):
    """Colour without brightness."""
    color = np.asarray(color, dtype=float)
    return color / np.linalg.norm(color)


@pytest.fixture(scope="module")
def ball():
    return Scene(
        parts={"ball": Part(octants(RADIUS, [tuple(np.array(hue) / 255.0) for hue in HUES]))},
        camera=CAMERA,
    )


@pytest.mark.parametrize("seed", range(20))
def test_every_octant_is_seen_where_its_attitude_puts_it(ball, seed):
    rng = np.random.default_rng(seed)
    q, position = random_attitude(rng), 0.5 * rng.normal(size=3)
    image = drawing(ball).picture(SceneFrame({"ball": Pose(position, q)}))
    eye = eye_and_axes(CAMERA)[0]
    seen = 0
    for signs in COLORS:
        normal = matrix(q) @ (np.array(signs) / math.sqrt(3.0))
        point = position + RADIUS * normal
        sight = (eye - point) / np.linalg.norm(eye - point)
        if normal @ sight < 0.3:
            continue
        i, j = pixel(point, CAMERA)
        if 0 <= i < SIZE and 0 <= j < SIZE:
            likeness = {other: hue(image[i, j]) @ hue(color) for other, color in COLORS.items()}
            assert max(likeness, key=likeness.get) == signs
            seen += 1
    assert seen >= 1


@pytest.mark.parametrize(("width", "height"), [(320, 200), (200, 320), (64, 64)])
def test_pictures_of_any_shape_are_not_distorted(ball, width, height):
    image = drawing(ball, width, height).picture(SceneFrame({"ball": Pose((0, 0, 0))}))
    assert image.shape == (height, width, 3)
    eye, right, up, _ = eye_and_axes(CAMERA)
    distance = np.linalg.norm(eye)
    back = eye / distance
    # the outline is the circle in which the cone of tangents from the eye touches the sphere
    centre, radius = RADIUS**2 / distance * back, RADIUS * math.sqrt(1 - (RADIUS / distance) ** 2)
    for along in (right, up, -right, -up):
        side = along - (along @ back) * back
        side /= np.linalg.norm(side)
        for share, inside in ((0.9, True), (1.1, False)):
            i, j = pixel(centre + share * radius * side, CAMERA, width, height)
            if 0 <= i < height and 0 <= j < width:
                assert (np.abs(image[i, j].astype(int) - image[0, 0]).max() > 20) == inside


def marked(image, color, tolerance=60):
    return (np.abs(image.astype(int) - color).max(axis=-1) < tolerance).nonzero()


def test_a_path_is_drawn_where_its_points_are():
    path = np.array([(-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 0.5, 0.0)])
    scene = Scene(
        parts={},
        camera=CAMERA,
        traces={"path": Trace((1.0, 0.0, 0.0), 0.05)},
        floor=Floor(0.0, 20.0, 1.0),
    )
    pixels = drawing(scene)
    for point in path:
        image = pixels.picture(SceneFrame({}, points={"path": point}))
    lines, columns = marked(image, (255, 0, 0))
    drawn = np.column_stack([lines, columns])
    for start, end in pairwise(path):
        for share in (0.1, 0.3, 0.5, 0.7, 0.9):
            place = pixel(start + share * (end - start), CAMERA)
            assert np.abs(drawn - place).max(axis=-1).min() <= 1
    mirrored = pixel((-1.0, 0.5, 0.0), CAMERA)
    assert np.abs(drawn - mirrored).max(axis=-1).min() > 10


def test_a_path_on_a_part_turns_with_it(ball):
    scene = Scene(
        parts=ball.parts, camera=CAMERA, traces={"path": Trace((0.0, 0.0, 0.0), 0.08, part="ball")}
    )
    pixels = drawing(scene)
    angles = np.linspace(-0.6, 0.6, 9)
    points = 1.01 * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    for point in points:
        pixels.picture(SceneFrame({"ball": Pose()}, points={"path": point}))
    # a quarter turn about z, so that +x of the ball is +y of the world; then seen from there
    q = (math.cos(math.pi / 4), 0.0, 0.0, math.sin(math.pi / 4))
    frame = SceneFrame({"ball": Pose((0, 0, 0), q)})
    image = pixels.picture(frame)
    turned = matrix(q) @ points.T
    for point in turned.T[2:7]:
        i, j = pixel(point, CAMERA)
        patch = image[i - 1 : i + 2, j - 1 : j + 2]
        assert patch.min(axis=(0, 1)).max() < 60  # black is near


def test_traces_end_at_points_that_are_not_finite_and_keep_their_length():
    scene = Scene(parts={}, camera=CAMERA, traces={"path": Trace((1.0, 0.0, 0.0), 0.1, length=3)})
    pixels = drawing(scene)
    for x in (-1.0, -0.5, np.nan, 0.5, 1.0):
        image = pixels.picture(SceneFrame({}, points={"path": (x, 0.0, 0.0)}))
    drawn = np.column_stack(marked(image, (255, 0, 0)))
    near = [np.abs(drawn - pixel((x, 0.0, 0.0), CAMERA)).max(axis=-1).min() for x in (0.75, 0.0)]
    assert near[0] <= 1
    assert near[1] > 3
    pixels.clear()
    assert not len(marked(pixels.picture(SceneFrame({})), (255, 0, 0))[0])


def test_an_arrow_reaches_from_its_start_to_its_tip():
    scene = Scene(parts={}, camera=CAMERA, arrows={"v": Arrow((0.0, 0.5, 0.0), 0.08, "v")})
    start, vector = np.array((0.7, -0.6, 0.1)), np.array((-0.9, 1.1, 0.5))
    image = drawing(scene).picture(SceneFrame({}, arrows={"v": (start, vector)}))
    background = image[0, 0].astype(int)
    for share in (0.05, 0.5, 0.9):
        i, j = pixel(start + share * vector, CAMERA)
        assert np.abs(image[i, j].astype(int) - background).max() > 60
    for share in (-0.15, 1.15):
        i, j = pixel(start + share * vector, CAMERA)
        assert np.abs(image[i, j].astype(int) - background).max() < 20


def test_a_shadow_falls_on_the_floor_away_from_the_light(ball):
    scene = Scene(parts=ball.parts, camera=CAMERA, floor=Floor(-1.0, 20.0, 1.0))
    frame = SceneFrame({"ball": Pose((0, 0, 0.5))})
    bright = drawing(scene, shadows=False).picture(frame).astype(int)
    dark = drawing(scene).picture(frame).astype(int)
    darker = (bright - dark).max(axis=-1) > 15
    assert 0.005 < darker.mean() < 0.3
    assert ((dark - bright).max(axis=-1) < 5).all()


def test_what_a_frame_leaves_out_and_an_arrow_without_length_are_not_shown(ball):
    scene = Scene(ball.parts, CAMERA, {"v": Arrow((0.0, 0.5, 0.0), 0.08, "v")})
    pixels, origin = drawing(scene, 64, 64), (0.0, 0.0, 0.0)
    seen = pixels.picture(SceneFrame({"ball": Pose()}, {"v": (origin, (0.0, 0.0, 2.0))}))
    assert seen.std() > 5.0
    for frame in (SceneFrame({}), SceneFrame({}, {"v": (origin, origin)})):
        nothing = pixels.picture(frame)
        assert (nothing == nothing[0, 0]).all()


def test_of_arrows_in_one_place_the_first_is_seen_and_not_that_which_comes_first_in_memory():
    looks = {str(k): Arrow((0.1 * k, 0.0, 0.8 - 0.1 * k), 0.1, "v") for k in range(8)}
    orders = [dict(reversed(looks.items())), looks, {"0": looks["0"]}]
    at = dict.fromkeys(looks, ((0.0, 0.0, 0.0), (0.0, 0.0, 1.5)))
    drawings = [drawing(Scene({}, CAMERA, arrows), 64, 64) for arrows in orders]
    last, first, alone = (each.picture(SceneFrame({}, at)) for each in drawings)
    assert np.array_equal(first, alone)
    assert not np.array_equal(first, last)


def test_edges_are_smooth():
    scene = Scene(parts={"ball": Part(ball_of_one_colour(RADIUS, (0.8, 0.1, 0.1)))}, camera=CAMERA)
    image = drawing(scene).picture(SceneFrame({"ball": Pose()})).astype(int)
    i, _ = pixel(np.zeros(3), CAMERA)
    steps = np.abs(np.diff(image[i - 30 : i + 30], axis=1)).max(axis=-1)
    counts = (steps > 15).sum(axis=1)
    assert counts.mean() > 3.0  # of 4: nearly all edges have a pixel between ball and background


def test_small_letters_have_the_proportions_of_large_ones():
    ends = {}
    for size in (9, 90):
        picture = np.full((2 * size, 60 * size, 3), 255, dtype=np.uint8)
        write(picture, ["Keep a disk rolling below its stable speed"], size)
        ends[size] = np.flatnonzero(picture.min(axis=(0, 2)) < 128)[-1]
    assert abs(10 * ends[9] - ends[90]) < 20  # two pixels of the small letters


def test_up_to_three_pictures_are_put_side_by_side_and_more_in_lines():
    for n, lines in ((1, [[0]]), (3, [[0, 1, 2]]), (5, [[0, 1, 2], [3, 4, 255]])):
        page = tiled([np.full((4, 6, 3), k, dtype=np.uint8) for k in range(n)])
        assert page.shape == (4 * len(lines), 6 * len(lines[0]), 3)
        assert np.array_equal(page[::4, ::6, 0], lines)


def test_a_floor_goes_with_a_camera_that_follows_and_no_cell_changes_its_colour(ball):
    camera = Camera(distance=6.0, azimuth=35.0, elevation=28.0, follow="ball")
    pixels = drawing(Scene(ball.parts, camera, floor=Floor(-1.0, 20.0, 1.0)))
    here, there = (
        pixels.picture(SceneFrame({"ball": Pose((x, y, 0.0))})) for x, y in ((0, 0), (60, -44))
    )
    assert np.abs(here.astype(int) - there).mean() < 0.1
    moved = pixels.picture(SceneFrame({"ball": Pose((1.0, 0.0, 0.0))}))
    assert np.abs(here.astype(int) - moved).mean() > 1.0


def test_a_point_is_found_where_the_camera_model_puts_it_and_behind_it_by_direction(ball):
    pixels = drawing(Scene(ball.parts, CAMERA), 320, SIZE)
    pixels.picture(SceneFrame({"ball": Pose()}))
    for point in np.random.default_rng(0).uniform(-2.0, 2.0, (20, 3)):
        right, up = pixels.place_of(point)
        found = 0.5 * SIZE * (1.0 - up), 0.5 * 320 * (1.0 + right)
        assert np.floor(found) == pytest.approx(pixel(point, CAMERA, 320), abs=1)
    eye, side, _, back = eye_and_axes(CAMERA)
    right, up = pixels.place_of(eye + 5.0 * back + 3.0 * side)
    assert right > 1.0 and abs(up) < 1e-3 * right
