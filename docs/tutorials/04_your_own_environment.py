# %% [markdown]
# # Your own environment
#
# A task of your own, on a system that exists, is one file: five compiled functions of one row, and a dataclass
# whose fields are the arguments of `gym.make`. It then has what all environments here have: a single and a vector
# form, checks of every argument, a page, contract tests, scores. For a system of your own too, see
# [extending](../extending.md).
#
# The task: a ball rolls on a hill. A force along the path, too weak to hold it on steep ground, is to bring it to
# rest on the top. The system is `Roller` with a negative curvature,
#
# $$
# (1 + \beta)\, m\, \ddot s = -m g \sin(\kappa s) + F, \qquad \kappa < 0 .
# $$

# %%
import subprocess
import sys
from pathlib import Path

FILE = '''"""Bring a ball to rest on the top of a hill."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import rigid_envs
from rigid_envs.extending import (
    Choice, Entry, Episode, NoAuxiliary, Number, Range, Task,
    clip_to_interval, physical, randoms, scalar, select, setting, span,
)
from rigid_envs.systems import Roller

ROLLER = Roller.dynamics
State, Input, Parameters = ROLLER.State, ROLLER.Input, ROLLER.Parameters
FASTEST = 20.0  # m/s; observed no further than this


class Action(NamedTuple):
    """Force along the path, in parts of the largest."""

    force: float


class Terms(NamedTuple):
    """Reward terms."""

    angle: float
    rest: float


class Constants(NamedTuple):
    """Largest force [N], largest angle at the start [rad], tolerances [rad], [m/s]."""

    force: float
    start_angle: float
    angle_tolerance: float
    speed_tolerance: float


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, tuple[()]]:
    """At rest, the angle uniform on both sides of the top."""
    angle = c.start_angle * (2.0 * randoms.uniform(stream, 0) - 1.0)
    return State(angle / p.curvature, 0.0), ()


@scalar
def actuate(
    a: Action, y: State, aux: NoAuxiliary, p: Parameters, c: Constants
) -> tuple[State, Input]:
    """The force; the inertia ratio stays."""
    return y, Input(force=c.force * a.force, beta_change=0.0)


@scalar
def outcome(
    y: State, u: Input, aux: NoAuxiliary, p: Parameters, c: Constants, dt: float
) -> tuple[NoAuxiliary, Terms, float, bool, bool]:
    """Angle from the top, impulse as cost, and success at rest there."""
    angle = abs(p.curvature * y.s)
    at_rest = (angle <= c.angle_tolerance) & (abs(y.v) <= c.speed_tolerance)
    terms = Terms(angle=-min(angle, 1.0), rest=select(at_rest, 1.0, 0.0))
    return aux, terms, dt * abs(u.force), at_rest, at_rest


@scalar
def observe(y: State, aux: NoAuxiliary, p: Parameters, c: Constants) -> tuple[float, float]:
    """Angle from the top, and speed."""
    angle = -p.curvature * y.s
    return min(max(angle, -math.pi), math.pi), min(max(y.v, -FASTEST), FASTEST)


@dataclass(frozen=True)
class HillTop(Task):
    """Bring a ball to rest on the top of a hill, by a force along the path.

    The top is unstable, and on steep ground the force is weaker than the weight.

    Physics:
        ``(1 + beta) m s'' = -m g sin(curvature s) + force`` with curvature < 0.

    Rewards:
        ``angle`` = minus the angle from the top, at most 1, and ``rest`` = 1 in the step that
        succeeds.

    Starting State:
        At rest, the angle uniform within `start_angle` of the top.

    Episode End:
        The episode terminates when the ball is within `angle_tolerance` of the top, no faster than
        `speed_tolerance`. That step is the success (`info["is_success"]`).

    Reference:
        A linear regulator succeeds where the force is stronger than the weight.

    Version History:
        v0: first version.

    Source:
        Goldstein, Poole & Safko, *Classical Mechanics*, section 2.4.
    """

    rotation: str = setting("none", Choice("a roller has no attitude", ("none",)))
    dt: float = setting(0.05, Number("control period", "s", 1e-4, 1.0))
    n_substeps: int = 2
    m: Range = physical(1.0, "mass", "kg")
    radius: Range = physical(1.0, "rolling radius", "m")
    beta: Range = physical(0.4, "inertia ratio", "1")
    g: Range = physical(9.81, "gravitational acceleration", "m/s^2")
    slope: float = setting(0.0, Number("angle at s = 0: the top", "rad", 0.0, 0.0))
    curvature: float = setting(-0.2, Number("curvature of the path", "1/m", -1.0, -1e-3))
    mu: Range = physical(1.0, "coefficient of static friction", "1")
    force: float = setting(3.0, Number("largest force", "N", 1e-3, 1e3))
    start_angle: float = setting(0.2, Number("largest angle at the start", "rad", 0.0, 3.0))
    angle_tolerance: float = setting(0.02, Number("angle off the top", "rad", 1e-3, 3.2))
    speed_tolerance: float = setting(0.1, Number("speed at rest", "m/s", 1e-3, 100.0))
    weight_angle: float = setting(0.1, Number("weight of the angle", "1", -1e3, 1e3))
    weight_rest: float = setting(10.0, Number("weight of the success", "1", -1e3, 1e3))

    system_type: ClassVar = Roller
    episode: ClassVar = Episode(
        dynamics=ROLLER,
        Action=Action,
        Terms=Terms,
        Constants=Constants,
        start=start,
        clip=clip_to_interval,
        actuate=actuate,
        outcome=outcome,
        observe=observe,
    )
    cost_unit: ClassVar = "impulse [N s]"

    def actions(self) -> tuple[Entry, ...]:
        """Force along the path."""
        return (Entry("force", "N", "path", -self.force, self.force),)

    def features(self) -> tuple[Entry, ...]:
        """Angle and speed."""
        return (
            Entry("angle", "rad", "path", -math.pi, math.pi),
            Entry("v", "m/s", "path", -FASTEST, FASTEST),
        )

    def largest_rate(self, duration: float) -> float:
        """Rate v |curvature| after a fall from top to bottom, under full force all the time."""
        inertia, m = 1.0 + span(self.beta)[0], span(self.m)[0]
        fall = 2.0 * math.sqrt(span(self.g)[1] * -self.curvature / inertia)
        return fall - self.force / (m * inertia) * duration * self.curvature


rigid_envs.register(
    "Hill/Top-v0",
    task="hill:HillTop",
    max_episode_steps=200,
    family="Hill",
    goal=False,
    early_end={"angle_tolerance": 3.0, "speed_tolerance": 100.0},
)
'''
Path("hill.py").write_text(FILE)
sys.path.insert(0, str(Path.cwd()))
print(len(FILE.splitlines()), "lines")

# %% [markdown]
# Names fit together: each term has a `weight_<term>`, each constant a field, each parameter of the system a field.
# What does not fit is refused at import. `start` takes random numbers by index from a stream of its own for each row
# and episode; `observe` stays within the bounds that `features` states; `largest_rate` proves that the integrator
# stays within its envelope.
#
# ## Use
#
# Importing the file registers the id.

# %%
import gymnasium as gym
import hill  # noqa: F401
import matplotlib.pyplot as plt
import numpy as np

import rigid_envs
from rigid_envs.control import lqr, zero_order_hold

env = gym.make("Hill/Top-v0")
observation, info = env.reset(seed=0)
print("start", observation, " after a step", env.step(np.array([1.0], dtype=np.float32))[:3])
print(gym.make_vec("Hill/Top-v0", num_envs=256, m=(0.8, 1.2)).reset(seed=0)[0].shape)
try:
    gym.make("Hill/Top-v0", curvature=0.2)
except ValueError as error:
    print("refused:", error)

# %% [markdown]
# ## Contract tests
#
# `python -m rigid_envs.testing` runs the tests of this library on it: determinism in every bit, autoreset, spaces,
# seeds, noise, invariants, the order of the integrator. Here a part of them; without `-k` all take half a minute and
# more.

# %%
command = [
    "-m",
    "rigid_envs.testing",
    "--env-id",
    "hill:Hill/Top-v0",
    "-q",
    "-k",
    "seeds or spaces",
]
tested = subprocess.run([sys.executable, *command], capture_output=True, text=True, check=False)
print(tested.stdout.strip().splitlines()[-1])

# %% [markdown]
# ## A controller and its score
#
# Linearised about the top, $\ddot s = -\kappa g / (1 + \beta)\, s + F / (1 + \beta) m$: unstable, because
# $\kappa < 0$. A linear-quadratic regulator of that is a function of the observation, and `evaluate` plays it, as any
# policy, from 500 fixed starts.

# %%
task, system = env.unwrapped.task, env.unwrapped.system
A, B = system.linearize(system.state(arc_length=0.0, velocity=0.0))
regulator = lqr(*zero_order_hold(A, B[:, :1], task.dt), [1.0, 0.1], [0.02])


def regulate(observations: np.ndarray) -> np.ndarray:
    """Force of the regulator over the largest, for all rows."""
    angle, speed = observations.T
    s = -angle / task.curvature
    return regulator.feedback(np.stack([s, speed], axis=-1)) / task.force


for policy in (regulate, "zero", "random"):
    result = rigid_envs.evaluate("Hill/Top-v0", policy)
    print(result, end="\n\n")

# %% [markdown]
# The action 0 succeeds where the ball starts within the tolerances already, and random actions from a few starts
# more. A task to publish would draw its starts from outside.
#
# Where is the regulator lost? The weight is stronger than the force beyond $\sin\theta = F / m g$. A start at rest between
# this angle and the top can be brought back by somebody; beyond, by nobody.

# %%
angles = np.linspace(0.01, 0.6, 60)
envs = gym.make_vec("Hill/Top-v0", num_envs=len(angles))
start = {"arc_length": angles / -task.curvature, "velocity": np.zeros(len(angles))}
observations, _ = envs.reset(seed=0, options={"state": start})
won = np.zeros(len(angles), dtype=bool)
for _ in range(envs.spec.max_episode_steps):
    observations, _, terminated, _, infos = envs.step(regulate(observations).astype(np.float32))
    won |= terminated
limit = np.arcsin(task.force / (system.m * system.g))

figure, axes = plt.subplots(figsize=(7, 1.8), layout="constrained")
axes.plot(angles, won, ".", label="brought to rest")
axes.axvline(limit, color="k", linestyle="--", label=r"$\sin\theta = F / mg$")
axes.set(xlabel="angle at the start [rad]", yticks=[0, 1], yticklabels=["no", "yes"])
axes.legend()
plt.show()

# %% [markdown]
# ## More
#
# `rigid-envs describe hill:Hill/Top-v0` prints its page, `rigid-envs docs DIR --ids hill:Hill/Top-v0` writes it,
# `rigid-envs play hill:Hill/Top-v0` lets you try. To observe noise or hidden parameters you need nothing: those
# arguments are there already.
