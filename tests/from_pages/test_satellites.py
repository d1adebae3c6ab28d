"""The pages of the satellites with reaction wheels are enough to rebuild them."""

import numpy as np
import pytest

from tests.from_pages.attitudes import compose, of_rotation_vector
from tests.from_pages.satellites import KINDS, TwoWheels, WheelReorient
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
    rng, pair = np.random.default_rng(2), Pair(kind, frame=frame, torque=0.3)
    pair.reset(rng)
    outcomes = pair.run(lambda page, k: np.sign(np.sin(0.3 * k + np.arange(page.n_action))), 40)
    assert np.abs(pair.page.stored(pair.page.y)).max() > 0.39 and len(outcomes) == 40


@pytest.mark.parametrize(
    ("kind", "arguments"),
    [
        (WheelReorient, {"I1": (1.8, 2.2), "J2": (0.01, 0.02), "observe_params": True}),
        (WheelReorient, {"bias": 0.0, "dt": 0.5, "rotation": "quat", "weight_angle": 0.3}),
        (TwoWheels, {"I3": (2.8, 3.2), "J1": 0.1, "weight_rate": 2.0, "action_delay": 1}),
        (TwoWheels, {"capacity": 0.05, "torque": 0.1, "rotation": "none"}),
    ],
)
def test_arguments_do_the_same(kind, arguments):
    rng, pair, clipped = np.random.default_rng(3), Pair(kind, **arguments), []
    for _ in range(2):
        pair.reset(rng)
        clipped += [outcome.info["action_clipped"] for outcome in pair.shake(rng, 20)]
    assert any(clipped) and not all(clipped)


@each
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
