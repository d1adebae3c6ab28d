"""Views of what rolls: paths and wheels do not slip, in the picture either."""

from typing import Any

import numpy as np
import pytest

from rigid_envs import systems
from rigid_envs.base.checks import Array
from rigid_envs.systems.dynamic_ball.tasks.ball_park_dynamic import BallParkDynamic
from rigid_envs.systems.dynamic_ball.tasks.ball_plate import BallPlate
from rigid_envs.systems.roller.tasks.roll_pump import RollPump
from rigid_envs.systems.rolling_ball.tasks.ball_park import BallPark
from rigid_envs.systems.rolling_ball.tasks.ball_steer import BallSteer
from rigid_envs.systems.rolling_ball.view import OUTSIDE
from rigid_envs.systems.rolling_disk.dynamics import State as DiskState
from rigid_envs.systems.rolling_disk.tasks.disk_roll import DiskRoll, rolling
from rigid_envs.systems.upright_coin.tasks.coin_park import CoinPark
from rigid_envs.tasks.core import Moment
from rigid_envs.watch.scene import SceneFrame
from tests.from_pages.attitudes import matrix
from tests.render.seeing import Q, at, placed


def moved(task: Any, y: Array, u: Array, dt: float, **aux: float) -> list[SceneFrame]:
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
def test_the_paths_on_plane_and_ball_roll_on_each_other(name: str) -> None:
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
def test_the_point_of_contact_is_the_foot_of_the_ball(name: str) -> None:
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
def test_the_foot_of_a_wheel_rests_on_its_track(part: str) -> None:
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


@pytest.mark.parametrize("spin", [1.5, -1.5])
def test_the_green_circle_is_the_one_of_the_commanded_curvature(spin: float) -> None:
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
