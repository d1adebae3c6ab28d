"""Turning a satellite by its wheels: by three from rest to rest, and by two."""

import numpy as np
import pytest

from rigid_envs.base.checks import ConfigError
from rigid_envs.mechanics import rotations
from rigid_envs.systems.gyrostat import references
from rigid_envs.systems.gyrostat.controllers import EigenaxisSlew, ThreeTurns
from rigid_envs.systems.gyrostat.system import Gyrostat
from rigid_envs.systems.gyrostat.tasks.wheel_reorient import TwoWheels, WheelReorient
from tests.systems.runs import at_random, bound, rows, run

REFERENCES = {"WheelReorient": references.eigenaxis, "TwoWheels": references.three_turns}
SATELLITE = Gyrostat(2.0, 2.5, 3.0, 0.001, 0.001, 0.001)
PAIR = Gyrostat(2.0, 2.5, 3.0, 0.001, 0.001)
LIMITS = {"torque": 0.02, "capacity": 0.4, "dt": 1.0}


@pytest.mark.parametrize("name", REFERENCES)
def test_the_reference_reaches_every_goal(name):
    assert run(name, bound(REFERENCES[name]), 200).success.all()


@pytest.mark.parametrize(("name", "satellite"), [("WheelReorient", SATELLITE), ("TwoWheels", PAIR)])
def test_motors_keep_the_angular_momentum_and_wheels_their_capacity(name, satellite):
    y = run(name, at_random(1), 50, torque=0.2).y
    L = satellite.L_world(y)
    np.testing.assert_allclose(L, np.broadcast_to(L[0], L.shape), rtol=0, atol=1e-13)
    stored = np.abs(satellite.spin_momenta(y))
    assert stored.max() == pytest.approx(0.4, rel=1e-12)
    assert (stored > 0.399).any(axis=(0, 1)).sum() == (3 if name == "WheelReorient" else 2)


@pytest.mark.parametrize("name", REFERENCES)
def test_no_rate_is_above_the_bound(name):
    envs = rows(f"gyrostat.tasks:{name}", 100, torque=0.5)
    envs.reset(seed=2)
    most = envs.task.largest_rate(np.inf)
    for step in range(60):
        envs.step(np.full(envs.action_space.shape, 1.0 if step % 7 < 4 else -1.0, np.float32))
        rates = [system.rate(y) for system, y in zip(envs.systems, envs.y, strict=True)]
        assert np.max(rates) <= most


def test_a_full_wheel_gives_no_torque_and_a_nearly_full_one_what_fills_it():
    envs = rows("gyrostat.tasks:WheelReorient", 3, bias=0.0)
    state = envs.get_state()
    filled = np.array([[0.4, 0.39, 0.3], [-0.4, -0.39, 0.0], [0.1, 0.2, 0.3]])
    state["y"][:, 4:7], state["y"][:, 7:] = 0.0, filled / 0.001
    envs.set_state(state)
    envs.step(np.array([[1, 1, 1], [-1, -1, 1], [1, -1, -1]], np.float32))
    after = SATELLITE.spin_momenta(envs.y)
    expected = [[0.4, 0.4, 0.32], [-0.4, -0.4, 0.02], [0.12, 0.18, 0.28]]
    np.testing.assert_allclose(after, expected, rtol=0, atol=1e-12)


def test_two_wheels_never_turn_the_carrier_about_the_third_axis():
    y = run("TwoWheels", at_random(3), 50).y
    np.testing.assert_allclose(y[..., 6], 0.0, rtol=0, atol=1e-15)
    assert np.abs(y[..., 4:6]).max() > 0.05


def slewed(law, angle, axis, satellite, wheels):
    """Times [s] that a satellite takes to rest at a turn about an axis, with wheels at rest."""
    goal = np.zeros((1, 4))
    goal[0, [0, 1 + axis]] = np.cos(0.5 * angle), np.sin(0.5 * angle)
    y = satellite.state(q=np.array([[1.0, 0.0, 0.0, 0.0]]))
    for n in range(200):
        at_rest = np.abs(satellite.omega_body(y)).max() < 1e-3
        if at_rest and rotations.distance(y[:, :4], goal)[0] < 1e-2:
            return n * LIMITS["dt"]
        u = law.inputs(law(y, goal))
        assert np.abs(u[:, :wheels]).max() <= LIMITS["torque"]
        y = satellite.advance(y, u, LIMITS["dt"], 4)
    return np.inf


@pytest.mark.parametrize("angle", [0.3, -1.0, 2.0])
@pytest.mark.parametrize("axis", [0, 1])
def test_a_turn_about_the_axis_of_a_wheel_is_nearly_as_fast_as_its_motor_allows(axis, angle):
    A = SATELLITE.carrier_moments[axis]
    least = 2.0 * np.sqrt(A * abs(angle) / LIMITS["torque"])
    slews = {
        "three": slewed(EigenaxisSlew(SATELLITE, **LIMITS, braking=1.0), angle, axis, SATELLITE, 3),
        "two": slewed(ThreeTurns(PAIR, **LIMITS), angle, axis, PAIR, 2),
    }
    # rates are chosen for whole periods, so that braking begins up to two of them earlier
    for time in slews.values():
        assert least - 1.5 <= time <= least + 4.0


def test_wheels_that_begin_beyond_their_capacity_are_refused():
    with pytest.raises(ConfigError, match=r"config\.bias: bias = 0\.5; expected at most capacity"):
        WheelReorient(bias=0.5)


def test_a_wheel_as_heavy_as_the_whole_is_refused():
    with pytest.raises(ConfigError, match=r"config\.J2: J2 = 2\.5; expected less than I2 = 2\.5"):
        TwoWheels(J2=2.5)
