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
from rigid_envs.rotations.vectors import norm
from rigid_envs.tasks.base import UNIT, Task
from rigid_envs.tasks.starts import of_unit_length

__all__ = ["StateFormat"]

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

_VERSION = 1
_SHOWN = {"frame", "rotation", "observe_params"}  # settings of what is observed only
_ROUNDING = 1e-9  # of the ends of a range
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

        Of rows that have not begun, only the clock is looked at. Attitudes of another length are
        brought to length 1; a state that is too large ends the episode with a physics error.

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
        begun = self.begun(arrays)
        self._check_clock(arrays["clock"], begun)
        self._check_physical(arrays["y"], begun)
        self._check_parameters(arrays["parameters"][begun])
        self._check_channel(arrays["channel"], begun)
        if "aux" in arrays:
            arrays["aux"] = self._checked_auxiliary(arrays, begun)
        if "history" in arrays:
            n = self._task.n_choices
            ends = (0.0, n - 1.0) if n else (-1.0, 1.0)
            _check_range("history", arrays["history"], ends, begun[:, None], whole=n > 0)
        if "q" in self._task.system_type.components:
            arrays["y"] = arrays["y"].copy()
            arrays["y"][begun, :4] = of_unit_length(arrays["y"][begun, :4])
        return arrays

    @staticmethod
    def begun(arrays: Mapping[str, Array]) -> Bools:
        """Rows that have begun an episode, shape (N,): in the others nothing means anything."""
        clock = arrays["clock"]
        return (clock[:, CLOCK.running] > 0) | (clock[:, CLOCK.elapsed] > 0)

    def _check_clock(self, clock: Array, begun: Bools) -> None:
        for name, k in CLOCK._asdict().items():
            _check_range(f"clock: {name}", clock[:, k], _CLOCK_ENDS[name], whole=True)
        name, episode = "state: clock: episode", clock[:, CLOCK.episode]
        require((episode >= 0.0) | ~begun, episode, name, "a number from 0 in a row that has begun")

    def _check_physical(self, y: Array, begun: Bools) -> None:
        system, name = self._task.system_type, "state['y']"
        require(np.isfinite(y) | ~begun[:, None], y, name, "finite numbers")
        if "q" in system.components:
            turned = np.any(y[:, :4] != 0.0, axis=1)
            require(turned | ~begun, y, name, "an attitude: its quaternion is not zero")
        for component in self._task.fixed_components:
            still = np.all(y[:, system.components[component]] == 0.0, axis=1)
            require(still | ~begun, y, name, f"{component} = 0, its constant value in this task")

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

    def _check_channel(self, channel: Array, begun: Bools) -> None:
        for name, k in CHANNEL._asdict().items():
            whole, ends = name == "action_delay", self._task.ranges()[name]
            _check_range(f"channel: {name}", channel[:, k], ends, begun, whole=whole)

    def _checked_auxiliary(self, arrays: Mapping[str, Array], begun: Bools) -> Array:
        """Auxiliary numbers in their ranges, directions and attitudes of length 1."""
        task, clock = self._task, arrays["clock"]
        aux = np.where(begun[:, None], arrays["aux"], 0.0)
        for k, name in enumerate(task.aux_names):
            _check_range(f"aux: {name}", aux[:, k], (-_LARGEST, _LARGEST))
        mended = np.all(aux == task.episode.prototypes.aux, axis=1)  # after a physics error
        rows = begun & ~(mended & (clock[:, CLOCK.running] == 0.0))
        places = task.parameter_positions()
        p = {
            name: np.where(begun, arrays["parameters"][:, places[name][0]], 1.0)
            for name in task.physical_parameters()
        }
        for named, ends in task.auxiliary_ranges(p, clock[:, CLOCK.elapsed]).items():
            slack = TOLERANCE if ends is UNIT else _ROUNDING
            low, high = (np.asarray(end) for end in ends)
            wider = (low - slack * np.abs(low), high + slack * np.abs(high))
            if isinstance(named, str):
                values, whole = aux[:, task.aux_names.index(named)], named in task.counters
                _check_range(f"aux: {named}", values, wider, rows, whole=whole)
                continue
            columns = [task.aux_names.index(name) for name in named]
            lengths = norm(aux[:, columns])[:, 0]
            _check_range(f"aux: length of ({', '.join(named)})", lengths, wider, rows)
            if ends is UNIT:
                aux[np.ix_(rows, columns)] = of_unit_length(aux[np.ix_(rows, columns)])
        return aux


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
    name: str,
    values: Array,
    ends: tuple[npt.ArrayLike, npt.ArrayLike],
    rows: Bools | bool = True,
    *,
    whole: bool = False,
) -> None:
    """Refuse numbers outside a range, and fractions where whole numbers are expected.

    Raises:
        ValueError: names the first one, of the given rows.
    """
    low, high = (np.broadcast_to(end, values.shape) for end in ends)
    good = (low <= values) & (values <= high) & ((values == np.floor(values)) | (not whole))
    good |= ~np.asarray(rows)
    if not good.all():
        k, kind = np.argmin(good), "whole numbers" if whole else "numbers"
        range_ = f"{kind} from {low.flat[k]:g} to {high.flat[k]:g}"
        require(good, values, f"state: {name}", range_)
