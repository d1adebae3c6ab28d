"""Programs of others open every id unmodified, and run the recipes: the rows of docs/clients.md."""

import hashlib
import json
import warnings
from pathlib import Path

import pytest
from gymnasium import wrappers
from gymnasium.wrappers import vector
from stable_baselines3 import DQN, PPO, SAC
from stable_baselines3.common.evaluation import evaluate_policy

from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.testing.environments import DISCRETE, GOALS
from tests.clients import rows, wrapping
from tests.clients.__main__ import DATA, main
from tests.clients.rows import markdown
from tests.clients.running import ROOT, run

HERE = Path(__file__).parent
CLEANRL = {
    "ppo.py": "edde76baef51f05a8654160dfb19a4fdb34d14d3",
    "LICENSE": "c4e562311a2917da1c770a80860d223965b41770",
}
"""Hashes of the files in the repository of CleanRL at fe8d8a0, as git names them."""

AT_A_PUSH = ("sb3_her", "cleanrl_ppo", "torchrl_envs")
"""One program that the tests need anyway, one with an environment of its own, one of rows."""


@pytest.mark.long
@pytest.mark.parametrize(
    "row",
    [
        pytest.param(row, id=row.recipe, marks=pytest.mark.push if row.recipe in AT_A_PUSH else ())
        for row in rows.ROWS
    ],
)
def test_a_program_of_others_runs_its_recipe(row):
    assert run(row)["result"]


@pytest.mark.long
def test_the_command_runs_what_is_named_and_writes_its_row(tmp_path):
    assert main(["sb3_published", "--out", str(tmp_path)]) == 0
    found, before = (json.loads(path.read_text()) for path in (tmp_path / DATA.name, DATA))
    assert found.keys() == before.keys()
    assert {name for name in found if found[name] != before[name]} == {"sb3_published"}
    assert (tmp_path / "clients.md").read_text() == markdown(found)
    with pytest.raises(SystemExit):
        main(["nothing"])


def test_every_recipe_is_a_row_and_every_environment_has_a_use():
    assert {row.recipe for row in rows.ROWS} == {path.stem for path in (HERE / "recipes").iterdir()}
    needed = {row.environment for row in rows.ROWS if row.environment}
    assert needed == {path.stem for path in (HERE / "requirements").iterdir()}


def test_the_page_is_that_of_the_data_and_every_recipe_is_short():
    data = json.loads(DATA.read_text())
    mend = "write it anew: python -m tests.clients"
    assert list(data) == [row.recipe for row in rows.ROWS], mend
    assert (ROOT / "docs" / "clients.md").read_text() == markdown(data), mend
    assert max(found["processor_seconds"] for found in data.values()) < 60.0


@pytest.mark.parametrize("name", CLEANRL)
def test_scripts_of_cleanrl_are_unmodified(name):
    data = (HERE / "cleanrl" / name).read_bytes()
    assert hashlib.sha1(b"blob %d\0" % len(data) + data).hexdigest() == CLEANRL[name]


def test_recipes_are_scripts_that_anybody_could_have_written():
    for path in (HERE / "recipes").iterdir():
        text = path.read_text()
        assert len(text.splitlines()) <= 55, path.name
        for word in ("monkeypatch", "unwrapped", "sys.path", "setattr", "_core"):
            assert word not in text, path.name


IDS = tuple(ENVIRONMENTS)

# Gymnasium says so whenever Stable-Baselines3 asks for pictures of what has none
quiet = pytest.mark.filterwarnings("ignore:.*render_mode.*:UserWarning")


@quiet
@pytest.mark.parametrize("env_id", IDS)
def test_stable_baselines3_trains_on_an_id(env_id):
    policy = "MultiInputPolicy" if env_id in GOALS else "MlpPolicy"
    model = PPO(policy, env_id, n_steps=16, batch_size=16, n_epochs=1, device="cpu")
    model.learn(16)
    evaluate_policy(model, model.get_env(), n_eval_episodes=1)


@quiet
@pytest.mark.parametrize("env_id", DISCRETE)
def test_dqn_trains_on_an_id(env_id):
    DQN("MlpPolicy", env_id, learning_starts=4, device="cpu").learn(8)


@quiet
@pytest.mark.parametrize("env_id", ["RigidEnvs/BallPark-v0", "RigidEnvs/SleepingTop-v0"])
def test_sac_trains_on_an_id(env_id):
    SAC("MlpPolicy", env_id, learning_starts=4, device="cpu").learn(8)


THREE = ("RigidEnvs/BallPark-v0", "RigidEnvs/BallParkGoal-v0", "RigidEnvs/BallGrid-v0")


@pytest.fixture
def no_display(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of wrappers, on what they convert
        yield


def wrappings():
    """Wrappers by name; those of pictures need the extra `render`, and take seconds."""
    for table, make in (
        (wrapping.SINGLE, wrapping.wrapped),
        (wrapping.ROWS, wrapping.wrapped_rows),
    ):
        for name in table:
            long = [pytest.mark.long] if name in wrapping.PICTURES else []
            yield pytest.param(name, make, marks=long)


@pytest.mark.usefixtures("no_display")
@pytest.mark.parametrize(("name", "make"), wrappings())
def test_a_wrapper_takes_single_environments_and_native_rows(name, make):
    for env_id in THREE:
        if wrapping.fits(name, env_id):
            env = make(name, env_id)
            wrapping.play(env)
            env.close()


def test_there_is_no_wrapper_that_is_neither_taken_nor_for_others():
    assert set(wrappers.__all__) == wrapping.SINGLE.keys() | wrapping.LEFT_OUT.keys()
    assert set(vector.__all__) == wrapping.ROWS.keys() | wrapping.LEFT_OUT_OF_ROWS.keys()


def test_each_wrapper_fits_two_ids_or_more_unless_it_is_for_goals():
    for name in {*wrapping.SINGLE, *wrapping.ROWS}:
        n = sum(wrapping.fits(name, env_id) for env_id in THREE)
        assert n >= 2 or name == "FilterObservation", name
