"""A complete state is restored to the bit, or refused; no number in it can do harm."""

import numpy as np
import pytest

from rigid_envs.kernels.layout import CLOCK
from rigid_envs.registry import ENVIRONMENTS
from rigid_envs.testing.environments import (
    actions,
    assert_same_bits,
    ending,
    flat,
    single,
    vector,
)

N = 3
NUMBERS = (np.nan, np.inf, -np.inf, -1.0, 0.5, 3.0, 1e3, 2.0**33, 1e18, 1e300, -1e300, 5e-324)
"""What is put in the place of each number of a state."""


def played(env_id):
    """Rows in the middle of episodes, with drawn parameters, noise and delays."""
    envs = vector(env_id, N, **ending(env_id))
    envs.reset(seed=0)
    for batch in actions(env_id, 3, N):
        envs.step(batch)
    return envs


def refusal(env, state):
    """The message with which a state is refused, after which everything is as before; or None."""
    before = env.get_state()
    try:
        env.set_state(state)
    except ValueError as error:
        assert_same_bits(env.get_state(), before)
        return str(error)
    return None


def test_no_number_of_a_state_does_harm(env_id):
    envs = played(env_id)
    state, batches, space = envs.get_state(), actions(env_id, 3, N, seed=1), envs.observation_space
    n_refused = 0
    for name, part in state.items():
        for k in range(part.shape[1]):
            for number in NUMBERS:
                other = part.copy()
                other[1, k] = number
                if refusal(envs, {**state, name: other}):
                    n_refused += 1
                    continue
                for batch in batches:
                    observations, rewards, *_ = envs.step(batch)
                    assert space.contains(observations), (name, k, number)
                    assert np.isfinite(rewards).all(), (name, k, number)
    assert n_refused > 5 * len(NUMBERS)


def test_a_physical_state_that_is_not_finite_is_refused(env_id):
    envs = played(env_id)
    state = envs.get_state()
    for k in range(state["y"].shape[1]):
        for number in (np.nan, np.inf, -np.inf):
            other = state["y"].copy()
            other[1, k] = number
            assert f"state['y'][1, {k}] = " in refusal(envs, {**state, "y": other})


def test_what_a_row_of_a_refused_state_would_index_is_never_read(env_id):
    envs = played(env_id)
    state = envs.get_state()
    for part, k, number in (
        ("channel", 2, 4.0),  # one more than the longest delay
        ("channel", 2, -1.0),
        ("channel", 2, 0.5),
        ("clock", CLOCK.elapsed, -1.0),
        ("clock", CLOCK.episode, 2.0**60),
        ("clock", CLOCK.key_low, 2.0**32),
        ("clock", CLOCK.running, 2.0),
    ):
        other = state[part].copy()
        other[-1, k] = number
        assert "expected whole numbers" in refusal(envs, {**state, part: other})


@pytest.mark.parametrize(
    "change",
    [
        lambda part: part.astype(complex),
        lambda part: part.astype(str),
        lambda part: part > 0.0,
        lambda part: part[:, :-1],
        lambda part: part[:-1],
        lambda part: part.ravel(),
        lambda part: [[None]],
        lambda part: [[1.0], [1.0, 2.0]],
        lambda part: 10**400,
    ],
    ids=["complex", "text", "bool", "short", "few", "flat", "none", "ragged", "huge"],
)
def test_parts_that_are_no_numbers_of_their_shape_are_refused_by_name(env_id, change):
    envs = played(env_id)
    state = envs.get_state()
    for name, part in state.items():
        assert f"state[{name!r}]" in refusal(envs, {**state, name: change(part)})


def test_a_missing_and_an_unknown_part_are_refused(env_id):
    envs = played(env_id)
    state = envs.get_state()
    assert "expected" in refusal(envs, {**state, "speed": state["y"]})
    for name in state:
        assert name in refusal(envs, {key: part for key, part in state.items() if key != name})


def test_the_state_of_another_environment_is_refused(env_id):
    env = single(env_id)
    env.reset(seed=0)
    state = env.get_state()
    for other_id in ENVIRONMENTS:
        other = single(other_id)
        other.reset(seed=0)
        if type(other.task) is not type(env.task):
            assert refusal(other, state)


def test_the_state_of_another_configuration_is_refused(env_id):
    env, other = single(env_id), single(env_id, **ending(env_id))
    for each in (env, other):
        each.reset(seed=0)
    assert "digest" in refusal(env, env.get_state() | {"digest": other.get_state()["digest"]})
    assert refusal(other, env.get_state())


def test_rows_that_have_not_begun_are_restored_as_they_are(env_id):
    envs, other = vector(env_id, N), vector(env_id, N)
    other.set_state(envs.get_state())
    assert_same_bits(other.get_state(), envs.get_state())
    other.reset(seed=3)
    envs.reset(seed=3)
    assert_same_bits(other.y, envs.y)
    assert np.isfinite(flat(other.step(actions(env_id, 1, N)[0])[0])).all()
