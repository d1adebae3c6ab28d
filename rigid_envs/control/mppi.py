"""Sampling model predictive control: path integrals, for any system that can be rolled out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rigid_envs.checks import integer, non_negative, positive, require

__all__ = ["CrossEntropyChoices", "PathIntegral", "weights"]

Array = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


def weights(costs: npt.ArrayLike, temperature: float) -> Array:
    """Importance weights of rollouts: w_k ~ exp(-(S_k - min S) / lambda), with sum 1.

    lambda is `temperature` times the span of the least twentieth of the costs S: their unit does
    not matter, nor do the largest of them. Rollouts that all cost the same count
    the same.

    Args:
        costs: shape (..., K).
        temperature: towards 0 only the best counts.
    """
    S = np.asarray(costs, dtype=np.float64)
    n = max(1, S.shape[-1] // 20)
    best = S.min(axis=-1, keepdims=True)
    span = np.partition(S, n, axis=-1)[..., n : n + 1] - best
    w = np.exp((best - S) / np.maximum(temperature * span, 1e-300))
    return np.asarray(w / w.sum(axis=-1, keepdims=True))


@dataclass(frozen=True)
class PathIntegral:
    """Model predictive path integral control: a plan moved to the weighted mean of sampled ones.

    Around the plan u, K plans ``v_k = clip(u + s_k e_k)`` are drawn, e_k Gaussian with the
    deviation `spread` and from one step to the next the `correlation`, and s_k from 1 down
    to `finest` in equal ratios: coarse samples explore, fine ones refine. Each is rolled
    out, to the cost S_k, and the plan becomes

        u <- sum_k w_k v_k,   w_k ~ exp(-S_k / lambda)   (see `weights`).

    Among the K is the plan itself. The plan stays inside the box [-1, 1], which is convex. There is
    no proof that it converges to the best plan, except where the cost is quadratic and nothing is
    clipped: there the best plan is the fixed point of the expected update.

    Attributes:
        n_samples: K.
        horizon: T, number of steps of a plan.
        spread: standard deviation of the samples from the plan [actions].
        temperature: see `weights`.
        correlation: of e between neighbouring steps, in [0, 1).
        finest: the least s_k, in (0, 1].

    Raises:
        ValueError: numbers outside their range.

    Source: Williams et al. 2017, doi:10.1109/ICRA.2017.7989202, algorithm 2, without its control
    cost, which belongs to the rollout.
    """

    n_samples: int
    horizon: int
    spread: float = 0.5
    temperature: float = 0.2
    correlation: float = 0.0
    finest: float = 0.03

    def __post_init__(self) -> None:
        """Check the numbers."""
        _check_sizes(self.n_samples, self.horizon, self.temperature)
        positive(self.spread, "spread")
        correlated = non_negative(self.correlation, "correlation") < 1.0
        require(correlated, self.correlation, "correlation", "a number in [0, 1)")
        require(positive(self.finest, "finest") <= 1.0, self.finest, "finest", "a number in (0, 1]")

    def start(self, lead: tuple[int, ...], n_action: int) -> Array:
        """Plans of zero actions, shape (T, *lead, m)."""
        return np.zeros((self.horizon, *lead, n_action))

    def draw(self, rng: np.random.Generator, n_action: int) -> Array:
        """Perturbations s_k e_k of a plan, shape (T, K, m); zero in the first of the K."""
        e = rng.standard_normal((self.horizon, self.n_samples, n_action))
        fresh = np.sqrt(1.0 - self.correlation**2)
        for t in range(1, self.horizon):
            e[t] = self.correlation * e[t - 1] + fresh * e[t]
        scales = self.spread * np.geomspace(1.0, self.finest, self.n_samples)
        scales[0] = 0.0
        return scales[:, None] * e

    def sample(self, plan: Array, draws: Array) -> Array:
        """Plans to roll out, shape (T, ..., K, m), of plans (T, ..., m); the first is the plan."""
        return np.clip(plan[..., None, :] + _beside(draws, plan.ndim - 2), -1.0, 1.0)

    def improve(self, samples: Array, costs: npt.ArrayLike) -> Array:
        """The new plan, shape (T, ..., m), of rolled out plans (T, ..., K, m), costs (..., K)."""
        share = weights(costs, self.temperature)
        return np.asarray((share[..., None, :] @ samples)[..., 0, :])

    def shift(self, plan: Array) -> Array:
        """The plan one step later; its last action is held."""
        return np.concatenate([plan[1:], plan[-1:]])


@dataclass(frozen=True)
class CrossEntropyChoices:
    """Cross-entropy method for plans of choices, with probabilities p of each choice in each step.

    K sequences are drawn from p, each step by itself, and rolled out; then

        p <- (1 - mixing) sum_k w_k [choice of k] + mixing / n,

    so that every choice keeps a probability.

    Attributes:
        n_samples: K.
        horizon: T, number of steps of a plan.
        n_choices: n.
        temperature: see `weights`.
        mixing: share of the uniform distribution.

    Raises:
        ValueError: numbers outside their range.

    Source: Rubinstein & Kroese 2004, *The Cross-Entropy Method*, chapter 4, with exponential
    weights in place of an elite.
    """

    n_samples: int
    horizon: int
    n_choices: int
    temperature: float = 0.2
    mixing: float = 0.1

    def __post_init__(self) -> None:
        """Check the numbers."""
        _check_sizes(self.n_samples, self.horizon, self.temperature)
        integer(self.n_choices, "n_choices", 2)
        require(positive(self.mixing, "mixing") <= 1.0, self.mixing, "mixing", "a number in (0, 1]")

    def start(self, lead: tuple[int, ...], n_action: int = 1) -> Array:
        """Uniform probabilities, shape (T, *lead, n)."""
        return np.full((self.horizon, *lead, self.n_choices), 1.0 / self.n_choices)

    def draw(self, rng: np.random.Generator, n_action: int = 1) -> Array:
        """Uniform random numbers in [0, 1), one for each choice, shape (T, K)."""
        return rng.random((self.horizon, self.n_samples))

    def sample(self, plan: Array, draws: Array) -> Integers:
        """Sequences to roll out, shape (T, ..., K, 1), of plans (T, ..., n)."""
        below = np.cumsum(plan, axis=-1)[..., :-1, None] <= _beside(draws, plan.ndim - 1)
        return np.asarray(below.sum(axis=-2)[..., None])

    def improve(self, samples: Integers, costs: npt.ArrayLike) -> Array:
        """The new plan, shape (T, ..., n), of sequences (T, ..., K, 1) and their costs (..., K)."""
        chosen = samples == np.arange(self.n_choices)
        share = (weights(costs, self.temperature)[..., None, :] @ chosen)[..., 0, :]
        return np.asarray((1.0 - self.mixing) * share + self.mixing / self.n_choices)

    def shift(self, plan: Array) -> Array:
        """The plan one step later; its last step is uniform."""
        return np.concatenate([plan[1:], np.full_like(plan[-1:], 1.0 / self.n_choices)])


def _beside(draws: Array, n_lead: int) -> Array:
    """Draws (T, ...) with axes of length 1 after the first, for those of the plans."""
    return draws.reshape(len(draws), *(1,) * n_lead, *draws.shape[1:])


def _check_sizes(n_samples: int, horizon: int, temperature: float) -> None:
    integer(n_samples, "n_samples", 2)
    integer(horizon, "horizon", 1)
    positive(temperature, "temperature")
