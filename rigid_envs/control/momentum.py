"""Taking the angular momentum of a body by impulses: at least cost, and in least time."""

from __future__ import annotations

import abc
import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rigid_envs.checks import positive
from rigid_envs.control.saturation import clip_to_ball
from rigid_envs.systems import FreeBody

__all__ = ["ImpulseLaw", "MomentumBrake", "MomentumRegulator"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class ImpulseLaw(abc.ABC):
    """A law for impulses on a body that drifts freely between them.

    The drift turns the angular momentum L in the body and keeps its size |L|. No impulse takes more
    from that than its own size, and only impulses against L take so much.

    Attributes:
        body: rigid body to control.
        impulse: largest impulse [N m s].

    Raises:
        ValueError: an impulse that is not positive.
    """

    body: FreeBody
    impulse: float

    def __post_init__(self) -> None:
        """Check the impulse."""
        positive(self.impulse, "impulse", "N m s")

    @abc.abstractmethod
    def __call__(self, y: npt.ArrayLike) -> Array:
        """Actions, impulses over the largest, shape (..., 3), of states y, shape (..., 7)."""

    def after(self, y: npt.ArrayLike, action: npt.ArrayLike) -> Array:
        """States, shape (..., 7), after the impulses of actions, shape (..., 3); then it drifts."""
        state = self.body.checked_state(y).copy()
        kick = self.impulse * np.asarray(action, dtype=np.float64)
        state[..., 4:7] += kick / self.body.moments
        return state

    def momentum(self, y: npt.ArrayLike) -> Array:
        """L in body axes of states y, shape (..., 7), which are checked [N m s]."""
        return self.body.L_body(self.body.checked_state(y))


@dataclass(frozen=True)
class MomentumRegulator(ImpulseLaw):
    """Brings L to zero at the least cost: j = -g L.

    A step costs ``a |L + j|^2 + b |j|^2``. The cost to go is ``P |L|^2`` with the root P = b g of
    the scalar Riccati equation ``P = b (a + P) / (a + b + P)``, where

        g = (sqrt((a / b)^2 + 4 a / b) - a / b) / 2 = (a + P) / (a + b + P).

    Certificate: P, in closed form: ``value(y) = P |L|^2`` is the sum of all costs from there on,
    and no law has a smaller one.

    Region: everywhere. The impulse stays in the ball, and the law optimal, while |L| <= `reach`;
    beyond, the largest impulse against L is taken.

    Attributes:
        body: rigid body to control.
        impulse: largest impulse [N m s].
        weight_momentum: a [1 / (N m s)^2].
        weight_impulse: b [1 / (N m s)^2].

    Raises:
        ValueError: numbers that are not positive.

    Source: Bertsekas, *Dynamic Programming and Optimal Control*, volume I, section 4.1.
    """

    weight_momentum: float
    weight_impulse: float

    def __post_init__(self) -> None:
        """Check the weights too."""
        super().__post_init__()
        positive(self.weight_momentum, "weight_momentum", "1 / (N m s)^2")
        positive(self.weight_impulse, "weight_impulse", "1 / (N m s)^2")

    def __call__(self, y: npt.ArrayLike) -> Array:
        """Actions, impulses over the largest, shape (..., 3), of states y, shape (..., 7)."""
        return clip_to_ball(-self.gain * self.momentum(y) / self.impulse)

    @property
    def gain(self) -> float:
        """Part g of L that is taken in a step."""
        ratio = self.weight_momentum / self.weight_impulse
        return 2.0 * ratio / (math.sqrt(ratio * (ratio + 4.0)) + ratio)  # nothing cancels

    @property
    def riccati(self) -> float:
        """P = b g [1 / (N m s)^2]."""
        return self.weight_impulse * self.gain

    @property
    def reach(self) -> float:
        """The |L| up to which the law is not limited [N m s]."""
        return self.impulse / self.gain

    def value(self, y: npt.ArrayLike) -> Array:
        """Cost to go of states y, shape (..., 7), with |L| <= `reach`; shape (...)."""
        return np.asarray(self.riccati * np.sum(self.momentum(y) ** 2, axis=-1))


@dataclass(frozen=True)
class MomentumBrake(ImpulseLaw):
    """Brings L to zero in the least time: the largest impulse against L, or all of L that is left.

    Certificate: ``n_steps(y) = ceil(|L| / impulse)`` decreases by one in every step, and no law
    makes it decrease faster, since no impulse takes more than its size from |L|.

    Attributes:
        body: rigid body to control.
        impulse: largest impulse [N m s].

    Raises:
        ValueError: an impulse that is not positive.
    """

    def __call__(self, y: npt.ArrayLike) -> Array:
        """Actions, impulses over the largest, shape (..., 3), of states y, shape (..., 7)."""
        return clip_to_ball(-self.momentum(y) / self.impulse)

    def n_steps(self, y: npt.ArrayLike) -> Array:
        """Least number of impulses to rest of states y, shape (..., 7); of shape (...)."""
        return np.asarray(np.ceil(np.linalg.norm(self.momentum(y), axis=-1) / self.impulse))
