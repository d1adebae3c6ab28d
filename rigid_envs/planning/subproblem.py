"""The convex problem that a linearisation leaves, solved through its dual by Newton's method."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from rigid_envs.planning.limits import Limits

__all__ = ["Subproblem"]

Array = npt.NDArray[np.float64]

_N_NEWTON = 60
_DAMPING = 1e-3  # first part of the diagonal of a Hessian that is added to it
_LEAST, _MOST = 1e-18, 1e12  # of that part
_WITHIN = 1.0 - 1e-5  # plans end so far within the tolerances: actions and goals are float32
_EQUAL = 1e-11  # relative difference of values that may be rounding
_SOLVED = 1e-6  # duality gap that counts as solved, a part of the value


class Subproblem(NamedTuple):
    """Proximal problems of N rows with plans a of T actions and R linearised conditions.

        min_v  sum_t w |v_t| + rho / 2 sum_t |v_t - a_t|^2 + mu sum_r max(0, |e_r| - b_r),
        e = c + G (v - a)

    over v within the limits. Its dual has R variables from -mu to mu, whatever T is: given them,
    each v_t is known in closed form (`Limits.shrink`).

    Attributes:
        limits: Of the actions.
        a: Plans, shape (N, T, m).
        G: Derivatives of the errors by the actions, shape (N, R, T, m).
        c: Errors over their tolerances, shape (N, R).
        b: Bounds of the errors, shape (N, R).
        w: Cost of a unit of action, shape (N,).
        rho: Weight of the distance from a, shape (N,).
        mu: Price of a violation, shape (N,).
    """

    limits: Limits
    a: Array
    G: Array
    c: Array
    b: Array
    w: Array
    rho: Array
    mu: Array

    def solve(self, prices: Array) -> tuple[Array, Array]:
        """Plans v, shape (N, T, m), and the prices of the conditions, shape (N, R).

        Args:
            prices: Where to begin, shape (N, R).
        """
        mu, bound = self.mu[:, None], _WITHIN * self.b
        prices = np.clip(prices, -mu, mu)
        value, v, slope, e = self._dual(prices)
        damping = np.full(len(prices), _DAMPING)
        gap = self._gap(prices, e)
        for _ in range(_N_NEWTON):
            if (gap <= _SOLVED * np.abs(value) + 1e-12).all():
                break
            side = np.where(prices == 0.0, np.sign(e), np.sign(prices))
            rest = e - bound * side
            fixed = (prices == 0.0) & (np.abs(e) <= bound)
            fixed |= (np.abs(prices) >= mu) & (rest * side >= 0.0)
            trial = prices + self._newton(slope, rest, fixed, damping)
            trial = np.where(trial * side < 0.0, 0.0, np.clip(trial, -mu, mu))
            found = self._dual(trial)
            left = self._gap(trial, found[3])
            equal = np.abs(found[0] - value) <= _EQUAL * np.abs(value)
            better = np.where(equal, left < gap, found[0] > value)
            old, new = (prices, value, v, slope, e, gap), (trial, *found, left)
            for kept, taken in zip(old, new, strict=True):
                kept[better] = taken[better]
            damping = np.clip(damping * np.where(better, 0.1, 5.0), _LEAST, _MOST)
        return v, prices

    def violation(self, v: Array) -> Array:
        """Sum of what the linearised errors of plans v are above their bounds, shape (N,)."""
        return np.asarray(np.maximum(np.abs(self._errors(v)) - self.b, 0.0).sum(axis=1))

    def _gap(self, prices: Array, e: Array) -> Array:
        """Difference of the primal and the dual value, shape (N,)."""
        bound = _WITHIN * self.b
        over = self.mu[:, None] * np.maximum(np.abs(e) - bound, 0.0)
        return np.asarray((over + bound * np.abs(prices) - prices * e).sum(axis=1))

    def _errors(self, v: Array) -> Array:
        flat = self.G.reshape(*self.c.shape, -1)
        return self.c + (flat @ (v - self.a).reshape(len(v), -1, 1))[..., 0]

    def _dual(self, prices: Array) -> tuple[Array, Array, Array, Array]:
        """Value (N,), minimiser, its slopes, and its errors, shape (N, R)."""
        n, t, m = self.a.shape
        pull = (prices[:, None] @ self.G.reshape(*self.c.shape, -1)).reshape(n, t, m)
        z = self.a - pull / self.rho[:, None, None]
        v, slope = self.limits.shrink(z, np.broadcast_to((self.w / self.rho)[:, None], (n, t)))
        e = self._errors(v)
        cost = self.w * self.limits.length(v).sum(axis=1)
        value = cost + 0.5 * self.rho * ((v - self.a) ** 2).sum(axis=(1, 2))
        return value + (prices * e - _WITHIN * self.b * np.abs(prices)).sum(axis=1), v, slope, e

    def _newton(
        self, slope: Array, rest: Array, fixed: npt.NDArray[np.bool_], damping: Array
    ) -> Array:
        """Newton's step of the prices that are not fixed, damped in the scale of each.

        The Hessian is G S G^T with S = F F^T. It is factorised as a product: an error that grows
        makes the rows of G so nearly parallel that G S G^T itself has no digits left.
        """
        n, r = self.c.shape
        factor = square_root(slope)
        steps = (self.G[..., j, None] * factor[:, None, :, j] for j in range(self.a.shape[2]))
        bent = sum(steps, start=np.zeros(())).reshape(n, r, -1)
        scale = np.linalg.norm(self.G.reshape(n, r, -1), axis=2) / np.sqrt(self.rho)[:, None]
        scale = 1.0 / np.maximum(scale, 1e-300)
        weight = np.where(fixed, 0.0, scale / np.sqrt(self.rho)[:, None])
        below = np.eye(r) * np.where(fixed, 1.0, np.sqrt(damping)[:, None])[:, None]
        both = np.concatenate([(bent * weight[..., None]).swapaxes(1, 2), below], axis=1)
        upper: Any = np.linalg.qr(both, mode="r")
        right = np.where(fixed, 0.0, scale * rest)[..., None]
        step = np.linalg.solve(upper, np.linalg.solve(upper.swapaxes(1, 2), right))
        return np.asarray(scale * step[..., 0])


def square_root(S: Array) -> Array:
    """Lower triangular F with F F^T = S, of symmetric matrices that may be singular."""
    m = S.shape[-1]
    F = np.zeros_like(S)
    for j in range(m):
        left = S[..., j, j] - (F[..., j, :j] ** 2).sum(axis=-1)
        F[..., j, j] = np.sqrt(np.maximum(left, 0.0))
        for i in range(j + 1, m):
            rest = S[..., i, j] - (F[..., i, :j] * F[..., j, :j]).sum(axis=-1)
            F[..., i, j] = rest / np.where(left > 1e-14, F[..., j, j], np.inf)
    return F
