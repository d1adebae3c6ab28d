"""The observed attitude is that of the state, in each representation."""

from contextlib import suppress
from functools import lru_cache
from itertools import product
from typing import Any

import numpy as np
import pytest

from rigid_envs.mechanics import rotations
from rigid_envs.testing.environments import (
    ATTITUDES,
    IDS,
    actions,
    assert_same_bits,
    bounds,
    flat,
    representations,
    single,
    task_of,
    vector,
)

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
def observed(env_id: str, rotation: str) -> list[tuple[Any, Any, Any]]:
    """Quaternions, observations and rewards at the start and after steps."""
    envs = vector(env_id, N, rotation=rotation)
    q = task_of(env_id).system_type.components["q"]
    results: list[tuple[Any, Any, Any]] = [(flat(envs.reset(seed=0)[0]), None)]
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


def cube(env_id: str) -> Any:
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
