"""Actions within their limits, and the proximal map of what they cost."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

__all__ = ["Limits"]

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

_N_HALVINGS = 45  # of where the length of an action at a side of the box may lie


class Limits(NamedTuple):
    """Limits of an action of m components, and those that its cost counts.

    Attributes:
        disk: Whether its length is limited to 1, rather than each component.
        counted: Which components the cost, a multiple of their joint length, counts, shape (m,).
    """

    disk: bool
    counted: Bools

    def clip(self, a: Array) -> Array:
        """The nearest actions within the limits, shape (..., m)."""
        if not self.disk:
            return np.clip(a, -1.0, 1.0)
        return np.asarray(a / np.maximum(np.linalg.norm(a, axis=-1, keepdims=True), 1.0))

    def length(self, a: Array) -> Array:
        """Length of the components that count, shape (...)."""
        return np.asarray(np.linalg.norm(a * self.counted, axis=-1))

    def shrink(self, z: Array, threshold: Array) -> tuple[Array, Array]:
        """The v within the limits with the least ``threshold |v| + |v - z|^2 / 2``, and dv/dz.

        Args:
            z: Shape (..., m).
            threshold: Shape (...).

        Returns:
            v, shape (..., m), and its derivative, shape (..., m, m).
        """
        length = self.length(z)
        kept = np.maximum(length - threshold, 0.0) / np.maximum(length, 1e-300)
        v = np.where(self.counted, kept[..., None] * z, z)
        if self.disk:
            return self._on_disk(z, v, kept, length)
        slope = self._slope(z, kept, length)
        over = np.abs(v).max(axis=-1) > 1.0
        if over.any():
            v[over], slope[over] = self._in_box(z[over], threshold[over])
        return v, slope

    def _slope(self, z: Array, kept: Array, length: Array) -> Array:
        """Derivative where no limit is reached: kept I + (1 - kept) z z^T / |z|^2."""
        unit = self.counted * z / np.maximum(length, 1e-300)[..., None]
        across = unit[..., :, None] * unit[..., None, :]
        inner = kept[..., None, None] * np.diag(1.0 * self.counted)
        inner = inner + ((1.0 - kept) * (kept > 0.0))[..., None, None] * across
        return np.asarray(inner + np.diag(1.0 * ~self.counted))

    def _on_disk(self, z: Array, v: Array, kept: Array, length: Array) -> tuple[Array, Array]:
        slope = self._slope(z, kept, length)
        over = kept * length > 1.0
        if over.any():
            unit = z[over] / length[over][..., None]
            v[over] = unit
            across = np.eye(z.shape[-1]) - unit[..., :, None] * unit[..., None, :]
            slope[over] = across / length[over][..., None, None]
        return v, slope

    def _in_box(self, z: Array, threshold: Array) -> tuple[Array, Array]:
        """Where a side of the box is reached: the length is a fixed point, found by bisection."""
        low, high = np.zeros(len(z)), np.full(len(z), np.sqrt(z.shape[1]))
        for _ in range(_N_HALVINGS):
            length = 0.5 * (low + high)
            kept = np.where(self.counted, (length / (length + threshold))[..., None], 1.0)
            v = np.clip(z * kept, -1.0, 1.0)
            more = self.length(v) > length
            low, high = np.where(more, length, low), np.where(more, high, length)
        free = np.abs(z * kept) < 1.0
        unit = self.counted * v / length[..., None]
        curved = np.diag(1.0 * self.counted) - unit[..., :, None] * unit[..., None, :]
        hessian = np.eye(z.shape[-1]) + (threshold / length)[..., None, None] * curved
        both = free[..., :, None] & free[..., None, :]
        inverse = np.linalg.inv(np.where(both, hessian, np.eye(z.shape[-1])))
        return v, np.where(both, inverse, 0.0)
