"""Reduction of a task by its symmetry: invariant observations, actions in a frame of the state.

A *symmetry* of a task is a change of state, parameters and action that commutes with a step and
changes neither reward, success nor end. States that symmetries lead to one another need the same
action up to the symmetry. In the reduced frame they look the same: the observation consists of
invariants, and the action is given in a frame that turns with the state (a moving frame, Olver,
*Classical Invariant Theory*, chapter 8). So a policy learns the task once, not once for each
direction.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, NamedTuple

from rigid_envs.kernels.actions import as_given, no_frame
from rigid_envs.kernels.episode import Episode, NoFrame
from rigid_envs.symmetries import Symmetry
from rigid_envs.tasks.entries import Entry

__all__ = ["Reduction", "Side", "in_reduced_frame"]


class Side(NamedTuple):
    """Frame of a group of two elements: -1 where the state is mirrored, else 1."""

    sign: float


@dataclass(frozen=True, eq=False, kw_only=True)
class Reduction:
    """Group of symmetries of a task, and its reduced coordinates.

    Attributes:
        group: name of the group of symmetries.
        symmetries: symmetries that generate it.
        frame: how the frame of the action turns with the state, as a sentence without subject.
        features: entries of the observation in the reduced frame; those of a goal task come after
            the two goals, which stay as they are.
        observe: ``observe(y, aux, p, c) -> features``, compiled; in a goal task, after both goals.
        Frame: `NamedTuple` of the numbers that give the frame.
        frame_of: ``frame_of(y, aux, p, c) -> frame``, compiled.
        turn: ``turn(action, frame) -> action``, compiled: from the reduced frame to that of the
            task.
        formulas: of the frame, the entries and the action, for the page; paragraphs are separated
            by empty lines.
    """

    group: str
    symmetries: tuple[Symmetry, ...]
    frame: str
    features: tuple[Entry, ...]
    observe: Callable[..., Any]
    Frame: type[Any] = NoFrame
    frame_of: Callable[..., Any] = no_frame
    turn: Callable[..., Any] = as_given
    formulas: str = ""


@cache
def in_reduced_frame(episode: Episode, reduction: Reduction) -> Episode:
    """The same episodes, observed and acted on in the reduced frame; made and compiled once."""
    return replace(
        episode,
        observe=reduction.observe,
        Frame=reduction.Frame,
        frame_of=reduction.frame_of,
        turn=reduction.turn,
    )
