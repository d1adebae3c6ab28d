"""What all pages share, written again from docs/environments/README.md alone.

Nothing here is imported from the library. A class derived from `Page` is one page: its arguments,
equation of motion, features, reward, success and starts.
"""

from abc import ABC, abstractmethod
from collections import deque
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from scipy.integrate import solve_ivp

from rigid_envs.base.checks import Array
from tests.from_pages.attitudes import shown


@dataclass
class Start:
    """State, parameters, and what the task keeps beside them, as `get_state` has it."""

    y: Array
    parameters: dict[str, float]
    aux: Array


@dataclass
class Outcome:
    """What a step gives back."""

    observation: Any
    reward: float
    terminated: bool
    info: dict[str, float]


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


def shortened(action: Array) -> Array:
    """An action in the unit disk or ball."""
    square = action @ action
    return single(action / np.sqrt(square) if square > 1 + 2.0**-22 else action)


def single(numbers: Any) -> Array:
    """Numbers that were rounded to float32."""
    return np.array(numbers, dtype=np.float32).astype(float)


class Page(ABC):
    """An environment as its page describes it, one control period after the other."""

    arguments: ClassVar[dict[str, Any]] = {}
    """Arguments of `gym.make` and their defaults, without the common ones below."""
    physical: ClassVar[tuple[str, ...]] = ()
    """Those that are parameters of the body."""
    terms: ClassVar[tuple[str, ...]] = ()
    controls: ClassVar[int] = 3
    round: ClassVar[bool] = False
    """Whether actions form a disk or ball, not a box."""
    accepted: ClassVar[float] = 0.5
    """Largest rate times integrator step [rad]."""

    def __init__(self, **changes: Any) -> None:
        """Take the arguments of `gym.make`."""
        common = {"observe_params": False, "action_delay": 0, "frame": "world"}
        settings = common | self.arguments
        assert changes.keys() <= settings.keys()
        self.settings = settings | changes
        self.parameters = {name: self.middle(name) for name in self.physical}

    def __getattr__(self, name: str) -> Any:
        """A parameter of the episode, or an argument."""
        if name.startswith("__") or name in ("settings", "parameters"):
            raise AttributeError(name)
        return self.parameters[name] if name in self.parameters else self.settings[name]

    def middle(self, name: str) -> float:
        """Middle of the range of an argument."""
        return float(np.mean(self.settings[name]))

    # -- an episode

    def reset(self, start: Start) -> Any:
        """Begin an episode; returns the observation."""
        self.parameters = dict(start.parameters)
        self.y = np.array(start.y, dtype=float)
        self.aux = np.array(start.aux, dtype=float)
        self.late = deque([np.zeros(self.controls)] * self.action_delay)
        self.steps_within = 0
        self.steps = 0
        return self.observation()

    def step(self, action: Array) -> Outcome:
        """One control period."""
        given = single(action)
        inside = self.clipped(given)
        self.late.append(self.turned(inside) if self.frame == "reduced" else inside)
        u = self.input_of(self.late.popleft())
        self.y = self.moved(u)
        self.steps += 1
        values, cost, success = self.values(u), self.cost(u), bool(self.success())
        terminated = bool(self.ended())
        too_fast = self.rate() * self.dt / self.n_substeps > self.accepted
        broken = bool(too_fast and not terminated)
        if broken:
            values, cost, success = dict.fromkeys(self.terms, 0.0), 0.0, False
            self.y, self.aux = self.nothing(self.y), self.nothing(self.aux)
        info = {
            **{f"reward/{name}": values[name] for name in self.terms},
            "cost": cost,
            "is_success": success,
            "action_clipped": bool(np.any(inside != given)),
            "physics_error": broken,
        }
        reward = sum(self.settings[f"weight_{name}"] * values[name] for name in self.terms)
        return Outcome(self.observation(), reward, terminated or broken, info)

    def nothing(self, numbers: Array) -> Array:
        """Attitude 1 and zeros, of a state or of what is kept beside it."""
        nothing = np.zeros_like(numbers)
        if len(numbers) >= 4:
            nothing[0] = 1.0
        return nothing

    def clipped(self, action: Array) -> Array:
        """The action in its space."""
        return shortened(action) if self.round else np.clip(action, -1.0, 1.0)

    def moved(self, u: Array) -> Array:
        """The state after a control period with a constant input."""
        motion = solve_ivp(
            lambda _, y: self.rhs(y, u),
            (0.0, self.dt),
            self.y,
            method="DOP853",
            rtol=1e-11,
            atol=1e-13,
            first_step=self.dt / 2,
        )
        y = motion.y[:, -1]
        y[:4] /= np.linalg.norm(y[:4])
        return y

    def held(self, within: bool) -> bool:
        """Whether that was so throughout the last `hold` seconds."""
        self.steps_within = self.steps_within + 1 if within else 0
        # the least n with n dt >= hold, of decimal numbers that are rounded
        return self.steps_within >= np.ceil(self.hold / self.dt - 1e-9)

    def observation(self) -> Any:
        """The observation, of float32."""
        ranges = [name for name in self.physical if isinstance(self.settings[name], tuple)]
        drawn = [self.parameters[name] for name in ranges if self.observe_params]
        if self.frame == "reduced":
            return np.array([*self.reduced(), *drawn], dtype=np.float32)
        attitude = shown(self.y[:4], self.rotation)
        return np.array([*self.features(), *attitude, *drawn], dtype=np.float32)

    # -- what each page says

    def input_of(self, action: Array) -> Array:
        """Physical input of an action in its space."""
        return self.torque * action

    @abstractmethod
    def rhs(self, y: Array, u: Array) -> Array:
        """Equation of motion."""

    @abstractmethod
    def rate(self) -> float:
        """What limits the integrator step [rad/s]."""

    @abstractmethod
    def features(self) -> Any:
        """Entries of the observation before the attitude."""

    @abstractmethod
    def reduced(self) -> Any:
        """Entries of the observation in the reduced frame."""

    @abstractmethod
    def turned(self, action: Array) -> Array:
        """The action in the frame of the task, of one in the reduced frame."""

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
