"""How keys and pointers become actions."""

import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array
from rigid_envs.envs.lookup import task_of
from rigid_envs.tasks.fields import Entry
from rigid_envs.tasks.task import Task
from rigid_envs.watch.views import view_of

# From what hands do to an action: every mapping follows from the entries of the action.
#
# The *stick* is what all devices move: three numbers in [-1, 1], to the right, up and twist.

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
        expected = "3 at most: hands have no more axes"
        raise ValueError(f"actions = {len(entries)} entries; expected {expected}")
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


# Keyboard, mouse and gamepad as a stick and commands.

_KEYS = {
    "right": (RIGHT, 1.0), "d": (RIGHT, 1.0), "left": (RIGHT, -1.0), "a": (RIGHT, -1.0),
    "up": (UP, 1.0), "w": (UP, 1.0), "down": (UP, -1.0), "s": (UP, -1.0),
    "e": (TWIST, 1.0), "q": (TWIST, -1.0),
}  # fmt: skip
"""Axis of the stick and side of every key."""

COMMANDS = {
    "space": "pause", "p": "pause", "r": "again", "n": "next", "return": "next",
    "tab": "slow", "h": "help", "f1": "help", "escape": "quit",
}  # fmt: skip
"""What other keys do."""

HELP = {RIGHT: "right, left (D, A)", UP: "up, down (W, S)", TWIST: "E, Q"}
"""Keys of each axis of the stick, in words."""

_BUTTONS = {0: "again", 1: "help", 2: "slow", 3: "next", 4: "again", 6: "pause"}
_PAD = {11: "up", 12: "down", 13: "left", 14: "right"}
_STICKS = {0: (RIGHT, 1.0), 1: (UP, -1.0), 2: (TWIST, 1.0)}  # left stick, right stick sideways
_DEAD, _FULL = 0.15, 32767.0
_REACH = 0.35  # of the picture's width, from its middle to a full deflection of the mouse


def dead(value: float) -> float:
    """Deflection of a gamepad's stick: 0 in the dead zone, and from there on linear to 1."""
    size = max(0.0, abs(value) - _DEAD) / (1.0 - _DEAD)
    return float(np.copysign(min(size, 1.0), value))


class Hands:
    """What is held now.

    Args:
        pygame: the module.
        size: width and height of the picture in which the mouse steers, in pixels.

    Attributes:
        directions: pressed since they were last taken, (right, up) each, for moves on a grid.
    """

    def __init__(self, pygame: Any, size: tuple[int, int]) -> None:
        """Nothing is held."""
        self._pygame, self._size = pygame, size
        self._held: set[str] = set()
        self._keys, self._mouse, self._pad = np.zeros(3), np.zeros(3), np.zeros(3)
        self.directions: deque[tuple[float, float]] = deque(maxlen=2)

    def take(self, event: Any) -> str | None:
        """Take an event of pygame; returns the command that it gives, if any."""
        pygame = self._pygame
        kind = event.type
        if kind == pygame.QUIT:
            return "quit"
        if kind in (pygame.KEYDOWN, pygame.KEYUP):
            return self._key(pygame.key.name(event.key), kind == pygame.KEYDOWN)
        if kind in (pygame.CONTROLLERBUTTONDOWN, pygame.CONTROLLERBUTTONUP):
            pressed = kind == pygame.CONTROLLERBUTTONDOWN
            if event.button in _PAD:
                return self._key(_PAD[event.button], pressed)
            return _BUTTONS.get(event.button) if pressed else None
        if kind == pygame.CONTROLLERAXISMOTION and event.axis in _STICKS:
            axis, sign = _STICKS[event.axis]
            self._pad[axis] = sign * dead(event.value / _FULL)
        elif kind == pygame.WINDOWFOCUSLOST:
            self.release()
        elif kind in (pygame.MOUSEBUTTONDOWN, pygame.MOUSEMOTION, pygame.MOUSEBUTTONUP):
            self._point(event, kind == pygame.MOUSEBUTTONDOWN)
        return None

    def stick(self, dt: float) -> Array:
        """Right, up and twist after a time dt [s], each in [-1, 1]."""
        aim = np.zeros(3)
        for name in self._held:
            axis, side = _KEYS[name]
            aim[axis] = np.clip(aim[axis] + side, -1.0, 1.0)
        self._keys = blended(self._keys, aim, dt)
        return np.clip(self._keys + self._mouse + self._pad, -1.0, 1.0)

    def release(self) -> None:
        """Let go of everything."""
        self._held.clear()
        self.directions.clear()
        for part in (self._keys, self._mouse, self._pad):
            part[:] = 0.0

    def _key(self, name: str, pressed: bool) -> str | None:
        if name not in _KEYS:
            return COMMANDS.get(name) if pressed else None
        if not pressed:
            self._held.discard(name)
            return None
        if name not in self._held:
            self._held.add(name)
            axis, side = _KEYS[name]
            if axis != TWIST:
                self.directions.append((side, 0.0) if axis == RIGHT else (0.0, side))
        return None

    def _point(self, event: Any, pressed: bool) -> None:
        """Left button: right and up, by where the mouse is; right button: twist."""
        held = self._pygame.mouse.get_pressed() if not hasattr(event, "buttons") else event.buttons
        if event.type == self._pygame.MOUSEBUTTONUP:
            held = tuple(down and k + 1 != event.button for k, down in enumerate(held))
        elif pressed:
            held = tuple(down or k + 1 == event.button for k, down in enumerate(held))
        width, height = self._size
        reach = _REACH * width
        x = (event.pos[0] - 0.5 * width) / reach
        y = (0.5 * height - event.pos[1]) / reach
        length = max(1.0, float(np.hypot(x, y)))
        self._mouse[:] = 0.0
        if held[0]:
            self._mouse[RIGHT], self._mouse[UP] = x / length, y / length
            if pressed:
                self.directions.append((x, y))
        if held[2]:
            self._mouse[TWIST] = np.clip(x, -1.0, 1.0)


# Which keys do what.

_OTHERS = (
    "Space, P\tpause",
    "Tab\tslow motion: 1/2, 1/4, 1",
    "R\tthe same start again",
    "N, Return\tthe next start",
    "H\tthese lines",
    "Esc\tquit",
    "",
    "mouse\tleft button: towards the pointer; right button: twist",
    "gamepad\tsticks; Start pauses, A again, Y next, X slow",
)


def keys_of(task: Task, parameters: Mapping[str, float]) -> Steering:
    """How a task is steered, seen with its own camera."""
    return steering_of(task, view_of(task, dict(parameters)).scene.camera.azimuth)


def keys(env_id: str, config: Mapping[str, Any] | None = None) -> str:
    """Keys of an environment and what they do, as text.

    Args:
        env_id: Gymnasium's id.
        config: hyperparameters of the task.

    Raises:
        ValueError: an unknown id, or a wrong hyperparameter.
    """
    task = task_of(env_id, config)
    system = task.system()
    parameters = {name: getattr(system, name) for name in task.system_type.parameter_names()}
    parts = (line.partition("\t") for line in help_lines(keys_of(task, parameters)))
    return "\n".join(f"{first:20}{second}".rstrip() for first, _, second in parts)


def help_lines(steering: Steering) -> tuple[str, ...]:
    """Keys and what they do; a tabulator parts both."""
    axes = (f"{HELP[axis]}\t{text}" for axis, text in steering.axes.items())
    return (steering.title, "", *axes, "", *_OTHERS)
