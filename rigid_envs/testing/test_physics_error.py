"""A state that is no longer physics ends the episode, and never reaches the agent."""

import numpy as np
import pytest

from rigid_envs.testing.environments import (
    ATTITUDES,
    EARLY_ENDS,
    IDS,
    actions,
    assert_same_bits,
    break_physics,
    free_entries,
    pick,
    rich,
    single,
    still,
    task_of,
    vector,
)

BAD = (1e12, -1e200, 1e300)  # the last ones overflow, to infinity and NaN


def normalized(env_id):
    """Entries of a state that are brought back to unit length: the quaternion's, for one."""
    system = task_of(env_id).system_type
    dynamics, components = system.dynamics, system.components
    rest = np.array(dynamics.State())
    states = (dynamics.State(*changed(rest, k, 1e12).tolist()) for k in range(len(rest)))
    bounded = {k for k, y in enumerate(states) if max(map(abs, dynamics.restore(y))) < 2.0}
    return bounded | set(range(len(rest))[components.get("q", slice(0))])


def changed(y, k, value):
    """A state with another value in one entry."""
    other = y.copy()
    other[k] = value
    return other


def broken_states(env_id, env, action):
    """States with one entry that no physics leads to."""
    state = env.get_state()
    for k in free_entries(env.task):
        if is_overwritten(env, state, k, action):
            continue
        if k in normalized(env_id):  # what is brought back to unit length does no harm
            continue
        for value in BAD:
            yield {**state, "y": changed(state["y"], k, value)}


def is_overwritten(env, state, k, action):
    """Whether an entry of the state means nothing, because the action is what sets it."""
    ends = set()
    for value in (0.0, 1.0, -1.0):
        env.set_state({**state, "y": changed(state["y"], k, value)})
        env.step(action)
        ends.add(env.y.tobytes())
    return len(ends) == 1


@pytest.mark.parametrize("configured", [False, True], ids=["default", "rich"])
def test_a_broken_state_ends_the_episode_without_a_reward(env_id, configured):
    env = single(env_id, **(rich(env_id) if configured else {}))
    env.reset(seed=0)
    action = actions(env_id, 1, 1)[0, 0]
    states = list(broken_states(env_id, env, action))
    assert len(states) >= len(BAD)
    for state in states:
        env.set_state(state)
        observation, reward, terminated, truncated, info = env.step(action)
        assert env.observation_space.contains(observation)
        assert (reward, terminated, truncated) == (0.0, True, False)
        assert info["physics_error"]
        assert not info["is_success"]
        assert info["cost"] == 0.0
        assert [info[f"reward/{term}"] for term in env.task.terms] == [0.0] * len(env.task.terms)
        assert np.isfinite(env.y).all()
        observation, info = env.reset()
        assert env.observation_space.contains(observation)
        assert not info["physics_error"]


@pytest.mark.parametrize("env_id", ATTITUDES)
def test_an_attitude_of_any_length_is_harmless(env_id):
    env = single(env_id)
    env.reset(seed=0)
    state = env.get_state()
    for k in normalized(env_id):
        for value in (1e12, -1e200):
            env.set_state({**state, "y": changed(state["y"], k, value)})
            observation, reward, _, _, _ = env.step(actions(env_id, 1, 1)[0, 0])
            assert env.observation_space.contains(observation)
            assert np.isfinite(reward)


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_a_broken_row_does_not_touch_the_others(env_id, mode):
    n, broken_row = 70, 65
    envs, whole = (vector(env_id, n, autoreset_mode=mode, **rich(env_id)) for _ in range(2))
    envs.reset(seed=0)
    whole.reset(seed=0)
    break_physics(envs, broken_row)
    others = np.arange(n) != broken_row
    for k, batch in enumerate(actions(env_id, 5, n)):
        ours, expected = envs.step(batch), whole.step(batch)
        for a, b in zip(ours[:4], expected[:4], strict=True):
            assert_same_bits(pick(a, others), pick(b, others))
        told = ours[4].get("final_info", ours[4])["physics_error"]
        assert told.tolist() == [row == broken_row and k == 0 for row in range(n)]
        assert np.isfinite(ours[1]).all()
        assert envs.observation_space.contains(ours[0])
    assert np.isfinite(envs.y).all()


def test_states_of_every_size_below_the_limit_are_observed_in_space(env_id):
    env = single(env_id)
    env.reset(seed=0)
    state = env.get_state()
    for k in set(free_entries(env.task)) - normalized(env_id):
        for exponent in range(-300, 9, 4):
            env.set_state({**state, "y": changed(state["y"], k, 10.0**exponent)})
            observation, reward, _, _, _ = env.step(actions(env_id, 1, 1)[0, 0])
            assert env.observation_space.contains(observation)
            assert np.isfinite(reward)


# No episode begins, or goes on, where the integrator is not accurate. That starts that are drawn
# never lead there is part of `test_space`: worst actions give no physics error.


def rates_of(env_id):
    """Component of the state that holds the rates of the motion; None where actions set them."""
    components = task_of(env_id).system_type.components
    return next((n for n in ("omega_body", "velocity", "v") if n in components), None)


FAST = [env_id for env_id in IDS if rates_of(env_id)]


def start(env_id, factor):
    """A start whose rates are some times those of the envelope."""
    components, name = task_of(env_id).system_type.components, rates_of(env_id)
    length = 1.0 if name == "omega_body" else 1e3  # of velocities: no radius is as large
    rates = np.full(len(range(20)[components[name]]), factor * length * task_of(env_id).fastest)
    return {name: rates if len(rates) > 1 else rates[0]}


@pytest.mark.parametrize("env_id", FAST)
def test_a_start_outside_the_envelope_is_refused_and_changes_nothing(env_id):
    for env in (single(env_id, **rich(env_id)), vector(env_id, 3, **rich(env_id))):
        for begin in (lambda: None, lambda env=env: env.reset(seed=0)):
            begin()
            before, generator = env.get_state(), env._np_random
            drawn = None if generator is None else generator.bit_generator.state
            for seed in (None, 1):
                with pytest.raises(ValueError, match=r"expected rates of at most .* rad/s"):
                    env.reset(seed=seed, options={"state": start(env_id, 2.0)})
                assert_same_bits(env.get_state(), before)
                assert env._np_random is generator
                assert generator is None or generator.bit_generator.state == drawn


@pytest.mark.parametrize("env_id", FAST)
def test_a_step_that_leaves_the_envelope_ends_the_episode(env_id):
    env = single(env_id)
    env.reset(seed=0)
    state, name = env.get_state(), rates_of(env_id)
    state["y"][env.task.system_type.components[name]] = start(env_id, 3.0)[name]
    env.set_state(state)
    _, reward, terminated, _, info = env.step(still(env_id, 1)[0])
    assert terminated
    assert np.isfinite(reward)
    assert info["physics_error"] or env_id in EARLY_ENDS  # which a rule of the task may have ended
    assert np.isfinite(env.y).all()


def test_what_goes_on_is_within_the_envelope(env_id):
    envs = vector(env_id, 32, max_episode_steps=30)
    envs.reset(seed=0)
    for batch in actions(env_id, 60, 32):
        _, _, terminated, _, _ = envs.step(batch)
        for y, system in zip(envs.y[~terminated], np.array(envs.systems)[~terminated], strict=True):
            assert system.rate(y) <= envs.task.fastest
