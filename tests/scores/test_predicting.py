"""Predictive control by name: three environments are held, in less than a minute each."""

import sys
import time
from importlib.util import find_spec

import numpy as np
import pytest

from rigid_envs.control.predictive import PredictiveControl
from rigid_envs.envs.lookup import task_of
from rigid_envs.scores.best import best_known
from rigid_envs.scores.evaluation import evaluate
from rigid_envs.scores.policies import predictive_controllers, untrained_policies
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools.cli import main

HELD = ("IntermediateAxis", "PivotTop", "BallPlate")
each = pytest.mark.parametrize(
    "name", [HELD[0], *(pytest.param(name, marks=pytest.mark.long) for name in HELD[1:])]
)
needs_casadi = pytest.mark.skipif(find_spec("casadi") is None, reason="needs CasADi")


def test_it_is_there_where_the_registry_says_so_and_no_reference_controller():
    known = {env_id for env_id in ENVIRONMENTS if predictive_controllers(env_id)}
    assert known == {f"RigidEnvs/{name}-v0" for name in (*HELD, "IntermediateAxisRandom")}
    for env_id, record in ENVIRONMENTS.items():
        assert ("nmpc" in untrained_policies(env_id)) == (env_id in known)
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
    task, (make,) = task_of(env_id), predictive_controllers(env_id).values()
    make(task)
    assert sum(seen[0]) == pytest.approx(periods * task.dt, rel=1e-12)
    assert f"{periods} control periods" in make.__doc__


@needs_casadi
@each
def test_an_episode_is_held_within_a_minute_and_costs_less_than_by_the_regulator(name):
    env_id, begin = f"RigidEnvs/{name}-v0", time.perf_counter()
    found = evaluate(env_id, "nmpc", n=1)
    assert time.perf_counter() - begin < 60.0
    assert found.success.mean == 1.0
    assert found.policy == "nmpc"
    regulator = evaluate(env_id, "lqr", n=1)
    assert found.costs[0] < regulator.costs[0]
    np.testing.assert_array_equal(found.best, best_known(env_id).costs[:1])


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
