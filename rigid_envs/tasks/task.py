"""What all tasks share: the base class, the stability envelope, the layout of rows."""

import abc
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, ConfigError, real_numbers
from rigid_envs.base.settings import (
    Choice,
    Flag,
    Integer,
    Number,
    Settings,
    check_fields,
    refusal,
    setting,
)
from rigid_envs.engine.episode import Episode, with_noise_and_delay
from rigid_envs.engine.layout import CHANNEL, Sizes
from rigid_envs.engine.rows import LANES
from rigid_envs.mechanics.system import System
from rigid_envs.tasks.fields import (
    ROTATION,
    ROTATIONS,
    Entry,
    Range,
    attitude_entries,
    physical,
    span,
)
from rigid_envs.tasks.reduction import Reduction, in_reduced_frame
from rigid_envs.tasks.registry import ENVIRONMENTS

# Base class of tasks: system, entries of action and observation, hyperparameters.

_SLACK = 1e-12  # the least number of substeps that is asked for is enough, whatever is rounded

Ends = tuple[npt.ArrayLike, npt.ArrayLike]
AuxiliaryRanges = dict[str | tuple[str, ...], Ends]
UNIT: Ends = (1.0, 1.0)
"""Range of the length of a direction or an attitude."""


@dataclass(frozen=True)
class Task(Settings, abc.ABC):
    """Hyperparameters of an environment.

    The fields here are common to all tasks. A subclass adds its own, among them a
    ``weight_<term>`` for every reward term, and the class attributes below.

    Attributes:
        dt: control period [s].
        n_substeps: integrator steps per control period.
        rotation: how the attitude is observed: "matrix" (9 entries of R, row by row), "rot6d"
            (first two columns), "quat" (w >= 0), "euler" (z-x-z; singular at theta = 0), "none".
        observe_params: append to the observation every parameter that is drawn from a range.
        action_noise: standard deviation of Gaussian noise on the action.
        observation_noise: standard deviation of Gaussian noise on every observation entry.
        action_delay: delay of actions in control periods; the action before the first one is zero.
        frame: frame of observations and actions: "world" is that of the task, "reduced" turns with
            the state, where the task declares its symmetry (`reduction`). The attitude is then part
            of the reduced coordinates, and `rotation` has no effect.
    """

    dt: float = setting(0.1, Number("control period", "s", 1e-4, 1.0))
    n_substeps: int = setting(1, Integer("integrator steps per control period", 1, 1000))
    rotation: str = setting("matrix", ROTATION)
    observe_params: bool = setting(False, Flag("append drawn parameters to the observation"))
    action_noise: Range = setting(
        0.0, Number("standard deviation of noise on the action", "1", 0.0, 10.0, drawn=True)
    )
    observation_noise: Range = setting(
        0.0, Number("standard deviation of noise on the observation", "1", 0.0, 10.0, drawn=True)
    )
    action_delay: int | tuple[int, int] = setting(
        0, Integer("control periods by which actions are late", 0, 100, drawn=True)
    )
    frame: str = setting("world", Choice("frame of observation and action", ("world", "reduced")))

    system_type: ClassVar[type[System]]
    """Class of the physical system."""
    envelope: ClassVar[float | None] = None
    """Largest rate times integrator step [rad]; None: that of the system, up to which the
    integrator keeps its stated accuracy."""
    episode: ClassVar[Episode]
    """Functions of one row, from which `step` and `reset` are compiled."""
    reduction: ClassVar[Reduction | None] = None
    """Symmetry and reduced coordinates; None where none are declared."""
    cost_unit: ClassVar[str]
    """Quantity and unit of ``info["cost"]``."""
    n_choices: ClassVar[int] = 0
    """Number of actions of a task with discrete actions; 0 where they are continuous."""
    counters: ClassVar[tuple[str, ...]] = ()
    """Whole numbers of the auxiliary state: from 0 to the steps of the episode, unless
    `auxiliary_ranges` says otherwise."""
    fixed_components: ClassVar[tuple[str, ...]] = ()
    """Components of the state that are constantly 0; a start with other values is refused."""
    aliases: ClassVar[Mapping[str, str]] = {}
    """Field of the task for a parameter of the system, where the names differ."""

    def __init_subclass__(cls) -> None:
        """Check that every constant and every weight is an attribute of the class.

        Raises:
            TypeError: an attribute is missing, or the episode belongs to another system.
        """
        super().__init_subclass__()
        if "episode" not in cls.__dict__:
            return
        episode = cls.episode
        if cls.system_type.dynamics is not episode.dynamics:
            raise TypeError(f"{cls.__name__}: the episode is not one of {cls.system_type.__name__}")
        weights = (f"weight_{term}" for term in episode.Terms._fields)
        for name in (*weights, *episode.Constants._fields):
            if not hasattr(cls, name):
                raise TypeError(
                    f"{cls.__name__} has no {name}; expected a field (or a property) of this name, "
                    "as its Terms or Constants have it"
                )

    def __post_init__(self) -> None:
        """Check every field by its rule, and settings in combination."""
        check_fields(self)
        if self.frame == "reduced" and self.reduction is None:
            raise refusal("frame", self.frame, f"'world': {type(self).__name__} has no reduction")
        self.check_settings()
        self.check_duration(self.registered_steps())
        if len(self.actions()) != len(self.episode.prototypes.action):
            raise TypeError(
                f"{type(self).__name__}: actions() has {len(self.actions())} entries; "
                f"expected those of {self.episode.Action.__name__}, {self.episode.Action._fields}"
            )

    @abc.abstractmethod
    def largest_rate(self, duration: float) -> float:
        """Bound on the angular rates that an episode of this duration can reach.

        The bound holds for every start and every sequence of actions. For the time limit in force
        it is compared with the `envelope`.

        Args:
            duration: Time from the start to the end of the episode [s]; may be infinite.

        Returns:
            Bound [rad/s] on the rates of the motion and of the rotations within an integrator step.
        """

    def check_duration(self, n_steps: float) -> None:
        """Check that the integrator stays within the stability envelope during an episode.

        Args:
            n_steps: Length of the episode in control periods.

        Raises:
            ConfigError: the rates may leave the envelope; the message names the remedy.
        """
        rate = self.largest_rate(n_steps * self.dt)
        least = rate * self.dt / self.largest_turn * (1.0 - _SLACK)
        if self.n_substeps < least:
            raise ConfigError(
                f"config.dt: dt = {self.dt} in {self.n_substeps} substeps; expected at most "
                f"{self.largest_turn / rate * self.n_substeps:.4g} s, for rates up to {rate:.4g} "
                f"rad/s in {n_steps:g} steps (stability envelope): "
                f"take n_substeps >= {math.ceil(least)}"
            )

    @classmethod
    def registered_steps(cls) -> int:
        """Least registered time limit of this task or a base class, in steps; 0 without an id."""
        for kind in cls.__mro__:
            # also where a package passes on the class of a module of its own
            modules = itertools.accumulate(kind.__module__.split("."), "{}.{}".format)
            tasks = {f"{module}:{kind.__name__}" for module in modules}
            limits = [r.max_episode_steps for r in ENVIRONMENTS.values() if r.task in tasks]
            if limits:
                return min(limits)
        return 0

    def stable_steps(self) -> int:
        """Largest number of steps within the stability envelope; 2**31 at most."""
        low, high = 0, 2**31
        if self.largest_rate(high * self.dt) <= self.fastest:
            return high
        while high - low > 1:
            middle = (low + high) // 2
            if self.largest_rate(middle * self.dt) <= self.fastest:
                low = middle
            else:
                high = middle
        return low

    @property
    def fastest(self) -> float:
        """Largest rate at which the step of the integrator is within the envelope [rad/s]."""
        return self.largest_turn * self.n_substeps / self.dt * (1.0 + _SLACK)

    @property
    def largest_turn(self) -> float:
        """Allowed product of rate and integrator step [rad]."""
        return self.system_type.envelope if self.envelope is None else self.envelope

    @property
    def compiled(self) -> Episode:
        """The episode whose compiled functions are run: in the frame, with noise and delay."""
        episode = self.episode
        if self.reduced is not None:
            episode = in_reduced_frame(episode, self.reduced)
        if any(span(getattr(self, name))[1] for name in CHANNEL._fields):
            episode = with_noise_and_delay(episode)
        return episode

    @property
    def reduced(self) -> Reduction | None:
        """The reduction in force; None in the frame of the task."""
        return self.reduction if self.frame == "reduced" else None

    @property
    def terms(self) -> tuple[str, ...]:
        """Names of the reward terms."""
        return tuple(self.episode.Terms._fields)

    @property
    def aux_names(self) -> tuple[str, ...]:
        """Names of the auxiliary state, which the task keeps from step to step."""
        return tuple(self.episode.Auxiliary._fields)

    @property
    def n_goal(self) -> int:
        """Number of entries of a goal; `features` then begins with achieved and desired goal."""
        return len(self.episode.Goal._fields)

    @property
    def slip_rule(self) -> tuple[bool, float]:
        """Whether slip ends an episode, and what it takes off the reward."""
        return False, 0.0

    def weights(self) -> Any:
        """Weights of the reward terms, by name."""
        Terms = self.episode.Terms
        return Terms(*(float(getattr(self, f"weight_{term}")) for term in Terms._fields))

    def constants(self) -> Any:
        """Constants of the compiled functions, by name: attributes of the task."""
        Constants = self.episode.Constants
        return Constants(*(float(getattr(self, name)) for name in Constants._fields))

    @abc.abstractmethod
    def actions(self) -> tuple[Entry, ...]:
        """Entries of the action; their bounds are the physical values of actions -1 and 1."""

    @abc.abstractmethod
    def features(self) -> tuple[Entry, ...]:
        """Entries of the observation before the attitude."""

    def shown_features(self) -> tuple[Entry, ...]:
        """Entries that `observe` gives: `features`, or goals and those of the reduced frame."""
        features = self.features()
        if self.reduced is not None:
            features = (*features[: 2 * self.n_goal], *self.reduced.features)
        return features

    def observations(self) -> tuple[Entry, ...]:
        """All entries of the observation: features, attitude, drawn parameters."""
        attitude = attitude_entries(self._shown_rotation)
        return (*self.shown_features(), *attitude, *self._drawn_entries())

    def goal_reward(self, achieved: npt.ArrayLike, desired: npt.ArrayLike) -> Array:
        """Reward of achieved goals, by the same functions as in `step`; shape (...).

        Args:
            achieved: shape (..., n_goal), as observed.
            desired: shape (..., n_goal).

        Raises:
            ValueError: no real numbers, or wrong shapes.
        """
        pair = [real_numbers(achieved, "achieved_goal"), real_numbers(desired, "desired_goal")]
        if not pair[0].shape == pair[1].shape or pair[0].shape[-1:] != (self.n_goal,):
            raise ValueError(
                f"achieved and desired goal have shapes {pair[0].shape} and {pair[1].shape}; "
                f"expected (..., {self.n_goal}) twice"
            )
        found, wanted = (np.ascontiguousarray(goal.reshape(-1, self.n_goal)) for goal in pair)
        out = np.empty(len(found))
        weights, constants = np.array(self.weights()), np.array(self.constants())
        self.episode.reward(found, wanted, weights, constants, out)
        return out.reshape(pair[0].shape[:-1])

    def auxiliary_ranges(self, p: Mapping[str, Array], elapsed: Array) -> AuxiliaryRanges:
        """Least and largest value of the auxiliary numbers of an episode, to check given ones.

        Args:
            p: parameters of the system by field, each of shape (N,).
            elapsed: steps since the reset, shape (N,).

        Returns:
            Ranges by name; of the length of a vector by the names of its entries, `UNIT` of a
            direction or an attitude. What is not named may be any number.
        """
        return {name: (0.0, elapsed) for name in self.counters}

    def ranges(self) -> dict[str, tuple[float, float]]:
        """Range of every parameter drawn at reset: of the system, then of noise and delay."""
        fixed = {field.name: field.default for field in fields(self.system_type)}
        given = {name: getattr(self, field) for name, field in self._fields().items()}
        system = {name: span(value) for name, value in {**fixed, **given}.items()}
        return {**system, **{name: span(getattr(self, name)) for name in CHANNEL._fields}}

    def physical_parameters(self) -> tuple[str, ...]:
        """Fields that are parameters of the system."""
        return tuple(dict.fromkeys(self._fields().values()))

    def parameter_positions(self) -> dict[str, tuple[int, ...]]:
        """Positions of the value of each field in `ranges`."""
        positions: dict[str, tuple[int, ...]] = {}
        known = self._fields()
        names = (known.get(name, name) for name in self.system_type.parameter_names())
        for k, name in enumerate((*names, *CHANNEL._fields)):
            positions[name] = (*positions.get(name, ()), k)
        return positions

    def observed_parameters(self) -> tuple[str, ...]:
        """Fields that are drawn from a range and appended to the observation."""
        if not self.observe_params:
            return ()
        drawn = (*self.physical_parameters(), *CHANNEL._fields)
        spans = {name: span(getattr(self, name)) for name in drawn}
        return tuple(name for name, (low, high) in spans.items() if low < high)

    @property
    def rotation_code(self) -> int:
        """Code of the attitude representation in the kernels."""
        return ROTATIONS[self._shown_rotation]

    @property
    def _shown_rotation(self) -> str:
        return self.rotation if self.reduced is None else "none"

    def system(self, parameters: Mapping[str, float] | None = None) -> System:
        """The physical system, with the given parameters or the middle of each range."""
        if parameters is None:
            parameters = {name: 0.5 * (low + high) for name, (low, high) in self.ranges().items()}
        names = self.system_type.parameter_names()
        return self.system_type(**{name: parameters[name] for name in names})

    def _fields(self) -> dict[str, str]:
        """Field of the task for each parameter of the system; those without one are fixed."""
        names = self.system_type.parameter_names()
        named = {name: self.aliases.get(name, name) for name in names}
        return {name: field for name, field in named.items() if hasattr(self, field)}

    def check_settings(self) -> None:
        """Check settings that depend on one another, each of which its rule allows.

        A subclass with such settings calls this method of its base class first. The system has
        been tried with all ends of the ranges of its parameters then.

        Raises:
            ConfigError: ``config.<key>: ...``, as `rigid_envs.base.settings.refusal` makes it.
        """
        ends = {name: set(span(getattr(self, name))) for name in self.physical_parameters()}
        # each condition is monotone in every parameter: valid corners imply a valid range
        for corner in itertools.product(*ends.values()):
            values = dict(zip(ends, corner, strict=True))
            try:
                self.system_type(**{name: values[field] for name, field in self._fields().items()})
            except ValueError as error:
                name = str(error).split()[0]
                raise ConfigError(f"config.{self.aliases.get(name, name)}: {error}") from None

    def _drawn_entries(self) -> tuple[Entry, ...]:
        rules = {field.name: field.metadata["rule"] for field in fields(self)}
        return tuple(
            Entry(name, rules[name].unit, "drawn", *span(getattr(self, name)))
            for name in self.observed_parameters()
        )


# Allocation of the array that holds all rows and settings of a task.

_LINE = 8  # numbers in a cache line


def parameter_slot(task: Task, position: int) -> int:
    """Slot of the parameter at a position of `Task.ranges`."""
    slots, n_raw = task.compiled.slots, len(task.episode.prototypes.raw)
    if position < n_raw:
        return slots.parameters + position
    return slots.channel + position - n_raw


def _shared_numbers(task: Task) -> dict[str, Sequence[float]]:
    """Numbers of all rows that follow the settings, by the offset that says where they begin."""
    positions = task.parameter_positions()
    return {
        "weights": task.weights(),
        "constants": task.constants(),
        "ranges": [end for ends in task.ranges().values() for end in ends],
        "observed": [parameter_slot(task, positions[k][0]) for k in task.observed_parameters()],
        "bounds": [end for entry in task.observations() for end in (entry.low, entry.high)],
    }


def new_buffer(
    task: Task, n_rows: int, max_steps: int | None
) -> tuple[npt.NDArray[np.float64], Sizes]:
    """Array of `n_rows` rows, zero except for the settings at its head; and the settings."""
    n_action, n_observation = len(task.episode.prototypes.action), len(task.observations())
    parts = _shared_numbers(task)
    *starts, n_head = itertools.accumulate(map(len, parts.values()), initial=len(Sizes._fields))
    ends_on_slip, slip_penalty = task.slip_rule
    noise, blur, delay = (task.ranges()[name][1] for name in CHANNEL._fields)
    history = task.compiled.slots.observation + n_observation
    total = history + int(delay) * n_action
    blocks = _blocks_up(n_head)
    actions = 2 * (blocks + _blocks_up(n_rows) * total)
    settings = Sizes(
        n_rows=n_rows,
        n_substeps=task.n_substeps,
        max_steps=np.inf if max_steps is None else max_steps,
        dt=task.dt,
        history=history,
        total=total,
        n_delays=int(delay),
        n_observed=len(parts["observed"]),
        n_observation=n_observation,
        n_exact=2 * task.n_goal,
        rotation=task.rotation_code,
        noisy_actions=int(noise > 0),
        noisy_observations=int(blur > 0),
        fastest=task.fastest,
        ends_on_slip=int(ends_on_slip),
        slip_penalty=slip_penalty,
        **dict(zip(parts, starts, strict=True)),
        blocks=blocks,
        actions=actions,
    )
    buffer = aligned_zeros(-(-(actions + n_action * n_rows) // 2))
    buffer[:n_head] = [*settings, *itertools.chain(*parts.values())]
    return buffer, settings


def aligned_zeros(n: int) -> npt.NDArray[np.float64]:
    """Zeros that begin at a cache line, so that vectors of a block do not lie across two."""
    whole = np.zeros(n + _LINE)
    first = -whole.ctypes.data // whole.itemsize % _LINE
    return whole[first : first + n]


def _blocks_up(n: int) -> int:
    """Smallest multiple of LANES that is at least n."""
    return -(-n // LANES) * LANES


# Options of tasks whose body rolls with inertia: friction, and an end where it would slip.


@dataclass(frozen=True)
class Rolling(Task):
    """Task of a body that rolls without slipping, whatever friction that needs.

    Attributes:
        mu: coefficient of static friction.
        end_on_slip: end the episode, without success, in a step after which rolling needs more
            friction than mu gives.
        slip_penalty: what that takes off the reward of the step.
    """

    mu: Range = physical(1.0, "coefficient of static friction", "1")
    end_on_slip: bool = setting(False, Flag("end the episode when rolling needs more than mu"))
    slip_penalty: float = setting(
        20.0, Number("taken off the reward of the step that ends so", "1", 0.0, 1e6)
    )

    @property
    def slip_rule(self) -> tuple[bool, float]:
        """Whether slip ends an episode, and what it takes off the reward."""
        return self.end_on_slip, self.slip_penalty
