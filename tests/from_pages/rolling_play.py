"""Episodes of an environment beside those of a model that was made from its page."""

from collections.abc import Iterable, Mapping
from typing import Any, TypeVar

import gymnasium as gym
import numpy as np
from scipy import stats

import rigid_envs  # noqa: F401 - registers the ids
from rigid_envs.base.checks import Array
from tests.from_pages.rolling import Model

ModelT = TypeVar("ModelT", bound=Model)

_HALF_ULP = 2.0**-24  # relative: observations are rounded to float32
_OF_A_STEP = ("cost", "is_success", "action_clipped", "physics_error")  # 0 at a reset
_LEAST_P = 1e-4  # of a two-sample test with fixed seeds


def environment(name: str, **settings: Any) -> gym.Env[Any, Any]:
    """An environment by the name of its page."""
    return gym.make(f"RigidEnvs/{name}-v0", disable_env_checker=True, **settings)


def both(kind: type[ModelT], **settings: Any) -> tuple[gym.Env[Any, Any], ModelT]:
    """An environment, and the model of its page."""
    return environment(kind.__name__, **settings), kind(**settings)


def begin(
    env: gym.Env[Any, Any],
    model: Model,
    state: Mapping[str, Any],
    params: Mapping[str, float] | None = None,
    seed: int | None = None,
    **beside: Any,
) -> Any:
    """Begin an episode of both in the same state; `beside` is known to the model alone."""
    options = {"state": dict(state), "params": dict(params or {})}
    observation, info = env.reset(seed=seed, options=options)
    assert not any(value for key, value in info.items() if key in _OF_A_STEP or "/" in key)
    model.begin(params, **state, **beside)
    return observation


def started(
    env: gym.Env[Any, Any], model: Model, rng: np.random.Generator, seed: int, **more: Any
) -> Any:
    """Begin an episode of both: state of the model, and what is beside it of the environment."""
    params = model.draw_params(rng)
    state = {**model.draw_with(rng, params), **more}
    for name in model.beside(np.zeros(20)):
        del state[name]
    observation, _ = env.reset(seed=seed, options={"state": state, "params": params})
    model.begin(params, **state, **model.beside(hidden(env)))
    return observation


def hidden(env: gym.Env[Any, Any]) -> Array:
    """What the task keeps beside the state of the body, in the order of its page, if anything."""
    aux = env.unwrapped.get_state().get("aux", [])
    return np.asarray(aux, dtype=float)


def actions(rng: np.random.Generator, n: int, size: int, largest: float = 1.3) -> Array:
    """Random actions, some of them outside the space, held for three steps."""
    held = rng.uniform(-largest, largest, (n // 3 + 1, size))
    return np.repeat(held, 3, axis=0)[:n].astype(np.float32)


def alike(seen: Any, expected: Any, tolerance: float, what: str = "observation") -> None:
    """What is seen is what is expected, rounded to float32."""
    if isinstance(expected, Mapping):
        assert seen.keys() == expected.keys()
        for key, value in expected.items():
            alike(seen[key], value, tolerance, key)
        return
    assert seen.dtype == np.float32
    np.testing.assert_allclose(seen, expected, rtol=_HALF_ULP, atol=tolerance, err_msg=what)


def play(env: gym.Env[Any, Any], model: Model, choices: Iterable[Any], tolerance: float) -> bool:
    """Step both until the end of the episode or of the actions.

    Args:
        env: in the same state as the model.
        choices: the actions.
        tolerance: largest difference of a number, beside the rounding of observations.

    Returns:
        Whether the last step was a success.
    """
    assert env.spec is not None and env.spec.max_episode_steps is not None
    success = False
    for n, action in enumerate(choices, 1):
        observation, reward, terminated, truncated, info = env.step(action)
        expected = model.step(action)
        assert info["physics_error"] == expected.broken, n
        if not expected.broken:
            alike(observation, expected.observation, tolerance)
        for key, value in expected.info.items():
            allowed = 0.0 if isinstance(value, bool) else tolerance
            assert abs(info[key] - value) <= allowed, (n, key)
        assert abs(float(reward) - expected.reward) <= tolerance * model.largest_weight, n
        assert terminated == expected.terminated, n
        assert truncated == (n == env.spec.max_episode_steps), n
        success = expected.success
        if terminated or truncated:
            break
    return success


def play_many(
    kind: type[Model],
    steps: int,
    tolerance: float,
    /,
    n: int = 40,
    at_start: float | None = None,
    **settings: Any,
) -> None:
    """Play n episodes of random actions; first observations may have a tolerance of their own."""
    (env, model), rng = both(kind, **settings), np.random.default_rng(99)
    for seed in range(n):
        alike(started(env, model, rng, seed), model.observe(), at_start or tolerance)
        play(env, model, actions(rng, steps, model.n_action), tolerance)


def drawn(
    kind: type[Model], n: int = 2000, seed: int = 5, **settings: Any
) -> tuple[Array, Any, Any]:
    """States, observations and vector environment after one reset of n rows."""
    envs = gym.make_vec(
        f"RigidEnvs/{kind.__name__}-v0",
        num_envs=n,
        vectorization_mode="vector_entry_point",
        **settings,
    )
    observations, _ = envs.reset(seed=seed)
    return np.asarray(envs.unwrapped.y), observations, envs


def same_distribution(ours: Mapping[str, Array], theirs: Mapping[str, Array]) -> None:
    """Every quantity has the same distribution in both, by the test of Kolmogorov and Smirnov."""
    assert ours.keys() == theirs.keys()
    for name, values in ours.items():
        p = stats.ks_2samp(values, theirs[name]).pvalue
        assert p > _LEAST_P, (name, p)
