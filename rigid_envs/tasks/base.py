"""Base class of tasks: system, entries of action and observation, hyperparameters."""

from __future__ import annotations

import abc
import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from rigid_envs.errors import ConfigError
from rigid_envs.kernels.episode import Episode
from rigid_envs.kernels.layout import CHANNEL
from rigid_envs.registry import ENVIRONMENTS
from rigid_envs.settings import refusal
from rigid_envs.systems import System
from rigid_envs.tasks.entries import ROTATION, ROTATIONS, Entry, attitude_entries
from rigid_envs.tasks.fields import (
    Choice,
    Flag,
    Integer,
    Number,
    Range,
    Settings,
    check_fields,
    setting,
    span,
)
from rigid_envs.tasks.reduction import Reduction, in_reduced_frame

__all__ = ["ROTATION", "Entry", "Task"]

Array = npt.NDArray[np.float64]

_SLACK = 1e-12  # the least number of substeps that is asked for is enough, whatever is rounded


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
    episode: ClassVar[Episode]
    """Functions of one row, from which `step` and `reset` are compiled."""
    reduction: ClassVar[Reduction | None] = None
    """Symmetry and reduced coordinates; None where none are declared."""
    cost_unit: ClassVar[str]
    """Quantity and unit of ``info["cost"]``."""
    n_choices: ClassVar[int] = 0
    """Number of actions of a task with discrete actions; 0 where they are continuous."""
    fixed_components: ClassVar[tuple[str, ...]] = ()
    """Components of the state that are constantly 0; a start with other values is refused."""
    envelope: ClassVar[float | None] = None
    """Largest rate times integrator step [rad]; None: that of the system, up to which the
    integrator keeps its stated accuracy."""
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
        """Check every field by its rule, and the parameters in combination."""
        check_fields(self)
        if self.frame == "reduced" and self.reduction is None:
            raise refusal("frame", self.frame, f"'world': {type(self).__name__} has no reduction")
        self._check_parameters()
        self.check_duration(self.registered_steps())
        if len(self.actions()) != len(self.episode.prototypes.action):
            raise TypeError(
                f"{type(self).__name__}: actions() has {len(self.actions())} entries; "
                f"expected those of {self.episode.Action.__name__}, {self.episode.Action._fields}"
            )

    @property
    def compiled(self) -> Episode:
        """The episode whose compiled functions are run: that of the frame."""
        if self.reduced is None:
            return self.episode
        return in_reduced_frame(self.episode, self.reduced)

    @property
    def reduced(self) -> Reduction | None:
        """The reduction in force; None in the frame of the task."""
        return self.reduction if self.frame == "reduced" else None

    @property
    def terms(self) -> tuple[str, ...]:
        """Names of the reward terms."""
        names: tuple[str, ...] = self.episode.Terms._fields
        return names

    @property
    def aux_names(self) -> tuple[str, ...]:
        """Names of the auxiliary state, which the task keeps from step to step."""
        names: tuple[str, ...] = self.episode.Auxiliary._fields
        return names

    @property
    def n_goal(self) -> int:
        """Number of entries of a goal; `features` then begins with achieved and desired goal."""
        return len(self.episode.Goal._fields)

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
        allowed = self.largest_turn * self.n_substeps / self.dt * (1.0 + _SLACK)
        low, high = 0, 2**31
        if self.largest_rate(high * self.dt) <= allowed:
            return high
        while high - low > 1:
            middle = (low + high) // 2
            if self.largest_rate(middle * self.dt) <= allowed:
                low = middle
            else:
                high = middle
        return low

    @property
    def largest_turn(self) -> float:
        """Allowed product of rate and integrator step [rad]."""
        return self.system_type.envelope if self.envelope is None else self.envelope

    def observations(self) -> tuple[Entry, ...]:
        """All entries of the observation: features, attitude, drawn parameters."""
        features = self.features()
        if self.reduced is not None:
            features = (*features[: 2 * self.n_goal], *self.reduced.features)
        return (*features, *attitude_entries(self._shown_rotation), *self._drawn_entries())

    def reached(self, achieved: npt.ArrayLike, desired: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Whether goals are reached, by the same function as in `step`; shape (...).

        Args:
            achieved: shape (..., n_goal), as observed.
            desired: shape (..., n_goal).

        Raises:
            ValueError: wrong shapes.
        """
        pair = [np.asarray(goal, dtype=np.float64) for goal in (achieved, desired)]
        if not pair[0].shape == pair[1].shape or pair[0].shape[-1:] != (self.n_goal,):
            raise ValueError(
                f"achieved and desired goal have shapes {pair[0].shape} and {pair[1].shape}; "
                f"expected (..., {self.n_goal}) twice"
            )
        found, wanted = (np.ascontiguousarray(goal.reshape(-1, self.n_goal)) for goal in pair)
        out = np.empty(len(found))
        self.episode.reach(found, wanted, np.array(self.constants()), out)
        return out.reshape(pair[0].shape[:-1]) > 0.0

    def ranges(self) -> dict[str, tuple[float, float]]:
        """Range of every parameter drawn at reset: of the system, then of noise and delay."""
        system = {name: span(getattr(self, field)) for name, field in self._fields().items()}
        return {**system, **{name: span(getattr(self, name)) for name in CHANNEL._fields}}

    def physical_parameters(self) -> tuple[str, ...]:
        """Fields that are parameters of the system."""
        return tuple(dict.fromkeys(self._fields().values()))

    def parameter_positions(self) -> dict[str, tuple[int, ...]]:
        """Positions of the value of each field in `ranges`."""
        positions: dict[str, tuple[int, ...]] = {}
        for k, name in enumerate((*self._fields().values(), *CHANNEL._fields)):
            positions[name] = (*positions.get(name, ()), k)
        return positions

    def observed_parameters(self) -> tuple[str, ...]:
        """Fields that are drawn from a range and appended to the observation."""
        if not self.observe_params:
            return ()
        spans = {name: span(getattr(self, name)) for name in self.parameter_positions()}
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
        return self.system_type(**{name: parameters[name] for name in self._fields()})

    def _fields(self) -> dict[str, str]:
        """Field of the task for each parameter of the system."""
        return {name: self.aliases.get(name, name) for name in self.system_type.parameter_names()}

    def _check_parameters(self) -> None:
        ends = {name: set(span(getattr(self, name))) for name in self.physical_parameters()}
        # a system's conditions are linear in its parameters: valid corners imply a valid range
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
