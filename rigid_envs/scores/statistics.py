"""Aggregates of many runs, and their intervals."""

import math
from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array

# Confidence intervals of means and rates.

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


# Aggregates of efficiencies over ids and seeds, with intervals over the seeds.
#
# Runs are given as one array for each id: the mean efficiency of every training seed. Seeds are
# what is drawn at random, so intervals resample the seeds within each id, and never the starts.
#
# Source: Agarwal et al. 2021, *Deep Reinforcement Learning at the Edge of the Statistical
# Precipice*, arXiv:2108.13264.

Runs = Sequence[npt.ArrayLike]
"""For each id, the results of its seeds, shape (number of seeds,)."""


def interquartile_mean(runs: Runs) -> float:
    """Mean of all runs without the lowest and the highest quarter of them.

    Every id has the same weight: where their numbers of seeds differ, runs are counted several
    times, so that they are as many from each id.

    Args:
        runs: Results by id and seed.
    """
    arrays = _checked(runs)
    common = math.lcm(*map(len, arrays))
    times = np.concatenate([np.full(len(each), float(common // len(each))) for each in arrays])
    x = np.concatenate(arrays)
    order = np.argsort(x)
    ends = np.cumsum(times[order])  # of each run among all that are counted
    cut = ends[-1] // 4
    kept = np.diff(np.clip(ends, cut, ends[-1] - cut), prepend=cut)
    return float(kept @ x[order] / kept.sum())


def performance_profile(runs: Runs, thresholds: npt.ArrayLike) -> Array:
    """Share of runs above each threshold: the mean over ids of their shares.

    Args:
        runs: Results by id and seed.
        thresholds: Shape (k,).

    Returns:
        Shape (k,).
    """
    at = np.asarray(thresholds, dtype=np.float64)
    shares = [(each[:, None] > at).mean(axis=0) for each in _checked(runs)]
    return np.asarray(np.mean(shares, axis=0))


def probability_of_improvement(runs: Runs, others: Runs) -> float:
    """Probability that a run is better than one of the others, averaged over ids; a tie is half.

    Args:
        runs: Results by id and seed.
        others: Those of another policy, with the same ids in the same order.
    """
    one, two = _checked(runs), _checked(others)
    if len(one) != len(two):
        raise ValueError(f"others = {len(two)} ids; expected {len(one)}, as runs has them")
    leads = [np.sign(a[:, None] - b).mean() for a, b in zip(one, two, strict=True)]
    return 0.5 + 0.5 * float(np.mean(leads))


def optimality_gap(runs: Runs, target: float = 1.0) -> float:
    """How far runs stay below a target: the mean over ids of the mean of max(target - x, 0).

    Args:
        runs: Results by id and seed.
        target: What is as good as can be.
    """
    return float(np.mean([np.maximum(target - each, 0.0).mean() for each in _checked(runs)]))


def stratified_bootstrap(
    statistic: Callable[..., float],
    *policies: Runs,
    n_resamples: int = 2000,
    level: float = 0.95,
    seed: int = 0,
) -> tuple[float, float]:
    """Percentile bootstrap interval of a statistic; seeds are drawn anew within each id.

    Args:
        statistic: For example `interquartile_mean`, or `probability_of_improvement` of two.
        *policies: Results by id and seed of each policy that the statistic takes.
        n_resamples: Number of samples.
        level: Confidence level.
        seed: Seed of the random draws.

    Returns:
        Lower and upper end. With one seed for each id both are the statistic itself: one seed says
        nothing about others.
    """
    low, high = stratified_band(
        statistic, *policies, n_resamples=n_resamples, level=level, seed=seed
    )
    return float(low), float(high)


def stratified_band(
    statistic: Callable[..., npt.ArrayLike],
    *policies: Runs,
    n_resamples: int = 2000,
    level: float = 0.95,
    seed: int = 0,
) -> tuple[Array, Array]:
    """As `stratified_bootstrap`, of a statistic of any shape: of a curve, point by point.

    Args:
        statistic: For example the `performance_profile` at some thresholds.
        *policies: See `stratified_bootstrap`; also arrays of curves, shape (number of seeds, k).
        n_resamples: See `stratified_bootstrap`.
        level: See `stratified_bootstrap`.
        seed: See `stratified_bootstrap`.

    Returns:
        Lower and upper end, each of the shape of the statistic.
    """
    rng = np.random.default_rng(seed)
    given = [[np.asarray(each, dtype=np.float64) for each in runs] for runs in policies]

    def drawn(runs: list[Array]) -> list[Array]:
        return [each[rng.integers(0, len(each), len(each))] for each in runs]

    found = np.array([statistic(*map(drawn, given)) for _ in range(n_resamples)])
    low, high = np.quantile(found, [0.5 - 0.5 * level, 0.5 + 0.5 * level], axis=0)
    return low, high


def estimate(
    statistic: Callable[..., float], *policies: Sequence[Sequence[float]], n_resamples: int = 2000
) -> tuple[float, tuple[float, float] | None]:
    """Value of a statistic, and its interval by `stratified_bootstrap`.

    The interval is None where an id has one seed alone, which says nothing about others.
    """
    ends = None
    if all(len(each) > 1 for runs in policies for each in runs):
        ends = stratified_bootstrap(statistic, *policies, n_resamples=n_resamples)
    return statistic(*policies), ends


# Comparison of two policies from the same starts.


def sign_test(differences: npt.ArrayLike) -> float:
    """Two-sided p-value of the sign test: that as many differences are above as below 0.

    Zeros are left out; where nothing is left, it is 1.

    Args:
        differences: Of pairs that are independent of each other, shape (n,).

    Source: Conover 1999, *Practical Nonparametric Statistics*, section 3.4.
    """
    from scipy.stats import binomtest  # takes 0.6 s to import

    x = np.asarray(differences, dtype=np.float64)
    above, below = int((x > 0.0).sum()), int((x < 0.0).sum())
    return float(binomtest(above, above + below).pvalue) if above + below else 1.0


def _checked(runs: Runs) -> list[Array]:
    """Each an array of one seed at least."""
    arrays = [np.asarray(each, dtype=np.float64) for each in runs]
    if not arrays or any(each.ndim != 1 or not len(each) for each in arrays):
        shapes = [each.shape for each in arrays]
        raise ValueError(f"runs have shapes {shapes}; expected (number of seeds,) for each id")
    return arrays
