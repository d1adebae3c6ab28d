"""`rigid_envs.evaluate`: any policy, any form of the environment, the same figures."""

from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.wrappers import RescaleAction, TimeLimit, TransformReward

import rigid_envs
from rigid_envs.base.files import DamagedFileError, write_document
from rigid_envs.envs.shells import RigidEnv
from rigid_envs.scores.best import best_known
from rigid_envs.scores.policies import (
    from_controller,
    from_predict,
    recorded,
    reference_controllers,
)
from rigid_envs.scores.records import read_evaluation
from rigid_envs.scores.statistics import wilson_interval

TOP = "RigidEnvs/SleepingTop-v0"
GOAL = "RigidEnvs/BallParkGoal-v0"
GRID = "RigidEnvs/BallGrid-v0"


def pd(observations):
    """Against the horizontal angular velocity and the tilt of the axis of the top."""
    tilt = observations[:, 3:].reshape(-1, 3, 3)[:, :, 2]
    push = np.stack([tilt[:, 1], -tilt[:, 0]], axis=-1)
    return np.clip(4.0 * push - observations[:, :2], -1.0, 1.0)


class Counting:
    """A policy with a memory: how many steps each episode has had."""

    name = max  # no text: not who acts

    def __init__(self):
        self.seen = []

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        assert deterministic
        state = np.zeros(len(observation)) if state is None else state
        state = np.where(episode_start, 0, state) + 1
        self.seen.append(state[0])
        return pd(observation), state


class OneAction:
    """A policy that takes its observations to be those of one environment."""

    def predict(self, observation, deterministic=False):
        return [0.0, 0.0], None


class OfAnother(OneAction):
    """A policy that says what it takes."""

    observation_space = gym.spaces.Box(-1.0, 1.0, (3,))


def test_a_function_a_model_and_a_controller_are_played_alike():
    by_function = rigid_envs.evaluate(TOP, pd, n=20)
    model = Counting()
    by_model = rigid_envs.evaluate(TOP, model, n=20)
    assert by_function.summary() == by_model.summary()
    assert (by_function.policy, by_model.policy) == ("pd", "counting")
    np.testing.assert_array_equal(model.seen, np.arange(1, 301))
    factory = reference_controllers(TOP)["lqr"]
    found = [rigid_envs.evaluate(TOP, p, n=20) for p in ("lqr", from_controller(factory))]
    assert found[0].summary() == found[1].summary()
    known = np.maximum(best_known(TOP).costs[:20], found[0].cost.floor)
    np.testing.assert_allclose(found[0].efficiencies, known / found[0].costs)


@pytest.mark.parametrize("mode", ["single", "native", "sync", "same step"])
def test_every_form_of_the_environment_gives_the_same_figures(mode):
    expected = rigid_envs.evaluate(TOP, pd, n=5)
    env = {
        "single": lambda: RescaleAction(gym.make(TOP), np.float32(-1.0), np.float32(1.0)),
        "native": lambda: gym.make_vec(TOP, num_envs=3),
        "sync": lambda: gym.make_vec(TOP, num_envs=2, vectorization_mode="sync"),
        "same step": lambda: gym.make_vec(TOP, num_envs=8, autoreset_mode="SameStep"),
    }[mode]()
    found = rigid_envs.evaluate(TOP, pd, n=5, env=env)
    for name, values in expected.values.items():
        np.testing.assert_allclose(found.values[name], values, rtol=1e-12, err_msg=name)
    np.testing.assert_array_equal(found.best, expected.best)
    env.close()


def test_wrappers_count_and_settings_are_those_of_the_environment():
    env = TransformReward(gym.make(TOP, rotation="quat", start_tilt=0.05), lambda r: 2.0 * r)
    found = rigid_envs.evaluate(TOP, "zero", n=3, env=env)
    plain = rigid_envs.evaluate(TOP, "zero", n=3, config={"rotation": "quat", "start_tilt": 0.05})
    assert found.config == plain.config == {"rotation": "quat", "start_tilt": 0.05}
    np.testing.assert_allclose(found.values["return"], 2.0 * plain.values["return"])
    assert found.best is None and found.efficiency is None


def test_an_environment_that_is_given_stays_open_and_its_id_may_be_short():
    env = gym.make(TOP)
    found = rigid_envs.evaluate("SleepingTop", "zero", n=2, env=env)
    assert found.env_id == TOP and found.cost is not None
    assert env.reset(seed=3)[0].shape == env.observation_space.shape
    env.close()


class TwoParts(gym.Env):
    """An environment of three steps whose actions have two parts."""

    observation_space = gym.spaces.Box(-1.0, 1.0, (2,))
    action_space = gym.spaces.Dict(
        push=gym.spaces.Box(-1.0, 1.0, (1,)), gear=gym.spaces.Discrete(2)
    )

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.steps = 0
        return np.zeros(2, np.float32), {}

    def step(self, action):
        assert self.action_space.contains(action)
        self.steps += 1
        return np.zeros(2, np.float32), 1.0, self.steps == 3, False, {}


class Parts:
    """A policy of the actions of `TwoParts`."""

    def predict(self, observation, deterministic=False):
        n = len(observation)
        return {"push": np.zeros((n, 1), np.float32), "gear": np.ones(n, np.int64)}, None


@pytest.mark.parametrize("vector", [False, True])
def test_actions_of_several_parts_are_played(vector):
    env = gym.vector.SyncVectorEnv([TwoParts] * 2) if vector else TwoParts()
    found = rigid_envs.evaluate("TwoParts-v0", Parts(), env=env, n=4)
    np.testing.assert_array_equal(found.values["return"], 3.0)


def test_an_environment_without_a_registered_id_is_played_and_has_no_cost(tmp_path):
    env = TimeLimit(RigidEnv(rigid_envs.ENVIRONMENTS[TOP].task), 300)
    found = rigid_envs.evaluate("Mine/Top-v0", pd, n=3, env=env)
    expected = rigid_envs.evaluate(TOP, pd, n=3)
    for name in ("success", "return", "length", "cost"):
        np.testing.assert_allclose(found.values[name], expected.values[name], rtol=1e-12)
    assert (found.env_id, found.config, found.cost, found.best) == ("Mine/Top-v0", {}, None, None)
    assert found.efficiency is None and found.gap is None and found.row()["cost"] is None
    assert read_evaluation(found.save(tmp_path / "row.json")).row() == found.row()
    # under the id of its task it is what its rows are: here those of the registered one
    again = rigid_envs.evaluate(TOP, pd, n=3, env=env)
    assert again.config == {} and again.efficiency == expected.efficiency


@pytest.mark.parametrize("config", [{"rotation": "rot6d"}, {"weight_upright": 0.5}])
def test_what_is_seen_and_paid_leaves_the_best_known_as_it_is(config):
    found, plain = (rigid_envs.evaluate(TOP, "lqr", n=5, config=c) for c in (config, {}))
    np.testing.assert_array_equal(found.efficiencies, plain.efficiencies)


def test_the_reduced_frame_has_the_same_starts_and_controllers_refuse_it():
    config = {"frame": "reduced"}
    one = rigid_envs.evaluate("RigidEnvs/BallPark-v0", "zero", n=5, config=config)
    other = rigid_envs.evaluate("RigidEnvs/BallPark-v0", "zero", n=5)
    np.testing.assert_array_equal(one.bounds, other.bounds)
    assert one.efficiency == other.efficiency
    with pytest.raises(ValueError, match="frame = 'reduced'; expected 'world'"):
        rigid_envs.evaluate("RigidEnvs/BallPark-v0", "reference", n=2, config=config)


def test_goals_and_choices_are_played_too():
    goal = rigid_envs.evaluate(GOAL, lambda obs: np.zeros((len(obs["observation"]), 2)), n=3)
    assert goal.policy == "lambda" and goal.success.mean == 0.0
    grid = rigid_envs.evaluate(GRID, "reference", n=5)
    assert grid.efficiency.mean == 1.0 and grid.gap == pytest.approx(0.0, abs=1e-12)


def test_figures_follow_from_the_starts():
    """Metrics of all starts count failures, and those of successes do not."""
    found = rigid_envs.evaluate(GRID, "random", n=300)
    won = int(found.successes.sum())
    assert 0 < won < 30
    path, paid = (found.values[name] for name in ("path", "return"))
    metrics = found.summary()["metrics"]
    assert metrics["path"] == path[found.successes].mean()
    assert metrics["return"] == paid.mean() < paid[found.successes].mean()
    assert found.success == (won / 300, *wilson_interval(won, 300))
    low, high = found.efficiency.low, found.efficiency.high
    assert low < found.efficiency.mean == found.efficiencies.mean() < high
    assert found.mean(found.costs) == found.values["path"][found.successes].mean()
    assert not found.records.any()
    lucky = found.against(np.full(300, 1e9))
    assert lucky.records.sum() == won == lucky.efficiencies.sum()
    assert f"from {won} starts" in str(lucky)
    free = replace(found, values={**found.values, "path": np.zeros(300)}, best=np.zeros(300))
    assert not free.records.any()  # nothing is not less than nothing


def test_the_gap_is_over_the_mean_bound_of_the_successes_if_there_is_one_above_zero():
    found = rigid_envs.evaluate(TOP, "lqr", n=5)
    assert found.successes.all()
    bounded = replace(found, bounds=np.full(5, 0.25 * found.costs.mean()))
    assert bounded.costs.mean() < 4.0 and bounded.gap == pytest.approx(3.0, rel=1e-12)
    assert replace(found, bounds=np.zeros(5)).gap is None
    assert replace(found, bounds=None).gap is None
    lost = replace(bounded, values={**found.values, "success": np.zeros(5)})
    assert lost.gap is None and np.isnan(lost.mean(lost.costs))


def test_a_row_is_read_as_it_was_written(tmp_path):
    found = rigid_envs.evaluate(GRID, "random", n=60)
    again = read_evaluation(found.save(tmp_path / "row.json"))
    assert str(again) == str(found) and again.row() == found.row()


def test_a_count_that_does_not_follow_from_the_starts_is_refused(tmp_path):
    row, file = rigid_envs.evaluate(GRID, "zero", n=2).row(), tmp_path / "row.json"
    row["policy"]["successes"] = 2
    write_document(file, row)
    with pytest.raises(DamagedFileError, match=r"policy\.successes = 2; expected 0"):
        read_evaluation(file)


def test_starts_without_an_outcome_are_refused_by_name(tmp_path):
    found, file = rigid_envs.evaluate(GRID, "zero", n=2), tmp_path / "row.json"
    missing = [(name, None) for name in ("success", "return", "length", "cost")]
    for name, wrong in (("success", 0.5), *missing):
        row = found.row()
        row["starts"][name][0] = wrong
        write_document(file, row)
        with pytest.raises(DamagedFileError, match=rf"starts\.{name}"):
            read_evaluation(file)


def scaled(value, factor):
    """A value of JSON with all its numbers multiplied."""
    if isinstance(value, dict):
        return {name: scaled(part, factor) for name, part in value.items()}
    if isinstance(value, list):
        return [scaled(part, factor) for part in value]
    return value * factor if isinstance(value, float) else value


def test_figures_that_were_rounded_otherwise_are_read_and_others_refused(tmp_path):
    found = rigid_envs.evaluate(TOP, "lqr", n=5)
    file = tmp_path / "row.json"
    for name in ("efficiency", "efficiency_95", "metrics"):  # a number, some, and some with names
        for factor, told in ((1.0 + 1e-12, True), (1.0 + 1e-6, False)):
            row = found.row()
            row["policy"][name] = scaled(row["policy"][name], factor)
            write_document(file, row)
            with nullcontext() if told else pytest.raises(DamagedFileError, match=name):
                assert read_evaluation(file).row() == found.row()
    lost = rigid_envs.evaluate(GRID, "zero", n=2)  # without means of successes
    write_document(file, lost.row() | {"policy": scaled(lost.summary(), 1.0 + 1e-12)})
    assert read_evaluation(file).row() == lost.row()


STAYS = gym.make_vec(TOP, num_envs=2, autoreset_mode="Disabled")
REFUSED = [
    ({"policy": 3}, "policy = 3; expected the name of a controller"),
    ({"policy": "pid"}, "controller = 'pid'; expected one of"),
    ({"policy": lambda _: np.zeros(2)}, r"shape \(2,\); expected \(2, 2\): it is given"),
    ({"policy": from_predict(OneAction())}, r"shape \(2,\); expected \(2, 2\): it is given"),
    ({"policy": OfAnother()}, rf"observations have shape \(3,\), those of {TOP} \(12,\); expected"),
    ({"env_id": "RigidEnvs/SleepingTob-v0"}, "did you mean 'RigidEnvs/SleepingTop-v0'"),
    ({"env_id": 7}, "env_id = 7; expected the id of an environment"),
    ({"env_id": None, "env": TwoParts()}, "env_id = None; expected the id of an environment"),
    *(
        ({"config": {name: 3}}, f"^config.{name}: unknown key; expected one of dt")
        for name in (1, "num_envs", "render_mode", "max_episode_steps")
    ),
    *(
        ({"config": bad}, f"config = {bad!r}; expected a dict of hyperparameters")
        for bad in (3, "x", 0)
    ),
    *(({"n": bad}, f"n = {bad!r}; expected an integer of at least 1") for bad in ("x", 0)),
    *(({"seed": bad}, f"seed = {bad!r}; expected an integer of at") for bad in ("x", None)),
    ({"env": "x"}, "env = 'x'; expected an environment of Gymnasium"),
    ({"env": TwoParts(), "config": 3}, "config = 3; expected none beside env"),
    ({"env": gym.make(TOP), "config": {"dt": 0.1}}, "expected none beside env"),
    ({"env": gym.make(GRID)}, f"env = {GRID}; expected one of {TOP}"),
    ({"env": STAYS}, "expected rows that start anew"),
    ({"env": gym.make(TOP), "policy": "lqr"}, "expected native rows for lqr"),
    ({"name": 3}, "name = 3; expected None or a text"),
    ({"progress": 3}, "progress = 3; expected a function"),
]


@pytest.mark.parametrize(("arguments", "message"), REFUSED, ids=[", ".join(a) for a, _ in REFUSED])
def test_what_cannot_be_played_is_refused_by_name(arguments, message):
    given = {"env_id": TOP, "policy": "zero", "n": 2, **arguments}
    with pytest.raises(ValueError, match=message):
        rigid_envs.evaluate(given.pop("env_id"), given.pop("policy"), **given)


def test_recorded_actions_of_other_episodes_are_refused():
    for shape in ((5, 3, 2), (5, 2, 3), (5, 2)):
        message = r"actions have shape \(.*\); expected \(T, \*\(2, 2\)\)"
        with pytest.raises(ValueError, match=message):
            rigid_envs.evaluate(TOP, recorded(np.zeros(shape)), n=2)


def test_models_of_stable_baselines3_are_played_with_their_scaling():
    pytest.importorskip("stable_baselines3")
    from stable_baselines3 import PPO
    from stable_baselines3.common.env_util import make_vec_env
    from stable_baselines3.common.vec_env import VecNormalize

    venv = make_vec_env(TOP, n_envs=2)
    plain = PPO("MlpPolicy", venv, n_steps=64, batch_size=64, n_epochs=1).learn(128)
    with pytest.raises(ValueError, match=r"shape \(12,\), .*expected the settings .*'reduced'"):
        rigid_envs.evaluate("BallSteer", plain, n=4)
    found = rigid_envs.evaluate(TOP, plain, n=4)
    assert found.policy == "ppo" and 0.0 <= found.efficiency.mean <= 1.0
    scaled = VecNormalize(make_vec_env(TOP, n_envs=2))
    model = PPO("MlpPolicy", scaled, n_steps=64, batch_size=64, n_epochs=1).learn(128)
    seen = []
    predict = model.policy.predict
    model.policy.predict = lambda obs, *rest: (seen.append(obs), predict(obs, *rest))[1]
    rigid_envs.evaluate(TOP, from_predict(model), n=4)
    raw, _ = gym.make_vec(TOP, num_envs=4).reset(seed=found.seeds)
    np.testing.assert_allclose(seen[0], scaled.normalize_obs(raw), rtol=1e-6)


def test_the_page_shows_the_row_of_an_outsider_as_it_is_now():
    root = Path(__file__).parents[2]
    row = read_evaluation(root / "docs/rows/IntermediateAxis-v0_ppo.json", anew=True)
    assert f"```text\n{row}\n```" in (root / "docs/scoring.md").read_text(encoding="utf-8")
