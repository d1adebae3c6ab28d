"""Plans that keep an error small in all steps, by the iterative linear-quadratic regulator."""

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array
from rigid_envs.control.planning.descent import Plans, merge
from rigid_envs.control.planning.model import Limits, Linear, Model, Motion, Tracking

_STIFF = 1.0  # first weight of a change of the actions, beside the squares of errors
_LEAST, _MOST = 1e-6, 1e6  # of that weight


def follow(model: Model, actions: npt.NDArray[np.floating], n_rounds: int) -> Plans:
    """Improve plans whose cost is the root mean square of the errors.

    Each round linearises the motion and minimises ``sum_t |e_t|^2 + rho |da_t|^2`` by dynamic
    programming. The gains also stabilise what is unstable while the new plan is rolled out. A plan
    that is better is kept, and rho falls; else it grows.

    Args:
        model: Of the rows; it counts errors.
        actions: Plans to begin with, shape (T, N, m).
        n_rounds: So many linearisations.

    Source: Li & Todorov 2004, "Iterative linear quadratic regulator design for nonlinear biological
    movement systems"; limits of actions: Tassa, Mansard & Todorov 2014,
    doi:10.1109/ICRA.2014.6907001.
    """
    plans = Plans(np.array(actions, dtype=np.float32), np.full(model.n_rows, np.inf))
    rows = np.arange(model.n_rows)
    motion, rho = model.roll(np.asarray(actions, dtype=np.float64)), np.full(len(rows), _STIFF)
    plans.keep(rows, motion)
    for _ in range(n_rounds):
        change, gains = _regulator(model.limits, model.linearise(motion), motion, rho)
        targets = model.path(motion)[:-1]
        trial = model.roll(motion.actions + change, Tracking(gains, targets))
        plans.keep(rows, trial)
        better = trial.costs < motion.costs
        motion = merge(better, trial, motion)
        rho = np.clip(np.where(better, 0.3, 5.0) * rho, _LEAST, _MOST)
    return plans


def _regulator(limits: Limits, linear: Linear, motion: Motion, rho: Array) -> tuple[Array, Array]:
    """Changes of the actions, shape (T, N, m), and gains (T, N, m, n), from the end back.

    An action at its limit that would leave it is changed along the limit alone.
    """
    T, N, n, m = linear.B.shape
    changes, gains = np.empty((T, N, m)), np.empty((T, N, m, n))
    P, p = np.zeros((N, n, n)), np.zeros((N, n, 1))
    for t in range(T - 1, -1, -1):
        A, B, Ey, Ea = linear.A[t], linear.B[t], linear.Ey[t], linear.Ea[t]
        e = motion.errors[t][..., None]
        slope = Ea.mT @ e + B.mT @ p
        free, price = limits.free(motion.actions[t], slope[..., 0])
        q, r = Ey.mT @ e + A.mT @ p, free @ slope
        B, Ea, weight = B @ free, Ea @ free, (rho + price)[:, None, None]
        R = Ea.mT @ Ea + B.mT @ P @ B + weight * np.eye(m)
        S = Ea.mT @ Ey + B.mT @ P @ A
        k, K = np.split(-np.linalg.solve(R, np.concatenate([r, S], axis=-1)), [1], axis=-1)
        p = q + S.mT @ k
        closed, seen = A + B @ K, Ey + Ea @ K  # a sum of squares stays one when it is rounded
        P = seen.mT @ seen + closed.mT @ P @ closed + weight * (K.mT @ K)
        changes[t], gains[t] = k[..., 0], K
    return changes, gains
