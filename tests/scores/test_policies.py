"""Policies by name: scripts in episodes that begin at any time, and predictive control."""

import sys
import time
from importlib.util import find_spec
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

import rigid_envs  # noqa: F401 - registers the ids
from rigid_envs.control.predictive import PredictiveControl
from rigid_envs.envs.lookup import task_of
from rigid_envs.scores import policies
from rigid_envs.scores.best import best_known
from rigid_envs.scores.evaluation import evaluate
from rigid_envs.scores.records import read_evaluation
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools.cli import main


def rows(n, mode="NextStep", limit=7):
    options = {"autoreset_mode": mode, "max_episode_steps": limit}
    return gym.make_vec("RigidEnvs/BallPark-v0", n, "vector_entry_point", **options)


class Counted:
    """A plan of three entries per row: which row it is, and how often it was planned for."""

    def __init__(self, n):
        self.times = np.zeros(n)

    def __call__(self, envs, rows):
        self.times[rows] += 1
        first = np.stack([rows + 0.0, self.times[rows], 0.0 * rows], axis=-1)
        return first + np.array([0.0, 0.0, 1.0]) * np.arange(3)[:, None, None]


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_a_policy_that_rests_acts_at_its_times_alone_in_every_episode(mode):
    envs = rows(2, mode)
    acts = np.array([[True, False], [False, True], [True, True]])
    policy = policies.from_function(lambda seen: np.full((len(seen), 2), 0.5, np.float32))
    act = policies.resting(policy, acts)(envs)
    seen, _ = envs.reset(seed=0)
    given = []
    for _ in range(9):
        given.append(act(seen)[:, 0])
        seen = envs.step(given[-1][:, None].repeat(2, axis=1))[0]
    gap = [] if mode == "SameStep" else [given[7]]  # the step that resets
    expected = [*(0.5 * acts), *[[0.5, 0.5]] * 4, *gap, *(0.5 * acts)]
    np.testing.assert_array_equal(given, expected[:9])


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_entries_are_due_one_after_the_other_and_the_last_one_stays(mode):
    envs, n = rows(4, mode), 4
    script = policies.Script(Counted(n))
    envs.reset(seed=0)
    steps = []
    for _ in range(20):
        due = script(envs.unwrapped)
        np.testing.assert_array_equal(due[:, 0], np.arange(n))
        steps.append(due[0, 1:])
        envs.step(np.zeros((n, 2), dtype=np.float32))
    # seven steps an episode; the step of a reset, in which actions do not count, is one more
    length = 8 if mode == "NextStep" else 7
    expected = [(1 + k // length, min(k % length, 2)) for k in range(20)]
    np.testing.assert_array_equal(steps, expected)


def test_only_rows_that_begin_are_planned_for():
    envs, plan = rows(4), Counted(4)
    script = policies.Script(plan)
    envs.reset(seed=0)
    for _ in range(3):
        script(envs.unwrapped)
        envs.step(np.zeros((4, 2), dtype=np.float32))
    envs.reset(options={"reset_mask": np.array([False, True, False, True])})
    np.testing.assert_array_equal(script(envs.unwrapped)[:, 2], [2, 0, 2, 0])
    np.testing.assert_array_equal(plan.times, [1, 2, 1, 2])


def test_rows_that_count_no_more_keep_their_last_plan():
    envs, plan = rows(3), Counted(3)
    script = policies.Script(plan)
    for begun in ([1, 1, 1], [1, 2, 1]):
        envs.reset(seed=0)
        script(envs.unwrapped)
        np.testing.assert_array_equal(plan.times, begun)
        envs.unwrapped.uncounted = np.array([True, False, True])


def test_a_script_that_comes_late_begins_where_rows_are():
    envs = rows(2)
    envs.reset(seed=0)
    envs.step(np.zeros((2, 2), dtype=np.float32))
    script = policies.Script(Counted(2))
    np.testing.assert_array_equal(script(envs.unwrapped)[:, 2], [0, 0])
    envs.step(np.zeros((2, 2), dtype=np.float32))
    np.testing.assert_array_equal(script(envs.unwrapped)[:, 2], [1, 1])


def test_plans_are_made_anew_after_a_period():
    envs, plan = rows(2, limit=100), Counted(2)
    script = policies.Script(plan, period=2)
    envs.reset(seed=0)
    for k in range(6):
        np.testing.assert_array_equal(script(envs.unwrapped)[:, 1:], [[1 + k // 2, k % 2]] * 2)
        envs.step(np.zeros((2, 2), dtype=np.float32))


@pytest.mark.parametrize("longer_first", [True, False])
def test_plans_of_different_lengths_stand_side_by_side(longer_first):
    lengths = iter([4, 2] if longer_first else [2, 4])

    def plan(envs, rows):
        n = next(lengths)
        return np.tile(np.arange(1.0, n + 1.0)[:, None, None], (1, len(rows), 1))

    envs, script = rows(2, limit=100), policies.Script(plan)
    envs.reset(seed=0)
    script(envs.unwrapped)
    envs.step(np.zeros((2, 2), dtype=np.float32))
    envs.reset(options={"reset_mask": np.array([False, True])})
    found = []
    for _ in range(5):
        found.append(script(envs.unwrapped)[:, 0])
        envs.step(np.zeros((2, 2), dtype=np.float32))
    first, second = ([2, 3, 4, 4, 4], [1, 2, 2, 2, 2]), ([2, 2, 2, 2, 2], [1, 2, 3, 4, 4])
    np.testing.assert_array_equal(np.transpose(found), first if longer_first else second)


@pytest.mark.long
@pytest.mark.push
@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_planned_balls_are_parked_episode_after_episode(mode):
    envs = rows(8, mode, limit=100)
    policy = policies.reference_controllers("RigidEnvs/BallPark-v0")["three_rolls"](
        envs.unwrapped.task
    )
    envs.reset(seed=0)
    ends, parked = 0, 0
    for _ in range(90):
        actions = policy(envs.unwrapped).astype(np.float32)
        _, _, terminated, truncated, infos = envs.step(actions)
        last = infos["final_info"] if "final_info" in infos else infos
        ended = terminated | truncated
        ends, parked = ends + np.sum(ended), parked + np.sum(last["is_success"][ended])
    assert ends > 20
    assert parked == ends


HELD = ("IntermediateAxis", "PivotTop", "BallPlate")
each = pytest.mark.parametrize(
    "name", [HELD[0], *(pytest.param(name, marks=pytest.mark.long) for name in HELD[1:])]
)
needs_casadi = pytest.mark.skipif(find_spec("casadi") is None, reason="needs CasADi")


def test_it_is_there_where_the_registry_says_so_and_no_reference_controller():
    known = {env_id for env_id in ENVIRONMENTS if policies.predictive_controllers(env_id)}
    assert known == {f"RigidEnvs/{name}-v0" for name in (*HELD, "IntermediateAxisRandom")}
    for env_id, record in ENVIRONMENTS.items():
        assert ("nmpc" in policies.untrained_policies(env_id)) == (env_id in known)
        assert "nmpc" not in record.controllers


@needs_casadi
@pytest.mark.parametrize(
    ("name", "periods"), [("IntermediateAxis", 52), ("PivotTop", 156), ("BallPlate", 32)]
)
def test_plans_look_as_far_ahead_as_their_descriptions_say(name, periods, monkeypatch):
    seen, checked = [], PredictiveControl.__post_init__

    def keep(law):
        checked(law)
        seen.append(law.intervals)

    monkeypatch.setattr(PredictiveControl, "__post_init__", keep)
    env_id = f"RigidEnvs/{name}-v0"
    task, (make,) = task_of(env_id), policies.predictive_controllers(env_id).values()
    make(task)
    assert sum(seen[0]) == pytest.approx(periods * task.dt, rel=1e-12)
    assert f"{periods} control periods" in make.__doc__


@needs_casadi
@each
def test_an_episode_is_held_within_a_minute_at_the_published_cost_below_the_regulators(name):
    env_id, begin = f"RigidEnvs/{name}-v0", time.perf_counter()
    found = evaluate(env_id, "nmpc", n=1)
    assert time.perf_counter() - begin < 60.0
    assert found.success.mean == 1.0
    assert found.policy == "nmpc"
    regulator = evaluate(env_id, "lqr", n=1)
    assert found.costs[0] < regulator.costs[0]
    rows = Path(__file__).parents[2] / "docs" / "rows"
    published = read_evaluation(rows / f"{name}-v0_nmpc.json")
    assert found.costs[0] == pytest.approx(published.costs[0], rel=1e-3)  # other builds of CasADi
    np.testing.assert_array_equal(found.best, best_known(env_id).costs[:1])


@pytest.mark.long
@pytest.mark.push
@needs_casadi
def test_a_row_is_planned_as_if_it_were_alone():
    alone, together = (evaluate("RigidEnvs/IntermediateAxis-v0", "nmpc", n=n) for n in (1, 2))
    assert alone.values["cost"][0] == together.values["cost"][0]
    assert alone.values["return"][0] == together.values["return"][0]


@pytest.mark.long
@pytest.mark.push
@needs_casadi
def test_bodies_that_are_drawn_are_held_by_the_plan_of_the_middle_one():
    assert evaluate("RigidEnvs/IntermediateAxisRandom-v0", "nmpc", n=3).success.mean == 1.0


def test_the_command_names_what_is_missing(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "casadi", None)
    assert main(["evaluate", "RigidEnvs/PivotTop-v0", "--policy", "nmpc", "--starts", "1"]) == 1
    assert capsys.readouterr().err == (
        'rigid-envs: symbolic models need CasADi: pip install "rigid-envs[control]"\n'
    )
