"""Views: what is seen is the state, and what rolls does not slip, by formulas of our own."""

import math
from dataclasses import asdict, replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rigid_envs import systems
from rigid_envs.mechanics.bodies import solids as bodies
from rigid_envs.systems.dynamic_ball.tasks import BallParkDynamic, BallPlate
from rigid_envs.systems.free_body.tasks import (
    AxisFlip,
    Detumble,
    IntermediateAxis,
    Reorient,
    SpinCapture,
)
from rigid_envs.systems.free_body.view import sides
from rigid_envs.systems.gyrostat.tasks import TwoWheels, WheelReorient
from rigid_envs.systems.gyrostat.view import (
    DualSpinView,
    GyrostatView,
    WheelTrackView,
    earth,
    limits,
    rings,
)
from rigid_envs.systems.heavy_top.tasks import PivotTop, SleepingTop, TopPrecession
from rigid_envs.systems.roller.tasks.roll_pump import RollPump
from rigid_envs.systems.rolling_ball.tasks import BallPark, BallParkGoal, BallSteer
from rigid_envs.systems.rolling_ball.view import OUTSIDE
from rigid_envs.systems.rolling_disk.dynamics import State as DiskState
from rigid_envs.systems.rolling_disk.tasks.disk_roll import DiskRoll, rolling
from rigid_envs.systems.satellite.tasks import MagneticDetumble
from rigid_envs.systems.spheroid.tasks import TippeTop
from rigid_envs.systems.spheroid.view import SpheroidView, tippe_top
from rigid_envs.systems.thrown_body.view import HIGHEST, ThrownBodyView, racket
from rigid_envs.systems.upright_coin.tasks.coin_park import CoinPark
from rigid_envs.tasks.core import Moment
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tasks.task import Task
from rigid_envs.testing.environments import fresh, single
from rigid_envs.watch.drawing import Drawing, Look
from rigid_envs.watch.meshes import box, octants, sectors
from rigid_envs.watch.views import GenericView, cost_figure, view_class, view_of
from tests.from_pages.attitudes import matrix
from tests.render.examples import Q, at, placed

IDS = sorted(ENVIRONMENTS)


@pytest.fixture(scope="module", params=IDS)
def started(request):
    """The first state of an environment after a step under half the action, and its view."""
    env = fresh(single(request.param))
    zero = np.zeros(env.action_space.shape, dtype=np.float32)
    env.step(1 if env.task.n_choices else zero + np.float32(0.5))
    moment = env.moment()
    return request.param, view_of(env.task, moment.parameters), moment


def test_every_id_has_a_view_of_its_own(started):
    _, view, _ = started
    general = {f"{kind.__name__}View" for kind in view.task.system_type.__mro__}
    assert type(view) is view_class(type(view.task))
    assert type(view).__name__ not in general | {"GenericView"}


def test_a_frame_places_what_the_scene_has(started):
    env_id, view, moment = started
    frame, scene = view.frame(moment), view.scene
    assert set(frame.poses) == set(scene.parts)
    assert set(frame.arrows) == set(scene.arrows)
    assert set(frame.points) == set(scene.traces)
    assert scene.camera.follow is None or scene.camera.follow in scene.parts
    assert {trace.part for trace in scene.traces.values()} <= {None, *scene.parts}
    assert sum(len(part.mesh.vertices) for part in scene.parts.values()) <= 4000
    for pose in frame.poses.values():
        assert np.linalg.norm(pose.q) == pytest.approx(1.0, abs=1e-9)
        assert np.isfinite(np.asarray(pose.position)).all() and min(pose.scale) > 0.0
    for point in [*frame.points.values(), *sum(frame.arrows.values(), ())]:
        assert np.shape(point) == (3,) and np.isfinite(np.asarray(point)).all()
    ghosts = [name for name, part in scene.parts.items() if part.opacity < 1.0]
    assert "Detumble" in env_id or ghosts, "a goal"


def test_the_text_says_time_reward_and_cost(started):
    _, view, moment = started
    text = view.frame(moment).text
    assert text[0] == f"time {moment.time:.1f} s   reward {moment.reward:.3f}"
    assert text[1].startswith("cost ") and text[1].endswith(" of this step)") and len(text) >= 3
    assert all(line.isascii() and len(line) <= 64 for line in text)
    solved = Moment(**(vars(moment) | {"success": True}))
    assert view.frame(solved).text[-1] == "success"


def test_where_totals_are_known_the_text_says_them(started):
    _, view, moment = started
    cost = 2000.0 * abs(moment.cost) + 7.0
    text = view.frame(replace(moment, totals=(-12.3456, cost))).text
    quantity, _, unit = view.task.cost_unit.rstrip("]").partition(" [")
    assert text[0] == f"time {moment.time:.1f} s   return -12.346"
    figure = f"{cost:.3g}" if cost < 999.5 else f"{cost:.0f}"
    assert text[1] == f"cost {figure} {unit} ({quantity})"


def test_a_cost_that_is_nothing_beside_an_action_is_0_whatever_the_units():
    for scale in (1e-5, 1e-2, 1.0):
        task = SleepingTop(torque=0.3 * scale)
        assert cost_figure(task, 6.66e-16 * scale) == cost_figure(task, -6.66e-16 * scale) == "0"
        assert cost_figure(task, 0.0901234 * scale) == f"{0.0901234 * scale:.3g}"


def test_a_large_cost_is_shown_to_the_unit():
    shown = {0.123456: "0.123", 45.67: "45.7", 999.4: "999", 999.6: "1000", -2345.6: "-2346"}
    assert {cost: cost_figure(SleepingTop(), cost) for cost in shown} == shown


def test_a_frame_depends_on_the_moment_alone(started):
    _, view, moment = started
    again = view_of(view.task, moment.parameters)
    for first, second in zip(flat(view.frame(moment)), flat(again.frame(moment)), strict=True):
        assert np.array_equal(first, second)


def flat(frame):
    poses = [part for pose in frame.poses.values() for part in (pose.position, pose.q, pose.scale)]
    return [np.asarray(part) for part in (*poses, *sum(frame.arrows.values(), ()))]


BODIES = {
    "FreeBody": (Reorient(), systems.FreeBody(), "body"),
    "Gyrostat": (WheelReorient(), systems.Gyrostat(), "body"),
    "Satellite": (MagneticDetumble(), systems.Satellite(), "body"),
    "HeavyTop": (SleepingTop(), systems.HeavyTop(), "top"),
    "RollingBall": (BallPark(), systems.RollingBall(), "ball"),
    "DynamicBall": (BallPlate(), systems.DynamicBall(), "ball"),
    "RollingDisk": (DiskRoll(), systems.RollingDisk(), "disk"),
    "Spheroid": (TippeTop(), systems.Spheroid(), "body"),
}


@pytest.mark.parametrize("name", BODIES)
def test_a_part_turns_the_body_axes_to_those_of_the_system(name):
    task, system, part = BODIES[name]
    y = system.state(q=Q)
    view, moment = at(task, y, goal_w=1.0, goal_curvature=0.2)
    pose = view.frame(moment).poses[part]
    assert np.allclose(matrix(pose.q), system.accessors["R"](y), atol=1e-12)


def test_the_coin_turns_as_its_heading_and_phase():
    q = systems.UprightCoin.attitude(0.7, -0.4)
    view, moment = at(CoinPark(), systems.UprightCoin.state(q=q, contact=[1.0, 2.0]))
    pose = view.frame(moment).poses["coin"]
    axis, ahead = matrix(pose.q) @ [0.0, 0.0, 1.0], np.array([-math.cos(0.7), -math.sin(0.7), 0.0])
    assert np.allclose(np.cross(axis, [0.0, 0.0, 1.0]), ahead)
    assert np.allclose(pose.position, [1.0, 2.0, 1.0])


def test_the_tip_of_a_top_is_where_its_mesh_ends_and_the_path_goes():
    y = systems.HeavyTop.state(q=Q, pivot=[0.5, -0.3])
    view, moment = at(PivotTop(), y)
    frame, mesh = view.frame(moment), view.scene.parts["top"].mesh
    tip = placed(frame.poses["top"], mesh.vertices[np.argmax(mesh.vertices[:, 2])])
    assert np.allclose(tip, frame.points["tip"], atol=1e-6)
    assert np.allclose(placed(frame.poses["top"], [0.0, 0.0, 0.0]), [0.5, -0.3, 0.0])


def test_arrows_are_the_vectors_of_the_system_in_the_world():
    body = systems.FreeBody(1.0, 2.0, 3.0)
    omega, torque = np.array([0.3, -0.5, 0.4]), np.array([0.1, 0.2, -0.3])
    view, moment = at(SpinCapture(), body.state(q=Q, omega_body=omega), torque)
    arrows = {name: np.asarray(vector) for name, (_, vector) in view.frame(moment).arrows.items()}
    wanted = {"L": [1.0, 2.0, 3.0] * omega, "omega": omega, "input": torque}
    for name, vector in wanted.items():
        direction = matrix(Q) @ vector / np.linalg.norm(vector)
        assert np.allclose(arrows[name] / np.linalg.norm(arrows[name]), direction), name


def test_the_goal_of_a_spin_is_the_arrow_at_which_omega_arrives():
    for task, sign in ((IntermediateAxis(), 1.0), (AxisFlip(), -1.0)):
        y = systems.FreeBody.state(q=Q, omega_body=[0.0, sign * task.spin_rate, 0.0])
        view, moment = at(task, y)
        frame = view.frame(moment)
        tip = placed(frame.poses["goal"], [0.0, 0.0, 1.0])
        assert np.allclose(tip, frame.arrows["omega"][1])


def test_ghosts_are_where_the_task_wants_the_body():
    goal = dict(zip(("goal_w", "goal_x", "goal_y", "goal_z"), Q.tolist(), strict=True))
    view, moment = at(Reorient(), systems.FreeBody.state(), **goal)
    assert np.allclose(view.frame(moment).poses["goal"].q, Q)
    view, moment = at(WheelReorient(), systems.Gyrostat.state(), **goal)
    assert np.allclose(view.frame(moment).poses["goal"].q, Q)
    view, moment = at(BallParkGoal(), systems.RollingBall.state(), **goal, goal_X=1.0)
    pose = view.frame(moment).poses["goal"]
    assert np.allclose(pose.q, Q) and np.allclose(pose.position, [1.0, 0.0, 1.0])
    view, moment = at(BallPark(), systems.RollingBall.state(q=Q, position=[2.0, 1.0]))
    pose = view.frame(moment).poses["goal"]
    assert np.allclose(pose.q, [1.0, 0.0, 0.0, 0.0]) and np.allclose(pose.position, [0, 0, 1])


def test_the_axis_of_a_top_at_the_commanded_tilt_lies_on_the_cone():
    q = [math.cos(0.25), math.sin(0.25), 0.0, 0.0]
    view, moment = at(TopPrecession(), systems.HeavyTop.state(q=q), goal_tilt=0.5)
    frame = view.frame(moment)
    x, y, z = np.asarray(frame.points["tip"])
    wide, _, high = frame.poses["goal"].scale
    assert (math.hypot(x, y), z) == pytest.approx((wide, high))
    assert np.allclose(frame.poses["goal_ring"].position, [0.0, 0.0, high])


def test_the_ghost_of_the_plate_stands_on_its_tilted_surface():
    y = systems.DynamicBall.state(position=[0.8, -0.5], tilt=[0.1, -0.2])
    view, moment = at(BallPlate(), y, point_X=0.8, point_Y=-0.5)
    poses = view.frame(moment).poses
    assert np.allclose(poses["goal"].position, poses["ball"].position)
    assert np.allclose(poses["ball"].position, systems.DynamicBall().accessors["centre"](y))


@pytest.mark.parametrize("moments", [(1.1, 1.8, 2.4), (2.0, 2.0, 2.0), (3.0, 1.5, 2.0)])
def test_a_box_has_the_ratios_of_the_moments_of_its_body(moments):
    inertia = np.diag(bodies.box(1.0, *sides(moments)).inertia)
    assert np.allclose(inertia / inertia.sum(), np.array(moments) / np.sum(moments))


def test_a_body_in_another_order_of_moments_is_a_box():
    view, moment = at(Detumble(I1=3.0, I2=1.5, I3=2.0), systems.FreeBody.state())
    assert view.frame(moment).poses["body"].scale == pytest.approx(tuple(sides((3.0, 1.5, 2.0))))


class BallParkOfMine(BallPark):
    """Shown by the class below, which has its name."""


class BallParkOfMineView(GenericView):
    """A view in the module of its task."""


def test_a_view_is_found_by_the_name_of_its_task_or_system_or_of_one_that_they_inherit():
    class Another(BallParkOfMine):
        pass

    class Plain(BallPark):
        pass

    class Rolled(systems.RollingBall):
        pass

    ball = "rigid_envs.systems.rolling_ball.view"
    for owner, module, name in (
        (BallParkOfMine, __name__, "BallParkOfMineView"),
        (Another, __name__, "BallParkOfMineView"),
        (Plain, ball, "BallParkView"),
        (Rolled, ball, "RollingBallView"),
        (Task, "rigid_envs.watch.views", "GenericView"),
    ):
        found = view_class(owner)
        assert (found.__module__, found.__name__) == (module, name)


def test_another_number_of_colours_than_a_solid_has_is_refused_by_name():
    for n in (0, 3, 41):
        with pytest.raises(ValueError, match=rf"^number of colors = {n}; expected a divisor of si"):
            sectors([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)], [(1.0, 1.0, 1.0)] * n)
    for n in (0, 2):
        with pytest.raises(ValueError, match=rf"^number of colors = {n}; expected 1, or 6 for"):
            box((1.0, 1.0, 1.0), [(1.0, 1.0, 1.0)] * n)


def test_a_system_without_a_view_is_a_box_with_its_state_in_words():
    task = SleepingTop()
    _, moment = at(task, task.system().state(q=Q, omega_body=[1.0, 2.0, 3.0]))
    frame = GenericView(task, moment.parameters).frame(moment)
    assert np.allclose(frame.poses["body"].q, Q)
    assert "omega2 2.000" in frame.text


def moved(task, y, u, dt, **aux):
    """Frames of a motion: at its start, after dt / 2 and after dt."""
    rows = task.system().simulate(y, [0.0, 0.5 * dt, dt], u).y
    frames = []
    for k, row in enumerate(rows):
        view, moment = at(task, row, **aux)
        frames.append(view.frame(Moment(**(vars(moment) | {"time": 0.5 * k * dt}))))
    return frames


ROLLING = {
    "given velocity": (BallPark(), systems.RollingBall.state(q=Q), [0.8, -0.5, 0.0]),
    "small ball": (BallPark(radius=0.4), systems.RollingBall.state(q=Q), [0.8, -0.5, 0.0]),
    "with a spin": (BallSteer(), systems.RollingBall.state(q=Q), [-0.3, 0.9, 2.0]),
    "by a force": (
        BallParkDynamic(),
        systems.DynamicBall.state(q=Q, velocity=[0.6, 0.7]),
        [1.0, -2.0, 0.0, 0.0],
    ),
    "on a turning table": (
        BallPlate(turntable_rate=0.7, n_substeps=4),
        systems.DynamicBall.state(q=Q, position=[1, 0.4], velocity=[0.6, 0.7], tilt=[0.1, -0.05]),
        [0.0, 0.0, 0.0, 0.0],
    ),
}


@pytest.mark.parametrize("name", ROLLING)
def test_the_paths_on_plane_and_ball_roll_on_each_other(name):
    """No slip: the contact moves alike on both; so a mirrored path, or one too long, is noticed."""
    task, y, u = ROLLING[name]
    aux = {"goal_w": 1.0, "reference_w": 1.0}
    before, middle, after = moved(task, y, np.array(u), 1e-4, **aux)
    part = at(task, y)[0].scene.traces["path"].part
    plane = np.eye(3) if part is None else matrix(middle.poses[part].q)
    ball = middle.poses["ball"]
    steps = [np.subtract(after.points[k], before.points[k]) for k in ("path", "on_ball")]
    on_plane = plane @ steps[0]
    on_ball = matrix(ball.q) @ steps[1] * ball.scale[0] / OUTSIDE
    assert np.linalg.norm(on_plane) > 3e-5
    assert np.allclose(on_plane, on_ball, atol=1e-7 * ball.scale[0])


@pytest.mark.parametrize("name", ROLLING)
def test_the_point_of_contact_is_the_foot_of_the_ball(name):
    task, y, u = ROLLING[name]
    _, frame, _ = moved(task, y, np.array(u), 1e-4, goal_w=1.0, reference_w=1.0)
    ball = frame.poses["ball"]
    world = placed(ball, np.asarray(frame.points["on_ball"]) / OUTSIDE)
    part = at(task, y)[0].scene.traces["path"].part
    path = np.asarray(frame.points["path"])
    seen = path if part is None else placed(frame.poses[part], path)
    assert np.allclose(world, seen, atol=0.05 * ball.scale[0])


WHEELS = {
    "coin": (
        CoinPark(),
        systems.UprightCoin.state(
            q=systems.UprightCoin.attitude(0.7, -0.4), roll_rate=1.3, steer_rate=0.8
        ),
    ),
    "disk": (DiskRoll(), systems.RollingDisk.state(q=Q, omega_body=[0.2, -0.3, 1.5])),
    "wheel": (RollPump(), systems.Roller.state(arc_length=2.0, velocity=1.5)),
}


@pytest.mark.parametrize("part", WHEELS)
def test_the_foot_of_a_wheel_rests_on_its_track(part):
    """It rolls without slipping, and in the right sense: its lowest point has no velocity."""
    task, y = WHEELS[part]
    u = np.zeros(len(task.system().input_entries))
    before, middle, after = moved(task, y, u, 1e-4, goal_curvature=0.2)
    pose = middle.poses[part]
    if part == "wheel":
        track = np.subtract(middle.poses["track"].position, pose.position)
        foot = -track / np.linalg.norm(track)
        reach = 1.0 + np.linalg.norm(track)
        assert reach == pytest.approx(middle.poses["track"].scale[0])
    else:
        foot = np.asarray(middle.points["path"]) - np.asarray(pose.position)
        foot[2] = -pose.position[2]
    inside = matrix(pose.q).T @ foot / np.linalg.norm(foot)
    first, last = placed(before.poses[part], inside), placed(after.poses[part], inside)
    travelled = np.subtract(after.poses[part].position, before.poses[part].position)
    assert np.linalg.norm(travelled) > 5e-5
    assert np.linalg.norm(last - first) < 1e-7


EGG = {"radius": 0.8, "half_height": 1.3, "offset": 0.2, "I1": 0.5, "I3": 0.3}


@pytest.mark.parametrize("shape", [{}, EGG], ids=["sphere", "egg"])
def test_a_spheroid_touches_the_plane_at_its_contact_and_holds_its_centre_of_mass(shape):
    system = systems.Spheroid(**shape)
    parameters = {name: getattr(system, name) for name in system.parameter_names()}
    y = system.state(q=Q, centre=[1.0, -2.0], omega_body=[0.3, -0.4, 1.0])
    view = SpheroidView(TippeTop(), parameters)
    moment = Moment(y, np.zeros(5), parameters, {}, dynamics=system.dynamics)
    pose = view.frame(moment).poses["body"]
    ball = np.array([placed(pose, point) for point in octants(1.0, [(0.5,) * 3] * 8, 90).vertices])
    lowest = ball[np.argmin(ball[:, 2])]
    assert lowest[2] == pytest.approx(0.0, abs=1e-3)
    assert lowest[:2] == pytest.approx(system.contact(y), abs=0.03)
    mass = np.append(system.centre(y), system.height(y))
    assert placed(pose, [0.0, 0.0, -system.offset / system.half_height]) == pytest.approx(mass)


def test_a_tippe_top_is_inside_the_sphere_that_its_physics_is_of():
    distances = np.linalg.norm(tippe_top().vertices, axis=-1)
    assert distances.max() == pytest.approx(1.0, abs=1e-6)
    assert tippe_top().vertices[:, 2].max() == pytest.approx(1.0)  # it stands on its stem


RACKET = systems.ThrownBody(0.0012, 0.0164, 0.0176, m=0.33)
BOOK = systems.ThrownBody(0.002, 0.0044, 0.0063, m=0.9)


def thrown(body, **state):
    """The view of a thrown body, without a task, and a moment."""
    view = ThrownBodyView(SimpleNamespace(system=lambda _: body), asdict(body))
    torque = np.array([0.1, 0.2, -0.3, 0.0, 0.0, 0.0])
    return view, Moment(body.state(**state), torque, asdict(body), dynamics=body.dynamics)


def test_a_thrown_body_is_where_its_centre_of_mass_is_and_leaves_its_path():
    place, omega = [0.3, -0.2, 1.1], np.array([0.3, -0.5, 0.4])
    view, moment = thrown(BOOK, q=Q, position=place, omega_body=omega)
    poses, points = view.poses(moment), view.points(moment)
    assert np.allclose(matrix(poses["body"].q), matrix(Q))
    assert np.array_equal(poses["body"].position, place)
    assert np.array_equal(points["centre"], place)
    assert np.allclose(poses["hand"].position, [0.3, -0.2, 0.0])
    for name, vector in {"L": BOOK.moments * omega, "omega": omega}.items():
        start, arrow = view.arrows(moment)[name]
        assert np.array_equal(start, place)
        assert np.allclose(
            arrow / np.linalg.norm(arrow), matrix(Q) @ vector / np.linalg.norm(vector)
        )


def test_a_thrown_box_has_the_moments_of_its_body():
    view, moment = thrown(BOOK)
    box = bodies.box(BOOK.m, *view.poses(moment)["body"].scale)
    assert np.allclose(np.diag(box.inertia), BOOK.moments)


def test_a_body_that_is_narrow_and_flat_is_a_racket_with_two_faces():
    assert thrown(RACKET)[0].scene.parts["body"].mesh is racket()
    others = (BOOK, systems.ThrownBody(1.0, 1.0, 2.0), systems.ThrownBody(0.1, 1.0, 1.0))
    assert all(thrown(body)[0].scene.parts["body"].mesh is not racket() for body in others)
    mesh = racket()
    inside = np.linalg.norm((mesh.vertices[:, :2] - [0.45, 0.0]) / [0.49, 0.39], axis=-1) < 1e-6
    above, below = (mesh.colors[inside & (side * mesh.vertices[:, 2] > 0.01)] for side in (1, -1))
    assert len(above) and len(below) and np.all(above == above[0]) and np.all(below == below[0])
    assert np.abs(np.subtract(above[0], below[0], dtype=int)).max() > 100


@pytest.mark.parametrize("body", [RACKET, BOOK], ids=["racket", "book"])
def test_a_thrown_body_stays_above_the_floor_and_in_the_picture(body):
    view, moment = thrown(body, q=Q, omega_body=[0.0, 9.0, 0.0])
    view.text = view.readings  # there is no task, whose rewards could be said
    drawing = Drawing(view, Look())
    for height in (0.0, HIGHEST):
        y = moment.y + height * np.eye(13)[9]
        pose = view.poses(replace(moment, y=y))["body"]
        mesh, frames = view.scene.parts["body"].mesh, np.eye(3)
        for turn in (frames, np.roll(frames, 1, axis=0), np.roll(frames, 2, axis=0)):
            points = pose.position + (mesh.vertices * np.array(pose.scale)) @ turn
            assert points[:, 2].min() >= view.scene.floor.height
            drawing.picture(replace(moment, y=y))
            assert np.abs([drawing.place_of(point) for point in points]).max() < 1.0


def test_what_is_said_of_a_thrown_body():
    view, moment = thrown(RACKET, position=[0.0, 0.0, 1.25], velocity=[1.0, 0.0, -0.5])
    moment.y[4:7] = 0.15 * np.array([0.0, 1.0, 1.0]) / RACKET.moments / math.sqrt(2.0)
    height, omega, momentum = view.readings(moment)
    assert height == "height 1.25 m   upward velocity -0.50 m/s"
    assert omega == "omega (0.00, 6.47, 6.03) rad/s in body axes"
    assert momentum == "|L| 0.15 N m s   twist about e1 45 deg"


def filled(shares, task, **aux):
    """The view of a satellite at rest whose wheels have these shares of their capacity."""
    J = task.system().wheel_moments
    rates = np.divide(np.multiply(task.capacity, shares), J, out=np.zeros(3), where=J > 0.0)
    return at(task, systems.Gyrostat.state(q=Q, wheel_rates=rates), goal_w=1.0, **aux)


def test_bars_are_as_long_as_wheels_are_full_and_end_at_the_red_ends():
    view, moment = filled([1.0, -0.25, 0.0], WheelReorient())
    poses, drawing = view.poses(moment), Drawing(view, Look())
    drawing.picture(moment)
    ends = {}
    for k in "123":
        mesh, pose = view.scene.parts[f"bar{k}"].mesh, poses[f"bar{k}"]
        far = placed(pose, [mesh.vertices[:, 0].max(), 0.0, 0.0])
        ends[k] = far, drawing.place_of(far)[0] - drawing.place_of(pose.position)[0]
    right, left = limits().vertices[:, 0].max(), limits().vertices[:, 0].min()
    assert left == -right
    bar = np.linalg.norm(ends["1"][0] - poses["bar1"].position)
    assert right - 0.1 < bar < right
    assert np.linalg.norm(ends["2"][0] - poses["bar2"].position) == pytest.approx(0.25 * bar)
    assert ends["1"][1] > 0.3 and ends["2"][1] == pytest.approx(-0.25 * ends["1"][1], rel=0.1)
    assert abs(ends["3"][1]) < 0.01
    assert view.readings(moment)[-1] == "wheels at 100 %, -25 %, 0 % of 0.4 N m s"


def test_a_wheel_turns_about_its_axis_as_its_motor_turns_it_and_is_seen_on_both_faces():
    view, moment = filled([0.25, -0.25, 0.0], WheelReorient())
    poses = view.poses(moment)
    for k, turn in enumerate((90.0, -90.0, 0.0)):
        pose, empty = poses[f"wheel{k + 1}"], filled([0.0] * 3, WheelReorient())
        axis = matrix(Q)[:, k]
        before = matrix(empty[0].poses(empty[1])[f"wheel{k + 1}"].q)
        c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
        x, y, z = axis
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        rotation = c * np.eye(3) + s * cross + (1.0 - c) * np.outer(axis, axis)
        assert np.allclose(matrix(pose.q), rotation @ before)
        points = view.scene.parts[f"wheel{k + 1}"].mesh.vertices * np.array(pose.scale)
        half = 0.5 * np.array(view.scale)
        for side in (1.0, -1.0):
            assert (side * points[:, k]).max() > half[k]
        assert np.all(np.abs(np.delete(points, k, axis=1)).max(axis=0) < np.delete(half, k))


def test_a_wheel_that_is_not_there_is_not_shown_and_its_motor_does_nothing():
    view, moment = filled([0.5, 0.5, 0.0], TwoWheels())
    assert {name for name in view.scene.parts if name[-1] in "123"} == {
        f"{name}{k}" for name in ("wheel", "bar", "limits") for k in "12"
    }
    u = np.array([0.1, 0.2, 0.4, 0.0, 0.0, -0.05])
    assert np.allclose(view.torque(replace(moment, u=u)), [-0.1, -0.2, -0.05])
    bare = systems.Gyrostat()
    alone = GyrostatView(SimpleNamespace(system=lambda _: bare), asdict(bare))
    still = Moment(bare.state(), np.zeros(6), asdict(bare), dynamics=bare.dynamics)
    assert set(alone.poses(still)) == {"body", "sphere"} and len(alone.readings(still)) == 1


def test_a_satellite_is_a_box_of_its_moments():
    view, _ = filled([0.0] * 3, WheelReorient(I1=1.1, I2=1.8, I3=2.4))
    assert np.ptp(np.array(view.scale) / sides((1.1, 1.8, 2.4))) < 1e-12


@pytest.mark.parametrize("task", [WheelReorient(), TwoWheels()], ids=["three", "two"])
def test_satellite_goal_and_bars_are_in_the_picture(task):
    rng = np.random.default_rng(0)
    view, moment = filled([0.0] * 3, task)
    drawing = Drawing(view, Look())
    for attitude, goal in rng.normal(size=(20, 2, 4)):
        y = systems.Gyrostat.state(q=attitude / np.linalg.norm(attitude))
        names = (f"goal_{k}" for k in "wxyz")
        aux = dict(zip(names, (goal / np.linalg.norm(goal)).tolist(), strict=True))
        seen = replace(moment, y=y, aux={**moment.aux, **aux})
        drawing.picture(seen)
        for name, pose in view.poses(seen).items():
            for point in view.scene.parts[name].mesh.vertices[::5]:
                assert np.abs(drawing.place_of(placed(pose, point))).max() < 0.98


def test_the_axis_of_a_rotor_that_has_taken_up_L_points_into_a_ring():
    satellite = systems.Gyrostat(2.0, 2.5, 3.0, J1=0.5)
    task = {"least_start_rate": 0.4, "largest_start_rate": 0.6, "torque": 0.03}
    view = DualSpinView(SimpleNamespace(system=lambda _: satellite, **task), asdict(satellite))
    centres = np.split(rings().vertices, 2)
    for L1, end in ((1.2, 0), (-1.2, 1)):
        y = satellite.state(q=Q, wheel_rates=[L1 / 0.5, 0.0, 0.0])
        moment = Moment(y, np.zeros(6), asdict(satellite), {}, dynamics=satellite.dynamics)
        poses, tip = view.poses(moment), np.asarray(view.points(moment)["axis"])
        L = L1 * matrix(Q)[:, 0]
        middle = [placed(poses["goal"], each.mean(axis=0)) for each in centres]
        assert np.allclose(middle[0], 1.5 * L / 1.2, atol=1e-2)
        assert np.allclose(middle[end], tip, atol=1e-2)
        assert poses["bar1"].scale[0] == pytest.approx(1.0)
        assert view.readings(moment)[-2:] == (
            "0.0 deg from L to the rotor   0.000 rad/s",
            f"rotor has {100 if L1 > 0 else -100} % of L",
        )
    spun = satellite.state(q=Q, omega_body=[0.0, 0.0, 0.5], wheel_rates=[0.0, 0.0, 0.0])
    readings = view.readings(replace(moment, y=spun))
    assert readings[-2:] == ("90.0 deg from L to the rotor   0.500 rad/s", "rotor has 0 % of L")
    still = replace(moment, y=satellite.state())
    assert np.allclose(view.poses(still)["goal"].q, [1.0, 0.0, 0.0, 0.0])


def flown(q, phi, beta, errors=(0.0, 0.0)):
    """The view of a satellite over the Earth, 500 km high, and a moment of its pass."""
    satellite = systems.Gyrostat(2.0, 2.5, 3.0, J1=1e-4, J2=1e-4, J3=1e-4)
    task = SimpleNamespace(
        system=lambda _: satellite, ground=6371.0 / 500.0, orbit_rate=0.00111,
        overhead_rate=0.0152, capacity=0.03, torque=1e-3, bound=0.05,
    )  # fmt: skip
    aux = {f"pass_{name}": x for name, x in zip("wxyz", Q.tolist(), strict=True)}
    aux |= {"sine": math.sin(phi), "cosine": math.cos(phi)}
    aux |= {"target_sine": math.sin(beta), "target_cosine": math.cos(beta)}
    aux |= dict(zip(("error_sum", "n_errors"), errors, strict=True))
    y = satellite.state(q=q)
    moment = Moment(y, np.zeros(6), asdict(satellite), aux, dynamics=satellite.dynamics)
    return WheelTrackView(task, asdict(satellite)), moment


@pytest.mark.parametrize(("phi", "beta"), [(-0.1, 0.03), (0.0, 0.0), (0.05, -0.05)])
def test_the_beam_of_a_camera_that_looks_at_its_target_ends_there(phi, beta):
    satellite, ground = 6871.0 * np.array([0.0, math.sin(phi), math.cos(phi)]), 6371.0
    target = ground * np.array([math.sin(beta), 0.0, math.cos(beta)])
    way = (target - satellite) / np.linalg.norm(target - satellite)
    turn = Rotation.align_vectors([way], [[0.0, 0.0, 1.0]])[0].as_matrix()
    frame = Rotation.from_matrix(matrix(Q) @ turn).as_quat(scalar_first=True)
    view, moment = flown(frame, phi, beta, (0.3, 10.0))
    poses, points = view.poses(moment), view.points(moment)
    assert np.allclose(points["target"], 1.5 * way)
    assert np.allclose(points["axis"], points["target"])
    assert np.allclose(placed(poses["beam"], [0.0, 0.0, 1.0]), points["target"])
    assert np.allclose(poses["target"].position, points["target"])
    assert np.allclose(matrix(poses["target"].q) @ [0.0, 0.0, 1.0], -way)
    first, *_ = view.readings(moment)
    assert first == "0.0 deg from the target, mean 1.72 of at most 2.86 deg"


def test_a_target_on_the_horizon_is_at_the_rim_of_the_earth():
    rim = -earth(6371.0 / 6871.0).vertices[:, 2].max()
    horizon = math.acos(6371.0 / 6871.0)  # as seen from the centre of the Earth
    for share, nearer in ((0.3, 0.1), (1.0, 0.0), (1.3, 0.01)):
        view, moment = flown(Q, share * horizon, 0.0)
        down = matrix(view.poses(moment)["earth"].q) @ [0.0, 0.0, -1.0]
        assert np.allclose(down, [0.0, -math.sin(share * horizon), -math.cos(share * horizon)])
        beside = np.asarray(view.points(moment)["target"]) @ down / 1.5 - rim
        assert beside > nearer if nearer else abs(beside) < 1e-6


def test_a_pass_is_seen_in_its_own_axes():
    view, moment = flown(Q, 0.0, 0.0)
    assert np.allclose(matrix(view.poses(moment)["body"].q), np.eye(3))
    moment.y[4:7] = 0.0, 0.01, 0.0
    _, omega = view.arrows(moment)["omega"]
    assert np.allclose(np.asarray(omega) / np.linalg.norm(omega), [0.0, 1.0, 0.0])


@pytest.mark.parametrize("rate", [5.0, -5.0])
@pytest.mark.parametrize("torque", [0.4, -0.4])
def test_arrows_of_a_spheroid_stand_above_it_and_point_where_the_vectors_do(rate, torque):
    y = systems.Spheroid.state(q=Q, omega_body=[0.3, -0.4, rate])
    view, moment = at(TippeTop(), y, np.array([0.0, 0.0, torque, 0.0, 0.0]))
    frame, centre = view.frame(moment), view.centre(moment)
    wanted = {"omega": [0.3, -0.4, rate], "input": [0.0, 0.0, torque]}
    for name, vector in wanted.items():
        start, arrow = frame.arrows[name]
        direction = matrix(Q) @ vector / np.linalg.norm(vector)
        assert np.allclose(arrow / np.linalg.norm(arrow), direction), name
        ends = [start - centre, start + arrow - centre]
        assert all(end[2] >= 0.0 and np.linalg.norm(end) > 1.0 for end in ends), name


@pytest.mark.parametrize("spin", [1.5, -1.5])
def test_the_green_circle_is_the_one_of_the_commanded_curvature(spin):
    y = systems.RollingDisk.state(q=Q, omega_body=[0.2, -0.3, spin])
    curvature = float(rolling(DiskState(*y)).curvature)
    task = DiskRoll()
    frames = moved(task, y, np.zeros(3), 2e-3, goal_curvature=curvature)
    a, b, c = (np.asarray(frame.points["path"])[:2] for frame in frames)
    rows = 2.0 * np.array([b - a, c - b])
    centre = np.linalg.solve(rows, [b @ b - a @ a, c @ c - b @ b])
    pose = frames[1].poses["goal"]
    wide = float(np.linalg.norm(centre - b))
    assert np.allclose(np.asarray(pose.position)[:2], centre, atol=2e-2 * wide)
    assert pose.scale[0] == pytest.approx(wide, rel=2e-2)
