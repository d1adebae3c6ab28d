"""Every wrapper of Gymnasium takes these environments, or is for others."""

import warnings
from collections.abc import Iterator

import pytest
from gymnasium import wrappers
from gymnasium.wrappers import vector

from tests.clients.wrapping import (
    LEFT_OUT,
    LEFT_OUT_OF_ROWS,
    PICTURES,
    ROWS,
    SINGLE,
    fits,
    play,
    wrapped,
    wrapped_rows,
)

IDS = ("RigidEnvs/BallPark-v0", "RigidEnvs/BallParkGoal-v0", "RigidEnvs/BallGrid-v0")


@pytest.fixture(autouse=True)
def no_display(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of wrappers, on what they convert
        yield


def cases(table: object) -> list[object]:
    """Wrappers by name; those of pictures need the extra `render`, and take seconds."""
    long = [pytest.mark.long]
    return [pytest.param(name, marks=long if name in PICTURES else []) for name in table]  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", cases(SINGLE))
def test_a_wrapper_takes_single_environments(name: str) -> None:
    for env_id in IDS:
        if fits(name, env_id):
            env = wrapped(name, env_id)
            play(env)
            env.close()


@pytest.mark.parametrize("name", cases(ROWS))
def test_a_wrapper_takes_native_rows(name: str) -> None:
    for env_id in IDS:
        if fits(name, env_id):
            envs = wrapped_rows(name, env_id)
            play(envs)
            envs.close()


def test_there_is_no_wrapper_that_is_neither_taken_nor_for_others() -> None:
    assert set(wrappers.__all__) == SINGLE.keys() | LEFT_OUT.keys()
    assert set(vector.__all__) == ROWS.keys() | LEFT_OUT_OF_ROWS.keys()


def test_each_wrapper_fits_two_ids_or_more_unless_it_is_for_goals() -> None:
    for name in {*SINGLE, *ROWS}:
        n = sum(fits(name, env_id) for env_id in IDS)
        assert n >= 2 or name == "FilterObservation", name
