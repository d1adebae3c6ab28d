"""Sampling model predictive control: path integrals, for any system that can be rolled out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

__all__ = ["CrossEntropyChoices", "PathIntegral", "weights"]

Array = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


def weights(costs: npt.ArrayLike, temperature: float) -> Array:
    """What each rollout counts: w_k ~ exp(-(S_k - min S) / lambda), with sum 1.

    lambda is `temperature` times the standard deviation of the costs S, so that their unit does not
    matter; rollouts that all cost the same count the same.

    Args:
        costs: shape (..., K).
        temperature: towards 0 only the best counts.
    """
    S = np.asarray(costs, dtype=np.float64)
    scale = np.maximum(temperature * S.std(axis=-1, keepdims=True), 1e-300)
    w = np.exp((S.min(axis=-1, keepdims=True) - S) / scale)
    return np.asarray(w / w.sum(axis=-1, keepdims=True))


@dataclass(frozen=True)
class PathIntegral:
    """Plans of continuous actions, moved towards the better ones of many that are tried.

    Around the plan u, K plans ``v_k = clip(u + s_k e_k)`` are drawn, e_k Gaussian with the
    deviation `spread` and from one step to the next the correlation `memory`, and s_k from 1 down
    to `finest` in equal ratios: coarse tries find the way, fine ones keep to it. Each is rolled
    out, to the cost S_k, and the plan becomes

        u <- sum_k w_k v_k,   w_k ~ exp(-S_k / lambda)   (see `weights`).

    Among the K is the plan itself. The plan stays inside the box [-1, 1], which is convex. There is
    no proof that it converges to the best plan, except where the cost is quadratic and nothing is
    clipped: there the best plan is the fixed point of the expected update.

    Attributes:
        n_samples: K.
        horizon: T, number of steps of a plan.
        spread: deviation of what is tried from the plan [actions].
        temperature: lambda over the standard deviation of the costs.
        memory: correlation of e between neighbouring steps, in [0, 1).
        finest: the least s_k, in (0, 1].

    Raises:
        ValueError: numbers outside their range.

    Source: Williams et al. 2017, doi:10.1109/ICRA.2017.7989202, algorithm 2, without its control
    cost, which belongs to the rollout.
    """

    n_samples: int
    horizon: int
    spread: float = 0.5
    temperature: float = 0.1
    memory: float = 0.0
    finest: float = 0.03

    def __post_init__(self) -> None:
        """Check the numbers."""
        _check_sizes(self.n_samples, self.horizon, self.temperature)
        if not self.spread > 0.0:
            raise ValueError(f"spread = {self.spread}; expected a positive number")
        if not 0.0 <= self.memory < 1.0:
            raise ValueError(f"memory = {self.memory}; expected a number in [0, 1)")
        if not 0.0 < self.finest <= 1.0:
            raise ValueError(f"finest = {self.finest}; expected a number in (0, 1]")

    def start(self, lead: tuple[int, ...], n_action: int) -> Array:
        """Plans that do nothing, shape (*lead, T, n_action)."""
        return np.zeros((*lead, self.horizon, n_action))

    def sample(self, plan: Array, rng: np.random.Generator) -> Array:
        """Plans to roll out, shape (..., K, T, m), of plans (..., T, m); the first is the plan."""
        shape = (*plan.shape[:-2], self.n_samples, *plan.shape[-2:])
        scales = self.spread * np.geomspace(1.0, self.finest, self.n_samples)
        e = scales[:, None, None] * rng.standard_normal(shape)
        fresh = np.sqrt(1.0 - self.memory**2)
        for t in range(1, self.horizon):
            e[..., t, :] = self.memory * e[..., t - 1, :] + fresh * e[..., t, :]
        e[..., 0, :, :] = 0.0
        return np.asarray(np.clip(plan[..., None, :, :] + e, -1.0, 1.0))

    def improve(self, samples: Array, costs: npt.ArrayLike) -> Array:
        """The new plan, shape (..., T, m), of rolled out plans (..., K, T, m), costs (..., K)."""
        share = weights(costs, self.temperature)
        return np.asarray(np.einsum("...k,...ktm->...tm", share, samples))

    def shift(self, plan: Array) -> Array:
        """The plan one step later; its last action is held."""
        return np.concatenate([plan[..., 1:, :], plan[..., -1:, :]], axis=-2)


@dataclass(frozen=True)
class CrossEntropyChoices:
    """Plans of choices: probabilities p of each choice in each step, moved towards the better ones.

    K sequences are drawn from p, each step by itself, and rolled out; then

        p <- (1 - mixing) sum_k w_k [choice of k] + mixing / n,

    so that nothing is ever ruled out.

    Attributes:
        n_samples: K.
        horizon: T, number of steps of a plan.
        n_choices: n.
        temperature: see `weights`.
        mixing: share of the even distribution.

    Raises:
        ValueError: numbers outside their range.

    Source: Rubinstein & Kroese 2004, *The Cross-Entropy Method*, chapter 4, with exponential
    weights in place of an elite.
    """

    n_samples: int
    horizon: int
    n_choices: int
    temperature: float = 0.1
    mixing: float = 0.1

    def __post_init__(self) -> None:
        """Check the numbers."""
        _check_sizes(self.n_samples, self.horizon, self.temperature)
        if self.n_choices < 2 or not 0.0 < self.mixing <= 1.0:
            raise ValueError(
                f"n_choices = {self.n_choices}, mixing = {self.mixing}; "
                "expected at least 2 choices, and mixing in (0, 1]"
            )

    def start(self, lead: tuple[int, ...]) -> Array:
        """Even plans, shape (*lead, T, n)."""
        return np.full((*lead, self.horizon, self.n_choices), 1.0 / self.n_choices)

    def sample(self, plan: Array, rng: np.random.Generator) -> Integers:
        """Sequences to roll out, shape (..., K, T), of plans (..., T, n)."""
        shape = (*plan.shape[:-2], self.n_samples, self.horizon)
        below = np.cumsum(plan, axis=-1)[..., None, :, :-1] <= rng.random(shape)[..., None]
        return np.asarray(below.sum(axis=-1))

    def improve(self, samples: Integers, costs: npt.ArrayLike) -> Array:
        """The new plan, shape (..., T, n), of sequences (..., K, T) and their costs (..., K)."""
        chosen = samples[..., None] == np.arange(self.n_choices)
        share = np.einsum("...k,...ktn->...tn", weights(costs, self.temperature), chosen)
        return np.asarray((1.0 - self.mixing) * share + self.mixing / self.n_choices)

    def shift(self, plan: Array) -> Array:
        """The plan one step later; its last step is even."""
        even = np.full_like(plan[..., -1:, :], 1.0 / self.n_choices)
        return np.concatenate([plan[..., 1:, :], even], axis=-2)


def _check_sizes(n_samples: int, horizon: int, temperature: float) -> None:
    for name, value, least in (("n_samples", n_samples, 2), ("horizon", horizon, 1)):
        if isinstance(value, bool) or int(value) != value or value < least:
            raise ValueError(f"{name} = {value!r}; expected an integer of at least {least}")
    if not temperature > 0.0:
        raise ValueError(f"temperature = {temperature}; expected a positive number")
