"""The shell of one environment: what it shows and hands out."""

import numpy as np
import pytest

from rigid_envs.envs import RigidEnv
from rigid_envs.systems import FreeBody, HeavyTop, RollingBall
from rigid_envs.tasks import ConfigError

SYSTEMS = {
    "rigid_envs.tasks:IntermediateAxis": FreeBody,
    "rigid_envs.tasks:SleepingTop": HeavyTop,
    "rigid_envs.tasks:BallPark": RollingBall,
}


@pytest.fixture(params=SYSTEMS)
def env(request):
    env = RigidEnv(request.param)
    env.reset(seed=0)
    return env


def test_system_is_the_physical_model_with_the_parameters_of_the_task(env):
    task = f"{type(env.task).__module__.rsplit('.', 1)[0]}:{type(env.task).__name__}"
    assert type(env.system) is SYSTEMS[task]
    assert env.system == env.task.system()


def test_system_reads_and_linearises_the_state_of_the_environment(env):
    system, y = env.system, env.y
    assert set(system.invariants(y)) and all(np.isfinite(v) for v in system.invariants(y).values())
    assert system.rhs(y).shape == y.shape
    n, m = len(y), len(system.input_entries)
    assert [part.shape for part in system.linearize(y)] == [(n, n), (n, m)]
    for accessor in system.accessors.values():
        assert np.isfinite(accessor(y)).all()


def test_step_without_control_is_the_advance_of_the_system(env):
    y = env.y
    env.step(np.zeros(env.action_space.shape, dtype=np.float32))
    expected = env.system.advance(y, None, env.task.dt, env.task.n_substeps)
    assert env.y.tobytes() == expected.tobytes()


def test_what_is_handed_out_is_a_copy(env):
    observation, _ = env.reset(seed=1)
    env.y[...] = 9.0
    for part in env.get_state().values():
        part[...] = 9.0
    observation[...] = 9.0
    action = np.full(env.action_space.shape, 0.5, dtype=np.float32)
    first, *_, info = env.step(action)
    kept = first.copy()
    first[...] = 9.0
    info["cost"] = -1.0
    env.reset(seed=1)
    np.testing.assert_array_equal(env.step(action)[0], kept)


def test_action_of_the_caller_is_not_changed(env):
    action = np.full(env.action_space.shape, 3.0, dtype=np.float32)
    assert env.step(action)[4]["action_clipped"]
    assert (action == 3.0).all()


def test_every_result_is_new(env):
    action = np.zeros(env.action_space.shape, dtype=np.float32)
    results = [env.step(action) for _ in range(3)]
    assert len({id(result[0]) for result in results}) == 3
    assert len({id(result[4]) for result in results}) == 3
    assert not np.shares_memory(results[0][0], results[1][0])


def test_name_in_messages_without_a_spec_is_that_of_the_task(env):
    with pytest.raises(ValueError, match=f"^{type(env.task).__name__}: "):
        env.step(np.full(env.action_space.shape, np.nan))


@pytest.mark.parametrize("wrong", ["missing", "shape"])
def test_a_state_that_does_not_fit_is_refused_and_changes_nothing(env, wrong):
    state = env.get_state()
    before = {name: part.copy() for name, part in state.items()}
    changed = {"missing": {"y": state["y"]}, "shape": {**state, "y": state["y"][1:]}}[wrong]
    with pytest.raises(ValueError, match="expected"):
        env.set_state(changed)
    for name, part in env.get_state().items():
        assert part.tobytes() == before[name].tobytes()


def test_state_of_an_ended_episode_is_one_that_has_ended(env):
    state = env.get_state()
    state["y"][-1] = np.nan
    env.set_state(state)
    zero = np.zeros(env.action_space.shape, dtype=np.float32)
    assert env.step(zero)[2]
    ended = env.get_state()
    env.reset()
    env.set_state(ended)
    with pytest.raises(Exception, match="after the episode ended"):
        env.step(zero)


def test_there_is_nothing_to_render(env):
    assert env.metadata["render_modes"] == []
    with pytest.raises(ConfigError, match=r"^config\.render_mode: 'human'"):
        RigidEnv("rigid_envs.tasks:BallPark", render_mode="human")
