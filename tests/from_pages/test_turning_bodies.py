"""What the pages of the free body and of the top promise alike."""

import re
from collections.abc import Iterator
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from tests.from_pages import test_bodies, test_tops
from tests.from_pages.episodes import Page
from tests.from_pages.rolling import PAGES
from tests.from_pages.side_by_side import Pair, noise

KINDS = [*test_bodies.KINDS, *test_tops.KINDS]
each = pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)


def is_top(kind: type[Page]) -> bool:
    return kind in test_tops.KINDS


def cases() -> Iterator[Any]:
    """Pages and arguments; delays, which are kernels of their own, of the first body and top."""
    for kind in KINDS:
        ranges = {"I1": (0.9, 1.1), "I2": (1.5, 1.7), "I3": (2.1, 2.3)}
        others = {"rotation": "matrix", "I1": 1.3, "I2": 1.8}
        if is_top(kind):
            ranges = {"I3": (0.45, 0.6), "g": (9.0, 10.0)}
            others = {"rotation": "none", "m": 1.1, "I3": 0.52}
        first = kind in (test_bodies.KINDS[0], test_tops.KINDS[0])
        for arguments, is_long in (
            ({"rotation": "rot6d", "dt": 0.04}, False),
            ({"rotation": "quat"}, False),
            ({"rotation": "euler", "observe_params": True, **ranges}, False),
            (others, False),
            ({"frame": "reduced", "observe_params": True, **ranges}, False),
            ({"rotation": "quat", "action_delay": 3}, not first),
            ({"frame": "reduced", "action_delay": 1, "rotation": "quat"}, True),
        ):
            yield pytest.param(kind, arguments, marks=[pytest.mark.long] * is_long)


@pytest.mark.parametrize(("kind", "arguments"), list(cases()))
def test_arguments_do_the_same(kind: type[Page], arguments: dict[str, Any]) -> None:
    rng, pair = np.random.default_rng(3), Pair(kind, **arguments)
    for _ in range(2):
        pair.reset(rng)
        pair.run(lambda page, k: noise(rng, page), 15)


@each
def test_default_substeps_do_nearly_the_same(kind: type[Page]) -> None:
    rng, page, rate = np.random.default_rng(2), kind(), 6.0 if is_top(kind) else 4.0
    # Fourth order: (rate times step)^4 per radian that it turns, at the largest rate [rad/s].
    step = rate * page.dt / page.n_substeps
    pair = Pair(kind, within=step**4 * rate * 30 * page.dt, n_substeps=page.n_substeps)
    pair.reset(rng)
    pair.run(lambda page, k: noise(rng, page), 30)


@each
def test_episodes_end_when_the_page_says(kind: type[Page]) -> None:
    (n,) = re.findall(r"After (\d+) steps", (PAGES / f"{kind.__name__}.md").read_text())
    env = gym.make(f"RigidEnvs/{kind.__name__}-v0")
    upright = {"state": {"q": [1, 0, 0, 0], "omega_body": [0, 0, 6]}}
    env.reset(seed=5, options=upright if is_top(kind) else None)
    ends = [env.step(np.zeros(kind.controls, np.float32))[2:4] for _ in range(int(n))]
    assert not any(any(end) for end in ends[:-1])
    assert ends[-1] == (False, True)


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
    name, ours = f"RigidEnvs/{kind.__name__}-v0", kind.defaults()
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
