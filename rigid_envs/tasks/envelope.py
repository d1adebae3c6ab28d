"""The stability envelope of the integrator, within which every episode must stay."""

from __future__ import annotations

import abc
import itertools
import math
from typing import ClassVar

from rigid_envs.errors import ConfigError
from rigid_envs.registry import ENVIRONMENTS
from rigid_envs.systems import System

__all__ = ["WithinEnvelope"]

_SLACK = 1e-12  # the least number of substeps that is asked for is enough, whatever is rounded


class WithinEnvelope(abc.ABC):
    """A task whose integrator steps stay within the envelope during an episode."""

    dt: float
    n_substeps: int
    system_type: ClassVar[type[System]]
    """Class of the physical system."""
    envelope: ClassVar[float | None] = None
    """Largest rate times integrator step [rad]; None: that of the system, up to which the
    integrator keeps its stated accuracy."""

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
