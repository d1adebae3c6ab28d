"""States of named angles and rates: what they say is measured on the motion that they begin."""

import gymnasium as gym
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.refusals import refuses
from tests.systems.examples import BALL, BODY, COIN, DISK, PLATE, ROLLER, TOP, name_of

ANGLES = {"azimuth": 0.4, "tilt": 1.2, "phase": -0.7}
RATES = {"precession": 0.3, "nutation": -0.2, "spin": 1.5}
H = 1e-4  # s, between two readings: differences are exact to 1e-7


def rotation(system, y):
    return Rotation.from_quat(system.accessors["q"](y), scalar_first=True)


def beside(system, y):
    """Attitudes just before and just after a state."""
    return [rotation(system, system.advance(y, None, h)) for h in (-H, H)]


@pytest.mark.parametrize("system", [BODY, TOP, DISK], ids=name_of)
def test_angles_are_those_of_scipy_and_rates_those_of_the_motion(system):
    y = system.state(**ANGLES, **RATES)
    before, after = beside(system, y)
    np.testing.assert_allclose(rotation(system, y).as_euler("ZXZ"), [*ANGLES.values()], rtol=1e-14)
    phi, theta, _ = (after.as_euler("ZXZ") - before.as_euler("ZXZ")) / (2.0 * H)
    turned = (before.inv() * after).as_rotvec() / (2.0 * H)  # mean omega, body axes
    np.testing.assert_allclose([phi, theta, turned[2]], [*RATES.values()], atol=1e-6)


@pytest.mark.parametrize("system", [BODY, TOP, DISK], ids=name_of)
def test_angles_and_rates_broadcast_together_and_what_is_left_out_is_at_rest(system):
    y = system.state(azimuth=[0.1, 0.2, 0.3], spin=[[1.0], [2.0]])
    assert y.shape == (2, 3, len(system.state_entries))
    for j, spin in enumerate((1.0, 2.0)):
        for k, azimuth in enumerate((0.1, 0.2, 0.3)):
            one = system.state(azimuth=azimuth, spin=spin, precession=0.0)
            np.testing.assert_array_equal(y[j, k], one)
    np.testing.assert_array_equal(system.omega_body(y)[..., 2], [[1.0] * 3, [2.0] * 3])


def test_an_upright_top_spins_and_a_disk_leans_as_they_are_told():
    np.testing.assert_array_equal(TOP.state(spin=6.0), TOP.state(omega_body=[0.0, 0.0, 6.0]))
    np.testing.assert_allclose(DISK.tilt(DISK.state(lean=-0.3, spin=4.0)), 0.5 * np.pi - 0.3)
    height = DISK.centre(DISK.state(lean=[0.3, -0.3]))[:, 2]
    np.testing.assert_allclose(height, DISK.radius * np.cos(0.3), rtol=1e-15)


def test_rates_belong_to_the_attitude_that_q_says():
    q = TOP.state(**ANGLES)[:4]
    np.testing.assert_allclose(TOP.state(q=q, **RATES), TOP.state(**ANGLES, **RATES), atol=1e-15)


def test_a_coin_rolls_where_it_heads():
    y = COIN.state(heading=0.8, phase=0.3, contact=(1.0, 2.0), roll_rate=2.0)
    moved = COIN.contact(COIN.advance(y, None, 1e-3)) - (1.0, 2.0)
    np.testing.assert_allclose(moved / np.hypot(*moved), [-np.cos(0.8), -np.sin(0.8)], atol=1e-2)
    assert COIN.phase(y) == pytest.approx(0.3)
    np.testing.assert_array_equal(COIN.state(heading=0.8)[4:], 0.0)


@pytest.mark.parametrize("ball", [BALL, PLATE], ids=name_of)
def test_a_ball_is_turned_by_its_rotation_vector(ball):
    turn = [[0.3, -1.1, 0.4], [0.0, 0.0, 0.0]]
    y = ball.state(rotation_vector=turn, position=(0.2, 0.1))
    np.testing.assert_allclose(ball.accessors["R"](y), Rotation.from_rotvec(turn).as_matrix(),
                               atol=1e-15)  # fmt: skip
    np.testing.assert_array_equal(ball.position(y), [[0.2, 0.1]] * 2)


def test_a_start_of_an_environment_is_named_by_components_alone():
    """What is left out of it is drawn: of a tilt alone it is not said what that would be."""
    env = gym.make("RigidEnvs/SleepingTop-v0")
    with pytest.raises(ValueError, match=r"component of the state = 'tilt'; expected some of"):
        env.reset(options={"state": {"tilt": 0.3}})


@pytest.mark.parametrize(
    ("system", "given", "complaint"),
    [
        (TOP, {"tlit": 0.3}, r"^component = 'tlit'; expected one of .*: did you mean 'tilt'\?"),
        (DISK, {"leen": 0.3}, r"did you mean 'lean'\?"),
        (ROLLER, {"arc": 0.3}, r"did you mean 'arc_length'\?"),
        (TOP, {"tilt": 35.0}, r"^tilt = 35\.0; expected an angle from 0 to pi rad: np\.radians"),
        (TOP, {"spin": np.nan}, r"^spin = nan; expected finite"),
        (TOP, {"tilt": 0.3, "q": [1, 0, 0, 0]}, r"^q = .*; expected none beside tilt"),
        (BODY, {"spin": 1.0, "omega_body": [0, 0, 1]}, r"^omega_body = .*none beside spin"),
        (DISK, {"lean": 1.6}, r"^lean = 1\.6; expected an angle between -pi/2 and pi/2"),
        (DISK, {"lean": 0.1, "tilt": 1.0}, r"^tilt = 1\.0; expected none beside lean"),
        (COIN, {"heading": 1.0, "q": [1, 0, 0, 0]}, r"^q = .*none beside heading"),
        (BALL, {"rotation_vector": [1, 2]}, r"^rotation_vector has shape \(2,\)"),
        (PLATE, {"rotation_vector": [0, 0, 1], "q": [1, 0, 0, 0]}, r"none beside rotation_vector"),
    ],
)  # fmt: skip
def test_what_no_state_has_is_refused_by_name(system, given, complaint):
    refuses(complaint, system.state, **given)
