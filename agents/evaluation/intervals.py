"""Confidence interval of a success rate."""

from __future__ import annotations

from scipy.stats import binomtest

__all__ = ["wilson_interval"]


def wilson_interval(successes: int, n: int) -> tuple[float, float]:
    """Wilson score interval of a rate, 95 %.

    Args:
        successes: Number of successes, 0 .. n.
        n: Number of trials, at least 1.

    Returns:
        Lower and upper end, within [0, 1].

    Source: Wilson (1927), doi:10.1080/01621459.1927.10502953.
    """
    interval = binomtest(successes, n).proportion_ci(0.95, method="wilson")
    return float(interval.low), float(interval.high)
