"""A complete state is restored to the bit, or refused; no number in it can do harm."""

import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode

from rigid_envs.engine.layout import CLOCK
from rigid_envs.tasks.task import UNIT
from rigid_envs.testing.environments import (
    IDS,
    OWN,
    actions,
    assert_same_bits,
    break_physics,
    counted,
    ending,
    flat,
    fresh,
    in_full,
    pick,
    single,
    task_of,
    vector,
)

N = 3
NUMBERS = (np.nan, np.inf, -np.inf, -1.0, 0.5, 3.0, 1e3, 2.0**33, 1e18, 1e300, -1e300)
NUMBERS += (5e-324, 1e-160, 1e-12, 1e6)
"""What is put in the place of each number of a state."""


def played(env_id):
    """Rows in the middle of episodes, with drawn parameters, noise and delays."""
    envs = fresh(vector(env_id, N, **ending(env_id)))
    for batch in actions(env_id, 3, N):
        envs.step(batch)
    return envs


def edited(state, part, place, number):
    """A state with another number in a place of a part."""
    other = state[part].copy()
    other[place] = number
    return {**state, part: other}


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
                told = refusal(envs, edited(state, name, (1, k), number)) or ""
                assert name != "y" or np.isfinite(number) or f"state['y'][1, {k}] = " in told
                if told:
                    n_refused += 1
                    continue
                for batch in batches:
                    observations, rewards, *_ = envs.step(batch)
                    assert space.contains(observations), (name, k, number)
                    assert np.isfinite(rewards).all(), (name, k, number)
    assert n_refused > 5 * len(NUMBERS)


@in_full(IDS)
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
        other = edited(state, part, (-1, k), number)
        assert "expected whole numbers" in refusal(envs, other)


@in_full(IDS)
def test_clocks_and_delayed_actions_are_taken_up_to_their_ends_and_no_further(env_id):
    envs = played(env_id)
    state, n = envs.get_state(), envs.task.n_choices
    ends = {
        ("clock", CLOCK.key_high): (0.0, 2.0**32 - 1.0),
        ("clock", CLOCK.key_low): (0.0, 2.0**32 - 1.0),
        ("clock", CLOCK.episode): (0.0, 2.0**53),
        ("clock", CLOCK.elapsed): (0.0, 2.0**44),
        ("clock", CLOCK.running): (0.0, 1.0),
        ("history", 0): (0.0, n - 1.0) if n else (-1.0, 1.0),
    }
    for (part, k), (low, high) in ends.items():
        for number, beyond in ((low, -1.0), (high, 1.0)):
            told = refusal(envs, edited(state, part, (1, k), number))
            assert told is None or number == 0.0  # less than has been played
            for far in {np.nextafter(number, np.inf * beyond), number + beyond} - {number}:
                assert f"state: {part}" in refusal(envs, edited(state, part, (1, k), far))
            envs.set_state(state)


def test_parts_that_are_no_numbers_of_their_shape_are_refused_by_name(env_id):
    for change in [
        lambda part: part.astype(complex),
        lambda part: part.astype(str),
        lambda part: part > 0.0,
        lambda part: part[:, :-1],
        lambda part: part[:-1],
        lambda part: part.ravel(),
        lambda part: [[None]],
        lambda part: [[1.0], [1.0, 2.0]],
        lambda part: 10**400,
    ]:
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
    env = fresh(single(env_id))
    state = env.get_state()
    for other_id in OWN[::8]:  # of several systems
        other = fresh(single(other_id))
        if type(other.task) is not type(env.task):
            assert refusal(other, state)


def test_the_state_of_another_configuration_is_refused(env_id):
    env = fresh(single(env_id))
    term = env.task.terms[0]
    other = fresh(single(env_id, **ending(env_id) | {f"weight_{term}": 0.1234}))
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


def test_no_step_leads_on_from_the_state_of_an_environment_that_was_never_reset(env_id):
    env, quiet = (fresh(single(env_id), 1) for _ in range(2))
    env.set_state(single(env_id).get_state())
    with pytest.raises(ResetNeeded, match="before the first reset"):
        env.step(actions(env_id, 1, 1)[0, 0])
    assert_same_bits(env.reset(), quiet.reset())
    env, quiet = single(env_id), single(env_id)
    env.np_random, quiet.np_random = (np.random.default_rng(1) for _ in range(2))
    env.set_state(quiet.get_state())
    assert_same_bits(env.reset(), quiet.reset())


def test_rows_that_have_not_begun_are_not_stepped_and_keep_their_streams(env_id):
    for mode in AutoresetMode:
        envs, quiet, half = (vector(env_id, N, autoreset_mode=mode) for _ in range(3))
        for each in (envs, quiet):
            each.reset(seed=1)
        first = np.arange(N) == 0
        half.reset(seed=7, options={"reset_mask": first})
        envs.set_state(half.get_state())
        batch = actions(env_id, 1, N)[0]
        with pytest.raises(ResetNeeded, match="before the first reset"):
            envs.step(batch)
        rest = {"reset_mask": ~first}
        begun, expected = envs.reset(options=rest)[0], quiet.reset(options=rest)[0]
        assert_same_bits(pick(begun, ~first), pick(expected, ~first))
        half.reset(seed=7)
        assert_same_bits(pick(envs.step(batch)[0], 0), pick(half.step(batch)[0], 0))


def test_rows_without_a_stream_get_one_at_their_first_reset_and_restored_ones_keep_theirs(env_id):
    first = np.arange(N) == 0
    half, envs = vector(env_id, N), vector(env_id, N)
    half.reset(seed=7, options={"reset_mask": first})
    envs.set_state(half.get_state())
    envs.reset(options={"reset_mask": ~first})
    keys = envs.get_state()["clock"][:, :2]
    assert len(np.unique(keys, axis=0)) == N
    assert_same_bits(keys[0], half.get_state()["clock"][0, :2])


def test_a_row_that_has_ended_is_not_stepped_without_a_reset(env_id):
    for mode in [AutoresetMode.SAME_STEP, AutoresetMode.DISABLED]:
        ended = fresh(vector(env_id, N))
        break_physics(ended, 1)
        ended.step(actions(env_id, 1, N)[0])
        envs = vector(env_id, N, autoreset_mode=mode)
        envs.set_state(ended.get_state())
        with pytest.raises(ResetNeeded, match="row 1 has ended"):
            envs.step(actions(env_id, 1, N)[0])


def test_every_auxiliary_number_has_a_range_of_its_own(env_id):
    envs = played(env_id)
    task, state = envs.task, envs.get_state()
    ranges = task.auxiliary_ranges(envs._core.parameters, np.full(N, 3.0))
    named = [(key,) if isinstance(key, str) else key for key in ranges]
    assert sorted(sum(named, ())) == sorted(task.aux_names)
    for key, names in zip(ranges, named, strict=True):
        columns = [task.aux_names.index(name) for name in names]
        for end, outwards in zip(ranges[key], (-1.0, 1.0), strict=True):
            last = np.broadcast_to(end, N)[1]
            wrong = last + outwards * 0.01 * (1.0 + abs(last))
            if key in task.aux_names or wrong > 0.0:  # a length is at least 0
                numbers = wrong, *np.zeros(len(columns) - 1)
                told = refusal(envs, edited(state, "aux", (1, columns), numbers))
                assert np.isinf(last) or (told.startswith("state: aux: ") and names[0] in told)
        if ranges[key] is UNIT:  # as close as rounding to float32 comes
            other = state["aux"].copy()
            other[:, columns] *= 1.0 + 5e-7
            envs.set_state({**state, "aux": other})
            np.testing.assert_allclose(envs.get_state()["aux"], state["aux"], rtol=1e-12)


def test_counters_are_whole(env_id):
    envs = played(env_id)
    state = envs.get_state()
    for name in task_of(env_id).counters:
        place = 1, task_of(env_id).aux_names.index(name)
        other = edited(state, "aux", place, state["aux"][place] + 0.5)
        assert f"aux: {name}[1] = " in refusal(envs, other)


def test_what_no_row_has_in_an_episode_is_refused(env_id):
    envs, task = played(env_id), task_of(env_id)
    state, parts = envs.get_state(), task.system_type.components
    wrong = [("clock", CLOCK.episode, -1.0)]
    wrong += [("y", parts["q"], 0.0)] if "q" in parts else []
    wrong += [("y", parts[name], 1.0) for name in task.fixed_components]
    for part, place, number in wrong:
        assert part in refusal(envs, edited(state, part, (1, place), number))


def test_the_state_of_any_moment_is_taken_and_gives_the_same_bits(env_id):
    envs, other = vector(env_id, N, **ending(env_id)), vector(env_id, N, **ending(env_id))
    envs.reset(seed=2)
    for k, batch in enumerate(actions(env_id, 60, N, seed=3)):
        if k == 30:
            break_physics(envs, 1)
        state = envs.get_state()
        other.set_state(state)
        assert_same_bits(other.get_state(), state)
        assert_same_bits(envs.step(batch), other.step(batch))


@counted("n_edits", 2000)
def test_edited_states_are_refused_without_a_trace_or_lead_nowhere_outside(env_id, n_edits):
    envs, quiet = played(env_id), played(env_id)
    state, space, n_taken = envs.get_state(), envs.observation_space, 0
    batches, rng = actions(env_id, 25, N, seed=1), np.random.default_rng(2)
    for _ in range(n_edits):
        part = str(rng.choice([*state]))
        other = {name: each.copy() for name, each in state.items()}
        place = (int(rng.integers(N)), int(rng.integers(state[part].shape[1])))
        old, size = other[part][place], 10.0 ** rng.integers(-10, 3)
        other[part][place] = rng.choice([old + size, old - size, old * (1 + size), round(old + 1)])
        if refusal(envs, other):
            assert_same_bits(envs.step(batches[0]), quiet.step(batches[0]))
        else:
            n_taken += 1
            for batch in batches:
                observations, rewards, *_ = envs.step(batch)
                assert space.contains(observations), (part, place, other[part][place])
                assert np.isfinite(rewards).all()
        for each in (envs, quiet):
            each.set_state(state)
    assert 0 < n_taken < n_edits
