"""References act on observations as trained policies do, wherever those act."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor

import rigid_envs
from rigid_envs.base.checks import ConfigError
from rigid_envs.sb3.adapter import make_vec_env
from rigid_envs.scores.evaluation import make_rows
from rigid_envs.scores.policies import reference_controllers
from rigid_envs.scores.starts import evaluation_seeds
from rigid_envs.tasks import registry
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.testing.environments import in_full
from tests.fixtures import Patch
from tests.page_code import run_page

IDS = list(ENVIRONMENTS)
PARK, GRID, GOAL = (f"RigidEnvs/{name}-v0" for name in ("BallPark", "BallGrid", "BallParkGoal"))
LAWS = [(env_id, name) for env_id in IDS for name in reference_controllers(env_id)]
# of the tasks that the planner of the shortest path solves, which takes seconds, one in short
ALIKE = {(f"RigidEnvs/{name}-v0", "shortest_path") for name in ("BallParkRandom", "BallReorient")}
ALIKE |= {(GOAL, "shortest_path")}


@cache
def agent_of(env_id: str, name: str) -> Any:
    """A controller as an agent, which keeps what it has computed for its task."""
    return rigid_envs.reference(env_id, name)


def quickest(env_id: str) -> Any:
    """The last controller of an id, which plans for milliseconds."""
    return agent_of(env_id, list(reference_controllers(env_id))[-1])


@pytest.mark.parametrize(
    ("env_id", "name"),
    [pytest.param(*law, marks=pytest.mark.long) if law in ALIKE else law for law in LAWS],
)
def test_every_controller_succeeds_from_observations(env_id: str, name: str) -> None:
    n = 4 if name == "shortest_path" else 20
    found = rigid_envs.evaluate(env_id, agent_of(env_id, name), n=n)
    assert found.successes.all()
    assert found.policy == name


@pytest.mark.long
@pytest.mark.parametrize(("env_id", "name"), LAWS)
def test_all_500_starts_cost_what_they_cost_the_controller_of_states(
    env_id: str, name: str
) -> None:
    found = rigid_envs.evaluate(env_id, rigid_envs.reference(env_id, name))
    states = rigid_envs.evaluate(env_id, name)
    np.testing.assert_array_equal(found.successes, states.successes)
    # observations are rounded to float32, 6e-8; unstable motions and bang-bang laws make more of it
    off = np.abs(found.costs / states.costs - 1.0)
    assert np.median(off) < 1e-5 and off.max() < 0.05


@in_full(IDS)
def test_single_environments_are_played_as_rows_are(env_id: str) -> None:
    agent, row = quickest(env_id), 1
    found = rigid_envs.evaluate(env_id, agent, n=2)
    env = gym.make(env_id)
    seen, _ = env.reset(seed=evaluation_seeds(2)[row])
    state, total, ended = None, 0.0, False
    while not ended:
        action, state = agent.predict(seen, state, np.array([state is None]))
        assert env.action_space.contains(action)
        seen, reward, terminated, truncated, info = env.step(action)
        total, ended = total + float(reward), terminated or truncated
    assert info["is_success"]
    assert total == pytest.approx(found.values["return"][row], rel=1e-6, abs=1e-6)


@in_full(IDS)
def test_evaluate_policy_of_stable_baselines3_takes_it(env_id: str) -> None:
    agent, wins = quickest(env_id), []

    def keep(names: dict[str, Any], _: dict[str, Any]) -> None:
        if names["done"]:
            wins.append(names["info"]["is_success"])

    theirs = DummyVecEnv([lambda: Monitor(gym.make(env_id))] * 2)
    theirs.seed(0)
    for env in (make_vec_env(env_id, 2, seed=0), theirs):
        returns, _ = evaluate_policy(
            agent, env, n_eval_episodes=2, callback=keep, return_episode_rewards=True
        )
        assert len(returns) == 2
    assert wins and all(wins)


def test_a_bare_environment_and_other_wrappers_are_taken() -> None:
    agent = quickest(PARK)
    mean, _ = evaluate_policy(agent, gym.make(PARK), n_eval_episodes=2, warn=False)
    assert mean > 5.0  # 10 for parking, minus what the way costs
    rows = DummyVecEnv([lambda: gym.wrappers.RecordEpisodeStatistics(gym.make(PARK))])
    assert evaluate_policy(agent, VecMonitor(rows), n_eval_episodes=3)[0] > 5.0
    envs = gym.wrappers.vector.RecordEpisodeStatistics(gym.make_vec(PARK, num_envs=5))
    assert rigid_envs.evaluate(PARK, agent, n=10, env=envs).successes.all()


def test_one_agent_serves_several_environments_for_it_remembers_nothing() -> None:
    agent, n = rigid_envs.reference(PARK, "three_rolls"), 4
    rows = [make_rows(PARK, n) for _ in range(2)]
    seen = [envs.reset(seed=seed)[0] for envs, seed in zip(rows, (0, 50), strict=True)]
    states: list[Any] = [None, None]
    for _ in range(10):
        for k, envs in enumerate(rows):  # in turns
            action, states[k] = agent.predict(seen[k], states[k], np.zeros(n, bool))
            again, _ = agent.predict(seen[k], states[k], np.zeros(n, bool))
            seen[k] = envs.step(action)[0]
            assert again.shape == action.shape
    for k, seed in enumerate((0, 50)):
        envs, alone, state = make_rows(PARK, n), rigid_envs.reference(PARK, "three_rolls"), None
        obs, _ = envs.reset(seed=seed)
        for _ in range(10):
            action, state = alone.predict(obs, state)
            obs = envs.step(action)[0]
        np.testing.assert_array_equal(obs, seen[k])


def test_the_same_state_gives_the_same_action_again() -> None:
    agent, envs = rigid_envs.reference("BallSteer"), make_rows("RigidEnvs/BallSteer-v0", 3)
    seen, _ = envs.reset(seed=0)
    first, state = agent.predict(seen)
    for _ in range(2):
        np.testing.assert_array_equal(agent.predict(seen)[0], first)
    seen = envs.step(first)[0]
    second, _ = agent.predict(seen, state)
    agent.predict(seen, None)
    np.testing.assert_array_equal(agent.predict(seen, state)[0], second)


def test_rows_that_begin_are_planned_anew_and_the_others_go_on() -> None:
    agent, envs = rigid_envs.reference(PARK, "three_rolls"), make_rows(PARK, 3)
    seen, _ = envs.reset(seed=0)
    _, state = agent.predict(seen)
    _, kept = agent.predict(seen, state, np.array([False, True, False]))
    np.testing.assert_array_equal(kept.age, [2, 1, 2])
    _, other = agent.predict(seen, kept)
    np.testing.assert_array_equal(other.age, [3, 2, 3])


def test_shapes_and_types_are_those_of_a_model() -> None:
    for env_id in (PARK, GRID, GOAL):
        agent, space = quickest(env_id), gym.make(env_id).action_space
        many, _ = make_rows(env_id, 3).reset(seed=0)
        one = {k: v[0] for k, v in many.items()} if isinstance(many, dict) else many[0]
        actions, _ = agent.predict(many)
        action, _ = agent.predict(one)
        assert actions.shape == (3, *space.shape) and np.shape(action) == space.shape
        assert actions.dtype == space.dtype
        np.testing.assert_array_equal(action, actions[0])
    mine = object()
    assert quickest(GRID).predict(make_rows(GRID, 1).reset()[0], mine)[1] is mine


@pytest.mark.parametrize(
    ("words", "settings", "message"),
    [
        (("BallPrak",), {}, "did you mean 'RigidEnvs/BallPark-v0'"),
        (("BallPark", "lqr"), {}, "name = 'lqr'; expected one of 'shortest_path', 'three_rolls'"),
        (
            ("BallPark",),
            {"frame": "reduced"},
            r"config\.frame: frame = 'reduced'; expected 'world'",
        ),
        (("BallPark",), {"radios": 1.0}, r"config\.radios: unknown key; did you mean 'radius'"),
    ],
)
def test_what_cannot_be_is_refused_by_name(
    words: tuple[str, ...], settings: dict[str, Any], message: str
) -> None:
    with pytest.raises(ConfigError, match=message):
        rigid_envs.reference(*words, **settings)


@pytest.mark.parametrize("lacking", [{"controllers": {}}, {"decoder": ""}])
def test_an_id_without_a_controller_or_a_decoder_is_refused(
    lacking: dict[str, Any], monkeypatch: Patch
) -> None:
    monkeypatch.setitem(registry._RECORDS, PARK, replace(ENVIRONMENTS[PARK], **lacking))
    with pytest.raises(ConfigError, match=f"env_id = '{PARK}'; expected one with a controller and"):
        rigid_envs.reference(PARK)


def test_observations_and_states_that_do_not_fit_are_refused() -> None:
    agent = rigid_envs.reference(PARK, "three_rolls")
    one_bad = np.where(np.arange(11) == 4, np.inf, 0.0)
    for bad in (np.zeros(3), np.zeros((2, 12)), np.zeros((2, 1, 11)), one_bad):
        with pytest.raises(ValueError, match=r"expected \(11,\) or \(N, 11\), every entry finite"):
            agent.predict(bad)
    goal = quickest(GOAL)
    for part in (np.zeros(33), {"observation": np.zeros(11)}):
        with pytest.raises(ValueError, match="expected a dictionary of achieved_goal, desired"):
            goal.predict(part)
    seen, _ = make_rows(PARK, 3).reset(seed=0)
    _, state = agent.predict(seen)
    with pytest.raises(ValueError, match="for the same 2 rows, or None"):
        agent.predict(seen[:2], state)


def test_it_says_what_it_is() -> None:
    agent = rigid_envs.reference("TopRandom", rotation="quat")
    assert repr(agent) == "rigid_envs.reference('RigidEnvs/TopRandom-v0', 'lqr', rotation='quat')"
    assert agent.env_kwargs == {"rotation": "quat"}
    assert rigid_envs.evaluate("TopRandom", agent, n=4).config == {"rotation": "quat"}


def test_the_page_runs(tmp_path: Path, monkeypatch: Patch) -> None:
    monkeypatch.chdir(tmp_path)
    names = run_page("references.md")
    assert names["info"]["is_success"]
    assert names["mean"] > 5.0  # 10 for parking, minus what the way costs
