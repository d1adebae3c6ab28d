"""The observed attitude is that of the state, in each representation, by `rigid_envs.rotations`."""

from typing import Any

import numpy as np
import pytest

from rigid_envs import rotations
from tests.contracts.environments import actions, assert_same_bits, vector

N = 500
ROUNDING = 2e-7  # of numbers up to 1 to float32
REPRESENTATIONS = {
    "none": lambda q: np.empty((len(q), 0)),
    "matrix": lambda q: rotations.matrix_from_quaternion(q).reshape(-1, 9),
    "rot6d": lambda q: rotations.rot6d_from_matrix(rotations.matrix_from_quaternion(q)),
    "quat": rotations.canonicalize,
    "euler": rotations.euler_from_quaternion,
}


def observed(env_id: str, rotation: str) -> list[tuple[Any, Any, Any]]:
    """Quaternions, observations and rewards at the start and after steps."""
    envs = vector(env_id, N, rotation=rotation)
    results: list[tuple[Any, Any, Any]] = [(None, envs.reset(seed=0)[0], None)]
    quaternions = [envs.y[:, :4]]
    for batch in actions(env_id, 10, N):
        results.append((None, *envs.step(batch)[:2]))
        quaternions.append(envs.y[:, :4])
    return [(q, *result[1:]) for q, result in zip(quaternions, results, strict=True)]


@pytest.mark.parametrize("rotation", REPRESENTATIONS)
def test_observed_attitude_is_that_of_the_state(env_id, rotation):
    n_features = observed(env_id, "none")[0][1].shape[1]
    for q, observations, _ in observed(env_id, rotation):
        attitude = observations[:, n_features:]
        expected = REPRESENTATIONS[rotation](q)
        assert attitude.shape == expected.shape
        difference = attitude - expected
        if rotation == "euler":
            difference = (difference + np.pi) % (2 * np.pi) - np.pi
        assert np.abs(difference).max(initial=0.0) <= np.pi * ROUNDING


@pytest.mark.parametrize("rotation", REPRESENTATIONS)
def test_representation_changes_nothing_but_the_observation(env_id, rotation):
    plain = observed(env_id, "none")
    for (q, observations, rewards), expected in zip(observed(env_id, rotation), plain, strict=True):
        assert_same_bits(q, expected[0])
        assert_same_bits(rewards, expected[2])
        n = expected[1].shape[1]
        assert_same_bits(np.ascontiguousarray(observations[:, :n]), expected[1])


def test_entries_of_the_observation_are_named_with_their_bounds(env_id):
    for rotation in REPRESENTATIONS:
        envs = vector(env_id, 1, rotation=rotation)
        entries, space = envs.task.observations(), envs.single_observation_space
        assert space.shape == (len(entries),)
        assert len({entry.symbol for entry in entries}) == len(entries)
        assert all(entry.unit and entry.frame for entry in entries)
        np.testing.assert_array_equal(space.low, np.float32([e.low for e in entries]))
        np.testing.assert_array_equal(space.high, np.float32([e.high for e in entries]))
        assert np.isfinite(space.low).all()
        assert np.isfinite(space.high).all()


@pytest.mark.parametrize("rotation", ["matrix", "rot6d", "quat", "euler"])
def test_attitude_is_observed_in_space_at_its_singular_places(env_id, rotation):
    turns = np.array(
        [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], [-1, 0, 0, 0], [0, 0, 0, -1]]
    )
    envs = vector(env_id, len(turns), rotation=rotation)
    observations, _ = envs.reset(seed=0, options={"state": {"q": turns}})
    assert envs.observation_space.contains(observations)
