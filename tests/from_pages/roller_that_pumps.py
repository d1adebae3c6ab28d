"""`RollPump`: a roller that leaves a valley by changing its inertia ratio."""

import math
from typing import Any, ClassVar

import numpy as np

from rigid_envs.base.checks import Array
from tests.from_pages.rolling import Judged, Model, Settings, in_box, limited, moved


class RollPump(Model):
    """Roll over the rim of a valley."""

    clip = staticmethod(in_box)
    SETTINGS: ClassVar[Settings] = {
        "m": 1.0,
        "radius": 1.0,
        "beta": 0.4,
        "g": 9.81,
        "curvature": 0.2,
        "mu": 1.0,
        "beta_change": 0.6,
        "rim": 1.2,
        "start_part": 0.3,
        "weight_shortfall": 0.02,
        "weight_over": 10.0,
        "rotation": "none",
    }

    @property
    def n_action(self) -> int:
        return 1

    def draw_with(self, rng: np.random.Generator, params: dict[str, float]) -> dict[str, Any]:
        """A start in a valley with these parameters."""
        part = self.s.start_part * rng.uniform(0.5, 1.0)
        curvature = params.get("curvature", self.s.curvature)
        return {
            "arc_length": rng.choice([-1.0, 1.0]) * part * self.s.rim / curvature,
            "velocity": 0.0,
        }

    def draw(self, rng: np.random.Generator) -> dict[str, Any]:
        return self.draw_with(rng, {})

    def place(self, arc_length: float, velocity: float) -> None:
        self.y, self.added = np.array([arc_length, velocity]), 0.0

    @property
    def angle(self) -> float:
        """From the bottom [rad]."""
        return float(self.p.curvature * self.y[0])

    @property
    def rate(self) -> float:
        return float(abs(self.p.curvature * self.y[1]))

    def features(self) -> Array:
        speed = self.y[1] * math.sqrt(self.p.curvature / self.p.g)
        added = self.added / self.s.beta_change
        return np.array([limited(self.angle, math.pi), limited(speed, 5.0), added])

    def move(self, action: Array) -> Judged:
        before, self.added = self.added, 0.5 * self.s.beta_change * (1.0 + float(action[0]))
        ratio = 1.0 + self.p.beta + self.added
        self.y[1] *= (1.0 + self.p.beta + before) / ratio
        self.y = moved(
            lambda y: [y[1], -self.p.g * math.sin(self.p.curvature * y[0]) / ratio],
            self.y,
            self.s.dt,
            has_attitude=False,
        )
        kinetic = 0.5 * ratio * self.y[1] ** 2 * self.p.curvature / self.p.g
        energy = 1.0 - math.cos(self.angle) + kinetic
        over = abs(self.angle) >= self.s.rim
        shortfall = energy / (1.0 - math.cos(self.s.rim)) - 1.0
        terms = {"shortfall": float(np.clip(shortfall, -1.0, 0.0)), "over": float(over)}
        return Judged(terms, self.s.dt, over, over)

    def reduced(self) -> Array:
        low, top = 1.0 + self.p.beta, math.sin(0.5 * self.s.rim)
        x = math.sin(0.5 * self.angle) / top
        momentum = (low + self.added) * self.y[1]
        w = momentum * math.sqrt(self.p.curvature / (self.p.g * low)) / (2.0 * top)
        energy = x * x + w * w
        least = max(energy, 1e-12)
        cos, sin = (x * x - w * w) / least, 2.0 * x * w / least
        size = limited(-math.log(least), 10.0)
        return np.array([cos, sin, limited(4.0 * sin, 1.0), min(energy, 4.0), size])

    def turn(self, action: Array) -> Array:
        return action
