"""Controller of a thrown racket: the least change of its rotation that leads to the catch."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, CheckedFields, positive
from rigid_envs.control.linear import clip_to_box
from rigid_envs.mechanics import rotations
from rigid_envs.mechanics.system import fastest_turn
from rigid_envs.systems.free_body.saddle import saddle_shape
from rigid_envs.systems.free_body.system import FreeBody

_ROUNDS = 4  # linearisations
_STEPS = 80  # of the free motion until the catch: of all turns by up to 40 rad
_SHIFT = 1e-5  # of the turn until the catch [rad], for difference quotients
_RADIUS = 0.5  # first largest change of the turn until the catch by a linearisation [rad]
_HALVINGS = 30  # of the range of nu
_RANGE = 30.0  # of its logarithm, to both sides of the largest eigenvalue


@dataclass(frozen=True)
class CatchShot(CheckedFields):
    """Least angular impulse now from which a free racket is caught within a tolerance.

    The free motion leads to an error e of the attitude at the catch, a rotation vector. In each
    round the shot solves ``min |p|^2, |e + G (p - p_k)| <= tolerance`` with the derivative G of e
    by the impulse p in body axes, by difference quotients. A trust region keeps it where G
    holds. It begins with p = 0 and with three pushes along the unstable coordinate: to 0, and to
    where half a twist comes in the middle of the time left, to either side. The least of the
    impulses that reach the catch is taken, and made as far as torque can.

    Free motion does not depend on the unit of time: omega t is the same for all rows when each is
    seen in units of its own time until the catch.

    Attributes:
        body: moments I1 < I2 < I3.
        torque: largest torque about each axis [N m].
        dt: control period [s].
        tolerance: largest error at the catch [rad].

    Raises:
        ValueError: numbers that are not positive.
    """

    body: FreeBody
    torque: Annotated[float, positive, "N m"]
    dt: Annotated[float, positive, "s"]
    tolerance: Annotated[float, positive, "rad"]

    def __call__(self, y: npt.ArrayLike, catch: npt.ArrayLike) -> Array:
        """Actions, torques over the largest, shape (..., 3).

        Args:
            y: states, shape (..., n), attitude and rates first.
            catch: time until the catch [s] and attitude there, shape (..., 5).
        """
        states, catches = np.asarray(y, dtype=np.float64), np.asarray(catch, dtype=np.float64)
        rows, known = states[..., :7].reshape(-1, 7), catches.reshape(-1, 5)
        q = rotations.multiply(rotations.conjugate(known[:, 1:]), rows[:, :4])
        omega, impulse = rows[:, 4:], np.zeros((len(rows), 3))
        time = np.maximum(known[:, :1], self.dt)
        missed = np.linalg.norm(self._errors(q, omega, time, impulse[:, None])[:, 0], axis=-1)
        off = missed > self.tolerance
        impulse[off] = self._least(q[off], omega[off], time[off])
        actions = clip_to_box(impulse / (self.dt * self.torque))
        return actions.reshape(*states.shape[:-1], 3)

    def _least(self, q: Array, omega: Array, time: Array) -> Array:
        """The least impulses that were found [N m s], shape (N, 3)."""
        found = [self._shot(q, omega, time, guess) for guess in self._guesses(omega, time)]
        impulses, misses = (np.stack(part) for part in zip(*found, strict=True))
        size = np.linalg.norm(impulses, axis=-1)
        far = misses > 1.01 * self.tolerance
        best = np.where(far, size.max(initial=0.0) + misses, size).argmin(axis=0)
        return np.asarray(impulses[best, np.arange(len(best))])

    def _guesses(self, omega: Array, time: Array) -> list[Array]:
        """Impulses to begin with: none, and three along the unstable coordinate."""
        shape = saddle_shape(*self.body.moments)
        rate = np.abs(omega[:, 1])
        ratio = np.where(omega[:, 1] < 0.0, -shape.ratio, shape.ratio)
        d = omega[:, 0] - ratio * omega[:, 2]
        half = 2.0 * rate * np.exp(-0.5 * shape.growth * rate * time[:, 0])
        direction = np.stack([np.full_like(d, 0.5), np.zeros_like(d), -0.5 / ratio], axis=-1)
        pushes = (self.body.moments * (side * half - d)[:, None] * direction for side in (0, 1, -1))
        return [np.zeros_like(omega), *pushes]

    def _shot(self, q: Array, omega: Array, time: Array, impulse: Array) -> tuple[Array, Array]:
        """An impulse improved, and by what angle its catch is missed [rad], shape (N,)."""
        shift = _SHIFT * self.body.moments / time
        beside = np.concatenate([np.zeros((len(q), 1, 3)), shift[:, None] * np.eye(3)], axis=1)
        radius = np.full((len(q), 1), _RADIUS)
        errors = self._errors(q, omega, time, impulse[:, None] + beside)
        for _ in range(_ROUNDS):
            slope = ((errors[:, 1:] - errors[:, :1]) / shift[..., None]).mT
            aim = errors[:, 0] - np.einsum("nij,nj->ni", slope, impulse)
            change = self._nearest(aim, slope) - impulse
            turn = np.linalg.norm(change / self.body.moments * time, axis=-1, keepdims=True)
            trial = impulse + np.minimum(1.0, radius / np.maximum(turn, 1e-12)) * change
            found = self._errors(q, omega, time, trial[:, None] + beside)
            before, after = (np.linalg.norm(each[:, 0], axis=-1) for each in (errors, found))
            better = (after < np.maximum(before, 1.01 * self.tolerance))[:, None]
            impulse = np.where(better, trial, impulse)
            errors = np.where(better[..., None], found, errors)
            radius = np.where(better, 2.0, 0.25) * radius
        return impulse, np.linalg.norm(errors[:, 0], axis=-1)

    def _errors(self, q: Array, omega: Array, time: Array, impulses: Array) -> Array:
        """Rotation vectors from the attitude of the catch to those then, shape (N, k, 3) [rad]."""
        turns = (omega[:, None] + impulses / self.body.moments) * time[..., None]
        # a step is limited: what turns too fast for it is beyond the torque, whatever it does
        root = np.sqrt(np.sum(self.body.moments * turns**2, axis=-1, keepdims=True))
        most = 0.99 * _STEPS * self.body.envelope / fastest_turn(self.body.moments)
        turns *= most / np.maximum(root, most)
        start = np.concatenate([np.broadcast_to(q[:, None], (*turns.shape[:2], 4)), turns], axis=-1)
        return rotations.log(self.body.advance(start, None, 1.0, _STEPS)[..., :4])

    def _nearest(self, aim: Array, slope: Array) -> Array:
        """The p with the least ``|p|`` and ``|aim + slope p| <= tolerance``, shape (N, 3).

        ``p = -G^T (G G^T + nu)^-1 aim``; nu is found by bisection of its logarithm.
        """
        values, vectors = np.linalg.eigh(slope @ slope.mT)
        values, parts = np.maximum(values, 0.0), np.einsum("nij,ni->nj", vectors, aim)
        low, high = np.full((2, len(aim)), np.log(np.maximum(values[:, 2], 1e-300)))
        low, high = low - _RANGE, high + _RANGE
        for _ in range(_HALVINGS):
            nu = 0.5 * (low + high)
            share = 1.0 / (1.0 + values * np.exp(-nu)[:, None])
            inside = np.linalg.norm(share * parts, axis=-1) <= self.tolerance
            low, high = np.where(inside, nu, low), np.where(inside, high, nu)
        weight = parts / (values + np.exp(low)[:, None])
        p = -np.einsum("nji,nj->ni", slope, np.einsum("nij,nj->ni", vectors, weight))
        near = np.linalg.norm(aim, axis=-1, keepdims=True) <= self.tolerance
        return np.asarray(np.where(near, 0.0, p))
