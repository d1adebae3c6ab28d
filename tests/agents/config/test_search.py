"""Searches of hyperparameters as YAML describes them."""

from pathlib import Path
from typing import Any

import pytest

from agents.config.search import Search, read_search
from rigid_envs.base.checks import ConfigError

RECIPE: dict[str, Any] = {
    "env_id": "BallPark",
    "learning_rate": [{"low": 1e-4, "high": 1e-2, "log": True}, 1e-5],
    "gamma": {"choices": [0.99, 0.995]},
    "train_kwargs": {"dt": {"low": 0.1, "high": 0.4}},
    "n_epochs": {"low": 4, "high": 10},
}


def test_any_value_of_a_recipe_may_be_a_range() -> None:
    search = Search(recipe=RECIPE)
    assert search.ranges() == {
        "learning_rate.0": RECIPE["learning_rate"][0],
        "gamma": RECIPE["gamma"],
        "train_kwargs.dt": RECIPE["train_kwargs"]["dt"],
        "n_epochs": RECIPE["n_epochs"],
    }
    values = {"learning_rate.0": 2e-3, "gamma": 0.995, "train_kwargs.dt": 0.2, "n_epochs": 7}
    config: Any = search.config(values, seed=4)
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
def test_a_search_that_cannot_be_is_refused(entries: dict[str, Any], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        Search(**entries)


def test_the_shipped_search_is_one() -> None:
    for path in (Path(__file__).parents[3] / "configs" / "searches").glob("*.yaml"):
        assert read_search(path).ranges()


def test_a_mistake_in_a_file_names_the_file(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("trails: 3\n")
    with pytest.raises(ConfigError, match=r"a\.yaml: config\.trails: unknown key; did you mean"):
        read_search(tmp_path / "a.yaml")
