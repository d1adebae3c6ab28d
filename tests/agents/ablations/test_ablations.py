"""Variants of tasks with one half of a reduction: what differs, and that nothing else does."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents.ablations.page import markdown
from agents.ablations.plan import NAMES, PARTS, ablation
from agents.environments import make
from agents.sweeps.sweep import Processes, Training, train_all
from rigid_envs.scores.records import read_record


@pytest.fixture(autouse=True, scope="module")
def registered() -> None:
    """Not at the head of this file, which every process of the tests imports."""
    import agents.ablations.registration  # noqa: F401


# Every variant has kernels of its own, which take long to compile.
SOME = [NAMES[0], *(pytest.param(name, marks=pytest.mark.long) for name in NAMES[1:])]


def stepped(name: str, part: str) -> tuple[Any, Any, list[Any]]:
    """Names of the features, observations and rewards of 40 steps with the same actions."""
    config = ablation(name, part, 0)
    venv: Any = make(config.env_id, config.env_kwargs, 64)
    rng, seen, rewards = np.random.default_rng(0), [venv.reset(seed=3)[0]], []
    for _ in range(40):
        actions = rng.uniform(-1.0, 1.0, venv.action_space.shape).astype(np.float32)
        observations, reward, *_ = venv.step(actions)
        seen.append(observations)
        rewards.append(reward)
    venv.close()
    return [entry.symbol for entry in venv.task.observations()], np.array(seen), rewards


@pytest.mark.parametrize("name", SOME)
def test_features_alone_are_seen_beside_the_world_which_goes_on_as_it_is(name: str) -> None:
    (world, seen, rewards), (names, more, same) = stepped(name, "none"), stepped(name, "features")
    reduced = stepped(name, "all")[0]
    assert sorted(names) == sorted(world + reduced)
    np.testing.assert_array_equal(rewards, same)
    of_world = sorted(names.index(symbol) for symbol in world)
    np.testing.assert_array_equal(more[..., of_world], seen)


@pytest.mark.long
@pytest.mark.parametrize("name", SOME)
def test_the_frame_alone_shows_coordinates_of_the_motion_in_the_reduced_frame(name: str) -> None:
    (whole, seen, rewards), (few, less, same) = stepped(name, "all"), stepped(name, "frame")
    assert len(few) < len(whole)
    np.testing.assert_array_equal(rewards, same)
    np.testing.assert_array_equal(less, seen[..., [whole.index(symbol) for symbol in few]])


def test_variants_differ_in_what_they_are_named_for() -> None:
    configs = {part: ablation("BallPark", part, 1) for part in PARTS}
    assert {config.seed for config in configs.values()} == {1}
    assert len({config.total_timesteps for config in configs.values()}) == 1
    assert configs["schedule"].action_std and not configs["none"].action_std  # type: ignore[attr-defined]
    assert [configs[part].env_kwargs.get("frame", "world") for part in PARTS] == [
        *("world", "world", "world", "reduced", "reduced")
    ]


def test_a_variant_is_trained_and_recorded(tmp_path: Path) -> None:
    small = {"n_envs": 8, "n_steps": 8, "batch_size": 64, "total_timesteps": 128, "n_epochs": 1}
    config = ablation("BallPark", "frame", 0, log_dir=str(tmp_path), run_name="a", **small)
    workers = Processes(1, ["agents.ablations.registration"])
    assert train_all([Training(config, tmp_path / "frame", 20)], workers) == 0
    record = read_record(tmp_path / "frame" / "BallParkFrame-v0" / "ppo_reduced_0.json")
    assert record.env_id == "Ablations/BallParkFrame-v0" and record.efficiency is None
    page = markdown(tmp_path)
    assert "## BallPark, 128 steps" in page and "\n| frame | 1 | 0.0 % |" in page
    assert "| none |" not in page and "## AxisFlip" not in page


def test_the_page_is_what_the_records_say() -> None:
    docs = Path(__file__).parents[3] / "docs"
    assert (docs / "ablations.md").read_text(encoding="utf-8") == markdown(docs / "ablations")
