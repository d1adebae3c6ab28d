"""Roots of a cubic, each to its own relative accuracy."""

import math

__all__ = ["cubic_roots"]


def cubic_roots(c2: float, c1: float, c0: float) -> tuple[float, float, float]:
    """Roots, ascending, of d^3 + c2 d^2 + c1 d + c0 that has three real ones.

    The lone root by Viete's cosine and Newton's step, the pair from the quadratic that is left,
    divided out from the end at which nothing cancels: small roots keep their relative accuracy.
    """
    centre, square = -c2 / 3.0, c2 * c2 / 9.0 - c1 / 3.0
    radius = math.sqrt(max(square, 0.0))
    bias, cube = centre**3 - 0.5 * (c1 * centre + c0), radius**3
    ratio = min(abs(bias) / cube, 1.0) if cube > 0.0 else 0.0
    root = centre + 2.0 * math.copysign(radius, bias) * math.cos(math.acos(ratio) / 3.0)
    for _ in range(3):
        slope = (3.0 * root + 2.0 * c2) * root + c1
        root -= (((root + c2) * root + c1) * root + c0) / slope if slope else 0.0
    half_sum, product = -0.5 * (c2 + root), (root + c2) * root + c1
    if root * root > abs(product):
        product = -c0 / root
        half_sum = 0.5 * (c1 - product) / root
    gap = math.sqrt(max(half_sum * half_sum - product, 0.0))
    outer = half_sum + math.copysign(gap, half_sum)
    inner = product / outer if outer else 0.0
    low, middle, high = sorted((root, inner, outer))
    return low, middle, high
