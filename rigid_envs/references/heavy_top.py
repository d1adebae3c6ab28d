"""Decoders of the tasks of a heavy top: attitude, angular velocity, pivot."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.references.decoding import Decoded, Decoder, attitude, entries
from rigid_envs.scores.bindings.heavy_top import top_of
from rigid_envs.tasks import PivotTop, SleepingTop, TopPrecession, TopRandom

__all__ = ["pivot_top", "sleeping_top", "top_precession", "top_random"]

Array = npt.NDArray[np.float64]

_IN_WORLD = ("omega_x", "omega_y", "omega_z")
_IN_BODY = ("omega1", "omega2", "omega3")


def sleeping_top(task: SleepingTop) -> Decoder:
    """The angular velocity is observed in world axes."""
    top, attitude_of, rates = top_of(task), attitude(task), entries(task, *_IN_WORLD)

    def decode(seen: Array) -> Decoded:
        q = attitude_of(seen)
        return Decoded(top, top.state(q=q, omega_body=rotations.rotate_inverse(q, rates(seen))))

    return decode


def pivot_top(task: PivotTop) -> Decoder:
    """The angular velocity is observed in world axes, the pivot in radii of the arena."""
    top, attitude_of, rates = top_of(task), attitude(task), entries(task, *_IN_WORLD)
    pivot, velocity = entries(task, "X / arena", "Y / arena"), entries(task, "VX", "VY")

    def decode(seen: Array) -> Decoded:
        q = attitude_of(seen)
        y = top.state(
            q=q,
            omega_body=rotations.rotate_inverse(q, rates(seen)),
            pivot=task.arena * pivot(seen),
            pivot_velocity=velocity(seen),
        )
        return Decoded(top, y)

    return decode


def top_precession(task: TopPrecession) -> Decoder:
    """Attitude, angular velocity in body axes, and the commanded tilt."""
    top, q, rates = top_of(task), attitude(task), entries(task, *_IN_BODY)
    goal = entries(task, "goal theta")
    return lambda seen: Decoded(
        top, top.state(q=q(seen), omega_body=rates(seen)), {"goal_tilt": goal(seen)}
    )


def top_random(task: TopRandom) -> Decoder:
    """Attitude and angular velocity in body axes."""
    top, q, rates = top_of(task), attitude(task), entries(task, *_IN_BODY)
    return lambda seen: Decoded(top, top.state(q=q(seen), omega_body=rates(seen)))
