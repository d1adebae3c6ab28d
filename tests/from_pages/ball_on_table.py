"""`BallPlate`: a ball that is to be held at a point of a table by tilting it."""

import math
from typing import Any, ClassVar

import numpy as np

from rigid_envs.base.checks import Array
from tests.from_pages.attitudes import draw
from tests.from_pages.pushed_ball import Ball, ball_rate, moved
from tests.from_pages.rolling import Held, Judged, Model, Settings, in_box, limited


class BallPlate(Model):
    """Hold a ball at a point of a table."""

    clip = staticmethod(in_box)
    SETTINGS: ClassVar[Settings] = {
        "m": 1.0,
        "radius": 1.0,
        "beta": 0.4,
        "g": 9.81,
        "turntable_rate": 0.0,
        "tilt_limit": 0.1,
        "tilt_rate": 0.4,
        "start_radius": 2.0,
        "start_speed": 0.5,
        "margin": 2.0,
        "tolerance": 0.05,
        "hold": 2.0,
        "weight_near": 1.0,
        "weight_effort": 0.1,
        "n_substeps": 2,
        "rotation": "none",
    }

    def draw(self, rng: np.random.Generator) -> dict[str, Any]:
        def in_disk(radius: float) -> Array:
            angle = rng.uniform(0.0, 2.0 * math.pi)
            far = radius * math.sqrt(rng.uniform())
            return far * np.array([math.cos(angle), math.sin(angle)])

        return {
            "q": draw(rng),
            "position": in_disk(self.s.start_radius),
            "velocity": in_disk(self.s.start_speed),
            "spin": 0.0,
            "tilt": [0.0, 0.0],
            "tilt_rate": [0.0, 0.0],
            "point": in_disk(self.s.start_radius),
        }

    def beside(self, aux: Array) -> dict[str, Any]:
        return {"point": aux[:2]}

    def place(self, point: Any, **state: Any) -> None:
        """Take a start; the point is beside the state."""
        names = ("q", "position", "velocity", "spin", "tilt", "tilt_rate")
        self.y = np.concatenate([np.atleast_1d(state[k]).astype(float) for k in names])
        self.point = np.array(point, dtype=float)
        self.ball = Ball(*(getattr(self.p, k) for k in Ball.__dataclass_fields__))
        self.held = Held(self.s.hold, self.s.dt)

    @property
    def q(self) -> Array:
        return self.y[:4]

    def offset(self) -> Array:
        """From the point to the ball [m]."""
        return np.asarray(self.y[4:6] - self.point)

    @property
    def rate(self) -> float:
        return float(np.linalg.norm(ball_rate(self.y, self.ball)))

    def features(self) -> Array:
        tilt = np.concatenate([self.y[9:11] / self.s.tilt_limit, self.y[11:] / self.s.tilt_rate])
        moving = limited([*self.offset(), *self.y[4:9]], 20.0)
        return np.array([*moving, *limited(tilt, 2.0)])

    def motor(self, action: Array) -> Array:
        """Accelerations of the angles: to a rate from which the table stops within its limit."""
        dt, limit, largest = self.s.dt, self.s.tilt_limit, self.s.tilt_rate
        angles, rates = self.y[9:11], self.y[11:]
        rest = angles + 0.5 * dt * rates
        wanted = np.clip(largest * action, (-limit - rest) / dt, (limit - rest) / dt)
        return np.asarray((limited(wanted, largest) - rates) / dt)

    def move(self, action: Array) -> Judged:
        self.y = moved(self.y, np.array([0.0, 0.0, *self.motor(action)]), self.ball, self.s.dt)
        distance = math.hypot(*self.offset())
        rate = math.hypot(*self.y[11:])
        terms = {
            "near": 1.0 / (1.0 + 5.0 * distance),
            "effort": -min(rate**2 / (2.0 * self.s.tilt_rate**2), 1.0),
        }
        success = self.held.after(distance < self.s.tolerance)
        off = math.hypot(*self.y[4:6]) > self.s.start_radius + self.s.margin
        return Judged(terms, self.s.dt * rate, success, off)

    def signs(self) -> Array:
        """Of X and Y."""
        dx, dy = self.offset()
        if self.p.turntable_rate != 0.0:
            dx = dy = dx + dy
        return np.array([-1.0 if d < 0.0 else 1.0 for d in (dx, dy)])

    def predicted(self) -> Array:
        """Offset after a while, near level and at constant tilt."""
        r, pull, half = self.p.radius, self.p.g / (1.0 + self.p.beta), 0.5 * self.s.dt
        time = 3.5 * math.sqrt(r / pull)
        near = self.offset() / max(math.hypot(*self.offset()), 1.0)
        (vx, vy), (ax, ay), (bx, by) = self.y[6:8], self.y[9:11], self.y[11:]
        pace = np.array([vx + r * by, vy - r * bx])
        fall = pull * np.array([ay + half * by, -ax - half * bx])
        return np.asarray(near + time * pace + 0.5 * time**2 * fall)

    def logarithm(self, d: Array) -> Array:
        """log(1 + |d| / tolerance) with the sign of d."""
        return np.asarray(np.sign(d) * np.log1p(np.minimum(np.abs(d), 20.0) / self.s.tolerance))

    def reduced(self) -> Array:
        sign = self.signs()
        offset, ahead = sign * self.offset(), sign * self.predicted()
        plain = self.features() * [*sign, *sign, *sign, sign.prod(), *sign[::-1], *sign[::-1]]
        return np.concatenate(
            [
                limited(offset, 20.0),
                self.logarithm(offset),
                plain[2:],
                limited(ahead, 20.0),
                self.logarithm(ahead),
            ]
        )

    def turn(self, action: Array) -> Array:
        return self.signs()[::-1] * action
