"""Confidence intervals of means and rates."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

__all__ = ["mean_interval", "wilson_interval"]

_Z = 1.959963984540054  # 97.5 % quantile of the normal distribution


def mean_interval(
    values: npt.ArrayLike, n_resamples: int = 2000, level: float = 0.95, seed: int = 0
) -> tuple[float, float]:
    """Percentile bootstrap interval of a mean.

    Not `scipy.stats.bootstrap`, which refuses a single value, differs in the last digits and takes
    0.6 s to import.

    Args:
        values: Independent values, shape (n,).
        n_resamples: Number of samples of n values, drawn with replacement.
        level: Confidence level.
        seed: Seed of the random draws.

    Returns:
        Lower and upper end.

    Source: Efron & Tibshirani 1993, *An Introduction to the Bootstrap*, section 13.3.
    """
    x = np.asarray(values, dtype=np.float64)
    rng = np.random.default_rng(seed)
    means = x[rng.integers(0, len(x), (n_resamples, len(x)))].mean(axis=1)
    low, high = np.quantile(means, [0.5 - 0.5 * level, 0.5 + 0.5 * level])
    return float(low), float(high)


def wilson_interval(successes: int, n: int) -> tuple[float, float]:
    """Wilson score interval of a rate, 95 %: p with ``(k / n - p)^2 <= z^2 p (1 - p) / n``.

    Args:
        successes: Number of successes k, 0 .. n.
        n: Number of trials, at least 1.

    Returns:
        Lower and upper end, within [0, 1].

    Source: Wilson (1927), doi:10.1080/01621459.1927.10502953.
    """
    rate, share = successes / n, _Z * _Z / n
    middle = rate + 0.5 * share
    half = math.sqrt(share * (rate * (1.0 - rate) + 0.25 * share))
    low = 0.0 if successes == 0 else (middle - half) / (1.0 + share)
    return low, 1.0 if successes == n else (middle + half) / (1.0 + share)
