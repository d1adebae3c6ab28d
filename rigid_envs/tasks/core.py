"""Rows of state and clock, reset and step: the only caller of the loops."""

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import (
    TOLERANCE,
    Array,
    Bools,
    Integers,
    Singles,
    one_of,
    real_numbers,
    require,
)
from rigid_envs.engine.compiler import compiled_for
from rigid_envs.engine.dynamics import Dynamics
from rigid_envs.engine.layout import CHANNEL, CLOCK, FLAGS, Sizes
from rigid_envs.engine.loops import BEGIN, BEGIN_UNSEEN, COUNT, OBSERVE, PARAMETERS_GIVEN, Reset
from rigid_envs.engine.publication import Observations, Outputs, Results
from rigid_envs.engine.rows import LANES
from rigid_envs.engine.threads import Workers
from rigid_envs.mechanics.rotations import norm
from rigid_envs.tasks.starts import Start, of_unit_length
from rigid_envs.tasks.task import UNIT, Task, new_buffer, parameter_slot

# One row of an environment at one moment: what is drawn, recorded and replayed.


@dataclass(frozen=True, eq=False)
class Moment:
    """State of one row and the results of its last step.

    Attributes:
        y: physical state, shape (n_state,).
        u: physical input of the last step, shape (n_input,); zeros after a reset.
        parameters: parameters of the system by name, of this episode.
        aux: auxiliary state of the task (goal, counters) by name.
        action: last action, shape (n_action,), each in [-1, 1] (or the choice).
        time: time since the reset [s].
        reward: last reward.
        cost: last cost, in ``task.cost_unit``.
        success: whether the last step was a success.
        totals: sums of rewards and of costs since the reset; None where only the last step is
            known.
        dynamics: of the system, whose names `state` and `input` have.
    """

    y: Array
    u: Array
    parameters: Mapping[str, float]
    aux: Mapping[str, float] = field(default_factory=dict)
    action: Array = field(default_factory=lambda: np.zeros(0))
    time: float = 0.0
    reward: float = 0.0
    cost: float = 0.0
    success: bool = False
    totals: tuple[float, float] | None = None
    dynamics: Dynamics = field(kw_only=True, repr=False)

    @property
    def state(self) -> Any:
        """The numbers of `y` by name: the `State` of the system, as ``moment.state.omega1``."""
        return self.dynamics.State(*self.y.tolist())

    @property
    def input(self) -> Any:
        """The numbers of `u` by name: the `Input` of the system."""
        return self.dynamics.Input(*self.u.tolist())


# Complete state of rows: its parts, and the check of one that is given.

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

    def __init__(self, task: Task, sizes: Sizes) -> None:
        """Look up the slots of every part."""
        self._task = task
        slots = task.compiled.slots
        parts = {
            "y": (slots.state, slots.inputs),
            "parameters": (slots.parameters, slots.parameters + len(task.episode.prototypes.raw)),
            "channel": (slots.channel, slots.aux),
            "aux": (slots.aux, slots.clock),
            "clock": (slots.clock, slots.frame),
            "history": (sizes.history, sizes.total),
        }
        self.parts = {name: ends for name, ends in parts.items() if ends[0] < ends[1]}
        """First slot of every part, and the one after its last."""
        kind = type(task)
        settings = {f.name: getattr(task, f.name) for f in fields(task) if f.name not in _SHOWN}
        # the history lies behind what is shown, and its size is that of the longest delay
        places = {name: ends for name, ends in self.parts.items() if name != "history"}
        content = (_VERSION, _first_module(kind), kind.__qualname__, settings, places)
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
            _check_range("history", arrays["history"], ends, begun[:, None], whole=bool(n))
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
        outside = np.any(raw != np.clip(raw, *ends.T), axis=1)
        positions = self._task.parameter_positions()
        where = {name: list(positions[name]) for name in self._task.physical_parameters()}
        for values in np.unique(raw[outside], axis=0):
            given: dict[str, Any] = {name: float(values[k[0]]) for name, k in where.items()}
            replace(self._task, **given)  # refuses what is not allowed
        for name, k in where.items():
            require(np.ptp(raw[:, k], axis=1) == 0.0, raw[:, k], name, "equal numbers")
        fixed = np.setdiff1d(np.arange(raw.shape[1]), np.concatenate(list(where.values())))
        kept, expected = raw[:, fixed] == ends[fixed, 0], "what the task has there"
        require(kept, raw[:, fixed], "state['parameters']", f"{expected}: {ends[fixed, 0]}")

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


def _first_module(kind: type[Task]) -> str:
    """Module of a task; of ours that in which it was when its states were first written."""
    place, _, name = kind.__module__.rpartition(".")
    if not place.startswith("rigid_envs.systems."):
        return kind.__module__
    return f"rigid_envs.tasks.{'ball_reorient' if kind.__qualname__ == 'BallReorient' else name}"


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


# Batch of rows of a task: state, goal, parameters and clock of each; step and reset.
#
# `Core` has no autoreset and does not depend on Gymnasium. All its data are in one array, `buffer`,
# on which the compiled step and reset of the task work (`rigid_envs.engine`). What these publish
# is written to three arrays, `outputs`: a shell that hands them out replaces them by new ones
# first.

DRAWN = Start()


class Core:
    """N rows of a task.

    Attributes:
        task: task of the rows.
        n_rows: number of rows N.
        actions: the action of the next step, written by the caller, float32 (N, n_action).
        outputs: results, observations and flags of all rows, as steps and resets publish them: see
            `rigid_envs.engine.publication`.
    """

    outputs: Outputs

    def __init__(
        self, task: Task, n_rows: int, max_steps: int | None = None, n_threads: int = 1
    ) -> None:
        """Allocate the buffer; no row has begun an episode."""
        self.task = task
        self.n_rows = n_rows
        self._n_blocks = -(-n_rows // LANES)
        self._n_threads = min(n_threads, self._n_blocks)
        self.buffer, self._settings = new_buffer(task, n_rows, max_steps)
        self._make_views()
        self.renew_outputs()

    def step(self) -> int:
        """Advance all rows by one control period under `actions`, and write `outputs`.

        Returns:
            What `step_into` returns.
        """
        return self.step_into(*self.outputs)

    # Attributes that hold functions: to bind a method takes a part of the time of a few rows.

    @cached_property
    def step_into(self) -> Callable[[Results, Observations, Bools], int]:
        """Function that advances all rows by one control period, and publishes to given arrays.

        It returns 0 if no flag of any row is set, a positive number if one is, at least `ENDED` if
        an episode has ended; -1 - k if entry k of the (flat) actions is not finite: then no row has
        changed, and nothing was published.
        """
        if self._n_threads > 1:
            return Workers(
                self.task.compiled.step, self.buffer, self._n_blocks, self._n_threads, self.outputs
            ).step
        advance = compiled_for(self.task.compiled.step, self.buffer, 0, 0, *self.outputs)
        return partial(advance, self.buffer, 0, self._n_blocks)

    @cached_property
    def blank_outputs(self) -> Callable[[], Outputs]:
        """Function that makes arrays for `outputs`, with nothing in them yet."""
        empty, single, boolean = np.empty, np.dtype(np.float32), np.dtype(np.bool_)
        results, observations, flags = (part.shape for part in self.outputs)
        return lambda: (empty(results), empty(observations, single), empty(flags, boolean))

    @property
    def max_steps(self) -> float:
        """Steps after which an episode is cut off; infinity for no limit."""
        return self._settings.max_steps

    def renew_outputs(self) -> None:
        """Replace `outputs` by new arrays that nobody holds, with what was published last."""
        s = self._slots
        self.outputs = (
            np.ascontiguousarray(self._columns(s.results, s.flags).T),
            self._columns(s.observation, self._settings.history).astype(np.float32),
            np.ascontiguousarray(self._columns(s.flags, s.observation).T != 0.0),
        )

    @property
    def results(self) -> Results:
        """Last cost, reward terms, grip and reward, shape (n, N)."""
        return self.outputs[0]

    @property
    def observations(self) -> Observations:
        """Last observations, shape (N, n_observation)."""
        return self.outputs[1]

    @property
    def flags(self) -> Bools:
        """Last flags in the order of `FLAGS`, shape (6, N)."""
        return self.outputs[2]

    def reset(self, rows: Integers, start: Start = DRAWN) -> None:
        """Begin a new episode in the given rows and publish their observations.

        Args:
            rows: indices of the rows, int64, contiguous: compiled code takes them as they are.
            start: given states and parameters; the rest is drawn.

        Raises:
            ValueError: a given start is too fast for the step of the integrator; the rows have
                changed.
        """
        self._begin(rows, BEGIN)
        if start.parameters:
            for name, value in start.parameters.items():
                for position in self.task.parameter_positions()[name]:
                    self._write(rows, parameter_slot(self.task, position), value)
            self._begin(rows, PARAMETERS_GIVEN)
        if start.state:
            for k, value in start.state.items():
                self._write(rows, self._slots.state + k, value)
            outside = self._begin(rows, OBSERVE)
            if outside >= 0:
                raise ValueError(
                    f"state = {self.y[outside].tolist()} of row {outside}; expected rates of at "
                    f"most {self.task.fastest:.6g} rad/s, for which the integrator is accurate: "
                    "take more n_substeps"
                )

    def reset_unseen(self, rows: Integers) -> None:
        """Begin a new episode in the given rows; all results of their last step become zero."""
        self._begin(rows, BEGIN_UNSEEN)

    def seed(self, rows: Integers, keys: npt.NDArray[np.uint64]) -> None:
        """Set new random streams of rows; their episode counters restart at 0."""
        high, low = keys >> np.uint64(32), keys & np.uint64(0xFFFFFFFF)
        for slot, value in ((CLOCK.key_high, high), (CLOCK.key_low, low), (CLOCK.episode, -1.0)):
            self._write(rows, self._slots.clock + slot, value)

    def _begin(self, rows: Integers, mode: int) -> int:
        """Reset rows and publish them: see `reset_rows`."""
        return self._compiled_reset(self.buffer, rows, mode, *self.outputs)

    @cached_property
    def _compiled_reset(self) -> Reset:
        example = self.buffer, np.zeros(1, np.int64), COUNT, *self.outputs
        reset: Reset = compiled_for(self.task.compiled.reset, *example)
        n, n_seen = len(self.task.shown_features()), reset(*example)
        if n_seen != n:  # more than there is room for would be written beyond the row
            observe = self.task.compiled.observe
            raise TypeError(
                f"observe = {observe.__module__}.{observe.__name__}, which gives {n_seen} numbers; "
                f"expected {n}, one for each entry of features(): return these, in their order"
            )
        return reset

    @cached_property
    def _format(self) -> StateFormat:
        return StateFormat(self.task, self._settings)

    @property
    def y(self) -> Array:
        """Physical states, shape (N, n_state)."""
        return self._columns(self._slots.state, self._slots.inputs)

    @property
    def applied(self) -> Singles:
        """Actions of the last step in the frame of the task, after clipping, noise and delay."""
        return self._columns(self._slots.action, self._slots.results).astype(np.float32)

    def in_frame(self, actions: npt.ArrayLike) -> Array:
        """Actions as they are to be given for actions in the frame of the task, shape (N, m).

        In the reduced frame the map from given actions to those of the task is orthogonal in every
        row, ``a = T g``, so ``g = T^T a``. Choices are not turned.

        Args:
            actions: In the frame of the task, within its limits, shape (N, m).
        """
        given, reduction = np.asarray(actions, dtype=np.float64), self.task.reduced
        if reduction is None or not reduction.Frame._fields:
            return given
        first, units = self._slots.frame, np.eye(given.shape[1]).tolist()
        rows = self._columns(first, first + len(reduction.Frame._fields))
        T = [[reduction.turn(tuple(e), reduction.Frame(*row)) for e in units] for row in rows]
        return np.asarray(np.einsum("nji,ni->nj", np.array(T), given))

    @property
    def elapsed(self) -> Array:
        """Steps since the last reset, shape (N,)."""
        return self._column(self._slots.clock + CLOCK.elapsed)

    @property
    def begun(self) -> npt.NDArray[np.bool_]:
        """Rows that have begun an episode, whether or not it has ended, shape (N,)."""
        return self._format.begun({"clock": self._columns(self._slots.clock, self._slots.frame)})

    @property
    def running(self) -> npt.NDArray[np.bool_]:
        """Rows in an episode, shape (N,)."""
        return self._column(self._slots.clock + CLOCK.running) > 0

    def system_parameters(self, row: int) -> dict[str, float]:
        """Parameters of the system in one row, by the system's names."""
        first = self._slots.parameters
        names = self.task.system_type.parameter_names()
        block, lane = divmod(row, LANES)
        values = self._blocks[block, first : first + len(names), lane]
        return dict(zip(names, values.tolist(), strict=True))

    @property
    def parameters(self) -> dict[str, Array]:
        """Parameters of every row, by field name, each of shape (N,)."""
        positions = self.task.parameter_positions()
        slots = {name: parameter_slot(self.task, k[0]) for name, k in positions.items()}
        return {name: self._column(slot) for name, slot in slots.items()}

    def auxiliary(self, *names: str) -> Array:
        """Parts of the auxiliary state (`Task.aux_names`): shape (N,), or (N, k) of k > 1 names.

        Raises:
            ValueError: unknown name.
        """
        for name in names:
            one_of(name, self.task.aux_names, "name")
        columns = [
            self._column(self._slots.aux + self.task.aux_names.index(name)) for name in names
        ]
        return columns[0] if len(columns) == 1 else np.stack(columns, axis=-1)

    def episode(self, row: int) -> int:
        """Number of the episode of a row since its stream was seeded; -1 before the first."""
        block, lane = divmod(row, LANES)
        return int(self._blocks[block, self._slots.clock + CLOCK.episode, lane])

    def moment(self, row: int) -> Moment:
        """State of a row and the results of its last step; zero results after a reset."""
        s, task = self._slots, self.task
        block, lane = divmod(row, LANES)
        slots = self._blocks[block, :, lane].copy()
        steps = slots[s.clock + CLOCK.elapsed]
        if not steps:
            slots[s.inputs : s.parameters] = slots[s.action : s.observation] = 0.0
        return Moment(
            y=slots[s.state : s.inputs],
            u=slots[s.inputs : s.parameters],
            parameters=self.system_parameters(row),
            aux=dict(zip(task.aux_names, slots[s.aux : s.clock].tolist(), strict=True)),
            action=slots[s.action : s.results],
            time=float(steps * task.dt),
            cost=float(slots[s.results]),
            reward=float(slots[s.flags - 1]),
            success=bool(slots[s.flags + FLAGS.is_success]),
            dynamics=task.system_type.dynamics,
        )

    def get_state(self) -> dict[str, Array]:
        """Complete state of the rows, by name, each part of shape (N, k): see `StateFormat`."""
        parts = {name: self._columns(*ends) for name, ends in self._format.parts.items()}
        return {"digest": np.full((self.n_rows, 1), self._format.digest), **parts}

    def set_state(self, state: Mapping[str, npt.ArrayLike]) -> None:
        """Restore the result of `get_state`; the continuation is bitwise the same.

        Rows that had not begun have not begun afterwards; they keep their random streams.

        Raises:
            ValueError: not a state of this task in this configuration, or a number that no row can
                have; the state is unchanged.
        """
        require(isinstance(state, Mapping), state, "state", "what get_state has given")
        arrays = self._format.checked(state, self.n_rows)
        mask = self._format.begun(arrays)
        begun, fresh = np.flatnonzero(mask), np.flatnonzero(~mask)
        for name, (first, last) in self._format.parts.items():
            self._write(begun, slice(first, last), arrays[name][begun])
        self._write(fresh, slice(0, self._slots.clock), 0.0)
        self._write(fresh, slice(self._slots.clock + CLOCK.elapsed, self._settings.total), 0.0)
        self._begin(begun, OBSERVE)

    def __getstate__(self) -> dict[str, Any]:
        """All attributes except the views, which refer to the buffer."""
        kept = ("task", "n_rows", "buffer", "outputs", "_n_blocks", "_n_threads", "_settings")
        return {name: getattr(self, name) for name in kept}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore the buffer and make its views again."""
        self.__dict__.update(state)
        self._make_views()

    def _make_views(self) -> None:
        self._slots = self.task.compiled.slots
        s, n, n_action = self._settings, self.n_rows, len(self.task.episode.prototypes.action)
        size = self._n_blocks * s.total * LANES
        self._blocks = self.buffer[s.blocks : s.blocks + size].reshape(self._n_blocks, -1, LANES)
        end = s.actions + n * n_action
        self.actions = self.buffer.view(np.float32)[s.actions : end].reshape(n, n_action)

    def _column(self, slot: int) -> Array:
        """One slot of all rows, shape (N,)."""
        return self._columns(slot, slot + 1)[:, 0]

    def _columns(self, first: int, last: int) -> Array:
        """Slots ``first .. last - 1`` of all rows, shape (N, last - first), a copy."""
        rows = self._blocks[:, first:last].transpose(0, 2, 1)
        return rows.reshape(-1, last - first)[: self.n_rows].copy()

    def _write(self, rows: Integers, slot: int | slice, value: npt.ArrayLike) -> None:
        """Set one slot, or several, of some rows."""
        blocks, lanes = np.divmod(rows, LANES)
        self._blocks[blocks, slot, lanes] = value
