"""From what hands do to an action: every mapping follows from the entries of the action.

The *stick* is what all devices move: three numbers in [-1, 1], to the right, up and twist.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rigid_envs.tasks import Entry, Task

__all__ = ["RIGHT", "TWIST", "UP", "Steering", "blended", "steering_of"]

Array = npt.NDArray[np.float64]

RIGHT, UP, TWIST = range(3)
"""Axes of the stick."""

_RISE, _FALL = 0.12, 0.07  # time constants of a held and of a released key [s]
_CLOSE = 2e-3  # difference that is none
_TURNS = {
    "psi'": (UP, -1.0, "roll forwards / backwards: "),
    "phi'": (RIGHT, -1.0, "turn right / left: "),
}
"""Axis of the stick, sign and meaning of rates: a coin rolls forwards where psi' < 0, and phi' > 0
turns it to the left."""
_WAYS = {"+x": (1.0, 0.0), "+y": (0.0, 1.0), "-x": (-1.0, 0.0), "-y": (0.0, -1.0)}


@dataclass(frozen=True, eq=False)
class Steering:
    """Linear map from the stick to an action, or from directions to choices.

    Attributes:
        matrix: change of the action per stick, shape (n_action, 3).
        rest: action when nothing is touched, shape (n_action,).
        bounded: whether the length of the action is at most 1, and not only each entry.
        choices: direction of the stick (right, up) of each choice; empty for continuous actions.
        axes: what the axes of the stick do, in words, for those that do something.
        title: what the action is.
    """

    matrix: Array
    rest: Array
    bounded: bool
    choices: tuple[tuple[float, float], ...]
    axes: dict[int, str]
    title: str

    def action(self, stick: Sequence[float] | Array) -> npt.NDArray[np.float32]:
        """The continuous action of a stick.

        Args:
            stick: right, up and twist, each in [-1, 1].

        Returns:
            Shape (n_action,), within the action space.
        """
        action = self.rest + self.matrix @ np.clip(np.asarray(stick, dtype=np.float64), -1.0, 1.0)
        if self.bounded:
            action /= max(1.0, float(np.linalg.norm(action)))
        return np.clip(action, -1.0, 1.0).astype(np.float32)

    def choice(self, right: float, up: float) -> int | None:
        """The choice in a direction of the stick; None for no direction."""
        along = [right * x + up * y for x, y in self.choices]
        best = int(np.argmax(along))
        return best if along[best] > 0.0 else None


def blended(stick: Array, aim: Array, dt: float) -> Array:
    """The stick after a time: exponential approach to where held keys pull it.

    ``s' = (aim - s) / T``, T = 0.12 s, and 0.07 s where it goes back; solved exactly, so that the
    rate of calls does not matter.

    Args:
        stick: shape (3,).
        aim: -1, 0 or 1 for each axis, shape (3,).
        dt: time [s].
    """
    back = (np.abs(aim) < np.abs(stick)) | (aim * stick < 0.0)
    away = (stick - aim) * np.exp(-dt / np.where(back, _FALL, _RISE))
    return np.asarray(aim + np.where(np.abs(away) < _CLOSE, 0.0, away))


def steering_of(task: Task, azimuth: float) -> Steering:
    """How a task is steered.

    Where the action is a vector in the plane, up is away from the camera. A horizontal torque on a
    top is the push of its tip, ``tau = e_z x d``; the rates of a plate are its slope, down which
    the ball rolls. Other entries have an axis of the stick each.

    Args:
        task: the task.
        azimuth: direction from target to camera, about the vertical [deg].

    Raises:
        ValueError: more than three entries, or choices that are no directions.
    """
    entries = task.actions()
    title = str(type(task).actions.__doc__).strip().rstrip(".")
    right = (-math.sin(math.radians(azimuth)), math.cos(math.radians(azimuth)))
    away = (-right[1], right[0])
    if task.n_choices:
        return _choosing(entries[0], right, away, title)
    if len(entries) > 3:
        raise ValueError(
            f"actions = {len(entries)} entries; expected 3 at most: hands have no more axes"
        )
    rest = np.array([_rest(entry) for entry in entries])
    bounded = any(word in entries[0].frame for word in ("disk", "ball"))
    plane = _plane(entries)
    if plane is not None:
        matrix = np.zeros((2, 3))
        matrix[:, :2] = plane @ np.array([right, away]).T
        axes = {RIGHT: "right / left, as seen", UP: "away / towards you"}
        return Steering(matrix, rest, bounded, (), axes, title)
    matrix, axes = np.zeros((len(entries), 3)), {}
    for k, entry in enumerate(entries):
        axis, sign, words = _TURNS.get(entry.symbol, (k, 1.0, ""))
        matrix[k, axis] = sign if rest[k] == 0.0 else 2.0
        axes[axis] = words + _range(entry, sign, rest[k])
    return Steering(matrix, rest, bounded, (), dict(sorted(axes.items())), title)


def _plane(entries: Sequence[Entry]) -> Array | None:
    """Action of a unit vector along X and Y, the columns; None if it is no vector in the plane."""
    if len(entries) != 2:
        return None
    first = entries[0]
    if first.frame.startswith("plate"):
        return np.array([[0.0, -1.0], [1.0, 0.0]])
    if not first.frame.startswith("world") or "disk" not in first.frame:
        return None
    return np.array([[0.0, -1.0], [1.0, 0.0]]) if first.unit == "N m" else np.eye(2)


def _rest(entry: Entry) -> float:
    """Action whose physical value is nearest to 0."""
    return float(np.clip((entry.high + entry.low) / (entry.low - entry.high), -1.0, 1.0)) + 0.0


def _range(entry: Entry, sign: float, rest: float) -> str:
    unit = "" if entry.unit == "1" else f" {entry.unit}"
    if rest != 0.0:
        return f"{entry.symbol} up to {entry.high:.3g}{unit}"
    ends = (entry.high, entry.low) if sign > 0.0 else (entry.low, entry.high)
    return f"{entry.symbol} {ends[0]:+.3g} / {ends[1]:+.3g}{unit}"


def _choosing(
    entry: Entry, right: tuple[float, float], away: tuple[float, float], title: str
) -> Steering:
    """Choices that are sides of a grid, named in the frame of the entry as ``0: +x, 1: +y``.

    Raises:
        ValueError: they are named otherwise.
    """
    named = dict(part.split(": ", 1) for part in entry.frame.split(", ") if ": " in part)
    try:
        sides = [_WAYS[named[str(k)]] for k in range(int(entry.high) + 1)]
    except KeyError:
        raise ValueError(
            f"{entry.symbol}: frame = {entry.frame!r}; expected '0: +x, 1: +y, ...' for the arrows"
        ) from None
    found = tuple((x * right[0] + y * right[1], x * away[0] + y * away[1]) for x, y in sides)
    axes = {RIGHT: "a cell to the right / left", UP: "a cell away / towards you"}
    return Steering(np.zeros((1, 3)), np.zeros(1), False, found, axes, title)
