"""DiskRoll: disks that fall or stand by themselves, and disks that are led round circles."""

from functools import cache

import numpy as np
import pytest

from rigid_envs.envs.single import RigidEnv
from rigid_envs.envs.vector import RigidVectorEnv
from rigid_envs.systems.rolling_disk.controllers import Rolling, rolling, rolling_state
from rigid_envs.systems.rolling_disk.references import circle_regulator
from rigid_envs.systems.rolling_disk.system import RollingDisk
from rigid_envs.systems.rolling_disk.tasks.disk_roll import DiskRoll, DiskRollRandom, threshold
from tests.systems.runs import bound, run, still

G = 9.81
TASKS = {"DiskRoll": DiskRoll, "DiskRollRandom": DiskRollRandom}


# I1, I3 in m r^2, and the square of the threshold in g / r, as in the books
SHAPES = {"disc": (0.25, 0.5, 1.0 / 3.0), "hoop": (0.5, 1.0, 1.0 / 4.0)}


@pytest.mark.parametrize("name", TASKS)
def test_linear_feedback_leads_disks_round_their_circles_from_every_start(name):
    success = run(name, bound(circle_regulator)).success
    # one wheel of 3000 falls: its circle takes 2.8 of the 3 N m there are, just to be held
    assert success.all() if name == "DiskRoll" else success.mean() >= 0.99


@cache
def leans(shape, share):
    """Leans of free disks from 1e-6 rad, (T, N) in that unit, at a share of the threshold."""
    I1, I3, _ = SHAPES[shape]
    config = {"I1": I1, "I3": I3, "start_lean": 1e-6, "start_rate": 0.0, "n_substeps": 8}
    y = run("DiskRoll", still, n=20, start_speed=share, start_spread=0.0, **config).y
    lean = rolling(y).lean
    return lean / lean[0]


def linear_lean(shape, share):
    """The same, of the linear equation, from rest.

    ``(I1 + m r^2) x'' = m g r x - (I3 + m r^2) (I3 / I1) w3^2 (x - x_0)``.
    """
    I1, I3, square = SHAPES[shape]
    stiff = (I3 + 1.0) * I3 / I1 * share**2 * square * G
    rate = np.emath.sqrt((G - stiff) / (I1 + 1.0))
    middle = stiff / (stiff - G)
    return np.real(middle + (1.0 - middle) * np.cosh(rate * 0.05 * np.arange(401)))


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("share", [1.02, 1.1, 1.5])
def test_above_the_threshold_an_upright_disk_rolls_on(shape, share):
    expected = linear_lean(shape, share)
    assert np.max(np.abs(expected)) < 60.0
    # Leans up to 6e-5 rad: their square over the 4 % by which one stiffness exceeds the other, for
    # 20 s; and roundings of 1e-16 in leans of 1e-8 rad and more.
    np.testing.assert_allclose(leans(shape, share).T[:, :401], [expected] * 20, rtol=0, atol=1e-3)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("share", [0.98, 0.9, 0.5])
def test_below_the_threshold_it_falls(shape, share):
    found, expected = leans(shape, share), linear_lean(shape, share)
    small = np.abs(expected) < 1e3  # while the lean is below 0.001 rad
    np.testing.assert_allclose(found[small[: len(found)]].T, [expected[small]] * 20, rtol=2e-3)
    assert np.max(np.abs(found), axis=0).min() > 1e3


@pytest.mark.parametrize("shape", SHAPES)
def test_the_threshold_of_starts_is_that_of_the_books(shape):
    I1, I3, square = SHAPES[shape]
    assert threshold(G, I1, I3, 1.0) ** 2 == pytest.approx(square * G, rel=1e-15)
    envs = RigidVectorEnv(
        "rigid_envs.systems.rolling_disk.tasks:DiskRoll",
        50,
        I1=I1,
        I3=I3,
        start_speed=0.7,
        start_spread=0.0,
    )
    envs.reset(seed=0)
    np.testing.assert_allclose(envs.y[:, 6] ** 2, 0.49 * square * G, rtol=1e-14)


def test_a_lean_beyond_sixty_degrees_ends_the_episode():
    env = RigidEnv("rigid_envs.systems.rolling_disk.tasks:DiskRoll", dt=1e-4)
    for degrees, fallen in ((59.9, False), (60.1, True), (-59.9, False), (-60.1, True)):
        y = rolling_state(Rolling(np.radians(degrees), 0.0, 0.0, 1.0))
        env.reset(options={"state": y})
        _, _, terminated, _, info = env.step(np.zeros(1, dtype=np.float32))
        assert terminated == fallen
        assert not info["is_success"]


def test_the_observed_curvature_is_that_of_the_way_of_the_contact():
    """From three places of the contact, of a disk that rolls steadily under the torque it needs."""
    disk, lean, wn, w3 = RollingDisk(), 0.3, 0.9, 1.2
    y = rolling_state(Rolling(lean, 0.0, wn, w3))
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
