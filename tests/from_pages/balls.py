"""Balls that roll as they are told to a pose: `BallPark` and its relatives, `BallParkGoal`."""

import math
from typing import Any, ClassVar

import numpy as np

from rigid_envs.base.checks import Array
from tests.from_pages.attitudes import (
    angle,
    compose,
    draw,
    inverse,
    matrix,
    of_matrix,
    of_rotation_vector,
    rotation_vector,
)
from tests.from_pages.rolling import (
    Frame,
    Judged,
    Model,
    Settings,
    in_disk,
    limited,
    root,
    single,
    smooth,
)


def pose_terms(p: Array, theta: Array) -> dict[str, float]:
    """Reward terms of an offset [radii] and a rotation vector."""
    m = math.hypot(theta[0] + p[1], theta[1] - p[0])
    return {
        "position": -min(math.hypot(*p), 50.0),
        "twist": -math.sqrt(smooth(theta[2])),
        "mismatch": -np.cbrt(min(smooth(m), 50.0)),
        "angle": -float(np.linalg.norm(theta)),
    }


def pose_frame(p: Array, theta: Array) -> Frame:
    """Moving frame of an offset and a rotation vector."""
    x, y = p if math.hypot(*p) >= 1e-9 else (theta[1], -theta[0])
    far = math.hypot(x, y)
    side = -1.0 if theta[2] < 0.0 else 1.0
    return Frame(x / far, y / far, side) if far >= 1e-9 else Frame(side=side)


def pose_features(frame: Frame, p: Array, theta: Array) -> Array:
    """Reduced features of an offset [radii] and a rotation vector."""
    r = min(frame.seen(*p)[0], 50.0)
    x, y, z = frame.axial(theta)
    turn = float(np.linalg.norm(theta))
    roots = (root(x), root(y - r))
    return np.array([r, x, y, z, math.sqrt(abs(z)), math.cos(turn), math.sin(turn), *roots])


class RolledBall(Model):
    """A ball whose velocity is the action."""

    clip = staticmethod(in_disk)
    SETTINGS: ClassVar[Settings] = {"radius": 1.0, "roll_per_step": math.pi / 8}

    def place(self, q: Any, position: Any) -> None:
        self.q, self.position = np.array(q, dtype=float), np.array(position, dtype=float)

    def features(self) -> Array:
        return np.asarray(limited(self.position / self.p.radius, 50.0))

    def roll(self, action: Array) -> float:
        """Roll for one control period; the distance."""
        rolled = self.s.roll_per_step * action  # radii
        self.q = compose(of_rotation_vector([-rolled[1], rolled[0], 0.0]), self.q)
        self.position = self.position + self.p.radius * rolled
        return float(self.p.radius * math.hypot(*rolled))


class BallPark(RolledBall):
    """Park a ball at the origin."""

    SETTINGS: ClassVar[Settings] = {
        **RolledBall.SETTINGS,
        "start_half_width": 2.0,
        "position_tolerance": 0.1,
        "angle_tolerance": 0.15,
        "weight_position": 0.01,
        "weight_twist": 0.02,
        "weight_mismatch": 0.02,
        "weight_angle": 0.0,
        "weight_parked": 10.0,
    }

    def draw(self, rng: np.random.Generator) -> dict[str, Any]:
        half = self.s.start_half_width
        return {"q": draw(rng), "position": rng.uniform(-half, half, 2)}

    def move(self, action: Array) -> Judged:
        cost = self.roll(action)
        terms = pose_terms(self.position / self.p.radius, rotation_vector(self.q))
        near = math.hypot(*self.position) <= self.s.position_tolerance
        parked = near and angle(self.q) <= self.s.angle_tolerance
        return Judged({**terms, "parked": float(parked)}, cost, parked, parked)

    def reduced(self) -> Array:
        p, theta = self.position / self.p.radius, rotation_vector(self.q)
        return pose_features(pose_frame(p, theta), p, theta)

    def turn(self, action: Array) -> Array:
        return pose_frame(self.position, rotation_vector(self.q)).back(action)


class BallParkRandom(BallPark):
    """With a drawn radius."""

    SETTINGS: ClassVar[Settings] = {**BallPark.SETTINGS, "radius": (0.5, 2.0)}


class BallReorient(BallPark):
    """From the origin."""

    SETTINGS: ClassVar[Settings] = {**BallPark.SETTINGS, "start_half_width": 0.0}


class BallParkGoal(RolledBall):
    """Park a ball at a drawn pose."""

    SETTINGS: ClassVar[Settings] = {
        **RolledBall.SETTINGS,
        "start_half_width": 2.0,
        "position_tolerance": 0.1,
        "angle_tolerance": 0.15,
        "weight_reached": 1.0,
        "weight_distance": 0.0,
    }

    def draw(self, rng: np.random.Generator) -> dict[str, Any]:
        half = self.s.start_half_width
        there = {"q": draw(rng), "position": rng.uniform(-half, half, 2)}
        return {**there, "goal": self.goal(draw(rng), rng.uniform(-half, half, 2))}

    def beside(self, aux: Array) -> dict[str, Any]:
        return {"goal": self.goal(aux[:4], aux[4:6])}

    def place(self, q: Any, position: Any, goal: Any = None) -> None:
        """Take a start; the goal is an observed one."""
        super().place(q, position)
        self.desired = self.goal(q, position) if goal is None else np.asarray(goal, dtype=float)

    @staticmethod
    def goal(q: Any, position: Any) -> Array:
        """A pose as it is observed, in float32."""
        return single([*limited(position, 50.0), *matrix(q).ravel()])

    def observe(self) -> dict[str, Any]:
        own = super().observe()
        achieved = np.array([*limited(self.position, 50.0), *matrix(self.q).ravel()])
        return {"observation": own, "achieved_goal": achieved, "desired_goal": self.desired}

    def judge(self, achieved: Array, desired: Array) -> dict[str, float]:
        """Reward terms of two observed goals."""
        offset = achieved[:2] - desired[:2]
        turned = achieved[2:].reshape(3, 3) @ desired[2:].reshape(3, 3).T
        near = float(offset @ offset) <= self.s.position_tolerance**2
        largest = min(self.s.angle_tolerance, math.pi)
        reached = near and np.trace(turned) >= 1.0 + 2.0 * math.cos(largest)
        radius = float(np.mean(self.s.radius))  # the middle of a range
        terms = pose_terms(offset / radius, rotation_vector(of_matrix(turned)))
        distance = terms["position"] + terms["twist"] + terms["mismatch"]
        return {"reached": 0.0 if reached else -1.0, "distance": 0.0 if reached else distance}

    def move(self, action: Array) -> Judged:
        cost = self.roll(action)
        terms = self.judge(self.goal(self.q, self.position), self.desired)
        return Judged(terms, cost, terms["reached"] == 0.0, False)

    def from_goal(self) -> tuple[Array, Array]:
        """Offset [m] and rotation vector from the goal, which is known as observed."""
        turned = compose(self.q, inverse(of_matrix(self.desired[2:].reshape(3, 3))))
        return self.position - self.desired[:2], rotation_vector(turned)

    def reduced(self) -> Array:
        p, theta = self.from_goal()
        p = p / self.p.radius
        return pose_features(pose_frame(p, theta), p, theta)

    def turn(self, action: Array) -> Array:
        p, theta = self.from_goal()
        inside = 1.0 - 1e-6
        near = math.hypot(*p) <= inside * self.s.position_tolerance
        if near and float(np.linalg.norm(theta)) <= inside * self.s.angle_tolerance:
            return np.zeros(2)
        return pose_frame(p, theta).back(action)
