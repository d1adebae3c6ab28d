"""The page of the tippe top is enough to rebuild it."""

import re

import numpy as np
import pytest

from tests.from_pages.model import pages_of
from tests.from_pages.side_by_side import Pair, environment, in_frames
from tests.from_pages.tippe_tops import TippeTop

LONG = pytest.mark.long
RANGES = {"I1": (0.37, 0.39), "mu": (0.5, 0.7), "offset": (0.28, 0.32)}
each_frame = pytest.mark.parametrize(("kind", "frame"), in_frames(TippeTop))


def leaning(tilt, omega, velocity=(0.0, 0.0)):
    """A state that leans towards -y."""
    return np.array([np.cos(tilt / 2), np.sin(tilt / 2), 0, 0, *omega, 0, 0, *velocity])


@each_frame
def test_any_state_does_the_same(kind, frame):
    rng, pair = np.random.default_rng(1), Pair(kind, frame=frame)
    for size in (0.5, 2.0, 4.0):
        y = rng.normal(size=11)
        y[:4] /= np.linalg.norm(y[:4])
        y[4:7] *= size
        pair.reset(rng, y)
        pair.shake(rng, 10)


@pytest.mark.parametrize(
    "arguments",
    [
        {"rotation": "rot6d", "dt": 0.1},
        {"rotation": "euler", "observe_params": True, **RANGES},
        {"rotation": "none", "m": 1.2, "radius": 1.1, "g": 9.0, "slip_speed": 1.5, "drag": 0.05},
        pytest.param(
            {"frame": "reduced", "observe_params": True, **RANGES}, marks=pytest.mark.long
        ),
        pytest.param({"rotation": "quat", "action_delay": 2}, marks=pytest.mark.long),
    ],
)
def test_arguments_do_the_same(arguments):
    rng, pair, clipped = np.random.default_rng(2), Pair(TippeTop, **arguments), []
    for _ in range(2):
        pair.reset(rng)
        clipped += [outcome.info["action_clipped"] for outcome in pair.shake(rng, 15)]
    assert any(clipped) and not all(clipped)


@each_frame
def test_limits_and_edges_are_alike(kind, frame):
    rng, pair = np.random.default_rng(3), Pair(kind, frame=frame)
    for tilt in (0.0, 1e-7, 0.3, 1.6, np.pi):
        for omega in ((33.0, -35.0, 32.0), (-33.0, 35.0, -32.0), (1.0, 0.0, 34.0)):
            pair.reset(rng, leaning(tilt, omega, (35.0, -31.0)))  # too fast to step so exactly
    pair.reset(rng, leaning(0.0, (0.0, 0.0, 4.0)))
    pair.step(np.zeros(1))


@pytest.mark.parametrize("hold", [0.0, 0.3, 1.0])
def test_a_spin_on_the_head_is_a_success_after_the_hold_time(hold):
    rng, pair = np.random.default_rng(4), Pair(TippeTop, hold=hold, weight_effort=0.5)
    pair.reset(rng, leaning(np.pi - 0.2, (0.0, 0.0, -9.0)))
    successes = [outcome.info["is_success"] for outcome in pair.run(lambda *_: np.zeros(1), 8)]
    assert successes.index(True) == {0.0: 0, 0.3: 1, 1.0: 4}[hold] and successes[-1]


def test_a_motion_that_becomes_too_fast_ends():
    pair = Pair(TippeTop, within=1e-3, n_substeps=14)
    pair.reset(np.random.default_rng(5), leaning(0.3, (0.0, 0.0, 47.0)))
    outcomes = pair.run(lambda *_: np.ones(1), 30)
    assert outcomes[-1].info["physics_error"] and outcomes[-1].reward == 0.0


def test_default_substeps_do_nearly_the_same():
    # fourth order: (0.5 rad in a step)^4, 6 rad/s for 3 s
    pair = Pair(TippeTop, within=0.5**4 * 18.0 * 1e-3, n_substeps=14)
    rng = np.random.default_rng(6)
    pair.reset(rng)
    pair.shake(rng, 15)


def test_episodes_end_when_the_page_says():
    n = int(re.findall(r"After (\d+) steps", "".join(pages_of("TippeTop.md")))[-1])
    env = environment("TippeTop")
    env.reset(seed=0)
    ends = [env.step(np.zeros(1, np.float32))[2:4] for _ in range(n)]
    assert not any(any(end) for end in ends[:-1]) and ends[-1] == (False, True)
