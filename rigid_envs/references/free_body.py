"""Decoders of the tasks of a free body: its angular velocity; the attitude where a law needs it."""

from __future__ import annotations

from rigid_envs.references.decoding import Decoded, Decoder, attitude, entries, goal_attitude
from rigid_envs.scores.bindings.free_body import body_of
from rigid_envs.tasks import (
    AxisFlip,
    Detumble,
    IntermediateAxis,
    IntermediateAxisSingle,
    Reorient,
    SpinCapture,
)

__all__ = ["axis_flip", "detumble", "intermediate_axis", "reorient"]

_SPIN = ("omega1 / Omega", "omega2 / Omega", "omega3 / Omega")
_RATES = ("omega1", "omega2", "omega3")


def intermediate_axis(
    task: IntermediateAxis | IntermediateAxisSingle | SpinCapture,
) -> Decoder:
    """The spin, which is observed divided by Omega."""
    body, q, spin = body_of(task), attitude(task, needed=False), entries(task, *_SPIN)
    return lambda seen: Decoded(body, body.state(q=q(seen), omega_body=task.spin_rate * spin(seen)))


def axis_flip(task: AxisFlip) -> Decoder:
    """The spin, and the time until the commanded time, which is 0 after it."""
    body, q, spin = body_of(task), attitude(task, needed=False), entries(task, *_SPIN)
    left = entries(task, "time left / longest")
    return lambda seen: Decoded(
        body,
        body.state(q=q(seen), omega_body=task.spin_rate * spin(seen)),
        {"time_left": task.largest_flip_time * left(seen)},
    )


def detumble(task: Detumble) -> Decoder:
    """The angular velocity."""
    body, q, rates = body_of(task), attitude(task, needed=False), entries(task, *_RATES)
    return lambda seen: Decoded(body, body.state(q=q(seen), omega_body=rates(seen)))


def reorient(task: Reorient) -> Decoder:
    """Pose and goal from the goals, which noise does not touch."""
    body, rates = body_of(task), entries(task, *_RATES, part="achieved_goal")
    here, there = goal_attitude(task, "achieved_goal"), goal_attitude(task, "desired_goal")
    return lambda seen: Decoded(
        body,
        body.state(q=here(seen), omega_body=rates(seen)),
        dict(zip(task.aux_names, there(seen).T, strict=True)),
    )
