"""What the pages of the free body and of the top promise alike."""

import gymnasium as gym
import numpy as np
import pytest

from tests.from_pages import test_bodies, test_tops
from tests.from_pages.episodes import Page
from tests.from_pages.side_by_side import Pair, noise

KINDS = [*test_bodies.KINDS, *test_tops.KINDS]
each = pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)


@each
@pytest.mark.parametrize("seed", [0, 1])
def test_random_actions_do_the_same(kind: type[Page], seed: int) -> None:
    rng, pair = np.random.default_rng(seed), Pair(kind)
    pair.reset(rng)
    outcomes = pair.run(lambda page, k: noise(rng, page), 40)
    clipped = [outcome.info["action_clipped"] for outcome in outcomes]
    assert any(clipped) and not all(clipped)


@each
def test_defaults_are_those_of_the_page(kind: type[Page]) -> None:
    name, ours = f"RigidEnvs/{kind.__name__}-v0", kind.SETTINGS
    envs = [gym.make(name), gym.make(name, **ours)]
    for env in envs:
        env.reset(seed=21)
    for _ in range(10):
        action = np.full(kind.controls, 0.5, np.float32)
        rewards = [env.step(action)[1] for env in envs]
        assert rewards[0] == rewards[1]
        assert np.array_equal(*(env.unwrapped.y for env in envs))  # to the bit


@pytest.mark.long
@each
@pytest.mark.parametrize("frame", ["world", "reduced"])
def test_longer_episodes_do_the_same(kind: type[Page], frame: str) -> None:
    pair = Pair(kind, frame=frame)
    for seed in range(10):
        rng = np.random.default_rng(100 + seed)
        pair.reset(rng)
        pair.run(lambda page, k, rng=rng: noise(rng, page), 100)
