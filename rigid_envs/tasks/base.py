"""Base class of tasks: system, entries of action and observation, hyperparameters."""

from __future__ import annotations

import abc
import itertools
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from rigid_envs.checks import real_numbers
from rigid_envs.errors import ConfigError
from rigid_envs.kernels.episode import Episode, with_noise_and_delay
from rigid_envs.kernels.layout import CHANNEL
from rigid_envs.settings import refusal
from rigid_envs.systems import System
from rigid_envs.tasks.entries import ROTATION, ROTATIONS, Entry, attitude_entries
from rigid_envs.tasks.envelope import WithinEnvelope
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

__all__ = ["ROTATION", "UNIT", "AuxiliaryRanges", "Entry", "Task"]

Array = npt.NDArray[np.float64]
Ends = tuple[npt.ArrayLike, npt.ArrayLike]
AuxiliaryRanges = dict[str | tuple[str, ...], Ends]
UNIT: Ends = (1.0, 1.0)
"""Range of the length of a direction or an attitude."""


@dataclass(frozen=True)
class Task(WithinEnvelope, Settings, abc.ABC):
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

    def observations(self) -> tuple[Entry, ...]:
        """All entries of the observation: features, attitude, drawn parameters."""
        features = self.features()
        if self.reduced is not None:
            features = (*features[: 2 * self.n_goal], *self.reduced.features)
        return (*features, *attitude_entries(self._shown_rotation), *self._drawn_entries())

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

    def _check_parameters(self) -> None:
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
