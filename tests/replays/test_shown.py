"""What a page is made of: what is packed, plotted and inset, which is what the replay holds."""

import base64
import json
import re
import zlib
from dataclasses import dataclass, replace
from itertools import pairwise
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest

from rigid_envs import systems
from rigid_envs.mechanics import rotations
from rigid_envs.systems.roller.system import Roller
from rigid_envs.systems.roller.tasks.roll_pump import RollPump
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.watch.replays.page import (
    Packer,
    _path,
    conservation_errors,
    curves,
    html,
    insets,
    is_driven,
)
from rigid_envs.watch.replays.replay import moment_at, moments, play_again
from rigid_envs.watch.views import view_class, view_of
from tests.replays.examples import free_body, idle, recorded, rolling_ball
from tests.systems.examples import BALL, BODY, COIN, DISK, ROLLER, SYSTEMS, TOP, name_of, states

Array = np.ndarray[Any, Any]


@pytest.fixture(scope="module")
def free():
    replay = free_body()
    return replay.task, replay.episodes[0]


@pytest.fixture(scope="module")
def spun():
    """A top that leans by 0.4 rad and is spun about its axis."""
    state = {"q": [np.cos(0.2), np.sin(0.2), 0.0, 0.0], "omega_body": [0.0, 0.0, 3.0]}
    replay = idle("RigidEnvs/SleepingTop-v0", state=state)
    return replay.task, replay.episodes[0]


def inset(task, episode, driven):
    """The one inset of a moment of each step."""
    (panel,) = insets(task.system(episode.parameters), moments(task, episode, 1), driven)
    return panel


def test_errors_are_those_of_the_definitions(free):
    task, episode = free
    omega, moment = episode.y[:, 4:7], np.array(list(episode.parameters.values()))
    energy = 0.5 * np.sum(moment * omega**2, axis=-1)
    L = np.linalg.norm(moment * omega, axis=-1)
    found = conservation_errors(task.system(episode.parameters), episode.y)
    assert np.allclose(found["energy"], energy / energy[0] - 1.0, rtol=0.0, atol=1e-14)
    assert np.allclose(found["L"], L / L[0] - 1.0, rtol=0.0, atol=1e-14)
    faster = episode.y * np.where(np.arange(len(episode.y))[:, None] == 1, [1] * 4 + [2] * 3, 1)
    found = conservation_errors(task.system(episode.parameters), faster)
    assert np.allclose(found["energy"][1], 0.75)  # of the largest


@pytest.mark.parametrize(
    "system", [BODY, TOP, replace(TOP, I2=TOP.I1), BALL, DISK, COIN, ROLLER], ids=name_of
)
def test_what_is_called_conserved_stays_as_it_is_where_nothing_acts(system):
    (like,) = (each for each in SYSTEMS if type(each) is type(system))
    path = [states(like, np.random.default_rng(1))]
    for _ in range(50):
        path.append(system.advance(path[-1], np.zeros(len(system.input_entries)), 0.01))
    found = conservation_errors(system, path)
    assert found and all(np.abs(error).max() < 1e-8 for error in found.values())
    assert ("L_spin" in found) == (system not in SYSTEMS)  # those have no axis of symmetry


def test_what_is_driven_has_changes_and_what_is_free_has_errors(free):
    task, episode = free
    assert not is_driven(episode)
    assert [c.title for c in curves(task, episode, False)][2:4] == ["Energy error", "|L| error"]
    pushed = play_again(task, episode.start, np.full((3, 3), 0.5, dtype=np.float32))
    assert is_driven(pushed)
    assert [c.title for c in curves(task, pushed, True)][2:4] == ["Energy change", "|L| change"]


def test_one_input_in_one_step_drives_an_episode(free):
    _, episode = free
    for name in ("u", "applied"):
        pushed = np.zeros_like(getattr(episode, name))
        assert not is_driven(replace(episode, **{name: pushed}))
        pushed[3, 1] = 1e-9
        assert is_driven(replace(episode, **{name: pushed}))


def drawn(name, key):
    """One of the curves of five random steps, the states, and the system."""
    replay = recorded(f"RigidEnvs/{name}-v0", 5)
    (episode,) = replay.episodes
    (found,) = (curve for curve in curves(replay.task, episode, True) if curve.key == key)
    return found, episode.y, replay.task.system(episode.parameters)


def test_curves_show_what_they_are_called():
    omega, y, _ = drawn("SpinCapture", "omega")
    assert (omega.title, omega.unit) == ("Angular velocity", "rad/s, body axes")
    assert np.array_equal(omega.values, y[:, 4:7])
    omega, y, _ = drawn("RollPump", "omega")
    assert (omega.title, omega.unit) == ("Velocity", "m/s")
    assert np.array_equal(omega.values, y[:, 1:])
    omega, y, ball = drawn("BallPark", "omega")
    rolled = 0.1 * ball.radius * omega.values[:, [1, 0]] * [1.0, -1.0]
    assert np.allclose(rolled, np.diff(y[:, 4:6], axis=0), rtol=0.0, atol=1e-12)
    tilt, y, _ = drawn("SleepingTop", "tilt")
    assert (tilt.title, tilt.unit) == ("Tilt", "deg, from the vertical")
    upward = rotations.rotate(rotations.normalize(y[:, :4]), [0.0, 0.0, 1.0])[:, 2:]
    assert np.allclose(tilt.values, np.degrees(np.arccos(upward)), atol=1e-5)
    tilt, y, _ = drawn("BallPark", "tilt")
    assert (tilt.title, tilt.unit) == ("Attitude", "deg, from upright")
    assert np.allclose(tilt.values, np.degrees(2.0 * np.arccos(np.abs(y[:, :1]))), atol=1e-5)
    tilt, y, coin = drawn("CoinPark", "tilt")
    assert (tilt.title, tilt.names) == ("Heading and roll phase", ("heading", "phase"))
    both = [coin.accessors[name](y) for name in tilt.names]
    assert np.array_equal(tilt.values.T, np.degrees(both))
    path, y, _ = drawn("BallPark", "plan")
    assert path.title == "Path on the plane, from above"
    assert np.array_equal(path.values, y[:, 4:6])
    assert len(_path(ball, y * [1.0, 1.0, 1.0, 1.0, 1.0, 0.0])) == 1  # along x
    (height,) = _path(SimpleNamespace(accessors={"position": lambda y: y[:, 3:]}), y)  # x, y, z
    assert (height.key, height.kind) == ("height", "time")
    assert np.array_equal(height.values, y[:, 5:])
    wheels, y, _ = drawn("WheelReorient", "wheels")
    assert (wheels.unit, len(wheels.names)) == ("N m s", 3)
    assert np.allclose(wheels.values, 0.001 * (y[:, 4:7] + y[:, 7:]), rtol=1e-12)
    parts, y, satellite = drawn("MagneticDetumble", "field")
    assert (parts.unit, parts.names) == ("N m s", ("along B", "across B"))
    L, B = satellite.moments * y[:, 4:7], satellite.field_body(y)
    assert np.allclose(np.linalg.norm(parts.values, axis=1), np.linalg.norm(L, axis=1), rtol=1e-12)
    assert np.allclose(parts.values[:, 0] * np.linalg.norm(B, axis=1), np.sum(L * B, axis=1))
    units = [drawn(name, "tilt")[0].unit for name in ("Reorient", "BallSteer", "AxisFlip")]
    assert units == ["deg, from the goal", "deg, from the reference", "deg, of e\u2083 from L"]
    tilt, y, body = drawn("AxisFlip", "tilt")
    L = body.moments * y[:, 4:7]
    assert np.allclose(np.cos(np.radians(tilt.values[:, 0])), L[:, 2] / np.linalg.norm(L, axis=1))
    units = [drawn(name, "action")[0].unit for name in ("BallPark", "BallGrid")]
    assert units == ["of the largest", "choice"]
    assert drawn("PivotTop", "plan")[0].title == "Path of the pivot, from above"
    assert drawn("BallPark", "momentum")[0].title == "|q|\N{SUPERSCRIPT TWO} error"


class Valley(Roller):
    components: ClassVar = {"place": slice(0, 1), "speed": slice(1, 2)}


@dataclass(frozen=True)
class Pump(RollPump):
    system_type: ClassVar = Valley


def test_of_a_system_whose_motion_has_no_known_name_the_state_is_plotted():
    (episode,) = recorded("RigidEnvs/RollPump-v0", 5).episodes
    found = {curve.key: curve for curve in curves(Pump(), episode, True)}
    assert "omega" not in found and found["state"].names == ("s", "v")
    assert np.array_equal(found["state"].values, episode.y)


@pytest.mark.parametrize("env_id", ENVIRONMENTS)
def test_every_environment_has_curves_of_every_moment_or_step(env_id):
    replay = recorded(env_id, 3)
    (episode,) = replay.episodes
    found = curves(replay.task, episode, is_driven(episode))
    keys = {curve.key for curve in found}
    assert {"reward", "cost", "action"} <= keys and len(keys & {"omega", "state"}) == 1
    assert len({curve.key for curve in found}) == len(found)
    for curve in found:
        assert curve.values.shape == (len(curve.values), len(curve.names))
        assert len(curve.values) in (3, 4) and np.isfinite(curve.values).all()
    assert len(moments(replay.task, episode, 10_000)) >= 4


def test_moments_of_steps_are_exact_and_those_between_lie_on_the_motion(free):
    task, episode = free
    path = moments(task, episode, 10_000)
    n = (len(path) - 1) // len(episode)
    assert n >= 3
    assert np.array_equal([moment.y for moment in path[::n]], episode.y)
    assert np.array_equal([moment.state for moment in path[::n]], episode.y)
    times = np.array([moment.time for moment in path])
    assert np.all(np.diff(times) > 0.0)
    exact = task.system(episode.parameters).simulate(episode.y[0], times)
    q = np.array([moment.y[:4] for moment in path])
    # a constant axis within a step of 0.1 s is off by the square of the angle that it moves
    assert rotations.distance(rotations.normalize(q), exact["q"]).max() < 2e-3


def test_success_is_shown_when_its_step_is_made_and_not_while_it_is_going_on(free):
    task, episode = free
    rng = np.random.default_rng(0)
    won, (rewards, costs) = rng.random(len(episode)) < 0.5, rng.random((2, len(episode)))
    assert {(False, True), (True, False), (True, True)} <= {*pairwise(won.tolist())}
    episode = replace(episode, success=won, rewards=rewards, costs=costs)
    path = moments(task, episode, 10_000)
    n = (len(path) - 1) // len(episode)
    for k, moment in enumerate(path):
        step, between = divmod(k, n)
        assert moment.success == (step > 0 and won[step - 1])
        # but what the step does is shown from its beginning on
        k_shown = step if between else step - 1
        assert moment.reward == (rewards[k_shown] if k else 0.0)
        assert moment.cost == (costs[k_shown] if k else 0.0)
        time = (step + between / n) * task.dt
        assert moment.time == pytest.approx(time)
        film = moment_at(task, episode, time)
        for name in ("success", "reward", "cost"):
            assert getattr(film, name) == getattr(moment, name)
        assert film.y == pytest.approx(moment.y, abs=1e-9)
    late = moment_at(task, episode, 1.5 * len(episode) * task.dt)
    assert late.success == won[-1] and np.array_equal(late.y, episode.y[-1])


def test_a_turn_of_more_than_half_a_circle_in_a_step_keeps_its_sense():
    state = {"q": [1.0, 0.0, 0.0, 0.0], "omega_body": [0.0, 0.0, 40.0]}
    replay = idle("RigidEnvs/SleepingTop-v0", 2, state, dt=0.1, n_substeps=40)
    (episode,) = replay.episodes
    dt = replay.task.dt
    path = moments(replay.task, episode, 10_000)
    times = np.array([moment.time for moment in path])
    q = rotations.normalize([moment.y[:4] for moment in path])
    turned = rotations.quaternion_from_axis_angle([0.0, 0.0, 1.0], 40.0 * times)
    assert 40.0 * dt > np.pi and len(times) > 8
    assert rotations.distance(q, turned).max() < 1e-6


def test_moments_stand_as_close_as_the_fastest_step_of_the_episode_needs():
    replay = recorded("RigidEnvs/Reorient-v0", torque=100.0, n_substeps=300)  # from rest
    path = moments(replay.task, replay.episodes[0], 10_000)
    q = rotations.normalize([moment.y[:4] for moment in path])
    assert rotations.distance(q[1:], q[:-1]).max() < 0.5


def test_budget_limits_the_moments_but_keeps_all_steps(free):
    task, episode = free
    assert len(moments(task, episode, 1)) == len(episode) + 1
    assert len(moments(task, episode, 3 * len(episode) - 1)) == 2 * len(episode) + 1


def test_lines_stand_a_little_above_what_they_are_drawn_on(free, spun):
    rolling, driven = (inset(*free, driven=acts) for acts in (False, True))
    sphere = inset(*spun, driven=True)
    for points in (
        *([f.points["polhode"] for f in panel.frames] for panel in (rolling, driven)),
        [frame.points["axis"] for frame in sphere.frames],
        *(panel.whole["separatrices"] for panel in (rolling, driven)),
        sphere.whole["equator"],
    ):
        sizes = np.linalg.norm(points, axis=-1)
        assert np.nanmin(sizes) > 1.002 and np.nanmax(sizes) < 1.02
    for frame in rolling.frames:
        x, y, z = frame.points["herpolhode"]
        assert (x, y) == tuple(frame.arrows["omega"][1][:2])
        assert 0.0 < z - rolling.scene.floor.height < 0.02
    lines = [sphere.whole["equator"], *np.split(rolling.whole["separatrices"], 2)]
    for line in map(np.asarray, lines):  # that come back to where they begin
        around = line[np.isfinite(line).all(axis=-1)]
        assert len(around) > 90 and np.allclose(around[0], around[-1])


def test_an_axis_is_an_arrow_from_the_centre_through_the_end_of_its_path(free, spun):
    body, sphere = (inset(*each, driven=True) for each in (free, spun))
    scale = body.frames[0].poses["ellipsoid"].scale
    for panel, arrow, path, sizes in (
        (body, "omega", "polhode", scale),
        (sphere, "e3", "axis", (1.0, 1.0, 1.0)),
    ):
        for frame in panel.frames:
            (begin, tip), end = frame.arrows[arrow], sizes * np.asarray(frame.points[path])
            assert np.array_equal(begin, np.zeros(3))
            ahead = np.linalg.norm(tip) / np.linalg.norm(end)
            assert 1.1 < ahead < 1.4 and np.allclose(tip, ahead * end, atol=1e-12)


def test_what_rests_in_a_place_has_no_path():
    for name in ("BallPark", "CoinPark", "PivotTop"):
        replay = idle(f"RigidEnvs/{name}-v0", 2)
        (episode,) = replay.episodes
        found = {curve.key for curve in curves(replay.task, episode, driven=False)}
        assert "tilt" in found and "plan" not in found


def test_inertia_ellipsoid_rolls_on_the_invariable_plane(free):
    task, episode = free
    system = task.system(episode.parameters)
    path = moments(task, episode, 1)
    upward = [replace(moment, y=np.array([1.0, 0, 0, 0, 0, 0, 2.0])) for moment in path[:2]]
    panels = [insets(system, several, driven=False)[0] for several in (path, upward)]
    for panel, frame in ((each, frame) for each in panels for frame in each.frames):
        floor = panel.scene.floor
        pose = frame.poses["ellipsoid"]
        contact = np.asarray(frame.arrows["omega"][1])
        assert frame.arrows["omega"][0] == (0.0, 0.0, 0.0)
        on_sphere = rotations.rotate_inverse(pose.q, contact) / np.array(pose.scale)
        assert np.linalg.norm(on_sphere) == pytest.approx(1.0, abs=1e-9)
        assert contact[2] == pytest.approx(floor.height, abs=1e-6)  # the energy error
        # the tangent plane there is horizontal
        normal = rotations.rotate(pose.q, on_sphere / np.array(pose.scale))
        assert np.allclose(normal[:2] / normal[2], 0.0, atol=1e-6)


def test_the_polhode_of_a_driven_body_lies_on_its_inertia_ellipsoid(free):
    """On ``rho . I rho = 1``, along omega, in units of the largest semi-axis."""
    task, episode = free
    episode = replace(episode, parameters={k: 3.0 * x for k, x in episode.parameters.items()})
    system = task.system(episode.parameters)
    panel = inset(task, episode, driven=True)
    semi = np.sqrt(system.moments.min() / system.moments)
    for frame, y in zip(panel.frames, episode.y, strict=True):
        assert np.allclose(frame.poses["ellipsoid"].scale, semi)
        on_sphere = np.asarray(frame.points["polhode"])
        assert np.linalg.norm(on_sphere) == pytest.approx(1.0, abs=0.011)  # lifted, to be seen
        across = np.cross(semi * on_sphere, y[4:7])
        assert np.linalg.norm(across) < 1e-9 * np.linalg.norm(y[4:7])
    at_rest = episode.y[:1] * [1, 1, 1, 1, 0, 0, 0]
    still = [replace(moment, y=y) for moment, y in
             zip(moments(task, episode, 1), [at_rest[0], *episode.y[1:]], strict=True)]  # fmt: skip
    (panel,) = insets(system, still, driven=False)
    points = np.array([frame.points["polhode"] for frame in panel.frames])
    assert np.isnan(points[0]).all() and np.isfinite(points[1:]).all()


def test_separatrices_are_polhodes_of_the_middle_moment(free):
    task, episode = free
    system = task.system(episode.parameters)
    panel = inset(task, episode, driven=True)
    points = np.asarray(panel.whole["separatrices"])
    points = points[np.isfinite(points).all(axis=-1)]
    omega = points / np.sqrt(system.moments)  # on the ellipsoid, to a factor
    ratio = np.sum((system.moments * omega) ** 2, -1) / np.sum(system.moments * omega**2, -1)
    assert np.allclose(ratio, np.sort(system.moments)[1], rtol=1e-12)
    assert len(points) > 200


def test_the_momentum_of_a_satellite_is_compared_with_that_of_its_wheels():
    change, y, _ = drawn("TwoWheels", "momentum")
    assert change.title == "|L| change" and np.abs(y[-1, 7:9]).min() > 1.0
    assert np.abs(change.values).max() < 1e-12


def test_the_momentum_of_a_satellite_is_on_the_unit_sphere_where_there_is_one():
    for name in ("WheelReorient", "TwoWheels"):
        replay = recorded(f"RigidEnvs/{name}-v0", 5)
        (episode,) = replay.episodes
        system = replay.task.system(episode.parameters)
        panels = insets(system, moments(replay.task, episode, 1), driven=True)
        if name == "TwoWheels":
            assert panels == []
            continue
        points = np.array([frame.points["L"] for frame in panels[0].frames])
        L = system.moments * episode.y[:, 4:7] + system.wheel_moments * episode.y[:, 7:]
        sizes = np.linalg.norm(points, axis=-1, keepdims=True)
        assert np.all((sizes > 1.002) & (sizes < 1.02))
        assert np.allclose(points / sizes, L / np.linalg.norm(L, axis=-1, keepdims=True))


def test_a_satellite_that_gravity_turns_has_a_polhode_and_rolls_on_no_plane():
    for n, title in ((0.001, "\u03c9 on the inertia ellipsoid"), (0.0, "Polhode and herpolhode")):
        satellite = systems.Satellite(n=n, b=0.0)
        y = satellite.state(q=[1.0, 0.0, 0.0, 0.0], omega_body=[0.01, 0.02, 0.03])
        path = satellite.simulate(y, np.linspace(0.0, 40.0, 5))
        (panel,) = view_class(systems.Satellite).insets(satellite, path.y, path.t, False)
        assert panel.title == title and len(panel.frames) == 5


def test_axis_of_a_top_is_on_the_unit_sphere(spun):
    task, episode = spun
    assert "Momentum error" in [c.title for c in curves(task, episode, False)]
    system, panel = task.system(episode.parameters), inset(task, episode, driven=False)
    points = np.array([frame.points["axis"] for frame in panel.frames])
    tilt = system.accessors["tilt"](episode.y)
    assert np.allclose(points[:, 2] / np.linalg.norm(points, axis=-1), np.cos(tilt), atol=1e-12)


def unpacked(blob, place):
    """The array of a reference, as the page reads it."""
    kind, offset, count = place
    block = zlib.decompress(base64.b64decode(blob))
    return np.frombuffer(block, f"<{kind}", count, offset)


def shown(*replays, title=""):
    """What a page of the first episode of each is given to show."""
    text = html([(replay, 0) for replay in replays], title)
    (document,) = re.findall(r'id="replay">(.*)</script>', text)
    return json.loads(document)


def test_equal_arrays_are_kept_once_and_all_are_read_back():
    packer = Packer()
    values = np.array([0.1, 2.0, -3.0])
    places = [packer.array(values), packer.array(values.tolist()), packer.array(values, "f8")]
    places.append(packer.array([7, 8, 255], "u1"))
    places.append(packer.array(values[::-1], "f8"))
    assert places[0] == places[1] and len({tuple(place) for place in places}) == 4
    block = len(zlib.decompress(base64.b64decode(packer.blob())))
    assert block == 16 + 24 + 8 + 24  # each begins at a multiple of 8 bytes
    expected = [values.astype(np.float32)] * 2 + [values, [7, 8, 255], values[::-1]]
    for place, array in zip(places, expected, strict=True):
        assert np.array_equal(unpacked(packer.blob(), place), array)


def test_a_trace_is_what_it_passed_or_whole_from_the_beginning(body):
    (episode,) = body.episodes
    path = moments(body.task, episode, 1)
    (panel,) = insets(body.task.system(episode.parameters), path, driven=True)
    packer = Packer()
    traces = packer.stage(panel)["traces"]
    assert [trace["whole"] for trace in traces] == [True, False]
    first, *others = panel.frames  # what is left out is nowhere
    bare = replace(first, poses={}, arrows={}, points={})
    stage = packer.stage(replace(panel, frames=[bare, *others]))
    (part, *_), (arrow, *_) = stage["parts"], stage["arrows"]
    for place in (*(part[k] for k in ("position", "q", "scale")), arrow["start"], arrow["vector"]):
        rows = unpacked(packer.blob(), place).reshape(len(path), -1)
        assert np.flatnonzero(np.isnan(rows).any(axis=1)).tolist() == [0]
    expected = (panel.whole["separatrices"], [frame.points["polhode"] for frame in panel.frames])
    for trace, points in zip(traces, expected, strict=True):
        found = unpacked(packer.blob(), trace["points"]).reshape(-1, 3)
        np.testing.assert_array_equal(found, np.asarray(points, np.float32))


@pytest.fixture(scope="module")
def ball():
    return rolling_ball("policy", 0, 12)


def test_times_and_frames_of_a_page_are_those_of_the_episode(ball):
    (episode,) = ball.episodes
    page = shown(ball)
    (found,) = page["episodes"]
    assert shown(ball, ball)["meshes"] == page["meshes"]  # equal ones are kept once
    assert np.array_equal(unpacked(page["blob"], found["times"]), episode.times)
    assert len(found["text"]) == len(episode) + 1
    for (_, said, *_), total in zip(found["text"][1:], np.cumsum(episode.costs), strict=True):
        assert said == f"cost {total:.3g} m (distance rolled)"
    view = view_of(ball.task, episode.parameters)
    assert [each["name"] for each in found["stage"]["parts"]] == [*view.scene.parts]
    (part,) = (each for each in found["stage"]["parts"] if each["name"] == "ball")
    assert found["stage"]["floor"]["size"] > 0.0
    assert unpacked(page["blob"], page["meshes"][part["mesh"]]["vertices"]).any()
    times = unpacked(page["blob"], found["stage"]["times"])
    path = unpacked(page["blob"], part["position"]).reshape(-1, 3)
    at = np.searchsorted(times, episode.times - 1e-9)
    assert np.allclose(path[at, :2], episode.y[:, 4:6], atol=1e-6)
    turns = unpacked(page["blob"], part["q"]).reshape(-1, 4)
    assert rotations.distance(turns[at], episode.y[:, :4]).max() < 1e-6
    assert unpacked(page["blob"], part["scale"]).tolist() == [1.0] * 3  # at all times


def test_a_page_says_success_where_the_last_step_was_one(ball):
    (episode,) = ball.episodes
    for flags in ([False] * 12, [True] + [False] * 11, [False] * 11 + [True]):
        once = replace(episode, success=np.array(flags))
        (found,) = shown(replace(ball, episodes=(once,)))["episodes"]
        result = f"{episode.rewards.sum():.4g} return, 12 steps"
        assert found["success"] is flags[-1]
        assert found["result"] == (f"success, {result}" if flags[-1] else result)


@pytest.fixture(scope="module")
def body():
    return free_body(5)


def test_a_plot_has_the_curve_of_every_episode_and_none_of_one_that_has_no_such_curve(ball, body):
    other = rolling_ball("reference", 1, 7)
    coin = idle("RigidEnvs/CoinPark-v0", 5)
    for replays in ((ball,), (ball, other), (body, ball), (coin, ball, other)):
        page = shown(*replays)
        told = ("key", "title", "unit", "kind", "names", "held")
        plots = {str([plot[name] for name in told]): plot["episodes"] for plot in page["plots"]}
        assert len(plots) == len(page["plots"])
        for k, replay in enumerate(replays):
            (episode,) = replay.episodes
            drawn = {place: lines[k] for place, lines in plots.items() if lines[k] is not None}
            for curve in curves(replay.task, episode, driven=True):
                of_steps = len(curve.values) == len(episode)
                place = [curve.key, curve.title, curve.unit, curve.kind, [*curve.names], of_steps]
                lines = drawn.pop(str(place))
                x, *columns = (unpacked(page["blob"], y) for y in (lines["x"], *lines["lines"]))
                if curve.kind == "plan":
                    x, columns = unpacked(page["blob"], lines["times"]), [x, *columns]
                assert np.array_equal(x, episode.times[1:] if of_steps else episode.times)
                assert np.array_equal(columns, curve.values.T)
                assert lines["end"] == episode.times[-1]
            assert not drawn


def test_a_page_says_what_it_shows_and_what_is_equal_once(ball, body):
    body = replace(body, provenance=ball.provenance)
    alone, twice, both = shown(ball), shown(ball, ball), shown(ball, body)
    assert alone["title"] == twice["title"] == "BallPark-v0"
    summary = str(type(ball.task).__doc__).splitlines()[0].replace("`", "")
    assert alone["subtitle"] == twice["subtitle"] == summary
    assert both["title"] == "BallPark-v0 and IntermediateAxis-v0" and both["subtitle"] == ""
    assert [each["label"] for each in twice["episodes"]] == ["policy 1", "policy 2"]
    assert [each["label"] for each in both["episodes"]] == ["policy", "free"]
    assert [name for name, _ in twice["facts"]] == ["parameters", "made with"]
    assert twice["facts"] == alone["facts"]
    names = [name for name, _ in both["facts"]]
    assert names == ["parameters: policy", "made with", "parameters: free"]
    for (_, text), replay in zip([both["facts"][0], both["facts"][2]], (ball, body), strict=True):
        values = replay.episodes[0].parameters.items()
        assert text == f"{', '.join(f'{k} = {x:.6g}' for k, x in values)} ({replay.env_id})"
    assert f"numpy {np.__version__}" in dict(alone["facts"])["made with"]


def test_a_page_with_a_title_is_of_the_motion_and_not_of_the_task(ball, body):
    for replay in (ball, body):
        (episode,) = replay.episodes
        won = replace(episode, success=np.full(len(episode), True))
        page = shown(replace(replay, episodes=(won,)), title="How it moves")
        assert (page["title"], page["subtitle"]) == ("How it moves", "")
        said = json.dumps({**page, "blob": ""}).replace('"success": false', "")
        for word in ("reward", "return", "cost", "success", "goal", replay.env_id):
            assert word not in said
        assert ("action" in [plot["key"] for plot in page["plots"]]) == is_driven(episode)


def test_too_many_and_unknown_episodes_are_refused():
    replay = rolling_ball("one", 0, 3)
    assert html(4 * [(replay, 0)])
    with pytest.raises(ValueError, match="5 episodes; expected 1 to 4"):
        html(5 * [(replay, 0)])
    with pytest.raises(ValueError, match="episode = 1; expected 0 to 0"):
        html([(replay, 1)])


def test_a_page_that_is_too_large_shows_fewer_moments_or_is_refused(body, monkeypatch):
    whole = html([(body, 0)])
    monkeypatch.setattr("rigid_envs.watch.replays.page.MOST_BYTES", len(whole.encode()) - 1)
    assert len(html([(body, 0)])) < len(whole)
    monkeypatch.setattr("rigid_envs.watch.replays.page.MOST_BYTES", 1)
    with pytest.raises(ValueError, match=r"page = \d+ bytes; expected less than 1: show fewer or"):
        html([(body, 0)])
