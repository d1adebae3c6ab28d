"""What all tasks have in common, from the page of all environments.

A model is one episode in plain NumPy: `begin` with a state, `observe`, `step`. It shares nothing
with `rigid_envs`.
"""

import math
import re
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
from scipy.integrate import solve_ivp

from rigid_envs.base.checks import Array
from tests.from_pages import attitudes

PAGES = Path(__file__).parents[2] / "docs" / "environments"
_WORDS = ("world", "none", "matrix", "both", "slow", "e1 e2 e3")  # values that are text


@dataclass(frozen=True)
class Judged:
    """What a task says of a step: reward terms, cost, success, end."""

    terms: Mapping[str, float]
    cost: float
    success: bool
    terminated: bool


@dataclass(frozen=True)
class Step(Judged):
    """A step as the environment returns it."""

    observation: Any
    reward: float
    clipped: bool
    broken: bool

    @property
    def info(self):
        """What `info` has of it."""
        told = {"is_success": self.success, "action_clipped": self.clipped}
        terms = {f"reward/{name}": value for name, value in self.terms.items()}
        return {**terms, "cost": self.cost, **told, "physics_error": self.broken}


class Model(ABC):
    """One episode of a task.

    Attributes:
        ranges: the arguments that are given as a pair, from which a start draws.
    """

    ACCEPTED: ClassVar[float] = 0.5  # rad in a step of the integrator
    n_action: ClassVar[int] = 2
    """Number of entries of an action."""
    q: Array

    def __init__(self, **settings):
        known = self.defaults()
        assert settings.keys() <= known.keys()
        self.s = SimpleNamespace(**{**known, **settings})
        self.ranges = {name: v for name, v in vars(self.s).items() if isinstance(v, tuple)}
        self.p = self.s

    @classmethod
    def defaults(cls):
        """Arguments of the task with their defaults, from its page."""
        return arguments_of(f"{cls.__name__}.md")

    def begin(self, params=None, **state):
        """Begin an episode in a state, with values of the parameters that have ranges."""
        self.p = SimpleNamespace(**{**vars(self.s), **(params or {})})
        self.late = [np.zeros(self.n_action)] * int(self.p.action_delay)
        self.place(**state)

    @property
    def largest_weight(self):
        """Sum of the sizes of the weights: what an error of all terms is multiplied by."""
        weights = (v for name, v in vars(self.s).items() if name.startswith("weight_"))
        return sum(map(abs, weights), 1.0)

    @staticmethod
    def clip(action):
        """An action of the space, and whether it was outside: each entry in [-1, 1]."""
        inside = np.clip(action, -1.0, 1.0)
        return inside, bool(np.any(inside != action))

    def draw_params(self, rng):
        """Values of the parameters that are given as ranges."""
        return {name: rng.uniform(*ends) for name, ends in self.ranges.items()}

    @abstractmethod
    def draw(self, rng, params):
        """A start with these parameters, by names of the components of the state."""

    def beside(self, aux):
        """What belongs to a start beside the state, of what the environment has drawn."""
        return {}

    @abstractmethod
    def place(self, **state):
        """Take a start."""

    @abstractmethod
    def features(self):
        """Entries of the observation before the attitude."""

    @abstractmethod
    def reduced(self):
        """Entries of the observation in the reduced frame."""

    @abstractmethod
    def turn(self, action):
        """The action in the frame of the world, of one in the reduced frame."""

    @abstractmethod
    def move(self, action):
        """One control period."""

    def stop(self):
        """Set the state that a motion which is too fast leaves; whether that is compared."""
        return False

    def observe(self):
        """The observation, before it is rounded to float32."""
        if self.s.frame == "reduced":
            parts = [self.reduced()]
        else:
            parts = [self.features()]
            if self.s.rotation != "none":
                parts.append(attitudes.shown(self.q, self.s.rotation))
        if self.s.observe_params:
            parts.append(np.array([getattr(self.p, name) for name in self.ranges]))
        return np.concatenate(parts)

    def step(self, action):
        """Clip, turn, delay, move, judge, observe; a motion that is too fast ends the episode."""
        inside, clipped = self.clip(np.asarray(action, dtype=np.float32).astype(float))
        self.late.append(self.turn(inside) if self.s.frame == "reduced" else inside)
        judged = self.move(self.late.pop(0))
        turned = self.rate * self.s.dt / self.s.n_substeps
        broken = bool(turned > self.ACCEPTED and not judged.terminated)
        known = not broken or self.stop()
        if broken:
            judged = Judged(dict.fromkeys(judged.terms, 0.0), 0.0, False, True)
        reward = sum(getattr(self.s, f"weight_{k}") * v for k, v in judged.terms.items())
        return Step(
            **vars(judged),
            observation=self.observe() if known else None,
            reward=reward,
            clipped=clipped,
            broken=broken,
        )

    @property
    def rate(self):
        """The rate that limits the step of the integrator [rad/s]; 0 where none does."""
        return 0.0


def moved(rate, y, dt, has_attitude=True):
    """The state after a time, by its rate of change; an attitude at its head has length 1."""
    flow = solve_ivp(
        lambda _, y: rate(y),
        (0.0, dt),
        y,
        method="DOP853",
        rtol=1e-11,
        atol=1e-13,
        first_step=dt / 2,
    )
    end = np.array(flow.y[:, -1])
    if has_attitude:
        end[:4] /= np.linalg.norm(end[:4])
    return end


class Held:
    """Whether a condition has been true throughout the last seconds."""

    def __init__(self, seconds, dt):
        self.needed = math.ceil(seconds / dt * (1.0 - 1e-9))
        self.steps = 0

    def after(self, true):
        """After a step, in which the condition is true or not."""
        self.steps = self.steps + 1 if true else 0
        return self.steps >= self.needed


def in_disk(action):
    """In the unit disk, rounded to float32; a length that rounding may have made is inside."""
    square = float(action @ action)
    outside = square > 1.0 + 2.0**-22
    return single(action / math.sqrt(square) if outside else action), outside


def single(x):
    """The nearest float32."""
    return np.asarray(x, dtype=np.float32).astype(float)


def limited(x, largest):
    """x between -largest and largest."""
    return np.clip(x, -largest, largest)


def smooth(x):
    """The length of x, rounded off within 0.001 of 0."""
    return math.hypot(x, 0.001)


def root(x):
    """Root of the magnitude, with the sign."""
    return math.copysign(math.sqrt(abs(x)), x)


@dataclass(frozen=True)
class Frame:
    """A moving frame in the plane: its x-axis, and -1 where y points to the right of it."""

    cosine: float = 1.0
    sine: float = 0.0
    side: float = 1.0

    def seen(self, x, y):
        """Components of an offset, a velocity or a force."""
        return np.array(
            [self.cosine * x + self.sine * y, self.side * (self.cosine * y - self.sine * x)]
        )

    def axial(self, v):
        """Components of a rotation vector, which a reflection reverses in its plane."""
        along, left = self.seen(v[0], v[1])
        return np.array([self.side * along, self.side * left, self.side * v[2]])

    def back(self, action):
        """World components of an action, rounded to float32."""
        along, left = action[0], self.side * action[1]
        return single(
            [self.cosine * along - self.sine * left, self.sine * along + self.cosine * left]
        )


def uniform(rng, range_):
    """A number that is drawn from a pair, or the number itself."""
    return float(rng.uniform(*range_) if isinstance(range_, tuple) else range_)


def in_ball(rng, radius, dimension=3):
    """Uniform in a ball, or in a disk."""
    direction = rng.normal(size=dimension)
    return radius * rng.uniform() ** (1 / dimension) * direction / np.linalg.norm(direction)


def near(x, tolerance):
    """`x / (|x| + tolerance)`."""
    return x / (abs(x) + tolerance)


def share(v, half):
    """`v / (|v| + half)` of a vector in the plane."""
    part = v / (abs(v) + half)
    return [part.real, part.imag]


class Turning(Model):
    """A body whose state y has its attitude at the head."""

    y: Array

    @property
    def q(self):
        return self.y[:4]


def pages_of(file):
    """What all environments share, the page that a page says it is like, and the page."""
    page = (PAGES / file).read_text(encoding="utf-8")
    if file == "README.md":
        return [page]
    parent = re.search(r"\nThe same as in .*\((\w+\.md)\):", page)
    return [*pages_of("README.md" if parent is None else parent[1]), page]


def arguments_of(file):
    """Defaults by argument, first those of the body in order, the weights of rewards among them."""
    values = {}
    for page in pages_of(file):
        section = page.split("# Arguments\n")[1].split("\n#")[0]
        found = re.findall(r"^\| `(\w+)` \| (.+?) \|", section, re.MULTILINE)
        weights = re.findall(r"^\| `(weight_\w+)` \| (\S+) \|", page, re.MULTILINE)
        short = re.findall(r"`(\w+)` = (\(.+?\)|[^\s,]+?)(?: = [\d.]+?)?[,.]\s", section)
        for name, value in [*found, *short, *weights]:
            exact = value.partition(" = ")[0]  # "pi/8 = 0.3927"
            values[name] = value if value in _WORDS else eval(exact, {"pi": math.pi})
    return {**{name: values[name] for name in attributes_of(file) if name in values}, **values}


def attributes_of(file):
    """Names of the parameters of the system that a page names, in order."""
    index, *pages = pages_of(file)
    found = re.search(r"^Equations of motion: \[(`\w+`)\]", "\n".join(pages), re.MULTILINE)
    section = index.partition(f"\n### System {found[1]}\n")[2].partition("\n#")[0]
    return re.findall(r"^- `(\w+)`: ", section, re.MULTILINE)


class Page(Turning):
    """A body that turns: its state is y, which `rhs` moves; beside it the task keeps aux."""

    physical: ClassVar[tuple[str, ...]] = ()
    """Arguments that are parameters of the body."""
    n_action = 3

    def __init__(self, **settings):
        super().__init__(**settings)
        self.ranges = {name: self.ranges[name] for name in self.physical if name in self.ranges}
        self.parameters = {name: self.middle(name) for name in self.physical}

    def __getattr__(self, name):
        """A parameter of the episode, or an argument."""
        if name.startswith("__") or name in ("s", "parameters"):
            raise AttributeError(name)
        return self.parameters[name] if name in self.parameters else self.settings[name]

    @property
    def settings(self):
        """All arguments."""
        return vars(self.s)

    def middle(self, name):
        """Middle of the range of an argument."""
        return float(np.mean(self.settings[name]))

    # -- the body

    @property
    def omega(self):
        """Angular velocity, in body axes."""
        return self.y[4:7]

    @property
    def rate(self):
        """The larger one of |omega| and |I omega| / I2."""
        momentum = self.moments * self.omega
        return max(np.linalg.norm(self.omega), np.linalg.norm(momentum) / self.moments[1])

    def spun(self, omega, torque):
        """omega' by Euler's equations."""
        (I1, I2, I3), (w1, w2, w3) = self.moments, omega
        gyroscopic = np.array([(I2 - I3) * w2 * w3, (I3 - I1) * w3 * w1, (I1 - I2) * w1 * w2])
        return (gyroscopic + torque) / self.moments

    # -- an episode

    def components(self, y):
        """The parts of a state, by name."""
        names = ("q", "omega_body", "pivot", "pivot_velocity")
        return dict(zip(names, np.split(y, [4, 7, 9] if len(y) > 7 else [4]), strict=False))

    def beside(self, aux):
        return {"aux": aux}

    def begin(self, params=None, **state):
        self.parameters |= params or {}
        super().begin(params, **state)

    def place(self, aux, **parts):
        self.y = np.concatenate([np.asarray(part, dtype=float) for part in parts.values()])
        self.aux = np.array(aux, dtype=float)
        self.holding = Held(self.settings.get("hold", 0.0), self.dt)

    def move(self, action):
        u = self.input_of(action)
        self.y = self.moved(u)
        values, cost, success = self.values(u), self.cost(u), bool(self.success())
        return Judged(values, cost, success, bool(self.ended()))

    def stop(self):
        """Attitude 1 and zeros, of the state and of what is kept beside it."""
        for numbers in (self.y, self.aux):
            numbers[:] = 0.0
            numbers[:1] = 1.0 if len(numbers) >= 4 else 0.0
        return True

    def moved(self, u):
        """The state after a control period with a constant input."""
        return moved(lambda y: self.rhs(y, u), self.y, self.dt)

    def held(self, within):
        """Whether that was so throughout the last `hold` seconds; asked once in each step."""
        return self.holding.after(within)

    # -- what each page says

    def input_of(self, action):
        """Physical input of an action in its space."""
        return self.torque * action

    @abstractmethod
    def rhs(self, y, u):
        """Equation of motion."""

    @abstractmethod
    def values(self, u):
        """The terms of the reward."""

    def cost(self, u):
        """Norm of the input times time."""
        return float(np.linalg.norm(u)) * self.dt

    @abstractmethod
    def success(self):
        """Whether the step is a success; asked once in each step."""

    def ended(self):
        """Whether the episode terminates by itself."""
        return False

    def draw(self, rng, params):
        self.parameters |= params
        return {**self.components(self.draw_state(rng)), "aux": self.draw_aux(rng)}

    @abstractmethod
    def draw_state(self, rng):
        """State at the start, of the body with the present parameters."""

    def draw_aux(self, rng):
        """What the task keeps beside the state: by default the counter of `hold`."""
        return np.zeros(1)
