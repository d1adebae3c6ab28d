"""Actions and observations: what is taken, what is shown, always finite and in the space."""

import datetime
from contextlib import suppress
from functools import lru_cache
from itertools import product
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
import pytest

from rigid_envs.base.checks import ConfigError
from rigid_envs.mechanics import rotations
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.testing.environments import (
    ATTITUDES,
    CONTINUOUS,
    EARLY_ENDS,
    FULL,
    IDS,
    OF_KERNELS,
    about_early_end,
    actions,
    assert_refused,
    assert_same_bits,
    bounds,
    counted,
    flat,
    fresh,
    is_round,
    n_actions,
    representations,
    rich,
    rules,
    single,
    task_of,
    vector,
)

# A bad action is refused by a message that names it, and changes nothing; others are clipped.


class Bad(NamedTuple):
    """A value that is no action.

    Attributes:
        value: it.
        entry: place of the entry that is wrong in an array of numbers; None if all of it is.
        told: what the message says behind the name.
    """

    value: Any
    entry: int | None
    told: str


def bad_actions(env_id):
    """Values of every kind that are refused."""
    if n_choices := task_of(env_id).n_choices:
        yield from no_choices(n_choices)
        return
    m = n_actions(env_id)
    for dtype in (np.float32, np.float64):
        for k in range(m):
            for number in (np.nan, np.inf, -np.inf, 1e39):
                action = np.zeros(m, dtype=np.float64)
                action[k] = number
                with np.errstate(over="ignore"):
                    action = action.astype(dtype)
                yield Bad(action, k, f" = {action[k]}")
                yield Bad(action.tolist(), k, "")
    for shape in ((m + 1,), (m - 1,), (1, m)):
        yield Bad(np.zeros(shape, dtype=np.float32), None, "")
    for thing in (0.25, None, "left", b"left", object(), np.zeros(m, complex), np.zeros(m, bool)):
        yield Bad(thing, None, "")


def no_choices(n):
    """Integers that are none of n choices, what is no integer, and what has another shape."""
    for number in (-1, n, np.int64(n), np.int8(-1), 10**9, -(2**62), np.uint64(2**63), 2**70):
        yield Bad(number, None, f" = {number};")
    for thing in (
        *(0.0, 1.0, 1.5, np.nan, np.inf, 1e39),
        *(np.float32(1.0), np.float32([1.0]), np.array(1.0, dtype=np.float32)),
        *(True, False, np.True_, np.array(True), None, "1", "left", b"1", 1j, np.complex64(1)),
        *(object(), {}, {0}, [], (), [[0], 1], datetime.timedelta(1), np.datetime64(1, "s")),
    ):
        yield Bad(thing, None, f" = {thing!r};")
    for list_ in ([0], (1,), [0, 1], np.zeros(1, dtype=np.int64), np.zeros((1, 1), int), [[0]]):
        yield Bad(list_, None, f" has shape {np.shape(list_)};")


def expected_of(env_id):
    """What a message says of the right kind."""
    n = task_of(env_id).n_choices
    return f"expected an integer from 0 to {n - 1}" if n else ""


def test_what_is_no_action_is_refused_by_index_and_value(env_id):
    for make in [single, gym.make]:
        env = make(env_id, **rich(env_id))
        env.reset(seed=0)
        for value, entry, told in bad_actions(env_id):
            name = "action" if entry is None else f"action[{entry}]"
            kind = f"({n_actions(env_id)},)" if entry is None and env_id in CONTINUOUS else ""
            assert_refused(env, value, f"{name}{told}", expected_of(env_id), kind)


def test_what_is_no_action_is_refused_in_any_row_by_its_number(env_id):
    for num_threads in [1, 2]:
        envs = fresh(vector(env_id, 7, num_threads=num_threads, **rich(env_id)))
        for row in range(7):
            for value, entry, told in bad_actions(env_id):
                batch = actions(env_id, 1, 7)[0]
                if entry is not None and isinstance(value, np.ndarray):
                    batch = batch.astype(value.dtype)
                    batch[row] = value
                    assert_refused(envs, batch, f"action[{row}, {entry}]{told}")
                batch = list(batch)
                batch[row] = value
                told = told if entry is None else ""
                assert_refused(envs, batch, f"action[{row}]{told}", expected_of(env_id))


def spoilt(env_id, batch, row):
    """Actions of which those of a row are bad, and what the message says of it."""
    batch = batch.copy()
    if env_id in CONTINUOUS:
        batch[row, -1] = np.nan
        return batch, f"action[{row}, {n_actions(env_id) - 1}] = nan"
    batch[row] = -1
    return batch, f"action[{row}] = -1"


def test_a_bad_row_beyond_the_first_block_advances_no_row(env_id):
    for num_threads in (1, 2):
        envs = fresh(vector(env_id, 200, num_threads=num_threads))
        for row in (0, 63, 64, 127, 128, 199):
            assert_refused(envs, *spoilt(env_id, actions(env_id, 1, 200)[0], row))


def test_batches_of_another_shape_or_kind_are_refused(env_id):
    envs = fresh(vector(env_id, 7, **rich(env_id)))
    good = actions(env_id, 1, 7)[0]
    more = [good[:, :-1]] if good.ndim > 1 else [good[:, None], good[:0]]
    for batch in (good[:6], np.concatenate([good, good[:1]]), good[None], good[0], *more):
        assert_refused(envs, batch, str(np.shape(batch)), str(good.shape))
    kinds = "?F" if good.ndim > 1 else "?fdF"
    wrong = [*map(good.astype, kinds), good[:, None].astype(np.float32)]
    for batch in (None, 0.5, "left", object(), np.float32(1.0), *wrong):
        assert_refused(envs, batch, str(good.shape))


def test_kind_of_number_does_not_matter(env_id):
    if n_choices := task_of(env_id).n_choices:
        kinds = (int, np.int64, np.int8, np.uint8, np.uint64, np.array)
        alike = [[kind(choice) for kind in kinds] for choice in range(n_choices)]
    else:
        action = np.round(actions(env_id, 1, 1)[0, 0])  # exact in every type
        alike = [[action, action.astype(np.float64), action.astype(np.int64), action.tolist()]]
    for values in alike:
        results = []
        for value in values:
            env = fresh(single(env_id))
            results.append(env.step(value))
        for other in results[1:]:
            assert_same_bits(results[0], other)


# Finite actions outside the space are clipped exactly, and the clipping is told.

continuous = pytest.mark.parametrize("env_id", CONTINUOUS)
N_STEPS = 100
SIZES = np.array([1e-45, 1e-40, 1e-30, 1e-8, 0.1, 0.7, 1.5, 1e3, 1e19, 1e30, 3e38])


def clipped(batch, is_round):
    """By its definition, in extended precision; nothing here lies within rounding of the edge."""
    if not is_round:
        return np.clip(batch, np.float32(-1.0), np.float32(1.0))
    exact = batch.astype(np.longdouble)
    norm = np.sqrt(np.sum(exact**2, axis=-1, keepdims=True))
    return np.where(norm > 1.0, exact / np.maximum(norm, 1.0), exact).astype(np.float32)


def wild(env_id, n_rows, rng):
    """Actions from denormals to the largest float32, zeros of both signs among them."""
    shape = (n_rows, n_actions(env_id))
    batch = (rng.uniform(-1.0, 1.0, shape) * rng.choice(SIZES, shape)).astype(np.float32)
    batch[rng.random(shape) < 0.1] = -0.0
    norm = np.linalg.norm(batch.astype(np.float64), axis=-1)
    batch[np.abs(norm - 1.0) < 1e-5] *= 0.5
    return batch


@continuous
@counted("n_rows", 1000)
@pytest.mark.parametrize("configured", [False, True], ids=["default", "rich"])
def test_a_step_by_an_action_is_the_step_by_the_clipped_action(env_id, configured, n_rows):
    config = rich(env_id) if configured else {}
    raw, tidy = vector(env_id, n_rows, **config), vector(env_id, n_rows, **config)
    assert_same_bits(raw.reset(seed=0), tidy.reset(seed=0))
    rng = np.random.default_rng(1)
    ended = np.zeros(n_rows, dtype=np.bool_)
    for _ in range(N_STEPS):
        batch = wild(env_id, n_rows, rng)
        inside = clipped(batch, is_round(env_id))
        *outputs, infos = raw.step(batch)
        *expected, expected_infos = tidy.step(inside)
        assert_same_bits(outputs, expected)
        # a row that begins anew ignores its action
        outside = (inside != batch).any(axis=-1) & ~ended
        np.testing.assert_array_equal(infos.pop("action_clipped"), outside)
        ended = outputs[2] | outputs[3]
        assert not expected_infos.pop("action_clipped").any()
        assert_same_bits(infos, expected_infos)


@continuous
@counted("n_rows", 1000)
def test_negative_zero_is_zero(env_id, n_rows):
    negative, positive = vector(env_id, n_rows), vector(env_id, n_rows)
    assert_same_bits(negative.reset(seed=0), positive.reset(seed=0))
    zero = np.zeros((n_rows, n_actions(env_id)), dtype=np.float32)
    for _ in range(N_STEPS):
        assert_same_bits(negative.step(-zero), positive.step(zero))


@continuous
def test_actions_on_the_edge_of_the_space_are_not_clipped_those_beyond_are(env_id):
    m = n_actions(env_id)
    corners = np.array(np.meshgrid(*[[-1.0, 1.0]] * m)).reshape(m, -1).T
    edge = np.vstack([np.eye(m), -np.eye(m), corners / (np.sqrt(m) if is_round(env_id) else 1.0)])
    envs = vector(env_id, len(edge))
    for size, outside in ((1.0, False), (1.0 + 1e-6, True)):  # a few ulp of float32
        envs.reset(seed=0)
        clipped_rows = envs.step((size * edge).astype(np.float32))[4]["action_clipped"]
        assert (clipped_rows == outside).all()


# The observed attitude is that of the state, in each representation.


N = 500
# Angles up to pi in float32 are off by at most 2^-23, and three of them make an entry of R.
ROUNDING = 3 * 2.0**-23
REPRESENTATIONS = {  # number of entries, and the matrix that they stand for
    "none": (0, None),
    "matrix": (9, lambda r: r.reshape(-1, 3, 3)),
    "rot6d": (6, rotations.matrix_from_rot6d),
    "quat": (4, rotations.matrix_from_quaternion),
    "euler": (3, rotations.matrix_from_euler),
}


with_attitude = pytest.mark.parametrize("env_id", ATTITUDES)


@lru_cache(maxsize=8)
def observed(env_id, rotation):
    """Quaternions, observations and rewards at the start and after steps."""
    envs = vector(env_id, N, rotation=rotation)
    q = task_of(env_id).system_type.components["q"]
    results = [(flat(envs.reset(seed=0)[0]), None)]
    quaternions = [envs.y[:, q]]
    for batch in actions(env_id, 10, N):
        observations, rewards, *_ = envs.step(batch)
        results.append((flat(observations), rewards))
        quaternions.append(envs.y[:, q])
    return [(q, *result) for q, result in zip(quaternions, results, strict=True)]


def test_attitude_is_shown_in_every_way_where_there_is_one():
    for env_id in IDS:
        expected = tuple(REPRESENTATIONS) if env_id in ATTITUDES else ("none",)
        assert representations(env_id) == expected


@with_attitude
def test_observed_attitude_is_that_of_the_state(env_id):
    for rotation in ["matrix", "rot6d", "quat", "euler"]:
        n_features = observed(env_id, "none")[0][1].shape[1]
        n_entries, matrix_from = REPRESENTATIONS[rotation]
        for q, observations, _ in observed(env_id, rotation):
            attitude = observations[:, n_features:].astype(np.float64)
            assert attitude.shape == (N, n_entries)
            error = matrix_from(attitude) - rotations.matrix_from_quaternion(q)
            assert np.abs(error).max() <= ROUNDING
            if rotation == "quat":
                assert (attitude[:, 0] >= 0.0).all()


@with_attitude
def test_representation_changes_nothing_but_the_observation(env_id):
    for rotation in REPRESENTATIONS:
        plain = observed(env_id, "none")
        for (q, observations, rewards), expected in zip(
            observed(env_id, rotation), plain, strict=True
        ):
            assert_same_bits(q, expected[0])
            assert_same_bits(rewards, expected[2])
            n = expected[1].shape[1]
            assert_same_bits(observations[:, :n], expected[1])


def test_entries_of_the_observation_are_named_with_their_bounds(env_id):
    for rotation in representations(env_id):
        env = single(env_id, rotation=rotation)
        entries = env.task.observations()
        low, high = bounds(env.observation_space)
        assert low.shape == (len(entries),)
        n = task_of(env_id).n_goal
        for part in (entries[:n], entries[n : 2 * n], entries[2 * n :]):
            assert len({(entry.symbol, entry.frame) for entry in part}) == len(part)
        assert all(entry.unit and entry.frame for entry in entries)
        np.testing.assert_array_equal(low, np.float32([e.low for e in entries]))
        np.testing.assert_array_equal(high, np.float32([e.high for e in entries]))
        assert np.isfinite(low).all()
        assert np.isfinite(high).all()


def cube(env_id):
    """Attitudes of a cube on a table, by both signs of q, as far as they are possible at all.

    Every representation is at its worst there: theta = 0 and pi, w = 0, entries of R at 1 and -1.
    """
    system = task_of(env_id).system_type
    numbers = (q for q in product((-1.0, 0.0, 1.0), repeat=4) if np.count_nonzero(q) in (1, 2, 4))
    possible = []
    for q in numbers:
        turn = np.divide(q, np.linalg.norm(q))
        with suppress(ValueError):  # a coin that must be upright
            system.checked_state(system.state(q=turn))
            possible.append(turn)
    return np.array(possible)


@with_attitude
def test_attitude_is_observed_in_space_at_its_singular_places(env_id):
    for rotation in ["matrix", "rot6d", "quat", "euler"]:
        turns = cube(env_id)
        assert len(turns) >= 16
        envs = vector(env_id, len(turns), rotation=rotation)
        observations, _ = envs.reset(seed=0, options={"state": {"q": turns}})
        assert envs.observation_space.contains(observations)


# Whatever is done, what is observed is finite, in the space and of the right type, every step.
#
# Eight ways to act, each by an eighth of the rows. Steps and settings are counted over all ids.


CYCLE = 128  # steps after which the prepared actions come again
WAYS = ("uniform", "bang-bang", "switch", "zero", "one side", "denormal", "resonant", "policy")


def prepared(way, rng, n_rows, m):
    """Numbers in [-1, 1] of one kind, shape (CYCLE, n_rows, m)."""
    shape = (CYCLE, n_rows, m)
    side = rng.choice([-1.0, 1.0], (1, n_rows, m))
    step = np.arange(CYCLE)[:, None, None]
    ways = {
        "uniform": lambda: rng.uniform(-1.0, 1.0, shape),
        "bang-bang": lambda: rng.choice([-1.0, 1.0], shape),
        "switch": lambda: np.where(step % rng.integers(2, 40, (1, n_rows, 1)) == 0, side, -side),
        "zero": lambda: np.zeros(shape),
        "one side": lambda: np.broadcast_to(side, shape),
        "denormal": lambda: rng.uniform(-1e-38, 1e-38, shape),
        # over all rows every frequency, that of the motion among them, in phase with every axis
        "resonant": lambda: np.sign(
            np.sin(
                2 * np.pi * (step * rng.uniform(0.0, 0.5, (1, n_rows, 1)) + rng.random(side.shape))
            )
        ),
        "policy": lambda: np.zeros(shape),
    }
    return ways[way]().astype(np.float32)


class Driver:
    """Acts on rows in all `WAYS` and checks every result."""

    def __init__(self, envs, seed):
        rng = np.random.default_rng(seed)
        self.envs, self.n_choices = envs, envs.task.n_choices
        self.low, self.high = bounds(envs.single_observation_space)
        n, m = envs.num_envs // len(WAYS), len(envs.task.actions())
        self.actions = np.concatenate([prepared(way, rng, n, m) for way in WAYS], axis=1)
        self.learners = slice((len(WAYS) - 1) * n, len(WAYS) * n)
        self.gain = rng.normal(0.0, 1.0, (*self.low.shape, m)).astype(np.float32)
        self.observations = flat(envs.reset(seed=seed)[0])
        self.n_errors, self.n_ended = 0, 0

    def run(self, n_steps):
        for k in range(n_steps):
            batch = self.actions[k % CYCLE]
            seen, noise = self.observations[self.learners], batch[: self.envs.num_envs // len(WAYS)]
            batch[self.learners] = np.tanh(seen @ self.gain) + noise
            self.check(self.envs.step(self.chosen(batch) if self.n_choices else batch))

    def chosen(self, batch):
        """The choices whose parts of [-1, 1] hold the numbers."""
        parts = np.floor(0.5 * self.n_choices * (batch[:, 0] + 1.0)).astype(np.int64)
        return np.clip(parts, 0, self.n_choices - 1)

    def check(self, results):
        observations, rewards, terminated, truncated, infos = results
        self.observations = flat(observations)
        dtypes = [array.dtype for array in (self.observations, rewards, terminated, truncated)]
        assert dtypes == [np.float32, np.float64, np.bool_, np.bool_]
        # a comparison with NaN is false
        assert (self.observations >= self.low).all()
        assert (self.observations <= self.high).all()
        assert np.isfinite(rewards).all()
        assert np.isfinite(infos["cost"]).all()
        assert terminated[infos["physics_error"]].all()
        self.n_errors += np.count_nonzero(infos["physics_error"])
        self.n_ended += np.count_nonzero(terminated)


def moderate(env_id, rng):
    """Settings within a factor of two of the default ones, some of them ranges, all switches."""
    task, config = task_of(env_id), {}
    for name, rule in rules(env_id).items():
        if name in OF_KERNELS:
            continue
        value = getattr(task, name)
        if isinstance(value, float) and rng.random() < 0.5:
            factors = 2.0 ** rng.uniform(-1.0, 1.0, 2)
            ends = np.clip(np.sort(value * factors), rule.low, rule.high).tolist()
            config[name] = tuple(ends) if rule.drawn and rng.random() < 0.5 else ends[0]
    config |= {
        "rotation": str(rng.choice(representations(env_id))),
        "n_substeps": task.n_substeps * int(rng.integers(2, 5)),
        "observe_params": bool(rng.random() < 0.5),
    }
    if env_id not in FULL:
        return config
    if env_id in CONTINUOUS:
        config["action_noise"] = (0.0, float(rng.choice([0.0, 0.3])))
    noise, delay = float(rng.choice([0.0, 0.1, 10.0])), int(rng.integers(0, 5))
    return config | {"observation_noise": (0.0, noise), "action_delay": (0, delay)}


def extreme(env_id, rng):
    """Two to five settings anywhere in their bounds, over all sizes."""
    barred = set() if env_id in FULL else OF_KERNELS
    numbers = {n: r for n, r in rules(env_id).items() if isinstance(getattr(r, "low", None), float)}
    numbers = {name: rule for name, rule in numbers.items() if name not in barred}
    names = rng.choice(list(numbers), rng.integers(2, 6), replace=False)
    config = {"n_substeps": 20 * task_of(env_id).n_substeps}
    for name in names.tolist():
        low, high = numbers[name].low, numbers[name].high
        least = max(low, 1e-12 * high)
        config[name] = float(np.clip(least ** (1 - (s := rng.random())) * high**s, low, high))
    return config


def accepted(env_id, draw, rng):
    """The first of the drawn settings that the task takes."""
    for _ in range(1000):
        config = draw(env_id, rng)
        try:
            type(task_of(env_id))(**config)
        except ConfigError:
            continue
        return config
    raise AssertionError(f"no settings of {env_id} were accepted")


@counted("n_steps", 100_000_000, first=50)
def test_nothing_leaves_its_space_at_the_default_settings(env_id, n_steps):
    n_rows, shown = 1024, representations(env_id)
    for rotation in shown:
        driver = Driver(vector(env_id, n_rows, rotation=rotation, num_threads=2), seed=0)
        driver.run(-(-n_steps // (n_rows * len(shown))))
        assert driver.n_errors == 0
        seen = f"{driver.n_ended} episodes ended before it at the default settings"
        assert driver.n_ended == 0 or env_id in EARLY_ENDS, about_early_end(env_id, seen)


@counted("n_configs", 500, first=10)
@pytest.mark.parametrize("draw", [moderate, extreme])
def test_nothing_leaves_its_space_at_any_settings(env_id, draw, n_configs):
    rng = np.random.default_rng(0)
    n_steps = min(60, ENVIRONMENTS[env_id].max_episode_steps)
    for seed in range(n_configs):
        config = accepted(env_id, draw, rng)
        envs = vector(env_id, 8 * len(WAYS), max_episode_steps=n_steps, **config)
        driver = Driver(envs, seed)
        driver.run(100)
        if draw is moderate:  # far out, motion may become too fast: that ends the episode
            assert driver.n_errors == 0, config
