"""What rolls knows no preferred direction, hand, size or direction of time.

Each symmetry is a table of factors: of the entries of a state, of the inputs, and of the parameters
that it changes. The steps are the same ones, so only roundings differ, and what the motion makes
of them.
"""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rigid_envs.mechanics import rotations
from rigid_envs.systems.dynamic_ball.system import DynamicBall
from rigid_envs.systems.roller.system import Roller
from rigid_envs.systems.rolling_disk.system import RollingDisk
from rigid_envs.systems.upright_coin.system import UprightCoin
from tests.verification.measures import random_attitude

T = np.linspace(0.0, 3.0, 16)
STEP = 0.005
SEEDS = range(3)
BAR = 1e-10
BALL = DynamicBall(m=1.2, radius=0.4, beta=0.55, g=9.6, turntable_rate=0.9)
DISK = RollingDisk(m=1.1, radius=0.6, I1=0.13, I3=0.2, g=9.5)
COIN = UprightCoin(m=1.1, radius=0.6, I1=0.13, I3=0.2, g=9.5, slope=0.2)
ROLLER = Roller(m=1.1, radius=0.3, beta=0.45, g=9.5, slope=0.4, curvature=0.5)
SYSTEMS = (BALL, DISK, COIN, ROLLER)
each_system = pytest.mark.parametrize("system", SYSTEMS, ids=lambda system: type(system).__name__)
each_seed = pytest.mark.parametrize("seed", SEEDS)


@dataclass(frozen=True)
class Symmetry:
    """Factors of state, input and parameters, and of time."""

    state: tuple[float, ...]
    inputs: tuple[float, ...]
    parameters: tuple[tuple[str, float], ...] = ()
    time: float = 1.0

    def of(self, system):
        factors = dict(self.parameters)
        return replace(system, **{name: getattr(system, name) * factors[name] for name in factors})


SAME = (1.0, 1.0, 1.0, 1.0)
# In the mirror y -> -y of world and body R becomes M R M, vectors of rotation change the other
# signs; torques about n and e3 change, that about l = e3 x n does not. The roller's is x -> -x.
FLIPPED = (1.0, -1.0, 1.0, -1.0)
MIRRORED = {
    BALL: Symmetry(
        (*FLIPPED, 1.0, -1.0, 1.0, -1.0, -1.0, -1.0, 1.0, -1.0, 1.0),
        (1.0, -1.0, -1.0, 1.0),
        (("turntable_rate", -1.0),),
    ),
    DISK: Symmetry((*FLIPPED, -1.0, 1.0, -1.0, 1.0, -1.0), (-1.0, 1.0, -1.0)),
    COIN: Symmetry((*FLIPPED, 1.0, -1.0, -1.0, -1.0), (-1.0, -1.0)),
    ROLLER: Symmetry((-1.0, -1.0), (-1.0, 1.0), (("slope", -1.0),)),
}
REVERSED = {
    BALL: Symmetry(
        (*SAME, 1.0, 1.0, -1.0, -1.0, -1.0, 1.0, 1.0, -1.0, -1.0),
        SAME,
        (("turntable_rate", -1.0),),
    ),
    DISK: Symmetry((*SAME, -1.0, -1.0, -1.0, 1.0, 1.0), (1.0, 1.0, 1.0)),
    COIN: Symmetry((*SAME, 1.0, 1.0, -1.0, -1.0), (1.0, 1.0)),
    ROLLER: Symmetry((1.0, -1.0), (1.0, 1.0)),
}
# Four times as large takes twice the time in the same gravity.
LARGER = {
    BALL: Symmetry(
        (*SAME, 4.0, 4.0, 2.0, 2.0, 0.5, 1.0, 1.0, 0.5, 0.5),
        (1.0, 1.0, 0.25, 0.25),
        (("radius", 4.0), ("turntable_rate", 0.5)),
        2.0,
    ),
    DISK: Symmetry(
        (*SAME, 0.5, 0.5, 0.5, 4.0, 4.0),
        (4.0, 4.0, 4.0),
        (("radius", 4.0), ("I1", 16.0), ("I3", 16.0)),
        2.0,
    ),
    COIN: Symmetry(
        (*SAME, 4.0, 4.0, 0.5, 0.5),
        (4.0, 4.0),
        (("radius", 4.0), ("I1", 16.0), ("I3", 16.0)),
        2.0,
    ),
    ROLLER: Symmetry((4.0, 2.0), (1.0, 1.0), (("radius", 4.0), ("curvature", 0.25)), 2.0),
}
HEAVIER = {
    BALL: Symmetry((1.0,) * 13, (3.0, 3.0, 1.0, 1.0), (("m", 3.0),)),
    DISK: Symmetry((1.0,) * 9, (3.0,) * 3, (("m", 3.0), ("I1", 3.0), ("I3", 3.0))),
    COIN: Symmetry((1.0,) * 8, (3.0,) * 2, (("m", 3.0), ("I1", 3.0), ("I3", 3.0))),
    ROLLER: Symmetry((1.0,) * 2, (3.0, 1.0), (("m", 3.0),)),
}


def close(found, expected):
    np.testing.assert_allclose(found, expected, rtol=0, atol=BAR)


def start(system, seed):
    """A state in motion and inputs held over each interval of T."""
    rng = np.random.default_rng([36, seed])
    y = rng.normal(size=len(system.state_entries))
    u = rng.uniform(-0.3, 0.3, (len(T) - 1, len(system.input_entries)))
    phi, lean, psi = rng.uniform(-3.0, 3.0, 3) * [1.0, 0.1, 1.0]
    if system is BALL:
        y[:4] = random_attitude(rng)
        y[9:] *= 0.2
    elif system is DISK:
        y[:4] = rotations.quaternion_from_euler((phi, 0.5 * np.pi + lean, psi))
        y[6] += 6.0
    elif system is COIN:
        y[:4] = system.attitude(phi, psi)
    elif system is ROLLER:
        u[:, 1] = np.abs(u[:, 1])
    return y, u, rng


def check(system, seed, symmetry):
    y, u, _ = start(system, seed)
    other, factors = symmetry.of(system), np.array(symmetry.state)
    one = system.simulate(y, T, u, max_step=STEP)
    times, inputs = symmetry.time * T, np.array(symmetry.inputs) * u
    two = other.simulate(factors * y, times, inputs, max_step=symmetry.time * STEP)
    close(factors * one.y, two.y)


@each_seed
@each_system
def test_in_the_mirror_everything_rolls_as_it_should(system, seed):
    check(system, seed, MIRRORED[system])


@each_seed
@each_system
def test_four_times_as_large_takes_twice_the_time(system, seed):
    check(system, seed, LARGER[system])


@each_seed
@each_system
def test_heavier_and_harder_pushed_in_proportion_rolls_the_same(system, seed):
    check(system, seed, HEAVIER[system])


@each_seed
@each_system
def test_with_all_velocities_reversed_the_motion_goes_back(system, seed):
    y, u, _ = start(system, seed)
    symmetry = REVERSED[system]
    factors = np.array(symmetry.state)
    forth = system.simulate(y, T, u, max_step=STEP)
    back = symmetry.of(system).simulate(factors * forth.y[-1], T, u[::-1], max_step=STEP)
    close(factors * back.y[::-1], forth.y)


def turned(system, y, angle):
    """The state in a world that is turned about the vertical."""
    turn = Rotation.from_rotvec((0.0, 0.0, angle))
    plane = turn.as_matrix()[:2, :2]
    z = y.copy()
    q = turn * Rotation.from_quat(y[:4], scalar_first=True)
    z[:4] = q.as_quat(scalar_first=True)
    for name in ("position", "velocity", "contact"):
        if name in system.components:
            where = system.components[name]
            z[where] = plane @ y[where]
    return z, turn.as_matrix(), plane


@each_seed
@pytest.mark.parametrize(
    "system", [BALL, DISK, replace(COIN, slope=0.0)], ids=["ball", "disk", "coin"]
)
def test_a_level_world_turned_about_the_vertical_turns_what_rolls_on_it(system, seed):
    known = COIN if isinstance(system, UprightCoin) else system
    (y, u, rng), v = start(known, seed), None
    if system is BALL:
        y[9:], u[:, 2:] = 0.0, 0.0  # a level plate that stays so
    z, turn, plane = turned(system, y, rng.uniform(0.0, 6.0))
    v = np.hstack([u[:, :2] @ plane.T, u[:, 2:]]) if system is BALL else u
    one, two = system.simulate(y, T, u), system.simulate(z, T, v)
    close(turn @ one["R"], two["R"])
    close(one["omega_world"] @ turn.T, two["omega_world"])
    for name in ("position", "velocity", "contact"):
        if name in system.components:
            close(one[name] @ plane.T, two[name])


@each_seed
def test_marks_on_the_ball_do_not_matter_to_its_rolling(seed):
    y, u, rng = start(BALL, seed)
    marks = Rotation.from_quat(random_attitude(rng), scalar_first=True)
    other = y.copy()
    other[:4] = (Rotation.from_quat(y[:4], scalar_first=True) * marks).as_quat(scalar_first=True)
    one, two = BALL.simulate(y, T, u), BALL.simulate(other, T, u)
    np.testing.assert_array_equal(one.y[:, 4:], two.y[:, 4:])
    close(one["R"] @ marks.as_matrix(), two["R"])


@each_seed
def test_marks_on_the_disk_do_not_matter_to_its_rolling(seed):
    y, u, rng = start(DISK, seed)
    marks = Rotation.from_rotvec((0.0, 0.0, rng.uniform(0.0, 6.0)))
    other = y.copy()
    other[:4] = (Rotation.from_quat(y[:4], scalar_first=True) * marks).as_quat(scalar_first=True)
    other[4:7] = marks.inv().apply(y[4:7])
    one, two = DISK.simulate(y, T, u), DISK.simulate(other, T, u)
    close(one["R"] @ marks.as_matrix(), two["R"])
    close(one["omega_world"], two["omega_world"])
    close(one["contact"], two["contact"])


@each_seed
def test_a_disk_turned_over_is_the_same_disk(seed):
    # Half a turn about n: e3 becomes -e3, l becomes -l, and so the torques about them.
    y, u, _ = start(DISK, seed)
    R = Rotation.from_quat(y[:4], scalar_first=True)
    half = Rotation.from_rotvec(np.pi * R.inv().apply(DISK.radius_up(y)))
    other = y.copy()
    other[:4] = (R * half).as_quat(scalar_first=True)
    other[4:7] = half.inv().apply(y[4:7])
    one, two = DISK.simulate(y, T, u), DISK.simulate(other, T, u * [1.0, -1.0, -1.0])
    close(one["omega_world"], two["omega_world"])
    close(one["centre"], two["centre"])
    close(one["contact_force"], two["contact_force"])
