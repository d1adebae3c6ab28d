"""Finite actions outside the space are clipped exactly, and the clipping is told."""

import numpy as np
import numpy.typing as npt
import pytest

from rigid_envs.testing.environments import (
    CONTINUOUS,
    assert_same_bits,
    counted,
    is_round,
    n_actions,
    rich,
    vector,
)

pytestmark = pytest.mark.parametrize("env_id", CONTINUOUS)

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


@counted("n_rows", 1000)
def test_negative_zero_is_zero(env_id, n_rows):
    negative, positive = vector(env_id, n_rows), vector(env_id, n_rows)
    assert_same_bits(negative.reset(seed=0), positive.reset(seed=0))
    zero = np.zeros((n_rows, n_actions(env_id)), dtype=np.float32)
    for _ in range(N_STEPS):
        assert_same_bits(negative.step(-zero), positive.step(zero))


def test_actions_on_the_edge_of_the_space_are_not_clipped_those_beyond_are(env_id):
    m = n_actions(env_id)
    corners = np.array(np.meshgrid(*[[-1.0, 1.0]] * m)).reshape(m, -1).T
    edge = np.vstack([np.eye(m), -np.eye(m), corners / (np.sqrt(m) if is_round(env_id) else 1.0)])
    envs = vector(env_id, len(edge))
    for size, outside in ((1.0, False), (1.0 + 1e-6, True)):  # a few ulp of float32
        envs.reset(seed=0)
        clipped_rows = envs.step((size * edge).astype(np.float32))[4]["action_clipped"]
        assert (clipped_rows == outside).all()
