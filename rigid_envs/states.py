"""Complete state of rows: its parts, and the check of one that is given."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.checks import TOLERANCE, real_numbers, require
from rigid_envs.kernels.layout import CHANNEL, CLOCK, Slots
from rigid_envs.tasks.base import Task

__all__ = ["StateFormat"]

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

_VERSION = 1
_SHOWN = {"frame", "rotation", "observe_params"}  # settings of what is observed only
_LARGEST = 1e9  # of an auxiliary number: far above every goal and counter, far below overflow
_CLOCK_ENDS = {
    "key_high": (0, 2**32 - 1),
    "key_low": (0, 2**32 - 1),
    "episode": (-1, 2**53),
    "elapsed": (0, 2**44),  # times 128 it counts the draws of noise
    "running": (0, 1),
}


class StateFormat:
    """Names and sizes of the parts of a complete state, and what their numbers may be.

    The part "digest" tells states of this task, version and configuration from others, except for
    the frame and what is observed, which no state depends on.
    """

    def __init__(self, task: Task, slots: Slots) -> None:
        """Look up the slots of every part."""
        self._task = task
        parts = {
            "y": (slots.state, slots.inputs),
            "parameters": (slots.parameters, slots.parameters + len(task.episode.prototypes.raw)),
            "channel": (slots.channel, slots.aux),
            "aux": (slots.aux, slots.clock),
            "clock": (slots.clock, slots.frame),
            "history": (slots.history, slots.total),
        }
        self.parts = {name: ends for name, ends in parts.items() if ends[0] < ends[1]}
        """First slot of every part, and the one after its last."""
        kind = type(task)
        settings = {f.name: getattr(task, f.name) for f in fields(task) if f.name not in _SHOWN}
        # the history lies behind what is shown, and its size is that of the longest delay
        places = {name: ends for name, ends in self.parts.items() if name != "history"}
        content = (_VERSION, kind.__module__, kind.__qualname__, settings, places)
        word = hashlib.sha256(repr(content).encode()).digest()[:6]
        self.digest = float(int.from_bytes(word, "big"))
        """48 bits, which a float64 holds."""

    def checked(self, state: Mapping[str, npt.ArrayLike], n_rows: int) -> dict[str, Array]:
        """The parts of a given state of `n_rows` rows, without the digest.

        Of the physical state only finiteness is asked: an attitude of another length is brought to
        length 1, and a state that is too large ends the episode with a physics error.

        Raises:
            ValueError: a part that is missing, unknown, no real numbers or of another shape; a
                state of another task or configuration; a number that no row can have.
        """
        expected = {"digest", *self.parts}
        if set(state) != expected:
            found = sorted(map(str, state))
            raise ValueError(f"state has keys {found}; expected {sorted(expected)}")
        sizes = {name: last - first for name, (first, last) in self.parts.items()}
        arrays = {
            name: _part(f"state[{name!r}]", state[name], (n_rows, size))
            for name, size in {"digest": 1, **sizes}.items()
        }
        same = arrays["digest"] == self.digest
        expected_digest = f"{self.digest}, of this version and configuration: {self._task!r}"
        require(same, arrays.pop("digest"), "state['digest']", expected_digest)
        self._check_clock(arrays["clock"])
        begun = self.begun(arrays)
        finite = np.isfinite(arrays["y"]) | ~begun[:, np.newaxis]
        require(finite, arrays["y"], "state['y']", "finite numbers")
        self._check_parameters(arrays["parameters"][begun])
        self._check_channel(arrays["channel"][begun])
        if "aux" in arrays:
            for k, name in enumerate(self._task.aux_names):
                _check_range(f"aux: {name}", arrays["aux"][:, k], (-_LARGEST, _LARGEST))
            self._task.check_auxiliary(self._task.episode.Auxiliary(*arrays["aux"][begun].T))
        if "history" in arrays:
            n_choices = self._task.n_choices
            ends = (0.0, n_choices - 1.0) if n_choices else (-1.0, 1.0)
            _check_range("history", arrays["history"], ends)
        if "q" in self._task.system_type.components:
            with np.errstate(all="ignore"):  # numbers that are no state
                arrays["y"] = _normalized(arrays["y"])
        return arrays

    @staticmethod
    def begun(arrays: Mapping[str, Array]) -> Bools:
        """Rows that have begun an episode, shape (N,): in the others nothing means anything."""
        clock = arrays["clock"]
        return (clock[:, CLOCK.running] > 0) | (clock[:, CLOCK.elapsed] > 0)

    def _check_clock(self, clock: Array) -> None:
        for name, k in CLOCK._asdict().items():
            _check_range(f"clock: {name}", clock[:, k], _CLOCK_ENDS[name], whole=True)
        possible = clock[:, CLOCK.running] <= clock[:, CLOCK.episode] + 1
        require(possible, clock, "state['clock']", "running = 0 before the first episode, -1")

    def _check_parameters(self, raw: Array) -> None:
        """Refuse parameters that are outside their ranges and that a reset would not take."""
        ends = np.array(list(self._task.ranges().values()))[: raw.shape[1]]
        outside = ~np.all((ends[:, 0] <= raw) & (raw <= ends[:, 1]), axis=1)
        positions = self._task.parameter_positions()
        where = {name: list(positions[name]) for name in self._task.physical_parameters()}
        for values in np.unique(raw[outside], axis=0):
            given: dict[str, Any] = {name: float(values[k[0]]) for name, k in where.items()}
            replace(self._task, **given)  # refuses what is not allowed
            for name, k in where.items():
                require(np.ptp(values[k]) == 0.0, values, name, "equal numbers")

    def _check_channel(self, channel: Array) -> None:
        for name, k in CHANNEL._asdict().items():
            whole = name == "action_delay"
            _check_range(f"channel: {name}", channel[:, k], self._task.ranges()[name], whole=whole)


def _part(name: str, value: npt.ArrayLike, shape: tuple[int, int]) -> Array:
    """The value as float64.

    Raises:
        ValueError: no real numbers, or another shape.
    """
    numbers = real_numbers(value, name)
    if numbers.shape != shape:
        raise ValueError(f"{name} has shape {numbers.shape}; expected {shape}")
    return numbers


def _check_range(
    name: str, values: Array, ends: tuple[float, float], *, whole: bool = False
) -> None:
    """Refuse numbers outside a range, and fractions where whole numbers are expected.

    Raises:
        ValueError: names the first one.
    """
    kind = "whole numbers" if whole else "numbers"
    good = (ends[0] <= values) & (values <= ends[1]) & ((values == np.floor(values)) | (not whole))
    require(good, values, f"state: {name}", f"{kind} from {ends[0]:g} to {ends[1]:g}")


def _normalized(y: Array) -> Array:
    """States (N, n) whose quaternions, if not near length 1, are brought to it.

    The integrators remove no more than rounding errors. What is near 1 keeps its bits.
    """
    size = np.max(np.abs(y[:, :4]), axis=1, keepdims=True)
    q = y[:, :4] / np.where(np.isfinite(size) & (size > 0.0), size, 1.0)
    length = np.sqrt(np.sum(q * q, axis=1, keepdims=True))
    near = np.abs(size * length - 1.0) <= TOLERANCE
    usable = np.isfinite(length) & (length > 0.0)
    return np.concatenate([np.where(near | ~usable, y[:, :4], q / length), y[:, 4:]], axis=1)
