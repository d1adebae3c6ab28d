"""In the reduced frame of a goal task, networks read the part that turns with the state only."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents.config.entries import config_from
from agents.environments import make
from agents.training.trainer import train
from rigid_envs import load
from tests.agents.sessions import SMALL

OF_PPO = ("n_steps", "batch_size", "n_epochs")
SAC = {
    "algo": "sac",
    "learning_starts": 256,
    "log_every": 256,
    "gradient_steps": 1,
    "buffer_size": 600,  # less than an episode of each row, which hindsight would need
}


def few(**values: Any) -> dict[str, Any]:
    """A run of a moment on a goal task in the reduced frame."""
    common = SMALL if "algo" not in values else {k: v for k, v in SMALL.items() if k not in OF_PPO}
    return {
        **common,
        "env_id": "RigidEnvs/BallParkGoal-v0",
        "env_kwargs": {"frame": "reduced"},
        "total_timesteps": 1024,
        "eval_every": 1024,
        **values,
    }


@pytest.mark.parametrize(
    "values",
    [{}, {"normalize_observation": True, "normalize_reward": True}, SAC],
    ids=["ppo", "normalized", "sac"],
)
def test_the_policy_reads_the_observation_and_not_the_goals(
    tmp_path: Path, values: dict[str, Any]
) -> None:
    outcome = train(config_from(few(log_dir=str(tmp_path), **values)), quiet=True)
    policy = load(outcome.folder / "best_model")
    venv = make("RigidEnvs/BallParkGoal-v0", {"frame": "reduced"}, 5)
    observation, _ = venv.reset(seed=0)
    venv.close()
    assert policy.document["network"]["inputs"] == [["observation", 9]]
    assert policy.document["spaces"]["observation"] == str(venv.single_observation_space)
    elsewhere = {**observation, "achieved_goal": observation["desired_goal"]}
    alone = {"observation": observation["observation"]}
    for other in (elsewhere, alone):
        np.testing.assert_array_equal(policy.predict(observation)[0], policy.predict(other)[0])


def test_the_rotation_between_goals_is_refused_there(tmp_path: Path) -> None:
    config = config_from(
        few(
            log_dir=str(tmp_path),
            env_id="RigidEnvs/Reorient-v0",
            goal_turn=True,
            normalize_reward=True,
        )
    )
    with pytest.raises(ValueError, match=r"^config\.goal_turn: goal_turn = True; expected False: "):
        train(config, quiet=True)
