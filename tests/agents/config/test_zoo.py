"""Hyperparameter files of RL Baselines3 Zoo are the shipped configs."""

from pathlib import Path

import pytest
import yaml

from agents.cli.command_line import main
from agents.config.reading import recipe_for
from agents.config.zoo import ALGOS, hyperparameters, zoo_config, zoo_file
from rigid_envs.tasks.registry import ENVIRONMENTS

FOLDER = Path(__file__).parents[3] / "configs" / "zoo"


@pytest.mark.parametrize("algo", ALGOS)
def test_the_file_is_that_of_the_configs(algo: str) -> None:
    text = (FOLDER / f"{algo}.yml").read_text()
    assert text == zoo_file(algo), "write it anew: python -m agents zoo configs/zoo"


def test_ppo_has_hyperparameters_for_every_id() -> None:
    ours = [env_id for env_id in ENVIRONMENTS if env_id.startswith("RigidEnvs/")]
    assert list(yaml.safe_load((FOLDER / "ppo.yml").read_text())) == ours


@pytest.mark.parametrize("env_id", ENVIRONMENTS)
def test_what_the_zoo_is_told_is_a_shipped_config_but_for_what_is_named(env_id: str) -> None:
    config, left_out = zoo_config(env_id, "ppo")
    recipe = recipe_for(env_id, "ppo", str(config.env_kwargs.get("frame", "world")))
    told = hyperparameters(config)
    assert told["n_timesteps"] == recipe["total_timesteps"]
    for key in ("n_envs", "n_steps", "batch_size", "n_epochs", "gamma", "gae_lambda"):
        assert told[key] == recipe.get(key, told[key])
    assert left_out == {key: recipe[key] for key in left_out}
    assert not (recipe.keys() & {"cost_price", "success_bonus", "action_std"}) - left_out.keys()
    told_kwargs = {**recipe.get("env_kwargs", {}), **recipe.get("train_kwargs", {})}
    if "train_kwargs" not in left_out:
        assert told.get("env_kwargs", {}) == told_kwargs


def test_hyperparameters_in_training_are_not_told_without_the_pay_they_belong_to() -> None:
    config, _ = zoo_config("RigidEnvs/SleepingTop-v0", "ppo")  # its pay would be 0
    assert not config.training_kwargs
    config, left_out = zoo_config("RigidEnvs/Reorient-v0", "ppo")
    assert config.train_kwargs["weight_angle"] == 1.0 and not left_out


def test_a_goal_in_the_reduced_frame_is_seen_by_its_observation_alone() -> None:
    told = hyperparameters(zoo_config("RigidEnvs/BallParkGoal-v0", "ppo")[0])
    assert told["policy"] == "MlpPolicy"
    assert [str(wrapper) for wrapper in told["env_wrapper"]][1].endswith("FlattenObservation")


def test_the_command_writes_a_file_for_each_algorithm(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["zoo", str(tmp_path / "new")]) == 0
    assert {path.name for path in (tmp_path / "new").iterdir()} == {"ppo.yml", "dqn.yml"}
    assert "written: ppo.yml, dqn.yml" in capsys.readouterr().out
