"""A published id keeps its bits."""

import gymnasium as gym
import pytest
from gymnasium import spaces

from rigid_envs.engine.compiler import cache_directory
from rigid_envs.testing import fingerprint
from rigid_envs.testing.environments import FULL, fresh, single
from tests.frozen.__main__ import CASES, computed, stored
from tests.refusals import refuses

MEND = (
    "a change of dynamics, spaces, reward or starts is a new id -v1 beside this one; "
    "if none was meant, find what changed it"
)


# a reduced frame is another kernel, which takes seconds to compile
REDUCED = (pytest.mark.long, pytest.mark.push)


@pytest.mark.parametrize(
    ("env_id", "frame"),
    [
        pytest.param(*case, marks=() if case[1] == "world" or case[0] in FULL else REDUCED)
        for case in CASES
    ],
)
def test_a_published_id_keeps_its_bits(env_id, frame):
    frozen = stored().get(env_id, {}).get(frame)
    assert frozen, f"{env_id}, {frame}: not frozen yet; run python -m tests.frozen"
    assert computed(env_id, frame) == frozen, f"{env_id}, frame {frame}, is another: {MEND}"


@pytest.mark.parametrize("env_id", stored())
def test_the_next_process_finds_its_kernels(env_id):
    env = fresh(single(env_id))
    env.step(env.action_space.sample())
    for kernel in (env.task.compiled.step, env.task.compiled.reset):
        kept = cache_directory().glob(f"{kernel.py_func.__qualname__}-*.nbc")
        assert list(kept), "it holds addresses of this process, of a function in an argument?"


def test_no_published_id_has_gone():
    assert {(env_id, frame) for env_id, frames in stored().items() for frame in frames} == {*CASES}


# Marks of states in checkpoints of commit 55502d3a, before the tasks moved to their systems.
STATES = {
    "BallPark": 131036027555625,
    "BallReorient": 240142757800320,
    "IntermediateAxisRandom": 256303025178363,
    "TopRandom": 6749475309125,
}


@pytest.mark.parametrize("name", STATES)
def test_states_of_before_are_taken(name):
    state = gym.make(f"RigidEnvs/{name}-v0").unwrapped.get_state()
    assert state["digest"] == STATES[name], "a run that was begun could not go on"


@pytest.mark.parametrize(
    "change",
    [
        {"weight_position": 0.010000001},
        {"roll_per_step": 0.39269908},
        {"position_tolerance": 0.9, "angle_tolerance": 1.5},
        {"rotation": "quat"},
    ],
)
def test_a_change_of_reward_dynamics_end_or_space_is_noticed(change):
    assert fingerprint("RigidEnvs/BallPark-v0", **change) != computed(
        "RigidEnvs/BallPark-v0", "world"
    )


def test_environments_of_others_have_one_too():
    first, *others = (fingerprint("Pendulum-v1", **gravity) for gravity in ({}, {}, {"g": 9.81}))
    assert [found == first for found in others] == [True, False]


def test_actions_without_bounds_are_refused():
    class Unbounded(gym.Env):
        observation_space = spaces.Discrete(2)
        action_space = spaces.Box(-float("inf"), float("inf"), (1,))

        def reset(self, *, seed=None, options=None):
            return 0, {}

    gym.register("Planted/Unbounded-v0", Unbounded)
    try:
        refuses(r"action_space = .*expected a bounded Box", fingerprint, "Planted/Unbounded-v0")
    finally:
        del gym.registry["Planted/Unbounded-v0"]
