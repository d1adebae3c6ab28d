"""Every environment is trained in the reduced frame where it has a recipe, else as before."""

from pathlib import Path
from typing import Any

import pytest

from agents.config.reading import config_for, frame_of, read_yaml, recipe_for

REDUCED = sorted((Path(__file__).parents[3] / "configs").glob("*_reduced_*.yaml"))
BALL_PARK, REORIENT = "RigidEnvs/BallPark-v0", "RigidEnvs/Reorient-v0"


@pytest.mark.parametrize("path", REDUCED, ids=lambda path: path.stem)
def test_a_reduced_recipe_is_what_its_environment_is_trained_with(path: Path) -> None:
    values = read_yaml(path)
    assert values["env_kwargs"]["frame"] == "reduced"
    assert values["algo"] == path.stem.rsplit("_", 1)[1]
    assert recipe_for(values["env_id"], values["algo"]) == values
    assert recipe_for(values["env_id"])["env_kwargs"]["frame"] == "reduced"


@pytest.mark.parametrize(
    ("env_id", "algo", "frame", "expected"),
    [
        (BALL_PARK, None, None, ("ppo", "reduced")),
        (BALL_PARK, None, "reduced", ("ppo", "reduced")),
        (BALL_PARK, None, "world", ("ppo", None)),
        (BALL_PARK, "ppo", None, ("ppo", "reduced")),
        (BALL_PARK, "sac", None, ("sac", "reduced")),
        (BALL_PARK, "sac", "world", ("sac", None)),
        ("SleepingTop", "sac", None, ("sac", None)),  # has no config for SAC
        ("SleepingTop", "sac", "reduced", ("sac", "reduced")),
    ],
)
def test_the_recipe_is_that_of_the_frame_and_the_algorithm(
    env_id: str, algo: str | None, frame: str | None, expected: tuple[str, str | None]
) -> None:
    values = recipe_for(env_id, algo, frame)
    assert (values["algo"], values.get("env_kwargs", {}).get("frame")) == expected


def test_an_algorithm_without_a_config_has_the_rewards_and_the_period_of_another_one() -> None:
    ppo, sac = (recipe_for("SleepingTop", algo, "reduced") for algo in ("ppo", "sac"))
    for key in ("env_id", "env_kwargs", "train_kwargs", "cost_price", "success_bonus"):
        assert sac[key] == ppo[key]
    assert config_for("SleepingTop", sac).total_timesteps == 200_000  # the default of SAC
    assert "cost_price" not in recipe_for("SleepingTop", "sac", "world")


@pytest.mark.parametrize(
    ("env_id", "frame", "algo"),
    [
        ("RigidEnvs/BallParkGoal-v0", None, "ppo"),
        ("RigidEnvs/BallParkGoal-v0", "world", "sac"),
        (REORIENT, "world", "sac"),
        (REORIENT, "reduced", "ppo"),
        ("RigidEnvs/BallGrid-v0", "world", "dqn"),
    ],
)
def test_hindsight_is_for_goals_in_the_frame_of_the_world(
    env_id: str, frame: str | None, algo: str
) -> None:
    assert recipe_for(env_id, None, frame)["algo"] == algo


@pytest.mark.parametrize(
    ("entries", "keywords", "frame"),
    [
        ({}, {}, None),
        ({"seed": 3}, {"radius": 1.0}, None),
        ({}, {"frame": "world"}, "world"),
        ({"env_kwargs": {"radius": 1.0}}, {}, "world"),
        ({"env_kwargs": {"frame": "reduced"}}, {}, "reduced"),
        ({"env_kwargs": {"frame": "reduced"}}, {"frame": "world"}, "world"),
        ({"env_kwargs": 3}, {}, "world"),  # refused where the config is made
    ],
)
def test_what_is_said_of_the_frame_chooses_the_recipe(
    entries: dict[str, Any], keywords: dict[str, Any], frame: str | None
) -> None:
    assert frame_of(entries, keywords) == frame


def test_a_config_has_the_recipe_of_its_own_frame() -> None:
    assert config_for(BALL_PARK, {}).env_kwargs == {"frame": "reduced"}
    config = config_for(BALL_PARK, {"env_kwargs": {"radius": 1.0}})
    assert config.total_timesteps == recipe_for(BALL_PARK, None, "world")["total_timesteps"]
