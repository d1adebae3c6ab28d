"""An environment of `gym.make` beside the same one rebuilt from its page."""

from collections.abc import Callable
from functools import cache
from typing import Any

import gymnasium as gym
import numpy as np
from scipy.stats import ks_2samp, kstest

import rigid_envs  # noqa: F401  (registers the ids)
from rigid_envs.base.checks import Array
from rigid_envs.engine.layout import CLOCK
from tests.from_pages.attitudes import matrix
from tests.from_pages.episodes import Page, Start
from tests.from_pages.rolling import Step

STARTS = 2000

FINE = 64  # substeps with which the integrator's error is negligible, see `TOLERANCE`
# The integrator is of fourth order. With 64 substeps a step of it turns the body by less than
# 0.01 rad (4 rad/s, 0.1 s), so that its error is below 1e-8 per radian; its constants are small,
# 1e-12 is measured. Neighbouring motions separate by less than e^4 in the 60 steps compared.
TOLERANCE = 1e-8
LATE = 150  # steps, of 250 in an episode, after which the time that is left may be negative

Policy = Callable[[Page, int], Any]
Rng = np.random.Generator


def noise(rng: Rng, page: Page, size: float = 1.5) -> Array:
    """An action that is outside its space now and then."""
    return rng.uniform(-size, size, page.controls)


class Pair:
    """One episode of both, started and stepped together; every difference fails."""

    def __init__(self, kind: type[Page], within: float = TOLERANCE, **arguments: Any) -> None:
        """Make both; n_substeps is `FINE` where it is not given."""
        arguments = {"n_substeps": FINE, **arguments}
        ours = {key: value for key, value in arguments.items() if key != "max_episode_steps"}
        self.page = kind(**ours)
        self.env = gym.make(f"RigidEnvs/{kind.__name__}-v0", **arguments)
        self.within = within

    def reset(self, rng: Rng, y: Array | None = None, aux: Array | None = None) -> None:
        """Begin at a start that the page draws, or at y; goals are drawn by the environment.

        What is kept beside the state can be given instead: it is set by `set_state`, as of `LATE`
        steps after a reset, and the environment shows it from the next step on.
        """
        start = self.page.draw(rng)
        y = start.y if y is None else np.asarray(y, dtype=float)
        names = ("q", "omega_body", "pivot", "pivot_velocity")
        parts = np.split(y, [4, 7, 9]) if len(y) > 7 else np.split(y, [4])
        options = {"state": dict(zip(names, parts, strict=False)), "params": start.parameters}
        seen, info = self.env.reset(seed=int(rng.integers(2**31)), options=options)
        assert not any(info.values())
        state = self.env.unwrapped.get_state()
        if aux is not None:
            state["clock"][CLOCK.elapsed] = LATE
            self.env.unwrapped.set_state({**state, "aux": aux})
            state["aux"] = np.asarray(aux)
        self.page.begin(start.parameters, y=y, aux=state.get("aux", np.empty(0)))
        if aux is None:
            same_observation(seen, self.page.observe(), self.within)

    def step(self, action: Any) -> tuple[Step, bool]:
        """Step both and compare everything; also whether the time limit is reached."""
        action = np.asarray(action, dtype=np.float32)
        seen, reward, terminated, truncated, info = self.env.step(action)
        outcome = self.page.step(action)
        same_observation(seen, outcome.observation, self.within)
        assert info.keys() == outcome.info.keys()
        for key, value in outcome.info.items():
            # terms have slopes up to 10, at the goal
            assert abs(float(info[key]) - float(value)) <= 10 * self.within * max(
                1.0, abs(value)
            ), key
            assert isinstance(info[key], bool) == isinstance(value, bool), key
        weights = self.page.largest_weight - 1.0
        most = max(1.0, *map(abs, outcome.terms.values()))
        assert abs(reward - outcome.reward) <= 10 * self.within * weights * most
        assert terminated == outcome.terminated
        y = self.env.unwrapped.y
        sign = 1.0 if y[:4] @ self.page.y[:4] > 0 else -1.0
        assert np.allclose(y[:4] * sign, self.page.y[:4], rtol=0, atol=self.within)
        size = max(1.0, float(np.abs(y).max()))
        assert np.allclose(y[4:], self.page.y[4:], rtol=0, atol=self.within * size)
        return outcome, truncated

    def run(self, policy: Policy, steps: int = 1000) -> list[Step]:
        """Steps until the end, or so many."""
        outcomes = []
        for k in range(steps):
            outcome, truncated = self.step(policy(self.page, k))
            outcomes.append(outcome)
            if truncated or outcome.terminated:
                break
        return outcomes


def same_observation(seen: Any, expected: Any, tolerance: float) -> None:
    """Equal to rounding, one unit of float32, besides the error of the motion.

    Entries in the reduced frame and the like have slopes up to 100.
    """
    if isinstance(expected, dict):
        assert seen.keys() == expected.keys()
        for key in expected:
            same_observation(seen[key], expected[key], tolerance)
        return
    expected = np.asarray(expected, dtype=np.float32)
    assert seen.dtype == np.float32
    assert seen.shape == expected.shape
    away = np.abs(seen.astype(float) - expected.astype(float))
    allowed = np.spacing(np.abs(expected)) + 100 * tolerance * np.maximum(1.0, np.abs(expected))
    assert np.all(away <= allowed), (seen, expected)


@cache
def drawn(kind: type[Page]) -> list[Start]:
    """Starts of the environment, always the same ones."""
    envs = gym.make_vec(f"RigidEnvs/{kind.__name__}-v0", num_envs=STARTS)
    envs.reset(seed=11)
    state = envs.unwrapped.get_state()
    held = list(envs.unwrapped.task.ranges())  # the parameters of the system, then others
    columns = [held.index({"I_perp": "I1"}.get(name, name)) for name in kind.physical]
    starts = []
    for k in range(STARTS):
        parameters = dict(zip(kind.physical, state["parameters"][k][columns], strict=True))
        aux = state["aux"][k] if "aux" in state else np.empty(0)
        starts.append(Start(state["y"][k], parameters, aux))
    return starts


def same_distribution(kind: type[Page], given: list[Start]) -> None:
    """Every quantity of such starts passes the test of Kolmogorov and Smirnov beside the page.

    Quantities are R, omega in body and world axes and its norm, what else is in the state, the
    parameters and what is kept. Of equal distributions one in ten thousand fails; the seeds are
    fixed, so that these pass for good.
    """
    page = kind()
    rng = np.random.default_rng(7)
    expected = np.array([_quantities(page.draw(rng)) for _ in given]).T
    for k, (a, b) in enumerate(
        zip(expected, np.array(list(map(_quantities, given))).T, strict=True)
    ):
        if np.ptp(a) < 1e-12:  # constant, as a parameter without range, or 0
            assert np.allclose(b, a[0], rtol=0, atol=1e-12), k
        else:
            assert ks_2samp(a, b).pvalue > 1e-4, k


def is_uniform(values: Array, low: float, high: float) -> None:
    """Uniform from low to high: inside, and by the test of Kolmogorov and Smirnov."""
    assert low <= np.min(values) and np.max(values) <= high
    assert kstest(values, "uniform", (low, high - low)).pvalue > 1e-4


def _quantities(start: Start) -> Array:
    R, omega = matrix(start.y[:4]), start.y[4:7]
    moving = [*omega, *(R @ omega), np.linalg.norm(omega), *start.y[7:]]
    return np.array([*R.ravel(), *moving, *start.parameters.values(), *_rotated(start.aux)])


def _rotated(aux: Array) -> Array:
    """A quaternion by its matrix, whose sign has no meaning; other numbers as they are."""
    return matrix(aux).ravel() if len(aux) == 4 else aux
