"""Episodes of an environment of `gym.make` beside those of the model made from its page."""

from collections.abc import Mapping

import gymnasium as gym
import numpy as np
import pytest

import rigid_envs  # noqa: F401 - registers the ids
from rigid_envs.engine.layout import CLOCK
from rigid_envs.testing.environments import FULL

FINE = 64  # substeps with which the integrator's error is negligible, see `TOLERANCE`
# The integrator is of fourth order. With 64 substeps a step of it turns the body by less than
# 0.01 rad (4 rad/s, 0.1 s), so that its error is below 1e-8 per radian; its constants are small,
# 1e-12 is measured. Neighbouring motions separate by less than e^4 in the 60 steps compared.
TOLERANCE = 1e-8
LATE = 150  # steps, of 250 in an episode, after which the time that is left may be negative

_HALF_ULP = 2.0**-24  # relative: observations are rounded to float32
_OF_A_STEP = ("cost", "is_success", "action_clipped", "physics_error")  # 0 at a reset


def in_frames(*kinds):
    """Models with each frame; a reduced one is a kernel of its own, of most ids a long test."""
    cases = [(kind, "world") for kind in kinds]
    for kind in kinds:
        is_long = f"RigidEnvs/{kind.__name__}-v0" not in FULL
        cases.append(pytest.param(kind, "reduced", marks=[pytest.mark.long] * is_long))
    return cases


def environment(name, **settings):
    """An environment by the name of its page."""
    return gym.make(f"RigidEnvs/{name}-v0", disable_env_checker=True, **settings)


def both(kind, **settings):
    """An environment, and the model of its page."""
    ours = {key: value for key, value in settings.items() if key != "max_episode_steps"}
    return environment(kind.__name__, **settings), kind(**ours)


def begin(env, model, state, params=None, seed=None, **beside):
    """Begin an episode of both in the same state; what is beside it, if not given, is theirs."""
    options = {"state": dict(state), "params": dict(params or {})}
    observation, info = env.reset(seed=seed, options=options)
    assert not any(value for key, value in info.items() if key in _OF_A_STEP or "/" in key)
    model.begin(params, **state, **(beside or model.beside(hidden(env))))
    return observation


def started(env, model, rng, seed, **more):
    """Begin an episode of both: state of the model, and what is beside it of the environment."""
    params = model.draw_params(rng)
    state = {**model.draw(rng, params), **more}
    for name in model.beside(np.zeros(20)):
        del state[name]
    return begin(env, model, state, params, seed)


def hidden(env):
    """What the task keeps beside the state of the body, in the order of its page, if anything."""
    return np.asarray(env.unwrapped.get_state().get("aux", []), dtype=float)


def actions(rng, n, size, largest=1.3):
    """Random actions, some of them outside the space, held for three steps."""
    held = rng.uniform(-largest, largest, (n // 3 + 1, size))
    return np.repeat(held, 3, axis=0)[:n].astype(np.float32)


def alike(seen, expected, tolerance, what="observation"):
    """What is seen is what is expected, rounded to float32."""
    if isinstance(expected, Mapping):
        assert seen.keys() == expected.keys()
        for key, value in expected.items():
            alike(seen[key], value, tolerance, key)
        return
    assert seen.dtype == np.float32
    np.testing.assert_allclose(seen, expected, rtol=_HALF_ULP, atol=tolerance, err_msg=what)


def step(env, model, action, tolerance, shown=None):
    """Step both and compare everything; also whether the time limit is reached.

    Observations may have a tolerance of their own.
    """
    observation, reward, terminated, truncated, info = env.step(action)
    expected = model.step(action)
    assert info["physics_error"] == expected.broken
    if expected.observation is not None:
        alike(observation, expected.observation, shown or tolerance)
    for key, value in expected.info.items():
        assert abs(info[key] - value) <= (0.0 if isinstance(value, bool) else tolerance), key
    assert abs(float(reward) - expected.reward) <= tolerance * model.largest_weight
    assert terminated == expected.terminated
    return expected, truncated


def play(env, model, choices, tolerance):
    """Step both until the end of the episode or of the actions.

    Args:
        env: in the same state as the model.
        choices: the actions.
        tolerance: largest difference of a number, beside the rounding of observations.

    Returns:
        Whether the last step was a success.
    """
    success = False
    for n, action in enumerate(choices, 1):
        expected, truncated = step(env, model, action, tolerance)
        assert truncated == (n == env.spec.max_episode_steps), n
        success = expected.success
        if expected.terminated or truncated:
            break
    return success


def play_many(kind, steps, tolerance, /, n=40, at_start=None, **settings):
    """Play n episodes of random actions; first observations may have a tolerance of their own."""
    (env, model), rng = both(kind, **settings), np.random.default_rng(99)
    for seed in range(n):
        alike(started(env, model, rng, seed), model.observe(), at_start or tolerance)
        play(env, model, actions(rng, steps, model.n_action), tolerance)


class Pair:
    """Episodes of a body that turns, led by policies; states are compared as well."""

    def __init__(self, kind, within=TOLERANCE, **settings):
        """Make both; n_substeps is `FINE` where it is not given."""
        self.env, self.page = both(kind, **{"n_substeps": FINE, **settings})
        self.within = within

    def reset(self, rng, y=None, aux=None):
        """Begin at a start that the page draws, or at y; goals are drawn by the environment.

        What is kept beside the state can be given instead: it is set by `set_state`, as of `LATE`
        steps after a reset, and the environment shows it from the next step on.
        """
        given = {} if y is None else self.page.components(np.asarray(y, dtype=float))
        seen = started(self.env, self.page, rng, int(rng.integers(2**31)), **given)
        if aux is None:
            alike(seen, self.page.observe(), 100.0 * self.within)
            return
        unwrapped = self.env.unwrapped
        state = unwrapped.get_state()
        state["clock"][CLOCK.elapsed] = LATE
        unwrapped.set_state({**state, "aux": aux})
        self.page.aux = np.array(aux, dtype=float)

    def step(self, action):
        """Step both and compare everything; also whether the time limit is reached."""
        # terms have slopes up to 10, at the goal; entries in the reduced frame up to 100
        tolerances = 10.0 * self.within, 100.0 * self.within
        outcome = step(self.env, self.page, np.float32(action), *tolerances)
        unwrapped = self.env.unwrapped
        y = unwrapped.y
        y[:4] *= 1.0 if y[:4] @ self.page.y[:4] > 0 else -1.0
        np.testing.assert_allclose(y[:4], self.page.y[:4], rtol=0, atol=self.within)
        size = max(1.0, float(np.abs(y).max()))
        np.testing.assert_allclose(y[4:], self.page.y[4:], rtol=0, atol=self.within * size)
        return outcome

    def run(self, policy, steps=1000):
        """Steps until the end, or so many."""
        outcomes = []
        for k in range(steps):
            outcome, truncated = self.step(policy(self.page, k))
            outcomes.append(outcome)
            if truncated or outcome.terminated:
                break
        return outcomes

    def shake(self, rng, steps):
        """Steps under actions that are outside their space now and then."""
        return self.run(lambda page, k: rng.uniform(-1.5, 1.5, page.n_action), steps)
