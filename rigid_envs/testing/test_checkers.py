"""The checkers that others use pass, with every warning an error."""

import warnings
from collections.abc import Iterator

import gymnasium as gym
import pytest
from gymnasium.utils.env_checker import check_env

from rigid_envs.testing.environments import GOALS, rich, single
from rigid_envs.watch.drawing import Window


@pytest.fixture(autouse=True)
def warnings_are_errors() -> Iterator[None]:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


@pytest.fixture(autouse=True)
def windows_do_not_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody watches: pictures are not shown in real time."""
    show = Window.show
    monkeypatch.setattr(Window, "show", lambda self, picture, _: show(self, picture, 0.0))


@pytest.mark.parametrize("make_config", [lambda _: {}, rich], ids=["default", "rich"])
def test_gymnasium_checker_passes_without_a_warning(env_id, make_config):
    check_env(single(env_id, **make_config(env_id)))


@pytest.mark.parametrize("make_config", [lambda _: {}, rich], ids=["default", "rich"])
def test_sb3_checker_passes_without_a_warning(env_id, make_config):
    pytest.importorskip("stable_baselines3")
    from stable_baselines3.common.env_checker import check_env as check_for_sb3

    check_for_sb3(single(env_id, **make_config(env_id)))
    if env_id not in GOALS:  # there it looks for compute_reward on the wrapper itself
        check_for_sb3(gym.make(env_id, **make_config(env_id)))


def test_making_a_vector_environment_warns_of_nothing(env_id):
    for mode in ("vector_entry_point", "sync"):
        gym.make_vec(env_id, num_envs=2, vectorization_mode=mode).close()
