"""Whatever is done, what is observed is finite, in the space and of the right type, every step.

Eight ways to act, each by an eighth of the rows. Steps and settings are counted over all ids.
"""

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from rigid_envs.base.checks import ConfigError
from rigid_envs.envs.vector import RigidVectorEnv
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.testing.environments import (
    CONTINUOUS,
    EARLY_ENDS,
    FULL,
    OF_KERNELS,
    bounds,
    counted,
    flat,
    representations,
    rules,
    task_of,
    vector,
)

CYCLE = 128  # steps after which the prepared actions come again
WAYS = ("uniform", "bang-bang", "switch", "zero", "one side", "denormal", "resonant", "policy")


def prepared(way: str, rng: np.random.Generator, n_rows: int, m: int) -> npt.NDArray[np.float32]:
    """Numbers in [-1, 1] of one kind, shape (CYCLE, n_rows, m)."""
    shape = (CYCLE, n_rows, m)
    side = rng.choice([-1.0, 1.0], (1, n_rows, m))
    step = np.arange(CYCLE)[:, None, None]
    ways = {
        "uniform": lambda: rng.uniform(-1.0, 1.0, shape),
        "bang-bang": lambda: rng.choice([-1.0, 1.0], shape),
        "switch": lambda: np.where(step % rng.integers(2, 40, (1, n_rows, 1)) == 0, side, -side),
        "zero": lambda: np.zeros(shape),
        "one side": lambda: np.broadcast_to(side, shape),
        "denormal": lambda: rng.uniform(-1e-38, 1e-38, shape),
        # over all rows every frequency, that of the motion among them, in phase with every axis
        "resonant": lambda: np.sign(
            np.sin(
                2 * np.pi * (step * rng.uniform(0.0, 0.5, (1, n_rows, 1)) + rng.random(side.shape))
            )
        ),
        "policy": lambda: np.zeros(shape),
    }
    return ways[way]().astype(np.float32)


class Driver:
    """Acts on rows in all `WAYS` and checks every result."""

    def __init__(self, envs: RigidVectorEnv, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.envs, self.n_choices = envs, envs.task.n_choices
        self.low, self.high = bounds(envs.single_observation_space)
        n, m = envs.num_envs // len(WAYS), len(envs.task.actions())
        self.actions = np.concatenate([prepared(way, rng, n, m) for way in WAYS], axis=1)
        self.learners = slice((len(WAYS) - 1) * n, len(WAYS) * n)
        self.gain = rng.normal(0.0, 1.0, (*self.low.shape, m)).astype(np.float32)
        self.observations = flat(envs.reset(seed=seed)[0])
        self.n_errors, self.n_ended = 0, 0

    def run(self, n_steps: int) -> None:
        for k in range(n_steps):
            batch = self.actions[k % CYCLE]
            seen, noise = self.observations[self.learners], batch[: self.envs.num_envs // len(WAYS)]
            batch[self.learners] = np.tanh(seen @ self.gain) + noise
            self.check(self.envs.step(self.chosen(batch) if self.n_choices else batch))

    def chosen(self, batch: npt.NDArray[np.float32]) -> npt.NDArray[np.int64]:
        """The choices whose parts of [-1, 1] hold the numbers."""
        parts = np.floor(0.5 * self.n_choices * (batch[:, 0] + 1.0)).astype(np.int64)
        return np.clip(parts, 0, self.n_choices - 1)

    def check(self, results: Any) -> None:
        observations, rewards, terminated, truncated, infos = results
        self.observations = flat(observations)
        dtypes = [array.dtype for array in (self.observations, rewards, terminated, truncated)]
        assert dtypes == [np.float32, np.float64, np.bool_, np.bool_]
        # a comparison with NaN is false
        assert (self.observations >= self.low).all()
        assert (self.observations <= self.high).all()
        assert np.isfinite(rewards).all()
        assert np.isfinite(infos["cost"]).all()
        assert terminated[infos["physics_error"]].all()
        self.n_errors += np.count_nonzero(infos["physics_error"])
        self.n_ended += np.count_nonzero(terminated)


def moderate(env_id: str, rng: np.random.Generator) -> dict[str, Any]:
    """Settings within a factor of two of the default ones, some of them ranges, all switches."""
    task, config = task_of(env_id), {}
    for name, rule in rules(env_id).items():
        if name in OF_KERNELS:
            continue
        value = getattr(task, name)
        if isinstance(value, float) and rng.random() < 0.5:
            factors = 2.0 ** rng.uniform(-1.0, 1.0, 2)
            ends = np.clip(np.sort(value * factors), rule.low, rule.high).tolist()
            config[name] = tuple(ends) if rule.drawn and rng.random() < 0.5 else ends[0]
    config |= {
        "rotation": str(rng.choice(representations(env_id))),
        "n_substeps": task.n_substeps * int(rng.integers(2, 5)),
        "observe_params": bool(rng.random() < 0.5),
    }
    if env_id not in FULL:
        return config
    if env_id in CONTINUOUS:
        config["action_noise"] = (0.0, float(rng.choice([0.0, 0.3])))
    noise, delay = float(rng.choice([0.0, 0.1, 10.0])), int(rng.integers(0, 5))
    return config | {"observation_noise": (0.0, noise), "action_delay": (0, delay)}


def extreme(env_id: str, rng: np.random.Generator) -> dict[str, Any]:
    """Two to five settings anywhere in their bounds, over all sizes."""
    barred = set() if env_id in FULL else OF_KERNELS
    numbers = {n: r for n, r in rules(env_id).items() if isinstance(getattr(r, "low", None), float)}
    numbers = {name: rule for name, rule in numbers.items() if name not in barred}
    names = rng.choice(list(numbers), rng.integers(2, 6), replace=False)
    config: dict[str, Any] = {"n_substeps": 20 * task_of(env_id).n_substeps}
    for name in names.tolist():
        low, high = numbers[name].low, numbers[name].high
        least = max(low, 1e-12 * high)
        config[name] = float(np.clip(least ** (1 - (s := rng.random())) * high**s, low, high))
    return config


def accepted(env_id: str, draw: Any, rng: np.random.Generator) -> dict[str, Any]:
    """The first of the drawn settings that the task takes."""
    for _ in range(1000):
        config = draw(env_id, rng)
        try:
            type(task_of(env_id))(**config)
        except ConfigError:
            continue
        return config
    raise AssertionError(f"no settings of {env_id} were accepted")


@counted("n_steps", 100_000_000)
def test_nothing_leaves_its_space_at_the_default_settings(env_id, n_steps):
    n_rows, shown = 1024, representations(env_id)
    for rotation in shown:
        driver = Driver(vector(env_id, n_rows, rotation=rotation, num_threads=2), seed=0)
        driver.run(-(-n_steps // (n_rows * len(shown))))
        assert driver.n_errors == 0
        assert driver.n_ended == 0 or env_id in EARLY_ENDS


@counted("n_configs", 500)
@pytest.mark.parametrize("draw", [moderate, extreme])
def test_nothing_leaves_its_space_at_any_settings(env_id, draw, n_configs):
    rng = np.random.default_rng(0)
    n_steps = min(60, ENVIRONMENTS[env_id].max_episode_steps)
    for seed in range(n_configs):
        config = accepted(env_id, draw, rng)
        envs = vector(env_id, 8 * len(WAYS), max_episode_steps=n_steps, **config)
        driver = Driver(envs, seed)
        driver.run(100)
        if draw is moderate:  # far out, motion may become too fast: that ends the episode
            assert driver.n_errors == 0, config
