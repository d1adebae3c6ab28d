"""Domain randomisation: parameters drawn at reset, noise and delay between agent and body."""

import numpy as np
import pytest
from scipy.stats import kstest

from rigid_envs.tasks.fields import span
from rigid_envs.testing.environments import (
    CONTINUOUS,
    IDS,
    actions,
    assert_same_bits,
    bounds,
    flat,
    fresh,
    in_full,
    is_round,
    ranges,
    single,
    still,
    task_of,
    vector,
)

N = 2000
PASS = 1e-4  # least p-value; seeds are fixed, so a test that passes goes on passing


def drawn(env_id, envs):
    """Physical parameters of every row, by the names that the task gives them."""
    names = {field: name for name, field in task_of(env_id).aliases.items()}
    systems = envs.systems
    return {
        name: np.array([getattr(system, names.get(name, name)) for system in systems])
        for name in ranges(env_id)
    }


def test_each_parameter_is_uniform_in_its_range_and_independent_of_the_others(env_id):
    envs = fresh(vector(env_id, N, **ranges(env_id)))
    values = drawn(env_id, envs)
    for name, (low, high) in ranges(env_id).items():
        assert values[name].min() >= low
        assert values[name].max() <= high
        assert kstest((values[name] - low) / (high - low), "uniform").pvalue > PASS
    correlation = np.corrcoef(list(values.values()))
    # of independent samples it is normal with deviation N^(-1/2); beyond 5 of them: 1 in 10^6
    assert np.abs(correlation - np.eye(len(values))).max() < 5 / np.sqrt(N)


def test_parameters_are_drawn_anew_at_reset_and_kept_until_then(env_id):
    envs = fresh(vector(env_id, 3, **ranges(env_id)))
    first = envs.systems
    for batch in actions(env_id, 5, 3):
        envs.step(batch)
    assert envs.systems == first
    envs.reset(options={"reset_mask": np.array([True, False, True])})
    assert [now == then for now, then in zip(envs.systems, first, strict=True)] == [0, 1, 0]


def test_parameters_that_are_not_ranges_stay_the_numbers_they_are(env_id):
    name, (low, high) = next(iter(ranges(env_id).items()))
    envs = fresh(vector(env_id, 50, **{name: (low, high)}))
    for other, values in drawn(env_id, envs).items():
        least, most = span(getattr(task_of(env_id), other))
        if other == name or least < most:
            assert len(np.unique(values)) == 50
        else:
            assert set(values) == {least}


def test_a_range_of_one_value_is_that_value(env_id):
    point = {name: (low, low) for name, (low, _) in ranges(env_id).items()}
    number = {name: low for name, (low, _) in ranges(env_id).items()}
    ranged, fixed = single(env_id, **point, observe_params=True), single(env_id, **number)
    assert ranged.observation_space == fixed.observation_space
    assert_same_bits(ranged.reset(seed=0), fixed.reset(seed=0))


def test_drawn_parameters_are_observed_on_request_behind_the_rest(env_id):
    shown = vector(env_id, N, **ranges(env_id), observe_params=True)
    hidden = vector(env_id, N, **ranges(env_id))
    observations, plain = flat(shown.reset(seed=0)[0]), flat(hidden.reset(seed=0)[0])
    n_plain = plain.shape[1]
    names = [entry.symbol for entry in shown.task.observations()[n_plain:]]
    assert sorted(names) == sorted(ranges(env_id))
    assert_same_bits(observations[:, :n_plain], plain)
    values = drawn(env_id, shown)
    for k, name in enumerate(names):
        assert_same_bits(observations[:, n_plain + k], values[name].astype(np.float32))
        ends = [end[n_plain + k] for end in bounds(shown.single_observation_space)]
        assert ends == [np.float32(end) for end in ranges(env_id)[name]]


def test_given_parameters_outside_an_observed_range_do_not_leave_the_space(env_id):
    env = single(env_id, **ranges(env_id), observe_params=True)
    for name, (low, high) in ranges(env_id).items():
        for value in (low - 0.01 * (high - low), high + 0.01 * (high - low)):
            try:
                observation, _ = env.reset(seed=0, options={"params": {name: value}})
            except ValueError:
                continue  # refused: as good
            assert env.observation_space.contains(observation)


@in_full(CONTINUOUS)
def test_noise_is_observed_where_it_is_drawn(env_id):
    envs = vector(env_id, 500, observe_params=True, action_noise=(0.1, 0.2), action_delay=2)
    noise = flat(envs.reset(seed=0)[0])[:, -1]
    assert envs.task.observations()[-1].symbol == "action_noise"
    assert noise.min() >= np.float32(0.1)
    assert noise.max() <= np.float32(0.2)
    assert len(np.unique(noise)) == 500


@in_full(IDS)
def test_delay_is_observed_where_it_is_drawn(env_id):
    envs = vector(env_id, 500, observe_params=True, action_delay=(1, 3))
    delay = flat(envs.reset(seed=0)[0])[:, -1]
    assert envs.task.observations()[-1].symbol == "action_delay"
    counts = [np.sum(delay == k) for k in (1, 2, 3)]
    assert sum(counts) == 500
    assert min(counts) > 500 / 3 - 5 * np.sqrt(500 * 2 / 9)  # 5 deviations of a binomial


def delayed(env_id, given, delay):
    """Actions that come so many steps late, and zero, or the first choice, before."""
    return np.concatenate([still(env_id, delay), given])[: len(given)]


@in_full(IDS)
@pytest.mark.parametrize("delay", [1, 2, 7])
def test_a_delay_of_k_is_the_same_actions_k_steps_later_and_zero_before(env_id, delay):
    late, plain = single(env_id, action_delay=delay), single(env_id)
    for seed in (0, None):  # the second episode must not see actions of the first
        assert_same_bits(late.reset(seed=seed), plain.reset(seed=seed))
        given = actions(env_id, 25, 1)[:, 0]
        for action, other in zip(given, delayed(env_id, given, delay), strict=True):
            *ours, info = late.step(action)
            *theirs, expected = plain.step(other)
            assert_same_bits(ours, theirs)
            assert_same_bits({**info, "action_clipped": expected["action_clipped"]}, expected)
            if ours[2]:
                break


@in_full(IDS)
def test_each_row_has_the_delay_that_it_observes(env_id):
    envs = vector(env_id, 30, action_delay=(0, 3), observe_params=True)
    delays = flat(envs.reset(seed=0)[0])[:, -1].astype(int)
    batches = actions(env_id, 12, 30)
    assert set(delays) == {0, 1, 2, 3}
    results = [envs.step(batch) for batch in batches]
    for row, delay in enumerate(delays):
        env = single(env_id, observe_params=True)
        env.reset(seed=row)
        for result, action in zip(results, delayed(env_id, batches[:, row], delay), strict=True):
            observation, _, terminated, *_ = env.step(action)
            assert_same_bits(flat(result[0])[row, :-1], flat(observation))
            if terminated:
                break


@in_full(IDS)
def test_noise_on_the_observation_leaves_the_physics_alone(env_id):
    noisy, plain = fresh(vector(env_id, 70, observation_noise=0.1)), fresh(vector(env_id, 70))
    for batch in actions(env_id, 10, 70):
        assert_same_bits(noisy.step(batch)[1:], plain.step(batch)[1:])
        assert_same_bits(noisy.y, plain.y)


@in_full(IDS)
def test_noise_on_the_observation_is_normal_and_independent_inside_the_bounds(env_id):
    sigma, exact_ones = 0.01, 2 * task_of(env_id).n_goal
    noisy, plain = vector(env_id, N, observation_noise=sigma), vector(env_id, N)
    low, high = bounds(plain.single_observation_space)
    pairs = [(noisy.reset(seed=0)[0], plain.reset(seed=0)[0])]
    for batch in actions(env_id, 3, N):
        pairs.append((noisy.step(batch)[0], plain.step(batch)[0]))
    errors = []
    for blurred, exact in ([flat(o) for o in pair] for pair in pairs):
        assert (blurred >= low).all()
        assert (blurred <= high).all()
        room = np.minimum(exact - low, high - exact)
        error = blurred.astype(np.float64) - exact
        errors.append(np.where(room > 8 * sigma, error / sigma, np.nan)[:, exact_ones:])
        assert not error[:, :exact_ones].any()  # goals are seen as they are
    table = np.concatenate(errors, axis=1)
    free = table[~np.isnan(table).any(axis=1)]
    inside = table[~np.isnan(table)]
    assert len(inside) > N
    assert kstest(inside, "norm").pvalue > PASS
    if len(free) > 100:
        correlation = np.corrcoef(free.T)
        assert np.abs(correlation - np.eye(len(correlation))).max() < 5 / np.sqrt(len(free))


@in_full(IDS)
def test_the_largest_noise_stays_inside_the_bounds(env_id):
    noise = {"action_noise": 10.0} if env_id in CONTINUOUS else {}
    envs = vector(env_id, N, observation_noise=10.0, **noise)
    assert envs.observation_space.contains(envs.reset(seed=0)[0])
    for batch in actions(env_id, 5, N):
        assert envs.observation_space.contains(envs.step(batch)[0])


def acting(envs, batch):
    """What acts in a step under a batch of actions: with a delay of one it waits in the history."""
    envs.step(batch)
    return envs.get_state()["history"]


def inner(env_id, n_steps, n_rows):
    """Actions well inside the space."""
    return 0.2 * actions(env_id, n_steps, n_rows)


@in_full(CONTINUOUS)
def test_noise_on_the_action_depends_on_seed_and_step_only(env_id):
    noisy, twin, plain = (
        fresh(vector(env_id, 3, action_noise=s, action_delay=1)) for s in (0.1, 0.1, 0.0)
    )
    for batch in inner(env_id, 5, 3):
        acts = acting(noisy, batch)
        assert_same_bits(acting(twin, batch), acts)
        assert_same_bits(acting(plain, batch).astype(np.float32), batch)
        assert (batch != acts).all()


@in_full(CONTINUOUS)
def test_noise_on_the_action_is_normal_and_independent_of_noise_on_the_observation(env_id):
    sigma = 0.01
    both, half = (
        vector(env_id, N, action_noise=sigma, observation_noise=o, action_delay=1)
        for o in (0.01, 0.0)
    )
    starts = [flat(envs.reset(seed=0)[0]).astype(np.float64) for envs in (both, half)]
    (batch,) = inner(env_id, 1, N)
    pushed = (acting(both, batch) - batch) / sigma
    assert kstest(pushed.ravel(), "norm").pvalue > PASS
    steps = [flat(envs.step(batch)[0]).astype(np.float64) for envs in (both, half)]
    m = pushed.shape[1]
    for blurred in (starts[0] - starts[1], steps[0] - steps[1]):
        blurred = blurred[:, blurred.std(axis=0) > 0]
        correlation = np.corrcoef(np.hstack([pushed, blurred]).T)[:m]
        assert np.abs(correlation - np.eye(m, len(correlation.T))).max() < 5 / np.sqrt(N)


@in_full(CONTINUOUS)
def test_noise_on_the_action_stays_inside_the_space(env_id):
    loud = fresh(vector(env_id, N, action_noise=10.0, action_delay=1))
    for batch in actions(env_id, 5, N):
        acts = acting(loud, batch)
        size = np.linalg.norm(acts, axis=1) if is_round(env_id) else np.abs(acts).max(axis=1)
        assert size.max() <= 1 + 2.0**-23  # a disk action is rounded to float32
        assert size.mean() > 0.9
