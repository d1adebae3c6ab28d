"""Hyperparameter files of RL Baselines3 Zoo say what the shipped configs do, or leave it out."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from agents.config.entries import Config, config_from
from agents.config.reading import recipe_for
from agents.environments import make, part_for
from rigid_envs.tasks.registry import ENVIRONMENTS

FOLDER = Path(__file__).parents[3] / "configs" / "zoo"
PART_ALONE = [
    {"gymnasium.wrappers.FilterObservation": {"filter_keys": ["observation"]}},
    "gymnasium.wrappers.FlattenObservation",
]
UNSAID = ("cost_price", "success_bonus", "action_std")
FILES = {algo: (FOLDER / f"{algo}.yml").read_text(encoding="utf-8") for algo in ("ppo", "dqn")}
ENTRIES = [(algo, env_id) for algo, text in FILES.items() for env_id in yaml.safe_load(text)]


def left_out(algo: str, env_id: str) -> dict[str, Any]:
    """What the comment above an entry says."""
    lines = FILES[algo].splitlines()
    above = lines[lines.index(f"{env_id}:") - 1]
    said = above.partition("# left out: ")[2].split("; ") if "# left out: " in above else []
    return {key: yaml.safe_load(value) for key, _, value in (each.partition(": ") for each in said)}


def told(config: Config) -> dict[str, Any]:
    """The entry of a config."""
    venv = make(config.env_id, config.env_kwargs, 1)
    alone = part_for(config.env_kwargs, venv.single_observation_space) is not None
    several = venv.single_observation_space.__class__.__name__ == "Dict" and not alone
    venv.close()
    rate, seen, paid = (
        config.learning_rate, config.normalize_observation, config.normalize_reward)  # fmt: skip
    return {
        "n_envs": config.n_envs,
        "n_timesteps": config.total_timesteps,
        "policy": "MultiInputPolicy" if several else "MlpPolicy",
        **({"env_kwargs": config.training_kwargs} if config.training_kwargs else {}),
        "gamma": config.gamma,
        "learning_rate": f"lin_{rate[0]}" if isinstance(rate, tuple) else rate,
        **config.of_sb3(),
        **({"normalize": {"norm_obs": seen, "norm_reward": paid}} if seen or paid else {}),
        **({"env_wrapper": PART_ALONE} if alone else {}),
    }


@pytest.mark.parametrize(("algo", "env_id"), ENTRIES)
def test_an_entry_is_the_shipped_config_but_for_what_is_named(algo: str, env_id: str) -> None:
    entry = yaml.safe_load(FILES[algo])[env_id]
    frame = entry.get("env_kwargs", {}).get("frame", "world")
    recipe, unsaid = recipe_for(env_id, algo, frame), left_out(algo, env_id)
    assert unsaid == {key: recipe[key] for key in unsaid}
    assert not [key for key in UNSAID if recipe.get(key) and key not in unsaid]
    # hyperparameters in training go with the pay that they belong to
    paid = unsaid.keys() & set(UNSAID[:2]) and recipe.get("train_kwargs")
    assert ("train_kwargs" in unsaid) == bool(paid)
    config: Any = config_from({key: recipe[key] for key in recipe if key not in unsaid})
    policy = entry.pop("policy_kwargs")
    assert entry == told(config)
    assert f"net_arch={list(config.net_arch)}" in policy
    assert f"nn.{config.activation}".lower() in policy.lower()
    assert algo != "ppo" or f"log_std_init={config.log_std_init}," in policy


def test_ppo_has_hyperparameters_for_every_id() -> None:
    ours = [env_id for env_id in ENVIRONMENTS if env_id.startswith("RigidEnvs/")]
    assert list(yaml.safe_load(FILES["ppo"])) == ours
