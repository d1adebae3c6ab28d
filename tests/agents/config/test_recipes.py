"""Shipped recipes: what each environment is trained with, as searches and as files of the zoo."""

from pathlib import Path

import pytest
import yaml

from agents.config.entries import config_from
from agents.config.reading import config_for, frame_of, read_yaml, recipe_for
from agents.config.search import Search, read_search
from agents.environments import make, part_for
from rigid_envs.base.checks import ConfigError
from rigid_envs.tasks.registry import ENVIRONMENTS

REDUCED = sorted((Path(__file__).parents[3] / "configs").glob("*_reduced_*.yaml"))
BALL_PARK, REORIENT = "RigidEnvs/BallPark-v0", "RigidEnvs/Reorient-v0"


@pytest.mark.parametrize("path", REDUCED, ids=lambda path: path.stem)
def test_a_reduced_recipe_is_what_its_environment_is_trained_with(path):
    values = read_yaml(path)
    assert values["env_kwargs"]["frame"] == "reduced"
    assert values["algo"] == path.stem.rsplit("_", 1)[1]
    assert recipe_for(values["env_id"], values["algo"]) == values
    assert recipe_for(values["env_id"])["env_kwargs"]["frame"] == "reduced"
    make(values["env_id"], config_from(values).training_kwargs, 1).close()


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
def test_the_recipe_is_that_of_the_frame_and_the_algorithm(env_id, algo, frame, expected):
    values = recipe_for(env_id, algo, frame)
    assert (values["algo"], values.get("env_kwargs", {}).get("frame")) == expected


def test_an_algorithm_without_a_config_has_the_rewards_and_the_period_of_another_one():
    ppo, sac = (recipe_for("SleepingTop", algo, "reduced") for algo in ("ppo", "sac"))
    for key in ("env_id", "env_kwargs", "train_kwargs", "cost_price", "success_bonus"):
        assert sac[key] == ppo[key]
    assert config_for("SleepingTop", sac).total_timesteps == 200_000  # the default of SAC
    assert "cost_price" not in recipe_for("SleepingTop", "sac", "world")
    taught = recipe_for("SleepingTop", "dagger", "reduced")
    assert taught.keys() == {"env_id", "algo", "env_kwargs"}  # the law has the period of the task


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
def test_hindsight_is_for_goals_in_the_frame_of_the_world(env_id, frame, algo):
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
def test_what_is_said_of_the_frame_chooses_the_recipe(entries, keywords, frame):
    assert frame_of(entries, keywords) == frame


def test_a_config_has_the_recipe_of_its_own_frame():
    assert config_for(BALL_PARK, {}).env_kwargs == {"frame": "reduced"}
    config = config_for(BALL_PARK, {"env_kwargs": {"radius": 1.0}})
    assert config.total_timesteps == recipe_for(BALL_PARK, None, "world")["total_timesteps"]


RECIPE = {
    "env_id": "BallPark",
    "learning_rate": [{"low": 1e-4, "high": 1e-2, "log": True}, 1e-5],
    "gamma": {"choices": [0.99, 0.995]},
    "train_kwargs": {"dt": {"low": 0.1, "high": 0.4}},
    "n_epochs": {"low": 4, "high": 10},
}


def test_any_value_of_a_recipe_may_be_a_range():
    search = Search(recipe=RECIPE)
    assert search.ranges() == {
        "learning_rate.0": RECIPE["learning_rate"][0],
        "gamma": RECIPE["gamma"],
        "train_kwargs.dt": RECIPE["train_kwargs"]["dt"],
        "n_epochs": RECIPE["n_epochs"],
    }
    values = {"learning_rate.0": 2e-3, "gamma": 0.995, "train_kwargs.dt": 0.2, "n_epochs": 7}
    config = search.config(values, seed=4)
    assert (config.env_id, config.seed) == ("RigidEnvs/BallPark-v0", 4)
    assert (config.learning_rate, config.gamma) == ((2e-3, 1e-5), 0.995)
    assert (config.train_kwargs, config.n_epochs) == ({"dt": 0.2}, 7)
    assert config.env_kwargs == {"frame": "reduced"}  # all else is of the shipped recipe
    assert search.ranges().keys() == values.keys()  # and the search is as it was


@pytest.mark.parametrize(
    ("entries", "words"),
    [
        ({"recipe": {"env_id": "BallPark"}}, r"recipe = .*; expected a range: \{low"),
        ({"recipe": {"gamma": {"low": 0.9, "high": 1.5}}}, r"gamma = 1\.5; expected"),
        ({"recipe": {"gamma": {"low": 1, "high": 0}}}, r"config\.recipe\.gamma: .*low < high"),
        ({"recipe": {"gamma": {"low": "a", "high": "b"}}}, r"config\.recipe\.gamma: "),
        ({"recipe": {"gamma": {"choices": []}}}, r"config\.recipe\.gamma: .*a list of choices"),
        ({"recipe": {"gama": {"low": 0.9, "high": 1}}}, "did you mean 'gamma'"),
        ({"recipe": RECIPE, "objective": {"mean_cost": "max"}}, "objective = .*; expected some of"),
        ({"recipe": RECIPE, "seeds": []}, "seeds = "),
        ({"recipe": RECIPE, "trials": 0}, "trials = 0; expected"),
    ],
)
def test_a_search_that_cannot_be_is_refused(entries, words):
    with pytest.raises(ConfigError, match=words):
        Search(**entries)


def test_the_shipped_search_is_one():
    for path in (Path(__file__).parents[3] / "configs" / "searches").glob("*.yaml"):
        assert read_search(path).ranges()


def test_a_mistake_in_a_file_names_the_file(tmp_path):
    (tmp_path / "a.yaml").write_text("trails: 3\n")
    with pytest.raises(ConfigError, match=r"a\.yaml: config\.trails: unknown key; did you mean"):
        read_search(tmp_path / "a.yaml")


FOLDER = Path(__file__).parents[3] / "configs" / "zoo"
PART_ALONE = [
    {"gymnasium.wrappers.FilterObservation": {"filter_keys": ["observation"]}},
    "gymnasium.wrappers.FlattenObservation",
]
UNSAID = ("cost_price", "success_bonus", "action_std")
FILES = {algo: (FOLDER / f"{algo}.yml").read_text(encoding="utf-8") for algo in ("ppo", "dqn")}
ENTRIES = [(algo, env_id) for algo, text in FILES.items() for env_id in yaml.safe_load(text)]


def left_out(algo, env_id):
    """What the comment above an entry says."""
    lines = FILES[algo].splitlines()
    above = lines[lines.index(f"{env_id}:") - 1]
    said = above.partition("# left out: ")[2].split("; ") if "# left out: " in above else []
    return {key: yaml.safe_load(value) for key, _, value in (each.partition(": ") for each in said)}


def told(config):
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
def test_an_entry_is_the_shipped_config_but_for_what_is_named(algo, env_id):
    entry = yaml.safe_load(FILES[algo])[env_id]
    frame = entry.get("env_kwargs", {}).get("frame", "world")
    recipe, unsaid = recipe_for(env_id, algo, frame), left_out(algo, env_id)
    assert unsaid == {key: recipe[key] for key in unsaid}
    assert not [key for key in UNSAID if recipe.get(key) and key not in unsaid]
    # hyperparameters in training go with the pay that they belong to
    paid = unsaid.keys() & set(UNSAID[:2]) and recipe.get("train_kwargs")
    assert ("train_kwargs" in unsaid) == bool(paid)
    config = config_from({key: recipe[key] for key in recipe if key not in unsaid})
    policy = entry.pop("policy_kwargs")
    assert entry == told(config)
    assert f"net_arch={list(config.net_arch)}" in policy
    assert f"nn.{config.activation}".lower() in policy.lower()
    assert algo != "ppo" or f"log_std_init={config.log_std_init}," in policy


def test_ppo_has_hyperparameters_for_every_id():
    ours = [env_id for env_id in ENVIRONMENTS if env_id.startswith("RigidEnvs/")]
    assert list(yaml.safe_load(FILES["ppo"])) == ours
