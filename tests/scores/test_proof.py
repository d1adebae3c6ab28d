"""An evaluation is ranked if its actions, played again in the registered task, give its figures."""

import copy
import re
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import SyncVectorEnv, VectorActionWrapper, VectorWrapper
from gymnasium.wrappers import NormalizeReward, RescaleAction, TimeLimit

from rigid_envs import evaluate, load
from rigid_envs.envs.shells import RigidEnv, RigidVectorEnv
from rigid_envs.scores import finding
from rigid_envs.scores.policies import from_function, recorded, reference_controllers
from rigid_envs.scores.proof import Witness, bounds_of, refuse_impossible
from rigid_envs.scores.starts import TEST_SEED, Cost
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools.cli import main
from rigid_envs.watch.replays.recording import record_starts

TOP = "RigidEnvs/SleepingTop-v0"  # 300 steps, no bound is known, nobody succeeds by doing nothing
PARK = "RigidEnvs/BallPark-v0"
PLATE = "RigidEnvs/BallPlate-v0"  # episodes end when the ball rolls off
DETUMBLE = "RigidEnvs/Detumble-v0"
N = 4
LAX = {"tolerance": 1.5, "start_tilt": 0.01}


def rows(env_id=TOP, **options):
    """Native rows that no registration knows of."""
    record = ENVIRONMENTS[env_id]
    given = {"max_episode_steps": record.max_episode_steps, "autoreset_mode": "SameStep", **options}
    return RigidVectorEnv(record.task, N, **given)


def nothing(_):
    return np.zeros((N, 2), np.float32)


def refused(found, reason):
    """It stands beside nothing, says why, and says it in the row too."""
    assert found.unranked is not None and reason in found.unranked
    assert found.best is None and found.efficiency is None and not found.records.any()
    assert found.unranked in str(found) and found.row()["unranked"] == found.unranked


@pytest.mark.parametrize(
    "make",
    [
        lambda: rows(**LAX),
        lambda: gym.make_vec(TOP, num_envs=N, **LAX),
        lambda: gym.make_vec(TOP, num_envs=N, vectorization_mode="sync", **LAX),
        lambda: TimeLimit(RigidEnv(ENVIRONMENTS[TOP].task, **LAX), 300),
    ],
    ids=["no spec", "native", "sync", "single without spec"],
)
def test_an_easier_task_is_not_ranked_whoever_made_it(make):
    found = evaluate(TOP, "zero", n=N, env=make())
    assert found.config == LAX and found.cost is not None
    refused(found, "start_tilt = 0.01; expected 0.2, as registered")


def test_an_easier_task_in_place_of_the_registered_one_is_not_ranked(monkeypatch):
    """Gymnasium lets anybody register an id again."""
    monkeypatch.setitem(gym.registry[TOP].kwargs, "tolerance", 1.5)
    found = evaluate(TOP, "zero", n=N)
    assert found.config == {"tolerance": 1.5}
    refused(found, "tolerance = 1.5; expected 0.05, as registered")


def test_a_task_that_says_other_settings_than_it_has_is_not_ranked():
    envs = rows(**LAX)
    envs._core.task = rows().task
    found = evaluate(TOP, "zero", n=N, env=envs)
    assert found.config == {}
    refused(found, "which its actions give in the registered task")


def test_an_environment_of_another_task_is_refused():
    with pytest.raises(ValueError, match=rf"env = SleepingTopRandom; expected one of {TOP}"):
        evaluate(TOP, "zero", n=N, env=rows("RigidEnvs/SleepingTopRandom-v0"))


class Lies(VectorWrapper):
    """Every infos entry of a name is what it says."""

    def __init__(self, env, **lies):
        super().__init__(env)
        self.lies = lies

    def step(self, actions):
        *rest, infos = self.env.step(actions)
        for told in (infos, infos.get("final_info", {})):
            told |= {name: np.full(self.num_envs, value) for name, value in self.lies.items()}
        return *rest, infos


@pytest.mark.parametrize("policy", ["random", "lqr"])
def test_infos_that_a_wrapper_has_written_do_not_count(policy):
    plain, lies = evaluate(TOP, policy, n=N), {"is_success": True, "cost": 0.001}
    lies["reward/upright"] = 1.0
    for mode in ("SameStep", "NextStep"):
        found = evaluate(TOP, policy, n=N, env=Lies(rows(autoreset_mode=mode), **lies))
        assert found.unranked is None
        np.testing.assert_equal(found.values, plain.values)


def test_nor_do_those_of_an_easier_task():
    easier = {"angle_tolerance": 1.5, "position_tolerance": 3.0}
    found = evaluate(PARK, "zero", n=N, env=Lies(rows(PARK, **easier), is_success=True))
    refused(found, "position_tolerance = 3.0")
    plain = evaluate(PARK, "zero", n=N, config=easier)
    np.testing.assert_equal(found.values, plain.values)


def test_a_success_below_the_bound_of_theory_is_refused():
    envs = rows(PARK)

    def parked(_):
        state = envs.get_state()
        state["y"][:, :4], state["y"][:, 4:] = [1.0, 0.0, 0.0, 0.0], 0.0
        envs.set_state(state)
        return np.zeros((N, 2), np.float32)

    least = re.escape(f"{bounds_of(PARK, 1, TEST_SEED, {})[0]:.6f}")
    message = rf"path of start 0 = 0\.0; expected at least {least}\d*, the bound of theory"
    with pytest.raises(ValueError, match=message):
        evaluate(PARK, parked, n=N, env=envs)


def test_a_bound_that_holds_in_the_registered_task_refuses_nothing_in_another_one():
    found = evaluate(DETUMBLE, "riccati", n=40, config={"weight_impulse": 5.0})
    cheap = found.costs < found.bounds * (1.0 - 1e-4)  # 50 steps cost less than to go on for ever
    assert (cheap & found.successes).any()
    refused(found, "weight_impulse = 5.0; expected")


@pytest.mark.parametrize("bounds", [None, np.zeros(2), np.ones(2)])
@pytest.mark.parametrize("cost", [np.nan, -1e-3])
def test_a_success_has_a_cost_from_the_bound_on_and_from_0_on_without_one(cost, bounds):
    path, won = Cost("path", "m", 0.01), np.array([True, True])
    with pytest.raises(ValueError, match=f"path of start 1 = {cost}; expected at least"):
        refuse_impossible(path, won, np.array([1.0, cost]), bounds)
    refuse_impossible(path, np.array([True, False]), np.array([1.0, cost]), bounds)
    refuse_impossible(path, won, np.array([1.0, 1.0 - 1e-7]), bounds)  # rounded


def test_a_policy_that_sets_states_is_not_ranked():
    envs = rows()

    def upright(_):
        state = envs.get_state()
        state["y"][:] = [1.0, 0.0, 0.0, 0.0, *np.zeros(state["y"].shape[1] - 4)]
        envs.set_state(state)
        return nothing(_)

    found = evaluate(TOP, upright, n=N, env=envs)
    assert found.successes.all()
    refused(found, "success of start 0 = True; expected False")


def test_a_policy_that_begins_elsewhere_is_not_ranked():
    envs, begun = rows(), []

    def elsewhere(_):
        if not begun:
            q = [1.0, 0.0, 0.0, 0.0]
            begun.append(envs.reset(options={"state": {"q": q, "omega_body": [0.0, 0.0, 0.0]}}))
        return nothing(_)

    found = evaluate(TOP, elsewhere, n=N, env=envs)
    assert found.successes.all()
    refused(found, "success of start 0 = True; expected False")


def test_a_policy_that_makes_steps_of_its_own_is_not_ranked():
    envs = rows()

    def hasty(_):
        envs.step(nothing(_))
        return nothing(_)

    refused(evaluate(TOP, hasty, n=N, env=envs), "length of start 0 = 1")


class Skips(VectorWrapper):
    """Each action three times; what the first two of them cost is not told."""

    def step(self, actions):
        for _ in range(2):
            self.env.step(actions)
        return self.env.step(actions)


def test_a_wrapper_that_hides_steps_is_not_ranked():
    refused(evaluate(TOP, "random", n=N, env=Skips(rows())), "cost of start 0 = ")


@pytest.mark.parametrize("limit", [1, 400])
@pytest.mark.parametrize(
    "make",
    [
        lambda limit: rows(max_episode_steps=limit),
        lambda limit: gym.make_vec(TOP, num_envs=N, max_episode_steps=limit),
        lambda limit: gym.make(TOP, max_episode_steps=limit),
    ],
    ids=["no spec", "native", "single"],
)
def test_another_time_limit_is_not_ranked(make, limit):
    found = evaluate(TOP, "zero", n=N, env=make(limit))
    np.testing.assert_array_equal(found.values["length"], limit)
    refused(found, f"max_episode_steps = {limit}; expected 300, as registered")


def test_an_end_before_the_time_limit_is_not_ranked():
    env = TimeLimit(RigidEnv(ENVIRONMENTS[TOP].task), 50)
    refused(evaluate(TOP, "zero", n=1, env=env), "length of start 0 = 50; expected 300")


def test_rows_in_other_processes_and_of_others_are_not_ranked():
    options = {"vectorization_mode": "async", "rotation": "quat"}
    envs = gym.make_vec(DETUMBLE, num_envs=2, **options)
    found = evaluate(DETUMBLE, "zero", n=2, env=envs)
    envs.close()
    assert found.config == {"rotation": "quat"}
    refused(found, "env: no rows in reach")
    again = evaluate("Mine/Top-v0", "zero", n=1, env=TimeLimit(RigidEnv(ENVIRONMENTS[TOP].task), 9))
    assert again.unranked == "env_id = 'Mine/Top-v0'; expected a registered one"


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"seed": 7}, f"seed = 7; expected {TEST_SEED}, of the evaluation set"),
        ({"n": 501}, "n = 501; expected 500 at most, the evaluation set"),
        ({"config": {"weight_impulse": 0.5}}, "weight_impulse = 0.5; expected 1.0, as registered"),
    ],
    ids=str,
)
def test_other_starts_and_weights_of_which_the_cost_is_made_are_not_ranked(options, reason):
    refused(evaluate(DETUMBLE, "brake", **{"n": 2, **options}), reason)


class Halved(VectorActionWrapper):
    """Half of each action."""

    def actions(self, actions):
        return 0.5 * actions


@pytest.mark.parametrize(
    ("env_id", "make"),
    [
        (TOP, lambda: rows()),
        (TOP, lambda: rows(max_episode_steps=None)),
        (TOP, lambda: rows(weight_upright=0.3, rotation="quat")),
        (DETUMBLE, lambda: gym.make_vec(DETUMBLE, num_envs=3)),
        (DETUMBLE, lambda: Halved(gym.make_vec(DETUMBLE, num_envs=3))),
        (DETUMBLE, lambda: RigidEnv(ENVIRONMENTS[DETUMBLE].task)),
        (DETUMBLE, lambda: RescaleAction(gym.make(DETUMBLE), np.float32(-2.0), np.float32(2.0))),
        (PLATE, lambda: SyncVectorEnv([lambda: gym.make(PLATE)] * 3)),
        (PARK, lambda: gym.make_vec(PARK, num_envs=200, num_threads=2, frame="reduced")),
        ("RigidEnvs/BallGrid-v0", lambda: gym.make_vec("RigidEnvs/BallGrid-v0", num_envs=5)),
        ("RigidEnvs/BallGrid-v0", lambda: gym.make("RigidEnvs/BallGrid-v0")),
        ("RigidEnvs/Reorient-v0", lambda: gym.make_vec("RigidEnvs/Reorient-v0", num_envs=2)),
    ],
)
def test_every_form_of_the_registered_task_is_ranked(env_id, make):
    env = make()
    found = evaluate(env_id, "random", n=5, env=env)
    assert found.unranked is None and found.efficiency is not None
    other = evaluate(env_id, "random", n=5, env=env)  # nothing is left behind
    np.testing.assert_array_equal(found.costs, other.costs)


def test_rewards_of_a_wrapper_count_in_the_return_and_in_no_metric():
    actions = load("Detumble").predict
    model = from_function(lambda seen: actions(seen)[0])
    plain = evaluate(DETUMBLE, model, n=N, config={"frame": "reduced"})
    env = NormalizeReward(gym.make(DETUMBLE, frame="reduced"))
    found = evaluate(DETUMBLE, model, n=N, env=env)
    assert found.unranked is None and found.efficiency == plain.efficiency
    assert (found.values["return"] != plain.values["return"]).all()
    np.testing.assert_equal(found.values | {"return": 0}, plain.values | {"return": 0})


def test_an_environment_steps_as_before_once_it_is_evaluated():
    envs = rows()
    step = envs._core.step_into
    evaluate(TOP, "zero", n=N, env=envs)
    assert envs._core.step_into is step
    single = gym.make(TOP)
    evaluate(TOP, "zero", n=1, env=single)
    env = single.unwrapped
    assert env._used_by_step[0].func is env._core.step_into.func


def test_of_several_steps_the_last_success_counts_and_all_costs():
    envs, cost = rows(DETUMBLE), np.zeros(N)
    witness, brake = Witness(envs), reference_controllers(DETUMBLE)["brake"](envs.task)
    envs.reset(seed=0)
    with witness.watching():
        while not (infos := envs.step(np.asarray(brake(envs), np.float32))[4])["is_success"].any():
            cost += infos["cost"]
    last = ("is_success", "reward/momentum")
    told = witness.told({}, (*last, "cost"), np.zeros(N, bool))
    for key in last:
        np.testing.assert_array_equal(told[key], infos[key])
    np.testing.assert_allclose(told["cost"], cost + infos["cost"], rtol=1e-12)
    assert cost.all()


def test_a_policy_may_try_its_actions_in_copies():
    env = gym.make(DETUMBLE)
    single = env.unwrapped

    def careful(_):
        copy.deepcopy(single).step(np.ones(3, np.float32))
        return np.zeros((1, 3), np.float32)

    assert evaluate(DETUMBLE, careful, n=1, env=env).unranked is None


def test_an_environment_without_a_limit_is_cut_off_at_the_registered_one():
    found = evaluate(TOP, "zero", n=N, env=rows(max_episode_steps=None))
    np.testing.assert_array_equal(found.values["length"], 300)


class Endless(gym.Env[Any, Any]):
    """Nothing happens."""

    observation_space = action_space = gym.spaces.Box(-1.0, 1.0, (1,))

    def reset(self, *, seed=None, options=None):
        return np.zeros(1, np.float32), {}

    def step(self, action):
        return np.zeros(1, np.float32), 0.0, False, False, {}


def test_episodes_of_others_that_do_not_end_are_refused(monkeypatch):
    monkeypatch.setattr("rigid_envs.scores.starts._MOST", 100)
    message = "env: 1 episodes of more than 100 steps; expected a time limit: wrap it in"
    with pytest.raises(ValueError, match=message):
        evaluate("Mine/Endless-v0", "zero", n=1, env=Endless())


def test_costs_of_an_easier_task_do_not_become_the_best_known(tmp_path, capsys):
    easier = evaluate(DETUMBLE, "brake", n=2, config={"start_momentum": 0.5})
    with pytest.raises(ValueError, match=r"^brake: start_momentum = 0\.5; expected .* registered"):
        finding.nothing(DETUMBLE, 2).and_of(easier)
    still = recorded(np.zeros((50, 2, 3), np.float32))
    replay = record_starts(still, DETUMBLE, 2, "me", config={"start_momentum": 0.5})
    words = ["best", DETUMBLE, "--starts", "2", "--out", str(tmp_path)]
    assert main([*words, "--with", str(replay.save(tmp_path / "mine.npz"))]) == 2
    assert "me: start_momentum = 0.5; expected" in capsys.readouterr().err
    assert not list(tmp_path.glob("*.json"))
