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
from typing import Any

from rigid_envs.kernels.episode import Episode
from rigid_envs.symmetries import Symmetry
from rigid_envs.tasks.entries import Entry

__all__ = ["Reduction", "in_reduced_frame"]


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
        turn: ``turn(action, y, aux, p, c) -> action``, compiled: from the reduced frame to that of
            the task.
        formulas: of the frame, the entries and the action, for the page; paragraphs are separated
            by empty lines.
    """

    group: str
    symmetries: tuple[Symmetry, ...]
    frame: str
    features: tuple[Entry, ...]
    observe: Callable[..., Any]
    turn: Callable[..., Any]
    formulas: str = ""


@cache
def in_reduced_frame(episode: Episode, reduction: Reduction) -> Episode:
    """The same episodes, observed and acted on in the reduced frame; made and compiled once."""
    return replace(episode, observe=reduction.observe, turn=reduction.turn)
