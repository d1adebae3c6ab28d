"""References decode states from observations, and act on them as trained policies do."""

from dataclasses import asdict, replace
from functools import cache

import gymnasium as gym
import numpy as np
import pytest
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor

import rigid_envs
from rigid_envs.base.checks import ConfigError
from rigid_envs.envs.lookup import task_of
from rigid_envs.mechanics import rotations
from rigid_envs.sb3.adapter import make_vec_env
from rigid_envs.scores.evaluation import make_rows
from rigid_envs.scores.policies import reference_controllers
from rigid_envs.scores.starts import evaluation_seeds
from rigid_envs.systems.rolling_ball.controllers import pose_error
from rigid_envs.systems.rolling_disk.controllers import rolling
from rigid_envs.tasks import registry
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.testing.environments import in_full, representations
from tests.page_code import run_page

# What is decoded from observations is the state, up to the rounding of float32.


IDS = list(ENVIRONMENTS)
ATTITUDES = [(i, shown) for i in IDS for shown in representations(i) if shown != "none"]
N, STEPS = 40, 12
ROUNDING = 1e-6
"""Eight roundings of float32 (1.2e-7): of the attitude, and of what is turned by it."""

HIDDEN = {
    "CoinPark": ("steer_rate", "roll_rate"),
    "BallPlate": ("q",),
    "TippeTop": ("centre",),
    "RacketCatch": ("position", "velocity"),
    **dict.fromkeys(("IntermediateAxis", "IntermediateAxisRandom", "Detumble", "AxisFlip"), ("q",)),
    **dict.fromkeys(("IntermediateAxisSingle", "SpinCapture", "DualSpin"), ("q",)),
}
"""Components of the state that no controller reads, and that are not observed by default."""

KNOWN = {
    "TopPrecession": ("goal_tilt",),
    "BallPlate": ("point_X", "point_Y"),
    "RollPump": ("beta_change",),
    "DiskRoll": ("goal_curvature",),
    "DiskRollRandom": ("goal_curvature",),
    "AxisFlip": ("time_left",),
    "RacketCatch": ("time_left",),
    "WheelTrack": ("sine", "cosine", "target_sine", "target_cosine"),
    "BallSteer": ("heading_X", "heading_Y", "curvature", "force_X", "force_Y"),
    "BallParkGoal": ("goal_X", "goal_Y"),
}
"""Parts of the auxiliary state that are compared as they are."""


def read(name, states, shown):
    """What controllers read: attitudes as matrices, lengths of balls and coins in radii."""
    system = states.systems[0]
    if name == "BallSteer":  # the pose relative to the reference
        reference = states.auxiliary(*(f"reference_{k}" for k in "wxyzXY"))
        found = {"error": pose_error(system, states.y, reference)}
    elif name.startswith("DiskRoll"):  # place, heading and phase do not count
        found = rolling(states.y)._asdict()
    else:
        hidden = () if shown else HIDDEN.get(name, ())
        hidden += tuple(part for part in HIDDEN.get(name, ()) if part != "q")
        parts = {key: at for key, at in system.components.items() if key not in hidden}
        found = {key: states.y[:, at] for key, at in parts.items()}
    if name == "RacketCatch":  # the attitude relative to that of the catch
        goal = states.auxiliary("goal_w", "goal_x", "goal_y", "goal_z")
        found["q"] = rotations.multiply(rotations.conjugate(goal), found["q"])
    if name == "WheelTrack":  # the attitude relative to the axes of the pass
        frame = states.auxiliary(*(f"pass_{k}" for k in "wxyz"))
        found["q"] = rotations.multiply(rotations.conjugate(frame), found["q"])
    if name == "MagneticDetumble":  # half an orbit does not count
        turns = 2.0 * found["latitude"]
        found["latitude"] = np.concatenate([np.cos(turns), np.sin(turns)], axis=-1)
    if "q" in found:
        found["q"] = rotations.matrix_from_quaternion(found["q"]).reshape(-1, 9)
    if "Random" in name and hasattr(system, "radius") and "position" in found:
        radii = np.array([each.radius for each in states.systems])[:, None]
        found["position"] = found["position"] / radii
    for key in KNOWN.get(name, ()):
        found[key] = np.maximum(states.auxiliary(key), 0.0 if key == "time_left" else -np.inf)
    if name in ("Reorient", "WheelReorient", "TwoWheels", "BallParkGoal"):
        goal = states.auxiliary("goal_w", "goal_x", "goal_y", "goal_z")
        found["goal"] = rotations.matrix_from_quaternion(goal).reshape(-1, 9)
    return found


def compare(env_id, **settings):
    """Random actions in many rows; in every step what is decoded is what is there."""
    name = env_id.split("/")[1].removesuffix("-v0")
    envs = make_rows(env_id, N, settings)
    agent = rigid_envs.reference(env_id, **settings)
    seen, _ = envs.reset(seed=1)
    rng, shown = np.random.default_rng(0), envs.task.rotation != "none"
    for _ in range(STEPS):
        expected = read(name, envs, shown)
        found = read(name, agent.decode(seen), shown)
        assert expected.keys() == found.keys()
        for key, values in expected.items():
            size = 1.0 + np.max(np.abs(values))
            np.testing.assert_allclose(found[key], values, rtol=0, atol=ROUNDING * size)
        choices = envs.task.n_choices
        shape = envs.action_space.shape
        actions = rng.integers(0, choices, shape) if choices else rng.uniform(-1, 1, shape)
        seen, *_ = envs.step(actions.astype(envs.single_action_space.dtype))


@pytest.mark.parametrize("shown", [False, True])
@pytest.mark.parametrize("env_id", IDS)
def test_states_of_the_defaults_are_found_with_observed_parameters_too(env_id, shown):
    compare(env_id, observe_params=shown)


@pytest.mark.parametrize(("env_id", "rotation"), ATTITUDES)
def test_states_are_found_in_any_representation_of_the_attitude(env_id, rotation):
    compare(env_id, rotation=rotation, observe_params=True)  # which come after the attitude


@pytest.mark.parametrize("env_id", IDS)
def test_states_are_found_at_other_values_of_all_settings(env_id):
    task = task_of(env_id)
    numbers = {key: value for key, value in asdict(task).items() if type(value) is float}
    if task.n_choices:
        del numbers["dt"]  # which is 1
    compare(env_id, **{key: 0.9 * value for key, value in numbers.items()})


@pytest.mark.parametrize("env_id", IDS)
def test_an_attitude_that_is_needed_and_hidden_is_refused_by_name(env_id):
    needed = {"SleepingTop", "PivotTop", "TopPrecession", "TopRandom", "SleepingTopRandom"}
    needed |= {"BallPark", "BallParkRandom", "BallReorient", "BallParkDynamic", "BallGrid"}
    if env_id.split("/")[1].removesuffix("-v0") in needed | {"CoinPark", "TippeTop"}:
        with pytest.raises(ConfigError, match=r"config\.rotation: rotation = 'none'; expected an"):
            rigid_envs.reference(env_id, rotation="none")
    else:
        compare(env_id, rotation="none")


@in_full(IDS)  # noise takes a kernel of its own
def test_noise_is_no_reason_to_stop(env_id):
    n = 4
    envs = make_rows(env_id, n, {"observation_noise": 0.01})
    agent = rigid_envs.reference(
        env_id, list(reference_controllers(env_id))[-1], observation_noise=0.01
    )
    seen, _ = envs.reset(seed=0)
    state, start = None, np.ones(n, bool)
    for _ in range(20):
        actions, state = agent.predict(seen, state, start)
        seen, _, terminated, truncated, _ = envs.step(actions)
        start = terminated | truncated


def test_a_reference_that_seems_to_rest_has_no_heading():
    agent = rigid_envs.reference("BallSteer")
    seen = np.zeros(make_rows("RigidEnvs/BallSteer-v0", 1).observation_space.shape)
    np.testing.assert_array_equal(agent.decode(seen).auxiliary("heading_X", "heading_Y"), 0.0)


def test_the_radius_cancels_where_it_is_hidden_and_is_asked_for_where_it_does_not():
    settings = {"radius": (0.5, 2.0), "start_half_width": 2.0}
    found = rigid_envs.evaluate(
        "BallPark", rigid_envs.reference("BallPark", "three_rolls", **settings), n=20
    )
    assert found.success.mean == 1.0
    with pytest.raises(ConfigError, match=r"config\.radius: radius = \(0\.8, 1\.2\); expected a n"):
        rigid_envs.reference("BallParkGoal", radius=(0.8, 1.2))


# References act on observations as trained policies do, wherever those act.


PARK, GRID, GOAL = (f"RigidEnvs/{name}-v0" for name in ("BallPark", "BallGrid", "BallParkGoal"))
LAWS = [(env_id, name) for env_id in IDS for name in reference_controllers(env_id)]
# of the tasks that the planner of the shortest path solves, which takes seconds, one in short
ALIKE = {(f"RigidEnvs/{name}-v0", "shortest_path") for name in ("BallParkRandom", "BallReorient")}
ALIKE |= {(GOAL, "shortest_path")}
BLIND = {("RigidEnvs/WheelTrack-v0", name) for name in ("feedforward", "pd")}


@cache
def agent_of(env_id, name):
    """A controller as an agent, which keeps what it has computed for its task."""
    return rigid_envs.reference(env_id, name)


@cache
def evaluation_of(env_id, name):
    """Its episodes from the first four starts."""
    return rigid_envs.evaluate(env_id, agent_of(env_id, name), n=4)


def quickest(env_id):
    """The last controller of an id, which plans for milliseconds."""
    return agent_of(env_id, list(reference_controllers(env_id))[-1])


@pytest.mark.parametrize(
    ("env_id", "name"),
    [pytest.param(*law, marks=pytest.mark.long) if law in ALIKE else law for law in LAWS],
)
def test_every_controller_succeeds_from_observations(env_id, name):
    found = evaluation_of(env_id, name)
    # what does not look ahead is left behind its target with a full wheel from some starts
    assert found.successes.all() or (env_id, name) in BLIND
    assert found.policy == name


@pytest.mark.long
@pytest.mark.parametrize(("env_id", "name"), LAWS)
def test_all_500_starts_cost_what_they_cost_the_controller_of_states(env_id, name):
    found = rigid_envs.evaluate(env_id, rigid_envs.reference(env_id, name))
    states = rigid_envs.evaluate(env_id, name)
    np.testing.assert_array_equal(found.successes, states.successes)
    # observations are rounded to float32, 6e-8; unstable motions and bang-bang laws make more of it
    off = np.abs(found.costs / states.costs - 1.0)
    assert np.median(off) < 1e-5 and off.max() < 0.05


@in_full(IDS)
def test_single_environments_are_played_as_rows_are(env_id):
    agent, row = quickest(env_id), 1
    found = evaluation_of(env_id, list(reference_controllers(env_id))[-1])
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
def test_evaluate_policy_of_stable_baselines3_takes_it(env_id):
    agent, wins = quickest(env_id), []

    def keep(names, _):
        if names["done"]:
            wins.append(names["info"]["is_success"])

    theirs = DummyVecEnv([lambda: Monitor(gym.make(env_id))])
    theirs.seed(0)
    for env in (make_vec_env(env_id, 2, seed=0), theirs):
        returns, _ = evaluate_policy(
            agent, env, n_eval_episodes=env.num_envs, callback=keep, return_episode_rewards=True
        )
        assert len(returns) == env.num_envs
    assert wins and all(wins)


def test_a_bare_environment_and_other_wrappers_are_taken():
    agent = quickest(PARK)
    mean, _ = evaluate_policy(agent, gym.make(PARK), n_eval_episodes=2, warn=False)
    assert mean > 5.0  # 10 for parking, minus what the way costs
    rows = DummyVecEnv([lambda: gym.wrappers.RecordEpisodeStatistics(gym.make(PARK))])
    assert evaluate_policy(agent, VecMonitor(rows), n_eval_episodes=3)[0] > 5.0
    envs = gym.wrappers.vector.RecordEpisodeStatistics(gym.make_vec(PARK, num_envs=5))
    assert rigid_envs.evaluate(PARK, agent, n=10, env=envs).successes.all()


def test_one_agent_serves_several_environments_for_it_remembers_nothing():
    agent, n = rigid_envs.reference(PARK, "three_rolls"), 4
    rows = [make_rows(PARK, n) for _ in range(2)]
    seen = [envs.reset(seed=seed)[0] for envs, seed in zip(rows, (0, 50), strict=True)]
    states = [None, None]
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


def test_the_same_state_gives_the_same_action_again():
    agent, envs = rigid_envs.reference("BallSteer"), make_rows("RigidEnvs/BallSteer-v0", 3)
    seen, _ = envs.reset(seed=0)
    first, state = agent.predict(seen)
    for _ in range(2):
        np.testing.assert_array_equal(agent.predict(seen)[0], first)
    seen = envs.step(first)[0]
    second, _ = agent.predict(seen, state)
    agent.predict(seen, None)
    np.testing.assert_array_equal(agent.predict(seen, state)[0], second)


def test_rows_that_begin_are_planned_anew_and_the_others_go_on():
    agent, envs = rigid_envs.reference(PARK, "three_rolls"), make_rows(PARK, 3)
    seen, _ = envs.reset(seed=0)
    _, state = agent.predict(seen)
    _, kept = agent.predict(seen, state, np.array([False, True, False]))
    np.testing.assert_array_equal(kept.age, [2, 1, 2])
    _, other = agent.predict(seen, kept)
    np.testing.assert_array_equal(other.age, [3, 2, 3])


def test_shapes_and_types_are_those_of_a_model():
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
def test_what_cannot_be_is_refused_by_name(words, settings, message):
    with pytest.raises(ConfigError, match=message):
        rigid_envs.reference(*words, **settings)


@pytest.mark.parametrize("lacking", [{"controllers": {}}, {"decoder": ""}])
def test_an_id_without_a_controller_or_a_decoder_is_refused(lacking, monkeypatch):
    monkeypatch.setitem(registry._RECORDS, PARK, replace(ENVIRONMENTS[PARK], **lacking))
    with pytest.raises(ConfigError, match=f"env_id = '{PARK}'; expected one with a controller and"):
        rigid_envs.reference(PARK)


def test_observations_and_states_that_do_not_fit_are_refused():
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


def test_it_says_what_it_is():
    agent = rigid_envs.reference("TopRandom", rotation="quat")
    assert repr(agent) == "rigid_envs.reference('RigidEnvs/TopRandom-v0', 'lqr', rotation='quat')"
    assert agent.env_kwargs == {"rotation": "quat"}
    assert rigid_envs.evaluate("TopRandom", agent, n=4).config == {"rotation": "quat"}


def test_the_page_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = run_page("references.md")
    assert names["info"]["is_success"]
    assert names["mean"] > 5.0  # 10 for parking, minus what the way costs
