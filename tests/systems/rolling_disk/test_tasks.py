"""Disks that fall or stand by themselves, and what leads them round circles."""

import math
from functools import cache

import numpy as np
import pytest

from rigid_envs.control.linear import region_of_attraction, simulate_closed_loop
from rigid_envs.envs.shells import RigidEnv, RigidVectorEnv
from rigid_envs.systems.rolling_disk import closed_forms as rolling_disk
from rigid_envs.systems.rolling_disk.controllers import (
    CircleRegulator,
    DiskMotion,
    rolling,
    rolling_state,
)
from rigid_envs.systems.rolling_disk.controllers import curvature as curvature_of
from rigid_envs.systems.rolling_disk.system import RollingDisk
from rigid_envs.systems.rolling_disk.tasks.disk_roll import DiskRoll, DiskRollRandom, threshold
from tests.refusals import refuses
from tests.systems.runs import rows, run, still

# CircleRegulator: steady circles of the closed form, the lean that does not move, and the cost.


DT = 0.05
DISKS = {"disk": RollingDisk.uniform(1.0, 0.8), "hoop": RollingDisk.hoop(2.0, 1.1)}


@cache
def controller_of(shape, share=0.3):
    disk = DISKS[shape]
    return CircleRegulator(disk, share * disk.m * disk.g * disk.radius, DT)


def steady(disk, theta, precession, omega3):
    """A steady motion: wn = phi' sin(theta) about the radius that points up."""
    return DiskMotion(theta - 0.5 * np.pi, 0.0, precession * math.sin(theta), omega3)


def free_circles(disk):
    """Steady circles that need no torque, by the closed form.

    With their curvatures times radius, and the squares of the frequencies of their leans.
    """
    for theta in (1.3, 1.5, 1.7):
        for ratio in (4.0, 9.0):
            radius = math.copysign(ratio, math.cos(theta)) * disk.radius
            circle = rolling_disk.steady_circle(
                theta, radius, m=disk.m, radius=disk.radius, i_perp=disk.I1, i3=disk.I3, g=disk.g
            )
            # the contact runs at phi' along its circle, whose radius is -radius psi' / phi'
            curvature = circle.precession / circle.spin
            motion = steady(disk, theta, circle.precession, circle.omega3)
            yield motion, curvature, circle.frequency_squared


def played(controller, y, goal, n):
    """States of the closed loop, the limit of the torque included."""
    return simulate_closed_loop(
        lambda y: controller.disk.advance(y, controller.inputs(controller(y, goal)), DT, 6), y, n
    )


@pytest.mark.parametrize("shape", DISKS)
def test_on_a_steady_circle_of_the_closed_form_no_torque_is_asked_for(shape):
    controller = controller_of(shape)
    for circle, curvature, _ in free_circles(DISKS[shape]):
        assert curvature_of(circle) == pytest.approx(curvature, rel=1e-12)
        # torques of m g r cos(theta) and more cancel, to rounding
        assert abs(float(controller(rolling_state(circle), curvature)[0])) < 1e-13
        assert abs(float(controller.value(rolling_state(circle), curvature))) < 1e-25


@pytest.mark.parametrize("shape", DISKS)
def test_on_any_circle_the_torque_is_that_which_holds_the_lean(shape):
    controller, rng = controller_of(shape, 10.0), np.random.default_rng(0)
    circle = DiskMotion(*rng.uniform([-0.5, 0, -1, 1], [0.5, 0, 1, 2], (20, 4)).T)
    y = rolling_state(circle)
    held = controller.inputs(controller(y, curvature_of(circle)))
    lean_rate = rolling(controller.disk.advance(y, held, 1e-4)).rate
    # none but from the next order of the motion, 1e-8 s^2
    np.testing.assert_allclose(lean_rate, 0.0, rtol=0, atol=1e-7)


def test_rolling_is_read_off_at_any_heading_and_phase():
    rng = np.random.default_rng(1)
    expected = DiskMotion(*rng.uniform(-1.0, 1.0, (4, 30)))
    found = rolling(rolling_state(expected))
    np.testing.assert_allclose(np.stack(found), np.stack(expected), rtol=0, atol=1e-14)
    disk, start = RollingDisk(), rolling_state(DiskMotion(0.2, 0.1, 0.3, 1.5))
    y = disk.simulate(start, np.linspace(0.0, 0.5, 3)).y[-1]
    theta, n = disk.tilt(y), disk.radius_up(y)
    now = rolling(y)
    assert now.lean == pytest.approx(float(theta) - 0.5 * np.pi, abs=1e-14)
    assert now.wn == pytest.approx(float(disk.omega_world(y) @ n), abs=1e-13)
    later = disk.simulate(y, [0.0, 1e-4]).y[-1]
    assert now.rate == pytest.approx(float(disk.tilt(later) - theta) / 1e-4, abs=1e-3)


@pytest.mark.parametrize("shape", DISKS)
def test_the_lean_that_a_circle_asks_for_does_not_move_whatever_the_torque(shape):
    controller = controller_of(shape)
    circle, curvature, _ = next(free_circles(DISKS[shape]))
    rng, y = np.random.default_rng(2), rolling_state(circle)
    for _ in range(8):
        y = controller.disk.advance(y, controller.inputs(rng.uniform(-0.05, 0.05, 1)), 0.01, 2)
        now = rolling(y)
        # one step of Newton's method: off by the square of the way to go, here up to 1e-3 rad
        assert abs(now.lean + controller.to_go(now, curvature) - circle.lean) < 10.0 * 1e-6


@pytest.mark.parametrize("shape", DISKS)
def test_the_lean_that_is_asked_for_does_not_move_far_from_upright_either(shape):
    controller, rng = controller_of(shape), np.random.default_rng(3)
    circle = DiskMotion(*rng.uniform([-0.9, 0, 0.5, 2], [0.9, 0, 1, 3], (20, 4)).T)
    y = rolling_state(circle._replace(rate=np.full(20, 0.05)))
    now = rolling(controller.disk.advance(y, controller.inputs(np.zeros((20, 1))), 0.02, 4))
    off = now.lean - circle.lean
    assert np.median(np.abs(off)) > 3e-4
    # One step of Newton's method: a slope that is wrong by a part in ten is 1e-4 off and more, the
    # next order, with derivatives of size 1, some 1e-6
    left = off + controller.to_go(now, curvature_of(circle))
    assert (np.abs(left) < 5.0 * off**2).all()


@pytest.mark.parametrize("shape", DISKS)
def test_the_sampled_closed_loop_is_stable_at_every_stiffness(shape):
    controller = controller_of(shape)
    disk = controller.disk
    weight, inertia = disk.m * disk.g * disk.radius, disk.I1 + disk.m * disk.radius**2
    for stiffness in weight * np.linspace(-40.0, 40.0, 161):  # between the nodes, too
        rate = np.emath.sqrt(-stiffness / inertia)
        c, s = np.cosh(rate * DT), DT * np.sinc(1j * rate * DT / np.pi)
        F = np.array([[c, s], [rate**2 * s, c]]).real
        push = (c - 1.0) / rate**2 if stiffness else 0.5 * DT**2
        G = -np.array([[push], [s]]).real / inertia
        loop = F - G @ controller.regulator(stiffness).gain
        assert np.max(np.abs(np.linalg.eigvals(loop))) < 1.0


@pytest.mark.parametrize("shape", DISKS)
def test_the_riccati_value_is_the_cost_near_a_circle(shape):
    controller, disk = controller_of(shape), DISKS[shape]
    circles, curvatures, squares = zip(*free_circles(disk), strict=True)
    circle, curvature = DiskMotion(*np.array(circles).T), np.array(curvatures)
    states = played(controller, rolling_state(circle._replace(rate=1e-4)), curvature, 40)
    now, torque = rolling(states), controller.torque * controller(states, curvature)[..., 0]
    stiffness = (disk.I1 + disk.m * disk.radius**2) * np.array(squares)
    error = np.stack([now.lean - circle.lean, now.rate], axis=-1)
    asked = controller.regulator(stiffness).feedback(error)[..., 0]
    np.testing.assert_allclose(torque, asked, rtol=0, atol=1e-5 * np.abs(asked).max())
    cost = (now.lean - circle.lean) ** 2 + now.rate**2 / 300.0 + controller.input_weight * torque**2
    value = controller.value(states, curvature)
    # the linear motion is off by the size of the error; P is interpolated over the stiffness
    np.testing.assert_allclose(np.sum(cost, axis=0), value[0], rtol=1e-2)
    big = value[:-1] > 1e-6 * value[0]
    assert (np.diff(value, axis=0)[big] < 0.0).all()


@pytest.mark.parametrize(
    ("share", "lean", "goal"),
    [
        (0.7, 0.2, -0.25),
        pytest.param(0.5, 0.15, 0.25, marks=pytest.mark.long),
        pytest.param(0.95, 0.3, 0.1, marks=pytest.mark.long),
    ],
)
def test_slow_discs_that_lean_are_led_onto_their_circles(share, lean, goal):
    controller = controller_of("disk")
    disk = controller.disk
    threshold = math.sqrt(disk.g / (3.0 * disk.radius))

    def succeeds(leans):
        slow = DiskMotion(leans[..., 0], 0.0, 0.0, share * threshold)
        end = rolling(played(controller, rolling_state(slow), goal, 160)[-1])
        return np.abs(curvature_of(end) / goal - 1.0) < 0.05

    sizes = lean * np.array([0.0001, 0.5, 1.0])
    assert (region_of_attraction(succeeds, [[1.0], [-1.0]], sizes) == lean).all()


def test_a_disk_that_stands_is_held_as_it_leans():
    controller = controller_of("disk")
    end = rolling(played(controller, rolling_state(DiskMotion(0.1, 0.0, 0.0, 0.0)), 0.2, 10)[-1])
    assert end.lean == pytest.approx(0.1, abs=1e-12)


def test_bad_numbers_are_refused():
    refuses("lies flat", controller_of("disk"), RollingDisk.state(q=[1.0, 0.0, 0.0, 0.0]), 0.1)


# DiskRoll: disks that fall or stand by themselves, and disks that are led round circles.


G = 9.81
TASKS = {"DiskRoll": DiskRoll, "DiskRollRandom": DiskRollRandom}


# I1, I3 in m r^2, and the square of the threshold in g / r, as in the books
SHAPES = {"disc": (0.25, 0.5, 1.0 / 3.0), "hoop": (0.5, 1.0, 1.0 / 4.0)}


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("share", [0.5, 0.98, 1.02, 1.5])
def test_an_upright_disk_falls_below_the_threshold_and_rolls_on_above(shape, share):
    I1, I3, _ = SHAPES[shape]
    config = {"I1": I1, "I3": I3, "start_lean": 1e-6, "start_rate": 0.0, "n_substeps": 8}
    y = run("DiskRoll", still, n=20, start_speed=share, start_spread=0.0, **config).y
    lean = np.abs(rolling(y).lean)
    grown = np.max(lean, axis=0) / lean[0]
    assert (grown < 60.0).all() if share > 1.0 else (grown > 1e3).all()


@pytest.mark.parametrize("shape", SHAPES)
def test_the_threshold_of_starts_is_that_of_the_books(shape):
    I1, I3, square = SHAPES[shape]
    assert threshold(G, I1, I3, 1.0) ** 2 == pytest.approx(square * G, rel=1e-15)
    envs = rows("rolling_disk.tasks:DiskRoll", 50, I1=I1, I3=I3, start_speed=0.7, start_spread=0.0)
    np.testing.assert_allclose(envs.y[:, 6] ** 2, 0.49 * square * G, rtol=1e-14)


def test_a_lean_beyond_sixty_degrees_ends_the_episode():
    env = RigidEnv("rigid_envs.systems.rolling_disk.tasks:DiskRoll", dt=1e-4)
    for degrees, fallen in ((59.9, False), (60.1, True), (-59.9, False), (-60.1, True)):
        y = rolling_state(DiskMotion(np.radians(degrees), 0.0, 0.0, 1.0))
        env.reset(options={"state": y})
        _, _, terminated, _, info = env.step(np.zeros(1, dtype=np.float32))
        assert terminated == fallen
        assert not info["is_success"]


def test_the_observed_curvature_is_that_of_the_way_of_the_contact():
    """From three places of the contact, of a disk that rolls steadily under the torque it needs."""
    disk, lean, wn, w3 = RollingDisk(), 0.3, 0.9, 1.2
    y = rolling_state(DiskMotion(lean, 0.0, wn, w3))
    spin = w3 - wn / np.tan(0.5 * np.pi + lean)  # psi'; n = e2 turns towards e1 of the body at psi'
    hold = np.array([0.0, (disk.rhs(y)[4] - spin * wn) * (disk.I1 + disk.m), 0.0])  # l = -e1
    a, b, c = disk.simulate(y, [0.0, 0.4, 0.8], hold)["contact"]
    area = (b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0]
    sides = np.linalg.norm([b - a, c - b, a - c], axis=1)
    env = RigidEnv("rigid_envs.systems.rolling_disk.tasks:DiskRoll")
    observation, _ = env.reset(options={"state": y})
    assert observation[4] == pytest.approx(2.0 * area / np.prod(sides), rel=1e-6)
    np.testing.assert_allclose(observation[:4], [lean, 0.0, wn, w3], rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize("name", TASKS)
def test_no_disk_becomes_faster_than_the_bound_before_it_has_fallen(name):
    """Pushed further over, or swung to and fro."""
    nothing, task = np.zeros(3), TASKS[name]()
    for n_held in (1000, 10, 20, 40):
        envs = RigidVectorEnv(f"rigid_envs.systems.rolling_disk.tasks:{name}", 20)
        envs.reset(seed=n_held)
        systems, upright = envs.systems, np.ones(20, dtype=bool)
        for k in range(80):
            y = envs.y
            rates = [systems[i].rate_and_growth(y[i], nothing)[0] for i in np.flatnonzero(upright)]
            assert max(rates, default=0.0) <= task.largest_rate(400 * task.dt)
            over = -np.sign(rolling(y).lean) * (-1.0) ** (k // n_held)
            upright &= ~envs.step(over[:, None].astype(np.float32))[2]
