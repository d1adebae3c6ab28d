"""A seed fixes a trajectory, in every shell; neighbouring runs are independent."""

import copy
import pickle
import random
from functools import cache

import gymnasium as gym
import numpy as np
import pytest

from rigid_envs.testing.environments import (
    DISCRETE,
    IDS,
    PUSH,
    actions,
    assert_same_bits,
    ending,
    flat,
    fresh,
    in_full,
    pick,
    ranges,
    rich,
    row_of,
    share,
    single,
    task_of,
    vector,
)

# A seed fixes a trajectory; neighbouring runs are independent; no global generator is touched.


@cache
def plain(env_id):
    """The default settings; where starts are few, parameters that tell them apart."""
    envs = fresh(vector(env_id, 64))
    return {} if len(np.unique(start_of(envs), axis=0)) == 64 else ranges(env_id)


def start_of(env):
    """What an episode begins with, apart from its random stream: one row, or (N, n)."""
    state = env.get_state()
    return np.concatenate([state[part] for part in ("y", "parameters", "aux") if part in state], -1)


def starts(env_id, seeds):
    """First state of each seed, shape (len(seeds), n)."""
    envs = vector(env_id, len(seeds), **plain(env_id))
    envs.reset(seed=list(seeds))
    return start_of(envs)


def test_seeds_of_numpy_are_those_of_python(env_id):
    env, envs = single(env_id), vector(env_id, 3)
    expected, rows = env.reset(seed=5)[0], envs.reset(seed=5)[0]
    for kind in (np.int64, np.uint32, np.int8):
        assert_same_bits(env.reset(seed=kind(5))[0], expected)
        assert_same_bits(envs.reset(seed=kind(5))[0], rows)
        assert_same_bits(envs.reset(seed=np.array([5, 6, 7], dtype=kind))[0], rows)


def test_starts_of_1024_spawned_seeds_are_distinct(env_id):
    seeds = [
        int(seed)
        for run in range(16)
        for seed in np.random.SeedSequence(run).generate_state(64, np.uint64)
    ]
    assert len(np.unique(starts(env_id, seeds), axis=0)) == 1024


def test_seeds_that_agree_in_their_lower_32_bits_differ(env_id):
    seeds = [s + k * 2**32 for s in range(64) for k in (0, 1, 2, 2**32)]
    assert len(np.unique(starts(env_id, seeds), axis=0)) == len(seeds)


def test_starts_of_neighbouring_seeds_are_independent(env_id):
    y = starts(env_id, range(4096))
    y = y[:, np.ptp(y, axis=0) > 0]
    y = (y - y.mean(axis=0)) / y.std(axis=0)
    for lag in (1, 2, 64):
        correlation = np.mean(y[lag:] * y[:-lag], axis=0)
        # of n independent pairs it is normal with deviation n^(-1/2) = 1/64; beyond 5 of them:
        # one in 10^6
        assert np.abs(correlation).max() < 5 / 64


def test_every_episode_of_a_seed_starts_elsewhere(env_id):
    env = fresh(single(env_id, **plain(env_id)))
    begun = [start_of(env)]
    for _ in range(99):
        env.reset()
        begun.append(start_of(env))
    assert len(np.unique(begun, axis=0)) == 100


def test_environments_without_a_seed_differ(env_id):
    begun = []
    for _ in range(5):
        envs = vector(env_id, 3, **plain(env_id))
        envs.reset()
        begun.append(start_of(envs))
    assert len(np.unique(np.vstack(begun), axis=0)) == 15


def test_rows_without_a_seed_of_their_own_go_on_in_their_streams(env_id):
    envs, other = fresh(vector(env_id, 3)), fresh(vector(env_id, 3))
    mixed, unseeded = envs.reset(seed=[None, 50, None])[0], other.reset()[0]
    assert_same_bits(pick(mixed, [0, 2]), pick(unseeded, [0, 2]))
    assert_same_bits(pick(mixed, 1), single(env_id).reset(seed=50)[0])


def test_bad_seeds_are_refused_and_change_nothing(env_id):
    lists = [1, 2], [1, 2, 3, 4], [1, 2, -3], [1, 2, "a"], [1, 2, 0.5]
    for env, seeds in (
        (single(env_id), (-1, 0.5, "a", [1, 2, 3])),
        (vector(env_id, 3), (-1, *lists)),
    ):
        env.reset(seed=0)
        before = env.get_state()
        for seed in seeds:
            with pytest.raises((ValueError, gym.error.Error), match=r"[Ss]eed"):
                env.reset(seed=seed)
            assert_same_bits(env.get_state(), before)


def test_global_generators_are_neither_read_nor_moved(env_id):
    def run():
        env, envs = single(env_id, **rich(env_id)), vector(env_id, 3, **rich(env_id))
        results = [env.reset(seed=0), envs.reset(seed=0)]
        for batch in actions(env_id, 20, 3):
            results += [envs.step(batch), env.reset(), env.step(batch[0])]
        env.reset(options={"state": env.y})
        return results

    random.seed(1)
    np.random.seed(1)  # noqa: NPY002 - the generator that must not be used
    before = random.getstate(), np.random.get_state()  # noqa: NPY002
    first = run()
    after = random.getstate(), np.random.get_state()  # noqa: NPY002
    assert before[0] == after[0]
    assert_same_bits(before[1], after[1])
    random.seed(2)
    np.random.seed(2)  # noqa: NPY002
    assert_same_bits(run(), first)


# One trajectory for an id, its settings, a seed and the actions: in every bit, however it is run.
#
# Episodes are cut to `HORIZON` steps, so that each run passes several ends and beginnings.


SEED, HORIZON, N_STEPS = 7, 11, 45
ROWS = (0, 1, 2, 6, 63, 64, 500, 999)  # the first, and both sides of where a block of rows ends
SIZES = (1, 2, 7, 1000)


def play(env, steps):
    """Results of steps; an ended episode is followed by the next."""
    results = []
    for action in steps:
        result = env.step(action)
        results.append(result)
        if result[2] or result[3]:
            results.append(env.reset())
    return results


def timed(env_id, **config):
    return gym.make(env_id, max_episode_steps=HORIZON, **config)


@cache
def table(env_id):
    """Actions of a thousand rows."""
    return actions(env_id, N_STEPS, 1000)


@cache
def alone(env_id, row):
    """What a row does as a single environment: (observation, reward, ends, info) of every step."""
    env = timed(env_id, **ending(env_id))
    first, info = env.reset(seed=SEED + row)
    results = [(first, 0.0, False, False, info)]
    for action in table(env_id)[:, row]:
        if results[-1][2] or results[-1][3]:  # as in NEXT_STEP mode: this action is ignored
            observation, info = env.reset()
            results.append((observation, 0.0, False, False, info))
        else:
            results.append(env.step(action))
    return results


def senseless(env_id, batch):
    """Other actions, for rows that begin anew, where none may matter."""
    if env_id in DISCRETE:
        return (batch + 1) % task_of(env_id).n_choices
    return np.full_like(batch, 1e30) * (np.arange(batch.shape[1]) % 2) - 0.123


def test_a_row_of_many_is_the_single_environment(env_id):
    for num_threads in [1, 2]:
        for n in SIZES:
            config = ending(env_id) | {"max_episode_steps": HORIZON, "num_threads": num_threads}
            envs = vector(env_id, n, **config)
            observations, infos = envs.reset(seed=SEED)
            blank = (np.zeros(n), np.zeros(n, dtype=np.bool_), np.zeros(n, dtype=np.bool_))
            results = [(observations, *blank, infos)]
            for batch in table(env_id)[:, :n]:
                ended = results[-1][2] | results[-1][3]
                taken = batch.copy()
                taken[ended] = senseless(env_id, batch)[ended]
                results.append(envs.step(taken))
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
    results = [env.reset(seed=SEED)]
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
    envs = fresh(
        vector(env_id, 130, max_episode_steps=HORIZON, num_threads=2, **ending(env_id)), SEED
    )
    for batch in table(env_id)[:15, :130]:
        envs.step(batch)
    twin = clone(envs)
    steps = table(env_id)[15:, :130]
    expected = [envs.step(batch) for batch in steps]
    assert_same_bits([twin.step(batch) for batch in steps], expected)


def test_a_restored_state_goes_on_bitwise_also_into_the_next_episodes(env_id):
    env = fresh(single(env_id, **ending(env_id)), SEED)
    play(env, table(env_id)[:15, 0])
    state = env.get_state()
    kept = copy.deepcopy(state)
    steps = table(env_id)[15:, 0]
    expected = [*play(env, steps), env.reset()]
    assert_same_bits(state, kept)  # a copy, not a view
    used = fresh(single(env_id, **ending(env_id)), 99)
    for other in (env, used, single(env_id, **ending(env_id))):
        other.set_state(state)
        assert_same_bits([*play(other, steps), other.reset()], expected)


def test_a_restored_state_of_many_rows_goes_on_bitwise(env_id):
    config = ending(env_id) | {"max_episode_steps": HORIZON}
    envs = fresh(vector(env_id, 130, **config), SEED)
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
        pytest.param(200, share(100), (SEED,), id="1e5 in all"),
        pytest.param(200, share(1000), (SEED,), id="1e6 in all", marks=PUSH),
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
