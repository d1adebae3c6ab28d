"""A bad action is refused by a message that names it, and changes nothing; others are clipped."""

import datetime
from collections.abc import Iterator
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
import numpy.typing as npt
import pytest

from rigid_envs.testing.environments import (
    CONTINUOUS,
    actions,
    assert_refused,
    assert_same_bits,
    counted,
    is_round,
    n_actions,
    rich,
    single,
    task_of,
    vector,
)


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


def bad_actions(env_id: str) -> Iterator[Bad]:
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


def no_choices(n: int) -> Iterator[Bad]:
    """Integers that are none of n choices, what is no integer, and what has another shape."""
    for number in (-1, n, np.int64(n), np.int8(-1), 10**9, -(2**62), np.uint64(2**63), 2**70):
        yield Bad(number, None, f" = {number};")
    for thing in (
        *(0.0, 1.0, 1.5, np.float32(1.0), np.array(1.0, dtype=np.float32), np.nan, np.inf, 1e39),
        *(True, False, np.True_, np.array(True), None, "1", "left", b"1", 1j, np.complex64(1)),
        *(object(), {}, {0}, [], (), [[0], 1], datetime.timedelta(1), np.datetime64(1, "s")),
    ):
        yield Bad(thing, None, f" = {thing!r};")
    for list_ in ([0], (1,), [0, 1], np.zeros(1, dtype=np.int64), np.zeros((1, 1), int), [[0]]):
        yield Bad(list_, None, f" has shape {np.shape(list_)};")


def expected_of(env_id: str) -> str:
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
        envs = vector(env_id, 7, num_threads=num_threads, **rich(env_id))
        envs.reset(seed=0)
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
        envs = vector(env_id, 200, num_threads=num_threads)
        envs.reset(seed=0)
        for row in (0, 63, 64, 127, 128, 199):
            assert_refused(envs, *spoilt(env_id, actions(env_id, 1, 200)[0], row))


def test_batches_of_another_shape_or_kind_are_refused(env_id):
    envs = vector(env_id, 7, **rich(env_id))
    envs.reset(seed=0)
    good = actions(env_id, 1, 7)[0]
    more = [good[:, :-1]] if good.ndim > 1 else [good[:, None], good[:0]]
    for batch in (good[:6], np.concatenate([good, good[:1]]), good[None], good[0], *more):
        assert_refused(envs, batch, str(np.shape(batch)), str(good.shape))
    kinds = "?F" if good.ndim > 1 else "?fdF"
    for batch in (None, 0.5, "left", object(), np.float32(1.0), *map(good.astype, kinds)):
        assert_refused(envs, batch, str(good.shape))


def test_after_a_refusal_the_episode_goes_on_as_if_nothing_had_happened(env_id):
    disturbed, quiet = vector(env_id, 3, **rich(env_id)), vector(env_id, 3, **rich(env_id))
    assert_same_bits(disturbed.reset(seed=0), quiet.reset(seed=0))
    for batch in actions(env_id, 20, 3):
        with pytest.raises(ValueError):
            disturbed.step(spoilt(env_id, batch, 1)[0])
        assert_same_bits(disturbed.step(batch), quiet.step(batch))


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
            env = single(env_id)
            env.reset(seed=0)
            results.append(env.step(value))
        for other in results[1:]:
            assert_same_bits(results[0], other)


# Finite actions outside the space are clipped exactly, and the clipping is told.

continuous = pytest.mark.parametrize("env_id", CONTINUOUS)
N_STEPS = 100
SIZES = np.array([1e-45, 1e-40, 1e-30, 1e-8, 0.1, 0.7, 1.5, 1e3, 1e19, 1e30, 3e38])


def clipped(batch: npt.NDArray[np.float32], is_round: bool) -> npt.NDArray[np.float32]:
    """By its definition, in extended precision; nothing here lies within rounding of the edge."""
    if not is_round:
        return np.clip(batch, np.float32(-1.0), np.float32(1.0))
    exact = batch.astype(np.longdouble)
    norm = np.sqrt(np.sum(exact**2, axis=-1, keepdims=True))
    return np.where(norm > 1.0, exact / np.maximum(norm, 1.0), exact).astype(np.float32)


def wild(env_id: str, n_rows: int, rng: np.random.Generator) -> npt.NDArray[np.float32]:
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
