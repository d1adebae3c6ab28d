"""What the pages of free bodies and of tops share, beside what all pages do (`rolling.Model`).

Nothing here is imported from the library. A class derived from `Page` is one page: its arguments,
equation of motion, features, reward, success and starts.
"""

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from rigid_envs.base.checks import Array
from tests.from_pages.rolling import Held, Judged, Model, in_box, moved


@dataclass
class Start:
    """State, parameters, and what the task keeps beside them, as `get_state` has it."""

    y: Array
    parameters: dict[str, float]
    aux: Array


def uniform(rng: np.random.Generator, range_: Any) -> float:
    """A number that is drawn from a pair, or the number itself."""
    return float(rng.uniform(*range_) if isinstance(range_, tuple) else range_)


def in_ball(rng: np.random.Generator, radius: float, dimension: int = 3) -> Array:
    """Uniform in a ball, or in a disk."""
    direction = rng.normal(size=dimension)
    return radius * rng.uniform() ** (1 / dimension) * direction / np.linalg.norm(direction)


def near(x: float, tolerance: float) -> float:
    """`x / (|x| + tolerance)`."""
    return x / (abs(x) + tolerance)


def share(v: complex, half: float) -> list[float]:
    """`v / (|v| + half)` of a vector in the plane."""
    part = v / (abs(v) + half)
    return [part.real, part.imag]


class Page(Model):
    """A body that turns: its state is y, which `rhs` moves; beside it the task keeps aux."""

    physical: ClassVar[tuple[str, ...]] = ()
    """Arguments that are parameters of the body."""
    terms: ClassVar[tuple[str, ...]] = ()
    controls: ClassVar[int] = 3
    clip = staticmethod(in_box)

    def __init__(self, **changes: Any) -> None:
        """Take the arguments of `gym.make`."""
        super().__init__(**changes)
        self.ranges = {name: self.ranges[name] for name in self.physical if name in self.ranges}
        self.parameters = {name: self.middle(name) for name in self.physical}

    def __getattr__(self, name: str) -> Any:
        """A parameter of the episode, or an argument."""
        if name.startswith("__") or name in ("s", "parameters"):
            raise AttributeError(name)
        return self.parameters[name] if name in self.parameters else self.settings[name]

    @property
    def settings(self) -> dict[str, Any]:
        """All arguments."""
        return vars(self.s)

    @property
    def n_action(self) -> int:
        return self.controls

    @property
    def q(self) -> Array:
        return self.y[:4]

    def middle(self, name: str) -> float:
        """Middle of the range of an argument."""
        return float(np.mean(self.settings[name]))

    # -- an episode

    def begin(self, params: Any = None, **state: Any) -> None:
        self.parameters = dict(params)
        super().begin(params, **state)

    def place(self, y: Array, aux: Array) -> None:
        self.y, self.aux = np.array(y, dtype=float), np.array(aux, dtype=float)
        self.holding = Held(self.settings.get("hold", 0.0), self.dt)
        self.steps = 0

    def move(self, action: Array) -> Judged:
        u = self.input_of(action)
        self.y = self.moved(u)
        self.steps += 1
        values, cost, success = self.values(u), self.cost(u), bool(self.success())
        return Judged(values, cost, success, bool(self.ended()))

    def stop(self) -> None:
        """Attitude 1 and zeros, of the state and of what is kept beside it."""
        for numbers in (self.y, self.aux):
            numbers[:] = 0.0
            numbers[:1] = 1.0 if len(numbers) >= 4 else 0.0

    def moved(self, u: Array) -> Array:
        """The state after a control period with a constant input."""
        return moved(lambda y: self.rhs(y, u), self.y, self.dt)

    def held(self, within: bool) -> bool:
        """Whether that was so throughout the last `hold` seconds; asked once in each step."""
        return self.holding.after(within)

    # -- what each page says

    def input_of(self, action: Array) -> Array:
        """Physical input of an action in its space."""
        return self.torque * action

    @abstractmethod
    def rhs(self, y: Array, u: Array) -> Array:
        """Equation of motion."""

    @abstractmethod
    def values(self, u: Array) -> dict[str, float]:
        """The terms of the reward."""

    def cost(self, u: Array) -> float:
        """Norm of the input times time."""
        return float(np.linalg.norm(u)) * self.dt

    @abstractmethod
    def success(self) -> bool:
        """Whether the step is a success; asked once in each step."""

    def ended(self) -> bool:
        """Whether the episode terminates by itself."""
        return False

    def draw(self, rng: np.random.Generator) -> Start:
        """A start."""
        parameters = {name: uniform(rng, self.settings[name]) for name in self.physical}
        self.parameters = parameters
        return Start(self.draw_state(rng), parameters, self.draw_aux(rng))

    @abstractmethod
    def draw_state(self, rng: np.random.Generator) -> Array:
        """State at the start, of the body with the present parameters."""

    def draw_aux(self, rng: np.random.Generator) -> Array:
        """What the task keeps beside the state: by default the counter of `hold`."""
        return np.zeros(1)
