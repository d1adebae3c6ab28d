"""The pages of the satellites with reaction wheels are enough to rebuild them."""

import numpy as np
import pytest

from tests.from_pages.attitudes import compose, of_rotation_vector
from tests.from_pages.satellites import KINDS, DualSpin, TwoWheels, WheelReorient, WheelTrack
from tests.from_pages.side_by_side import Pair, in_frames

each = pytest.mark.parametrize(("kind", "frame"), in_frames(*KINDS))


@each
def test_episodes_from_rest_are_alike(kind, frame):
    rng, pair = np.random.default_rng(1), Pair(kind, frame=frame)
    for _ in range(3):
        pair.reset(rng)
        pair.shake(rng, 40)


@each
def test_wheels_that_are_full_do_the_same(kind, frame):
    small = {"capacity": 0.1} if kind is DualSpin else {}
    rng, pair = np.random.default_rng(2), Pair(kind, frame=frame, torque=0.3, **small)
    pair.reset(rng)
    outcomes = pair.run(lambda page, k: np.sign(np.sin(0.3 * k + np.arange(page.n_action))), 40)
    page = pair.page
    assert np.abs(page.stored(page.y)).max() > 0.95 * page.capacity and len(outcomes) > 10


@pytest.mark.parametrize(
    ("kind", "arguments"),
    [
        (WheelReorient, {"I1": (1.8, 2.2), "J2": (0.01, 0.02), "observe_params": True}),
        (WheelReorient, {"bias": 0.0, "dt": 0.5, "rotation": "quat", "weight_angle": 0.3}),
        (TwoWheels, {"I3": (2.8, 3.2), "J1": 0.1, "weight_rate": 2.0, "action_delay": 1}),
        (TwoWheels, {"capacity": 0.05, "torque": 0.1, "rotation": "none"}),
        (DualSpin, {"J1": (0.4, 0.6), "start_rate": 0.3, "rate_tolerance": 0.1, "action_delay": 2}),
        (WheelTrack, {"altitude": 4e5, "across": 1e6, "I2": (2.0, 2.5), "observe_params": True}),
        (WheelTrack, {"lead": 50.0, "bound": 0.2, "rotation": "rot6d", "start_angle": 1.0}),
    ],
)
def test_arguments_do_the_same(kind, arguments):
    rng, pair, clipped = np.random.default_rng(3), Pair(kind, **arguments), []
    for _ in range(2):
        pair.reset(rng)
        clipped += [outcome.info["action_clipped"] for outcome in pair.shake(rng, 20)]
    assert any(clipped) and not all(clipped)


@pytest.mark.parametrize(("kind", "frame"), in_frames(WheelReorient, TwoWheels))
def test_a_satellite_at_its_goal_is_alike(kind, frame):
    # with wheels at rest: else roundings decide with which signs their momenta are seen
    at_rest = {"bias": 0.0} if kind is WheelReorient else {}
    rng, pair = np.random.default_rng(4), Pair(kind, frame=frame, **at_rest)
    for angle in (0.0, 1e-9, 0.05):
        pair.reset(rng)
        state = pair.env.unwrapped.get_state()
        state["y"][:4] = compose(pair.page.aux, of_rotation_vector([0.0, angle, 0.0]))
        pair.env.unwrapped.set_state(state)
        pair.page.y[:4] = state["y"][:4]
        outcomes = [pair.step(np.zeros(kind.n_action))[0] for _ in range(2)]
        assert outcomes[1].info["is_success"]


@pytest.mark.parametrize(("kind", "frame"), in_frames(DualSpin))
def test_a_carrier_that_comes_to_rest_ends_the_episode_alike(kind, frame):
    rng, pair = np.random.default_rng(5), Pair(kind, frame=frame)
    n = np.array([1.0, 0.02, -0.01])
    for size in (1.0, -1.0):  # all of the momentum in the rotor, and L beside e1 or -e1
        L = size * n / np.linalg.norm(n)
        omega = np.array([0.004 * size, L[1] / 2.5, L[2] / 3.0])
        wheel = (L[0] - 1.5 * omega[0]) / 0.5 - omega[0]
        pair.reset(rng, [*compose([1, 0, 0, 0], [0.6, 0, 0.8, 0]), *omega, wheel, 0.0, 0.0])
        last = pair.shake(rng, 5)[-1]
        assert last.terminated and last.info["is_success"]


@pytest.mark.parametrize(("kind", "frame"), in_frames(WheelTrack))
def test_a_whole_pass_is_alike(kind, frame):
    rng, pair = np.random.default_rng(6), Pair(kind, frame=frame, lead=60.0)
    pair.reset(rng)
    assert len(pair.shake(rng, 120)) == 120
