"""Balls that roll as they are told: to a pose, on a grid, and along a path."""

import itertools
import math

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

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
from tests.from_pages.model import Frame, Judged, Model, in_disk, limited, root, single, smooth


def pose_terms(p, theta):
    """Reward terms of an offset [radii] and a rotation vector."""
    m = math.hypot(theta[0] + p[1], theta[1] - p[0])
    return {
        "position": -min(math.hypot(*p), 50.0),
        "twist": -math.sqrt(smooth(theta[2])),
        "mismatch": -np.cbrt(min(smooth(m), 50.0)),
        "angle": -float(np.linalg.norm(theta)),
    }


def pose_frame(p, theta):
    """Moving frame of an offset and a rotation vector."""
    x, y = p if math.hypot(*p) >= 1e-9 else (theta[1], -theta[0])
    far = math.hypot(x, y)
    side = -1.0 if theta[2] < 0.0 else 1.0
    return Frame(x / far, y / far, side) if far >= 1e-9 else Frame(side=side)


def pose_features(frame, p, theta):
    """Reduced features of an offset [radii] and a rotation vector."""
    r = min(frame.seen(*p)[0], 50.0)
    x, y, z = frame.axial(theta)
    turn = float(np.linalg.norm(theta))
    roots = (root(x), root(y - r))
    return np.array([r, x, y, z, math.sqrt(abs(z)), math.cos(turn), math.sin(turn), *roots])


class RolledBall(Model):
    """A ball whose velocity is the action."""

    clip = staticmethod(in_disk)

    def place(self, q, position):
        self.q, self.position = np.array(q, dtype=float), np.array(position, dtype=float)

    def features(self):
        return np.asarray(limited(self.position / self.p.radius, 50.0))

    def roll(self, action):
        """Roll for one control period; the distance."""
        rolled = self.s.roll_per_step * action  # radii
        self.q = compose(of_rotation_vector([-rolled[1], rolled[0], 0.0]), self.q)
        self.position = self.position + self.p.radius * rolled
        return float(self.p.radius * math.hypot(*rolled))


class BallPark(RolledBall):
    """Park a ball at the origin."""

    def draw(self, rng, params):
        half = self.s.start_half_width
        return {"q": draw(rng), "position": rng.uniform(-half, half, 2)}

    def move(self, action):
        cost = self.roll(action)
        terms = pose_terms(self.position / self.p.radius, rotation_vector(self.q))
        near = math.hypot(*self.position) <= self.s.position_tolerance
        parked = near and angle(self.q) <= self.s.angle_tolerance
        return Judged({**terms, "parked": float(parked)}, cost, parked, parked)

    def reduced(self):
        p, theta = self.position / self.p.radius, rotation_vector(self.q)
        return pose_features(pose_frame(p, theta), p, theta)

    def turn(self, action):
        return pose_frame(self.position, rotation_vector(self.q)).back(action)


class BallParkRandom(BallPark):
    """With a drawn radius."""


class BallReorient(BallPark):
    """From the origin."""


class BallParkGoal(RolledBall):
    """Park a ball at a drawn pose."""

    def draw(self, rng, params):
        half = self.s.start_half_width
        there = {"q": draw(rng), "position": rng.uniform(-half, half, 2)}
        return {**there, "goal": self.goal(draw(rng), rng.uniform(-half, half, 2))}

    def beside(self, aux):
        return {"goal": self.goal(aux[:4], aux[4:6])}

    def place(self, q, position, goal=None):
        """Take a start; the goal is an observed one."""
        super().place(q, position)
        self.desired = self.goal(q, position) if goal is None else np.asarray(goal, dtype=float)

    @staticmethod
    def goal(q, position):
        """A pose as it is observed, in float32."""
        return single([*limited(position, 50.0), *matrix(q).ravel()])

    def observe(self):
        own = super().observe()
        achieved = np.array([*limited(self.position, 50.0), *matrix(self.q).ravel()])
        return {"observation": own, "achieved_goal": achieved, "desired_goal": self.desired}

    def judge(self, achieved, desired):
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

    def move(self, action):
        cost = self.roll(action)
        terms = self.judge(self.goal(self.q, self.position), self.desired)
        return Judged(terms, cost, terms["reached"] == 0.0, False)

    def from_goal(self):
        """Offset [m] and rotation vector from the goal, which is known as observed."""
        turned = compose(self.q, inverse(of_matrix(self.desired[2:].reshape(3, 3))))
        return self.position - self.desired[:2], rotation_vector(turned)

    def reduced(self):
        p, theta = self.from_goal()
        p = p / self.p.radius
        return pose_features(pose_frame(p, theta), p, theta)

    def turn(self, action):
        p, theta = self.from_goal()
        inside = 1.0 - 1e-6
        near = math.hypot(*p) <= inside * self.s.position_tolerance
        if near and float(np.linalg.norm(theta)) <= inside * self.s.angle_tolerance:
            return np.zeros(2)
        return pose_frame(p, theta).back(action)


SIDES = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
QUARTER = math.pi / 2
# of R, as they decide between images: row and column of R12, R11, R22, R13, R31, R23, R32, R21
ORDER = ((0, 1), (0, 0), (1, 1), (0, 2), (2, 0), (1, 2), (2, 1), (1, 0))
IMAGES = [
    np.diag([a, b])[::order] for a, b, order in itertools.product((1, -1), (1, -1), (1, -1))
]  # the eight symmetries of the square


def as_choice(action):
    """The choice itself: any other is refused."""
    return action, False


def quarter(side):
    """The rotation of a quarter roll."""
    x, y = SIDES[side]
    return of_rotation_vector([-QUARTER * y, QUARTER * x, 0.0])


def by_parity():
    """Attitudes that an even, and that an odd number of quarter rolls leads to."""
    found = ([np.array([1.0, 0.0, 0.0, 0.0])], [])
    for parity in (0, 1, 0, 1, 0, 1):
        for q, side in itertools.product(found[parity], range(4)):
            new = compose(quarter(side), q)
            if all(abs(new @ known) < 0.9 for known in found[1 - parity]):
                found[1 - parity].append(new)
    return found


class BallGrid(RolledBall):
    """Bring a ball home by quarter rolls."""

    clip = staticmethod(as_choice)
    SOLVABLE = by_parity()

    n_action = 1

    def draw(self, rng, params):
        cell = rng.integers(-self.s.start_cells, self.s.start_cells, 2, endpoint=True)
        attitudes = self.SOLVABLE[int(cell.sum()) % 2]
        return {
            "q": attitudes[rng.integers(12)],
            "position": QUARTER * cell * np.mean(self.s.radius),
        }

    def step(self, action):
        return super().step([action])

    def cell(self):
        """Position in cells."""
        return self.position / (QUARTER * self.p.radius)

    def features(self):
        return np.clip(self.cell(), -100.0, 100.0)

    def move(self, action):
        side = int(action[0])
        self.q = compose(quarter(side), self.q)
        self.position = self.position + QUARTER * self.p.radius * SIDES[side]
        near = math.hypot(*self.position) < 0.5 * self.p.radius
        home = bool(near and self.q[0] ** 2 > 0.95)
        cost = QUARTER * self.p.radius
        return Judged({"moves": -1.0, "home": float(home)}, cost, home, home)

    def image(self):
        """Cell and R of the image that is observed, and its symmetry of the plane."""
        found = []
        for S in IMAGES:
            space = np.eye(3)
            space[:2, :2] = S
            cell = np.round(S @ self.cell())
            R = np.round(space @ matrix(self.q) @ space.T)
            found.append(((*cell, *(R[k] for k in ORDER)), cell, R, S))
        return max(found, key=lambda image: image[0])

    def reduced(self):
        _, cell, R, _ = self.image()
        return np.array([*cell, *R.ravel()])

    def turn(self, action):
        *_, S = self.image()
        (side,) = np.flatnonzero((SIDES == S.T @ SIDES[int(action[0])]).all(axis=1))
        return np.array([float(side)])


EIGHT = brentq(lambda k: ellipk(k**2) - 2.0 * ellipe(k**2), 0.5, 0.99, xtol=1e-15)
"""Modulus of the closed elastica."""
SHARES = {"eight": 1.0, "both": 0.5, "elastica": 0.0}


def cross(a, b):
    """Vertical component of the product of two horizontal vectors."""
    return float(a[0] * b[1] - a[1] * b[0])


class BallSteer(RolledBall):
    """Follow a reference ball."""

    def draw(self, rng, params):
        radius, w = np.mean(self.s.radius), self.s.wavenumber / np.mean(self.s.radius)
        heading, away = rng.uniform(0.0, 2.0 * math.pi, 2)
        eight = rng.uniform() < SHARES[self.s.path]
        modulus = EIGHT if eight else rng.uniform(0.6, 1.2)
        far = radius * self.s.start_offset * math.sqrt(rng.uniform())
        axis = rng.normal(size=3)
        theta = self.s.start_angle * np.cbrt(rng.uniform()) * axis / np.linalg.norm(axis)
        ahead = np.array([math.cos(heading), math.sin(heading)])
        return {
            "q": of_rotation_vector(theta),
            "position": far * np.array([math.cos(away), math.sin(away)]),
            "aux": [
                *(1.0, 0.0, 0.0, 0.0, 0.0, 0.0),
                *ahead,
                rng.choice([-2.0, 2.0]) * modulus * w,
                *(w * w * ahead),
                *(0.0, 0.0),
            ],
        }

    def beside(self, aux):
        return {"aux": aux}

    def place(self, q, position, aux):
        """Take a start; `aux` is what the task keeps beside the state."""
        super().place(q, position)
        aux = np.array(aux, dtype=float)
        self.reference_q, self.reference_position = aux[:4], aux[4:6]
        self.heading, self.curvature, self.force = aux[6:8], float(aux[8]), aux[9:11]
        self.errors = []

    def leading(self):
        """Action of the reference."""
        return single(self.s.reference_speed * self.heading)

    def offset(self):
        """Offset in radii, and rotation vector, from the reference."""
        p = (self.position - self.reference_position) / self.p.radius
        return p, rotation_vector(compose(self.q, inverse(self.reference_q)))

    def bend(self):
        """The heading and the curvature of the next side of the reference's polygon."""
        side = self.s.roll_per_step * self.s.reference_speed * self.p.radius
        self.curvature += 0.5 * side * cross(self.heading, self.force)
        c, s = math.cos(side * self.curvature), math.sin(side * self.curvature)
        self.heading = np.array([[c, -s], [s, c]]) @ self.heading
        self.curvature += 0.5 * side * cross(self.heading, self.force)

    def features(self):
        p, theta = self.offset()
        bent = self.p.radius * self.curvature
        shape = [bent, *(self.p.radius**2 * self.force)]
        return np.array([*limited(p, 50.0), *theta, *self.leading(), *limited(shape, 5.0)])

    def frame(self):
        """Along the heading, y on the side to which the path bends."""
        return Frame(*self.heading, -1.0 if self.curvature < 0.0 else 1.0)

    def reduced(self):
        frame = self.frame()
        p, theta = self.offset()
        shape = [self.p.radius * abs(self.curvature), *frame.seen(*self.p.radius**2 * self.force)]
        return np.array([*limited(frame.seen(*p), 50.0), *frame.axial(theta), *limited(shape, 5.0)])

    def turn(self, action):
        return self.frame().back(action)

    def move(self, action):
        rolled = self.s.roll_per_step * self.leading()
        turned = of_rotation_vector([-rolled[1], rolled[0], 0.0])
        self.reference_q = compose(turned, self.reference_q)
        self.reference_position = self.reference_position + self.p.radius * rolled
        self.bend()
        cost = self.roll(action)
        p, theta = self.offset()
        error = math.sqrt(p @ p + theta @ theta)
        self.errors.append(error)
        success = float(np.mean(self.errors)) <= self.s.bound
        return Judged({"close": 1.0 / (1.0 + 5.0 * error)}, cost, success, False)
