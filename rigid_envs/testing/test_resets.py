"""Resets: from given states and parameters, and of rows that have ended."""

import itertools
from collections import Counter
from contextlib import suppress
from functools import cache
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import VectorEnv

from rigid_envs.base.checks import ConfigError
from rigid_envs.engine.layout import CLOCK
from rigid_envs.scores.policies import untrained_policy
from rigid_envs.scores.starts import rollout
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.testing.environments import (
    ATTITUDES,
    EARLY_ENDS,
    GOALS,
    HORIZON,
    IDS,
    OF_KERNELS,
    OWN,
    about_early_end,
    actions,
    assert_same_bits,
    counted,
    flat,
    fresh,
    pick,
    ranges,
    representations,
    rich,
    row_of,
    rules,
    share,
    single,
    still,
    task_of,
    vector,
)

# ``reset(options=...)`` starts from exactly the state and the parameters that were given.


N = 70  # more than one block of rows


def states(env_id, n, /, **config):
    """Possible states, shape (n, n_state)."""
    envs = fresh(vector(env_id, n, **config), 1000)
    for batch in actions(env_id, 3, n):
        envs.step(batch)
    return envs.y


def values(env_id, share):
    """Parameters at a share of the way through their ranges."""
    return {
        name: np.minimum(low + share * (high - low), high)
        for name, (low, high) in ranges(env_id).items()
    }


def parameter(env, name):
    """A parameter of the episode, by the name that the task gives it."""
    names = {field: name for name, field in env.task.aliases.items()}
    return float(getattr(env.system, names.get(name, name)))


def test_a_given_state_is_the_state_of_the_start(env_id):
    y = states(env_id, 1)[0]
    components = {k: y[part] for k, part in task_of(env_id).system_type.components.items()}
    for state in (y, y.tolist(), components):
        env = single(env_id)
        env.reset(seed=0, options={"state": state})
        assert_same_bits(env.y, y)


def test_a_state_given_by_name_in_part_is_drawn_in_the_others(env_id):
    y = states(env_id, 1)[0]
    plain = fresh(single(env_id, **rich(env_id)))
    for name, part in task_of(env_id).system_type.components.items():
        env = single(env_id, **rich(env_id))
        env.reset(seed=0, options={"state": {name: y[part]}})
        expected = plain.y
        expected[part] = y[part]
        assert_same_bits(env.y, expected)


def test_the_observation_of_a_state_is_the_same_however_it_was_reached(env_id):
    envs = fresh(vector(env_id, 2))
    for batch in actions(env_id, 5, 2):
        observations = envs.step(batch)[0]
    envs.set_state(envs.get_state())  # observed anew; a reset of the other row shows it
    again = envs.reset(options={"reset_mask": np.array([False, True])})[0]
    assert_same_bits(pick(again, 0), pick(observations, 0))


def test_the_first_observation_is_that_of_the_given_state(env_id):
    y = states(env_id, 1)[0]
    mask = {"reset_mask": np.array([False, True])}
    envs = fresh(vector(env_id, 2))
    first = pick(envs.reset(options={**mask, "state": y})[0], 1)
    state = envs.get_state()
    assert_same_bits(state["y"][1], y)
    envs.set_state({name: part[[1, 1]] for name, part in state.items()})
    assert_same_bits(pick(envs.reset(options=mask)[0], 0), first)


def test_given_parameters_are_those_of_the_episode(env_id):
    env = single(env_id, **rich(env_id))
    for part in (0.25, 0.75):
        given = values(env_id, part)
        env.reset(seed=0, options={"params": given})
        assert {name: parameter(env, name) for name in given} == given


def test_a_start_is_drawn_for_the_given_parameters(env_id):
    given = values(env_id, 0.5)
    configured, opted = single(env_id, **given), single(env_id, **ranges(env_id))
    configured.reset(seed=0)
    opted.reset(seed=0, options={"params": given})
    assert_same_bits(opted.y, configured.y)
    for action in actions(env_id, 20, 1)[:, 0]:
        assert_same_bits(opted.step(action), configured.step(action))


def test_the_next_episode_draws_again(env_id):
    plain, opted = single(env_id, **rich(env_id)), single(env_id, **rich(env_id))
    plain.reset(seed=0)
    opted.reset(seed=0, options={"params": values(env_id, 0.5), "state": plain.y})
    assert_same_bits(opted.reset(), plain.reset())


def test_options_for_each_row_are_those_of_the_single_environments(env_id):
    for n in [1, 2, 7, N]:
        y, shares = states(env_id, n), np.linspace(0.0, 1.0, n)
        envs = vector(env_id, n, **rich(env_id))
        options = {"state": y, "params": values(env_id, shares)}
        results = [envs.reset(seed=5, options=options)[0]]
        results += [envs.step(batch)[0] for batch in actions(env_id, 4, n)]
        for row in {0, n // 2, n - 1}:
            env = single(env_id, **rich(env_id))
            options = {"state": y[row], "params": values(env_id, shares[row])}
            mine = [env.reset(seed=5 + row, options=options)[0]]
            mine += [env.step(action)[0] for action in actions(env_id, 4, n)[:, row]]
            assert_same_bits(mine, [pick(result, row) for result in results])


def test_options_for_all_rows_hold_in_every_row(env_id):
    y, given = states(env_id, 1)[0], values(env_id, 0.5)
    envs = vector(env_id, N, **rich(env_id))
    envs.reset(seed=0, options={"state": y, "params": given})
    assert_same_bits(envs.y, np.tile(y, (N, 1)))
    assert len(set(envs.systems)) == 1


def test_a_reset_of_some_rows_leaves_the_others_bitwise_as_they_are(env_id):
    mask = np.random.default_rng(0).random(N) < 0.3
    for seed in (None, 17, list(range(N))):
        envs, twin = (fresh(vector(env_id, N, **rich(env_id))) for _ in range(2))
        for both in (envs, twin):
            for batch in actions(env_id, 4, N):
                observations = both.step(batch)[0]
        after = envs.reset(seed=seed, options={"reset_mask": mask})[0]
        assert_same_bits(pick(after, ~mask), pick(observations, ~mask))
        assert (flat(after)[mask] != flat(observations)[mask]).any(axis=-1).all()
        states, expected = envs.get_state(), twin.get_state()
        for name, part in states.items():
            assert_same_bits(part[~mask], expected[name][~mask], name)
        for batch in actions(env_id, 4, N, seed=1):
            for ours, theirs in zip(envs.step(batch)[:4], twin.step(batch)[:4], strict=True):
                assert_same_bits(pick(ours, ~mask), pick(theirs, ~mask))


def test_a_masked_reset_is_a_reset_of_those_rows(env_id):
    mask = np.arange(N) % 3 == 0
    y = states(env_id, int(mask.sum()))
    envs = fresh(vector(env_id, N))
    envs.reset(seed=40, options={"reset_mask": mask, "state": y})
    assert_same_bits(envs.y[mask], y)
    envs.reset(seed=40, options={"reset_mask": mask})
    for row in (6, 66):
        env = single(env_id)
        env.reset(seed=40 + row)
        assert_same_bits(envs.y[row], env.y)


def test_options_of_the_caller_stay_as_they_are(env_id):
    mask = np.array([True, False, True])
    given = {"reset_mask": mask, "state": states(env_id, 2), "params": values(env_id, 0.5)}
    options, inner = dict(given), dict(given["params"])
    kept = [mask.copy(), given["state"].copy()]
    envs = fresh(vector(env_id, 3, **rich(env_id)))
    envs.reset(options=options)
    assert options.keys() == given.keys()
    assert all(options[key] is given[key] for key in given)
    assert given["params"] == inner
    assert_same_bits([mask, given["state"]], kept)


def bad_options(env_id):
    """Options that are refused, each with what the message must name."""
    y = states(env_id, 1)[0]
    not_finite = y.copy()
    not_finite[-1] = np.nan
    name = next(name for name in ranges(env_id) if rules(env_id)[name].low > 0.0)
    components = task_of(env_id).system_type.components
    component, part = max(components.items(), key=lambda item: item[1].stop - item[1].start)
    bad = {
        "unknown option": ({"stat": y}, "'stat'"),
        "short state": ({"state": y[:-1]}, str(y[:-1].shape)),
        "too many states": ({"state": np.tile(y, (5, 1))}, "(5,"),
        "nan in state": ({"state": not_finite}, "nan"),
        "text for a state": ({"state": "up"}, "'up'"),
        "unknown component": ({"state": {"speed": y}}, "'speed'"),
        "text for a component": ({"state": {component: "up"}}, component),
        "unknown parameter": ({"params": {"mass_of_air": 1.0}}, "'mass_of_air'"),
        "negative parameter": ({"params": {name: -1.0}}, f"{name} = -1.0"),
        "nan parameter": ({"params": {name: np.nan}}, f"{name} = nan"),
        "parameter for five rows": ({"params": {name: np.ones(5)}}, "(5,)"),
        "a list of options": ([name], "options"),
        "a list of parameters": ({"params": [1.0]}, "params"),
        "text for a parameter": ({"params": {name: "heavy"}}, "params"),
        "a dictionary for a parameter": ({"params": {name: {}}}, "params"),
    }
    if len(y[part]) > 1:
        bad["short component"] = ({"state": {component: y[part][1:]}}, component)
    if "q" in components:
        bad["no unit quaternion"] = ({"state": {"q": 0.9 * y[components["q"]]}}, "length 1")
    return bad


@pytest.mark.parametrize("env_id", ATTITUDES)
def test_a_given_attitude_with_rounding_errors_is_observed_within_the_space(env_id):
    q = (1.0 + 9e-7) * np.sqrt(0.5) * np.array([1.0, 1.0, 0.0, 0.0])
    for rotation in representations(env_id):
        envs = vector(env_id, 2, rotation=rotation)
        assert envs.observation_space.contains(envs.reset(seed=0, options={"state": {"q": q}})[0])
        state = envs.get_state()
        state["y"][0, :4] = q
        envs.set_state(state)
        shown, _ = envs.reset(options={"reset_mask": np.array([False, True])})
        assert envs.observation_space.contains(shown)


def test_bad_options_are_refused_by_name_and_change_nothing(env_id):
    for env in (single(env_id, **rich(env_id)), vector(env_id, 3, **rich(env_id))):
        env.reset(seed=0)
        env.step(still(env_id, 3) if isinstance(env, VectorEnv) else still(env_id, 1)[0])
        before = env.get_state()
        for seed in (None, 1):  # a seed beside bad options is not taken
            for kind, (options, name) in bad_options(env_id).items():
                with pytest.raises(ValueError) as refusal:
                    env.reset(seed=seed, options=options)
                assert name in str(refusal.value), kind
                assert_same_bits(env.get_state(), before, kind)


def test_masks_that_choose_no_rows_are_refused_and_change_nothing(env_id):
    envs = fresh(vector(env_id, 3))
    before = envs.get_state()
    several = [True, False, True], np.ones(2, bool), np.ones(3, int), np.zeros(3, bool), "all", True
    for mask in several:
        with pytest.raises(ValueError, match="reset_mask"):
            envs.reset(seed=1, options={"reset_mask": mask})
        assert_same_bits(envs.get_state(), before)


def test_a_single_environment_has_no_rows_to_choose(env_id):
    env = single(env_id)
    with pytest.raises(ValueError, match="reset_mask"):
        env.reset(options={"reset_mask": np.array([True])})


# Autoreset loses nothing: every end of an episode is told as the single environment tells it.


SEED, N_ROWS = 3, 20
MODES = ("NextStep", "SameStep", "Disabled")

episodes = counted("n_episodes", 10_000)  # of at most HORIZON steps each


class Step(NamedTuple):
    """One step of one row; `after` is what the reset returns that follows an end."""

    observation: Any
    reward: float
    terminated: bool
    truncated: bool
    info: dict[str, Any]
    after: Any


def config_of(env_id):
    return {**EARLY_ENDS.get(env_id, {}), "max_episode_steps": HORIZON}


@cache
def table(env_id, n_episodes):
    """Action of each row at its own k-th step, resets not counted."""
    return actions(env_id, HORIZON * -(-n_episodes // N_ROWS), N_ROWS)


@cache
def alone(env_id, n_episodes):
    """Steps of every row, as a single environment."""
    rows = []
    env = gym.make(env_id, **config_of(env_id))
    for row in range(N_ROWS):
        env.reset(seed=SEED + row)
        steps, elapsed = [], 0
        for action in table(env_id, n_episodes)[:, row]:
            result, elapsed = env.step(action), elapsed + 1
            assert result[3] == (elapsed == HORIZON)
            ended = result[2] or result[3]
            elapsed = 0 if ended else elapsed
            steps.append(Step(*result, env.reset() if ended else None))
        rows.append(steps)
    return rows


def assert_told(outputs, row, step):
    """Reward and ends of a row, each by itself."""
    _, rewards, terminated, truncated, _ = outputs
    told = (rewards[row].item(), terminated[row].item(), truncated[row].item())
    assert_same_bits(told, step[1:4])


def ends_of(env_id):
    """How many episodes were terminated, truncated, both."""
    steps = (step for row in alone(env_id, share(10_000)) for step in row)
    return Counter((step.terminated, step.truncated) for step in steps if step.after)


@pytest.mark.skipif(not set(OWN) <= set(IDS), reason="counts over all ids of this package")
def test_ten_thousand_episodes_end_in_every_way():
    ends = sum(map(ends_of, IDS), Counter())
    assert ends.total() >= 10_000
    assert set(ends) == {(True, False), (False, True), (True, True)}


def test_episodes_end_early_where_a_task_can_end(env_id):
    ends = ends_of(env_id)
    early, lasting = ends[True, False], ends[False, True]
    seen = about_early_end(env_id, f"under it {early} ended and {lasting} did not")
    assert lasting, seen
    assert bool(early) == (env_id in EARLY_ENDS), seen


ENDLESS = [env_id for env_id in IDS if env_id not in EARLY_ENDS]


def least_and_largest(env_id):
    """The least and the largest value of each number among the settings, one at a time."""
    rest = {"n_substeps": 20 * task_of(env_id).n_substeps}
    for name, rule in rules(env_id).items():
        if hasattr(rule, "low") and name not in {*OF_KERNELS, *rest}:
            yield from ({name: value, **rest} for value in (rule.low, rule.high))


@pytest.mark.parametrize("env_id", ENDLESS)
def test_no_setting_ends_an_episode_early_where_early_end_is_left_out(env_id):
    for config in least_and_largest(env_id):
        with suppress(ConfigError):
            envs = fresh(vector(env_id, 16, **config))
            for batch in actions(env_id, 40, 16):
                _, _, terminated, _, infos = envs.step(batch)
                seen = f"with {config} random actions ended some"
                assert not (terminated > infos["physics_error"]).any(), about_early_end(
                    env_id, seen
                )


@pytest.mark.parametrize("env_id", [i for i in ENDLESS if ENVIRONMENTS[i].controllers])
def test_no_reference_controller_ends_an_episode_early_where_early_end_is_left_out(env_id):
    envs, policy = vector(env_id, 8), untrained_policy(env_id, "reference")
    seen = "the reference controller ended some"
    for step in rollout(policy(envs), envs, [*range(8)], ()):
        assert not step.terminated.any(), about_early_end(env_id, seen)


@episodes
def test_same_step_mode_hands_over_the_last_observation_and_info(env_id, n_episodes):
    envs = fresh(vector(env_id, N_ROWS, autoreset_mode="SameStep", **config_of(env_id)), SEED)
    for k, batch in enumerate(table(env_id, n_episodes)):
        outputs = envs.step(batch)
        infos = outputs[4]
        ended = outputs[2] | outputs[3]
        assert ("final_obs" in infos) == ("final_info" in infos) == ended.any()
        if ended.any():
            assert isinstance(infos["final_obs"], dict) == (env_id in GOALS)
            for mask in ("_final_obs", "_final_info"):
                np.testing.assert_array_equal(infos[mask], ended)
        for row in range(N_ROWS):
            step = alone(env_id, n_episodes)[row][k]
            assert_told(outputs, row, step)
            now, info = step.after or (step.observation, step.info)
            assert_same_bits(pick(outputs[0], row), now)
            assert_same_bits(row_of(infos, row), info)
            if ended[row]:
                assert_same_bits(pick(infos["final_obs"], row), step.observation)
                assert_same_bits(row_of(infos["final_info"], row), step.info)


@episodes
def test_disabled_mode_leaves_resets_to_the_caller(env_id, n_episodes):
    envs = fresh(vector(env_id, N_ROWS, autoreset_mode="Disabled", **config_of(env_id)), SEED)
    for k, batch in enumerate(table(env_id, n_episodes)):
        outputs = envs.step(batch)
        ended = outputs[2] | outputs[3]
        after = envs.reset(options={"reset_mask": ended})[0] if ended.any() else outputs[0]
        for row in range(N_ROWS):
            step = alone(env_id, n_episodes)[row][k]
            assert_told(outputs, row, step)
            assert_same_bits(pick(outputs[0], row), step.observation)
            assert_same_bits(row_of(outputs[4], row), step.info)
            now = step.after[0] if step.after else step.observation
            assert_same_bits(pick(after, row), now)


def test_without_a_limit_nothing_is_truncated(env_id):
    """However long an episode has lasted: the clock is put near the limit and far beyond.

    No further than where steps are refused, because rates may leave the stability envelope.
    """
    rows = [vector(env_id, 2, autoreset_mode=mode, max_episode_steps=None) for mode in MODES]
    for before, env in itertools.product((3, 10**9), (single(env_id), *rows)):
        far = max(ENVIRONMENTS[env_id].max_episode_steps - before, before)
        action = still(env_id, 2) if env in rows else still(env_id, 1)[0]
        env.reset(seed=0)
        state = env.get_state()
        state["clock"][..., CLOCK.elapsed] = min(far, task_of(env_id).stable_steps() - 6)
        env.set_state(state)
        for _ in range(6):
            _, _, terminated, truncated, _ = env.step(action)
            assert not np.any(truncated)
            if np.any(terminated):
                break
