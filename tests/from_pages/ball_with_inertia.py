"""`BallParkDynamic`: a ball that a force drives to a pose, where it is to rest."""

import math
from typing import Any, ClassVar

import numpy as np

from rigid_envs.base.checks import Array
from tests.from_pages.attitudes import angle, compose, draw, of_rotation_vector, rotation_vector
from tests.from_pages.balls import pose_features, pose_frame, pose_terms
from tests.from_pages.pushed_ball import Ball, ball_rate, moved
from tests.from_pages.rolling import Frame, Judged, Model, Settings, in_disk, limited


class BallParkDynamic(Model):
    """Park a ball that has inertia."""

    clip = staticmethod(in_disk)
    SETTINGS: ClassVar[Settings] = {
        "m": 1.0,
        "radius": 1.0,
        "beta": 0.4,
        "g": 9.81,
        "turntable_rate": 0.0,
        "force": 4.0,
        "dt": 0.2,
        "n_substeps": 6,
        "start_half_width": 2.0,
        "margin": 7.0,
        "position_tolerance": 0.1,
        "angle_tolerance": 0.15,
        "speed_tolerance": 0.05,
        "weight_position": 0.01,
        "weight_twist": 0.02,
        "weight_mismatch": 0.02,
        "weight_angle": 0.0,
        "weight_parked": 10.0,
        "weight_off": 20.0,
    }

    def draw(self, rng: np.random.Generator) -> dict[str, Any]:
        half = self.s.start_half_width
        return {"q": draw(rng), "position": rng.uniform(-half, half, 2), "velocity": [0.0, 0.0]}

    def place(self, q: Any, position: Any, velocity: Any, spin: float = 0.0) -> None:
        self.y = np.array([*q, *position, *velocity, spin, 0.0, 0.0, 0.0, 0.0], dtype=float)
        self.ball = Ball(*(getattr(self.p, k) for k in Ball.__dataclass_fields__))

    @property
    def q(self) -> Array:
        return self.y[:4]

    @property
    def position(self) -> Array:
        """Position [m]."""
        return self.y[4:6]

    @property
    def velocity(self) -> Array:
        """Velocity [m/s]."""
        return self.y[6:8]

    @property
    def rate(self) -> float:
        return float(np.linalg.norm(ball_rate(self.y, self.ball)))

    def features(self) -> Array:
        return np.asarray(limited(self.y[4:8] / self.p.radius, 50.0))

    def move(self, action: Array) -> Judged:
        force = self.s.force * action
        self.y = moved(self.y, np.array([*force, 0.0, 0.0]), self.ball, self.s.dt)
        distance = math.hypot(*self.position)
        there = distance <= self.s.position_tolerance and angle(self.q) <= self.s.angle_tolerance
        parked = bool(there and math.hypot(*self.velocity) <= self.s.speed_tolerance)
        off = bool(distance > math.sqrt(2.0) * self.s.start_half_width + self.s.margin)
        terms = pose_terms(self.position / self.p.radius, rotation_vector(self.q))
        ends = {"parked": float(parked), "off": -float(off)}
        cost = self.s.dt * math.hypot(*force)
        return Judged({**terms, **ends}, cost, parked, parked or off)

    def stopped(self) -> tuple[Array, Array]:
        """Offset [radii] and rotation vector after braking by the largest force."""
        middle_m, middle_beta = np.mean(self.s.m), np.mean(self.s.beta)
        deceleration = self.s.force / (middle_m * (1.0 + middle_beta))
        v = self.velocity / self.p.radius
        way = v * math.hypot(*self.velocity) / (2.0 * deceleration)
        rolled = of_rotation_vector([-way[1], way[0], 0.0])
        return self.position / self.p.radius + way, rotation_vector(compose(rolled, self.q))

    def frame(self) -> Frame:
        """Of the pose after braking; not mirrored on a turntable."""
        frame = pose_frame(*self.stopped())
        mirrored = self.p.turntable_rate == 0.0
        return frame if mirrored else Frame(frame.cosine, frame.sine)

    def reduced(self) -> Array:
        frame = self.frame()
        pose = pose_features(frame, *self.stopped())
        place = frame.seen(*self.position / self.p.radius)
        pace = frame.seen(*self.velocity / self.p.radius)
        return np.array([*pose, *limited([*place, *pace, math.hypot(*pace)], 50.0)])

    def turn(self, action: Array) -> Array:
        return self.frame().back(action)
