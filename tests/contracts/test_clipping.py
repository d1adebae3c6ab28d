"""Finite actions outside the space are clipped exactly, and the clipping is told."""

import numpy as np
import numpy.typing as npt
import pytest

from tests.contracts.environments import (
    assert_same_bits,
    is_disc,
    n_actions,
    rich,
    single,
    vector,
)

N_ROWS, N_STEPS = 1000, 100
SIZES = np.array([1e-45, 1e-40, 1e-30, 1e-8, 0.1, 0.7, 1.5, 1e3, 1e19, 1e30, 3e38])


def clipped(batch: npt.NDArray[np.float32], disc: bool) -> npt.NDArray[np.float32]:
    """By its definition, in extended precision; nothing here lies within rounding of the edge."""
    if not disc:
        return np.clip(batch, np.float32(-1.0), np.float32(1.0))
    exact = batch.astype(np.longdouble)
    norm = np.sqrt(np.sum(exact**2, axis=-1, keepdims=True))
    return np.where(norm > 1.0, exact / np.maximum(norm, 1.0), exact).astype(np.float32)


def wild(env_id: str, rng: np.random.Generator) -> npt.NDArray[np.float32]:
    """Actions from denormals to the largest float32, zeros of both signs among them."""
    shape = (N_ROWS, n_actions(env_id))
    batch = (rng.uniform(-1.0, 1.0, shape) * rng.choice(SIZES, shape)).astype(np.float32)
    batch[rng.random(shape) < 0.1] = -0.0
    norm = np.linalg.norm(batch.astype(np.float64), axis=-1)
    batch[np.abs(norm - 1.0) < 1e-5] *= 0.5
    return batch


@pytest.mark.parametrize("configured", [False, True], ids=["default", "rich"])
def test_a_step_by_an_action_is_the_step_by_the_clipped_action(env_id, configured):
    config = rich(env_id) if configured else {}
    raw, tidy = vector(env_id, N_ROWS, **config), vector(env_id, N_ROWS, **config)
    assert_same_bits(raw.reset(seed=0), tidy.reset(seed=0))
    rng = np.random.default_rng(1)
    ended = np.zeros(N_ROWS, dtype=np.bool_)
    for _ in range(N_STEPS):
        batch = wild(env_id, rng)
        inside = clipped(batch, is_disc(env_id))
        *outputs, infos = raw.step(batch)
        *expected, expected_infos = tidy.step(inside)
        assert_same_bits(outputs, expected)
        # a row that begins anew ignores its action
        outside = (inside != batch).any(axis=-1) & ~ended
        np.testing.assert_array_equal(infos.pop("action_clipped"), outside)
        ended = outputs[2] | outputs[3]
        assert not expected_infos.pop("action_clipped").any()
        assert_same_bits(infos, expected_infos)


def test_negative_zero_is_zero(env_id):
    negative, positive = vector(env_id, N_ROWS), vector(env_id, N_ROWS)
    assert_same_bits(negative.reset(seed=0), positive.reset(seed=0))
    zero = np.zeros((N_ROWS, n_actions(env_id)), dtype=np.float32)
    for _ in range(N_STEPS):
        assert_same_bits(negative.step(-zero), positive.step(zero))


def test_actions_on_the_edge_of_the_space_are_not_clipped(env_id):
    env = single(env_id)
    env.reset(seed=0)
    m = n_actions(env_id)
    corners = np.array(np.meshgrid(*[[-1.0, 1.0]] * m)).reshape(m, -1).T
    edge = np.vstack([np.eye(m), -np.eye(m), corners / (np.sqrt(m) if is_disc(env_id) else 1.0)])
    for action in edge.astype(np.float32):
        assert not env.step(action)[4]["action_clipped"]
