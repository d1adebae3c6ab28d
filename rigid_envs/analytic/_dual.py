"""Dual numbers: exact first derivatives, and exact higher ones where they are nested."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

__all__ = ["Dual"]


@dataclass(frozen=True)
class Dual:
    """The number value + slope e with e^2 = 0; both may be dual themselves.

    NumPy calls `sin` and `cos` of an object array on its elements.

    Source: Clifford (1873), Proc. London Math. Soc. 4:381, doi:10.1112/plms/s1-4.1.381.
    """

    value: Any
    slope: Any

    def __add__(self, other: Any) -> Dual:
        """Sum."""
        other = _dual(other)
        return Dual(self.value + other.value, self.slope + other.slope)

    __radd__ = __add__

    def __neg__(self) -> Dual:
        """Negative."""
        return Dual(-self.value, -self.slope)

    def __sub__(self, other: Any) -> Dual:
        """Difference."""
        other = _dual(other)
        return Dual(self.value - other.value, self.slope - other.slope)

    def __rsub__(self, other: Any) -> Dual:
        """Difference, the dual number second."""
        return _dual(other) - self

    def __mul__(self, other: Any) -> Dual:
        """Product."""
        other = _dual(other)
        slope = self.value * other.slope + self.slope * other.value
        return Dual(self.value * other.value, slope)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Dual:
        """Quotient."""
        other = _dual(other)
        ratio = self.value / other.value
        return Dual(ratio, (self.slope - ratio * other.slope) / other.value)

    def __rtruediv__(self, other: Any) -> Dual:
        """Quotient, the dual number below."""
        return _dual(other) / self

    def sin(self) -> Dual:
        """Sine."""
        return Dual(np.sin(self.value), self.slope * np.cos(self.value))

    def cos(self) -> Dual:
        """Cosine."""
        return Dual(np.cos(self.value), -(self.slope * np.sin(self.value)))


def _dual(number: Any) -> Dual:
    """The number itself, or a constant without slope."""
    return number if isinstance(number, Dual) else Dual(number, 0.0)
