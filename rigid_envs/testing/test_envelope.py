"""No episode goes on where the integrator is not accurate.

That starts that are drawn never lead there is part of `test_space`: worst constant, switching and
resonant actions give no physics error.
"""

import numpy as np
import pytest

from rigid_envs.testing.environments import (
    EARLY_ENDS,
    IDS,
    actions,
    assert_same_bits,
    rich,
    single,
    still,
    task_of,
    vector,
)


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
