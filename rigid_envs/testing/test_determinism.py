"""One trajectory for an id, its settings, a seed and the actions: in every bit, however it is run.

Episodes are cut to `HORIZON` steps, so that each run passes several ends and beginnings.
"""

import copy
import pickle
from functools import cache
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from rigid_envs.testing.environments import (
    IDS,
    actions,
    assert_same_bits,
    ending,
    flat,
    in_full,
    pick,
    rich,
    row_of,
    share,
    single,
    vector,
)

SEED, HORIZON, N_STEPS = 7, 11, 45
ROWS = (0, 1, 2, 6, 63, 64, 500, 999)  # the first, and both sides of where a block of rows ends
SIZES = (1, 2, 7, 1000)


def play(env: gym.Env, steps: Any) -> list[Any]:
    """Results of steps; an ended episode is followed by the next."""
    results = []
    for action in steps:
        result = env.step(action)
        results.append(result)
        if result[2] or result[3]:
            results.append(env.reset())
    return results


def timed(env_id: str, **config: Any) -> gym.Env:
    return gym.make(env_id, max_episode_steps=HORIZON, **config)


@cache
def table(env_id: str) -> Any:
    """Actions of a thousand rows."""
    return actions(env_id, N_STEPS, 1000)


@cache
def alone(env_id: str, row: int) -> list[Any]:
    """What a row does as a single environment: (observation, reward, ends, info) of every step."""
    env = timed(env_id, **ending(env_id))
    first, info = env.reset(seed=SEED + row)
    results: list[Any] = [(first, 0.0, False, False, info)]
    for action in table(env_id)[:, row]:
        if results[-1][2] or results[-1][3]:  # as in NEXT_STEP mode: this action is ignored
            observation, info = env.reset()
            results.append((observation, 0.0, False, False, info))
        else:
            results.append(env.step(action))
    return results


def test_a_row_of_many_is_the_single_environment(env_id):
    for num_threads in [1, 2]:
        for n in SIZES:
            config = ending(env_id) | {"max_episode_steps": HORIZON, "num_threads": num_threads}
            envs = vector(env_id, n, **config)
            observations, infos = envs.reset(seed=SEED)
            blank = (np.zeros(n), np.zeros(n, dtype=np.bool_), np.zeros(n, dtype=np.bool_))
            results = [(observations, *blank, infos)]
            results += [envs.step(batch[:n]) for batch in table(env_id)]
            for row in (r for r in ROWS if r < n):
                for step, expected in zip(results, alone(env_id, row), strict=True):
                    observations, rewards, terminated, truncated, infos = step
                    assert_same_bits(pick(observations, row), expected[0])
                    ends = (rewards[row].item(), terminated[row].item(), truncated[row].item())
                    assert_same_bits(ends, expected[1:4])
                    assert_same_bits(row_of(infos, row), expected[4])


@in_full(IDS)
@pytest.mark.parametrize(
    ("mode", "autoreset"), [("sync", "NextStep"), ("sync", "SameStep"), ("async", "SameStep")]
)
def test_native_rows_are_those_of_the_vector_environments_of_gymnasium(env_id, mode, autoreset):
    config = ending(env_id) | {"max_episode_steps": HORIZON}
    native = vector(env_id, 3, autoreset_mode=autoreset, **config)
    theirs = gym.make_vec(
        env_id,
        num_envs=3,
        vectorization_mode=mode,
        vector_kwargs={"autoreset_mode": autoreset},
        **config,
    )
    assert_same_bits(native.reset(seed=SEED), theirs.reset(seed=SEED))
    for batch in table(env_id)[:, :3]:
        ours, other = native.step(batch), theirs.step(batch)
        if "final_obs" in ours[4]:  # an array of ours, theirs is a list in an array
            last = (ours[4].pop("final_obs"), other[4].pop("final_obs"))
            for row in np.flatnonzero(ours[4]["_final_obs"]):
                assert_same_bits(pick(last[0], row), last[1][row])
        assert_same_bits(ours, other)
    theirs.close()


def test_a_used_environment_seeded_again_is_a_new_one(env_id):
    used, new = timed(env_id, **ending(env_id)), timed(env_id, **ending(env_id))
    used.reset(seed=123)
    play(used, table(env_id)[:, 9])
    used.reset(options={"state": used.unwrapped.y})
    play(used, table(env_id)[:5, 9])
    assert_same_bits(used.reset(seed=SEED), new.reset(seed=SEED))
    steps = table(env_id)[:, 0]
    assert_same_bits(play(used, steps), play(new, steps))


def test_environments_run_by_turns_do_not_disturb_each_other(env_id):
    quiet = timed(env_id, **ending(env_id))
    expected = [quiet.reset(seed=SEED), *play(quiet, table(env_id)[:, 0])]
    env, other = timed(env_id, **ending(env_id)), timed(env_id, **ending(env_id))
    others = vector(env_id, 70, **ending(env_id))
    results: list[Any] = [env.reset(seed=SEED)]
    for action in table(env_id)[:, 0]:
        other.reset(seed=1)
        others.reset()
        results += play(env, [action])
        others.step(table(env_id)[0, :70])
        other.step(action)
    assert_same_bits(results, expected)


clones = pytest.mark.parametrize(
    "clone", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))], ids=["copy", "pickle"]
)


@pytest.mark.parametrize("make", [single, timed], ids=["unwrapped", "wrapped"])
@clones
def test_a_copy_in_mid_episode_goes_on_bitwise(env_id, make, clone):
    env = make(env_id, **ending(env_id))
    env.reset(seed=SEED)
    play(env, table(env_id)[:15, 0])
    twin = clone(env)
    steps = table(env_id)[15:, 0]
    expected = play(env, steps)  # the original first: the copy must not see it move
    assert_same_bits(play(twin, steps), expected)


@clones
def test_a_copy_of_many_rows_goes_on_bitwise(env_id, clone):
    envs = vector(env_id, 130, max_episode_steps=HORIZON, num_threads=2, **ending(env_id))
    envs.reset(seed=SEED)
    for batch in table(env_id)[:15, :130]:
        envs.step(batch)
    twin = clone(envs)
    steps = table(env_id)[15:, :130]
    expected = [envs.step(batch) for batch in steps]
    assert_same_bits([twin.step(batch) for batch in steps], expected)


def test_a_restored_state_goes_on_bitwise_also_into_the_next_episodes(env_id):
    env = single(env_id, **ending(env_id))
    env.reset(seed=SEED)
    play(env, table(env_id)[:15, 0])
    state = env.get_state()
    kept = copy.deepcopy(state)
    steps = table(env_id)[15:, 0]
    expected = [*play(env, steps), env.reset()]
    assert_same_bits(state, kept)  # a copy, not a view
    used = single(env_id, **ending(env_id))
    used.reset(seed=99)
    for other in (env, used, single(env_id, **ending(env_id))):
        other.set_state(state)
        assert_same_bits([*play(other, steps), other.reset()], expected)


def test_a_restored_state_of_many_rows_goes_on_bitwise(env_id):
    config = ending(env_id) | {"max_episode_steps": HORIZON}
    envs = vector(env_id, 130, **config)
    envs.reset(seed=SEED)
    for batch in table(env_id)[:11, :130]:
        envs.step(batch)  # some rows have just ended
    state = envs.get_state()
    steps = table(env_id)[15:, :130]
    expected = [*(envs.step(batch) for batch in steps), envs.reset()]
    for other in (envs, vector(env_id, 130, num_threads=2, **config)):
        other.set_state(state)
        assert_same_bits([*(other.step(batch) for batch in steps), other.reset()], expected)


def test_a_state_moves_between_a_row_and_a_single_environment(env_id):
    envs, env = vector(env_id, 70, **rich(env_id)), single(env_id, **rich(env_id))
    envs.reset(seed=SEED)
    env.reset(seed=SEED + 66)
    for batch in table(env_id)[:5, :70]:
        envs.step(batch)
        env.step(batch[66])
    assert_same_bits({k: part[66] for k, part in envs.get_state().items()}, env.get_state())


@pytest.mark.parametrize(
    ("n_rows", "n_checked", "seeds"),
    [
        pytest.param(200, share(1000), (SEED,), id="1e6 in all"),
        pytest.param(1000, 1000, range(100), id="1e8 each", marks=pytest.mark.long),
    ],
)
def test_a_million_steps_of_many_rows_are_those_of_single_environments(
    env_id, n_rows, n_checked, seeds
):
    n_steps, config = 1000, ending(env_id)
    checked = np.linspace(0, n_rows - 1, n_checked, dtype=int)
    envs = vector(env_id, n_rows, num_threads=2, autoreset_mode="SameStep", **config)
    env = gym.make(env_id, **config)
    for seed in seeds:
        batches = actions(env_id, n_steps, n_rows, seed)
        observations, ends = [flat(envs.reset(seed=seed)[0])[checked]], []
        for batch in batches:
            observation, *end, _ = envs.step(batch)
            observations.append(flat(observation)[checked])
            ends.append(np.array(end)[:, checked])
        theirs, their_ends = np.stack(observations), np.stack(ends)
        for k, row in enumerate(checked.tolist()):
            mine, my_ends = [env.reset(seed=seed + row)[0]], []
            for action in batches[:, row]:
                observation, *end, _ = env.step(action)
                mine.append(env.reset()[0] if end[1] or end[2] else observation)
                my_ends.append(end)
            assert_same_bits(np.stack([flat(o) for o in mine]), theirs[:, k])
            assert_same_bits(np.array(my_ends), their_ends[:, :, k])
