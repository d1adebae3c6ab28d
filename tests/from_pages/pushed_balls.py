"""Balls that a force or a tilting plate drives: their motion by the laws of Newton and Euler.

In plate axes, n the third. The centre is at ``s = (X, Y, radius)``; with the rate w of the plate
and the velocity V in it, its acceleration is ``V' + 2 w x V + w' x s + w x (w x s)``. The contact
force C of Newton's law goes into Euler's law, and rolling gives omega from V: two linear equations
for V' remain.
"""

import math

import numpy as np

from tests.from_pages import model
from tests.from_pages.attitudes import angle, compose, draw, of_rotation_vector, rotation_vector
from tests.from_pages.balls import pose_features, pose_frame, pose_terms
from tests.from_pages.model import Frame, Held, Judged, Turning, in_disk, limited
from tests.vectors import cross


def plate_axes(alpha_x, alpha_y):
    """Axes of the plate in the world, Rx(alpha_x) Ry(alpha_y)."""
    a, b, c, d = math.cos(alpha_x), math.sin(alpha_x), math.cos(alpha_y), math.sin(alpha_y)
    return np.array([[1.0, 0, 0], [0, a, -b], [0, b, a]]) @ [[c, 0, d], [0, 1.0, 0], [-d, 0, c]]


def ball_rate(y, ball):
    """Angular velocity of the ball in plate axes, from rolling.

    ``V = (omega - w) x radius n + turn n x (X, Y)`` with the rate w of the plate.
    """
    X, Y, VX, VY, spin, _, alpha_y, rate_x, rate_y = y[4:]
    r, turn = ball.radius, ball.turntable_rate
    w_x, w_y = rate_x * math.cos(alpha_y), rate_y
    return np.array([w_x - (VY - turn * X) / r, w_y + (VX + turn * Y) / r, spin])


def rate_of_change(y, u, ball):
    """y' of the state y and the input u = (FX, FY, a_x, a_y)."""
    X, Y, VX, VY, _, alpha_x, alpha_y, rate_x, rate_y = y[4:]
    r, turn = ball.radius, ball.turntable_rate
    P = plate_axes(alpha_x, alpha_y)
    c, s = math.cos(alpha_y), math.sin(alpha_y)
    w = np.array([rate_x * c, rate_y, rate_x * s])
    dw = np.array([u[2] * c - rate_x * rate_y * s, u[3], u[2] * s + rate_x * rate_y * c])
    omega = ball_rate(y, ball)
    V, place = np.array([VX, VY, 0.0]), np.array([X, Y, r])
    # the acceleration without V', less gravity
    A = 2 * cross(w, V) + cross(dw, place) + cross(w, cross(w, place)) + ball.g * P[2]
    transport = cross(w, omega)
    push_x = u[0] / ball.m - A[0] - ball.beta * (r * dw[1] + turn * VY + r * transport[1])
    push_y = u[1] / ball.m - A[1] + ball.beta * (r * dw[0] + turn * VX + r * transport[0])
    dq = 0.5 * compose([0.0, *(P @ omega)], y[:4])
    dV = np.array([push_x, push_y]) / (1.0 + ball.beta)
    return np.array([*dq, VX, VY, *dV, -transport[2], rate_x, rate_y, u[2], u[3]])


def moved(y, u, ball, dt):
    """The state after the input was held for a time."""
    return model.moved(lambda y: rate_of_change(y, u, ball), y, dt)


class PushedBall(Turning):
    """A ball that rolls on a plate: its parameters are among the arguments."""

    @property
    def rate(self):
        return float(np.linalg.norm(ball_rate(self.y, self.p)))


class BallParkDynamic(PushedBall):
    """Park a ball that has inertia."""

    clip = staticmethod(in_disk)

    def draw(self, rng, params):
        half = self.s.start_half_width
        return {"q": draw(rng), "position": rng.uniform(-half, half, 2), "velocity": [0.0, 0.0]}

    def place(self, q, position, velocity, spin=0.0):
        self.y = np.array([*q, *position, *velocity, spin, 0.0, 0.0, 0.0, 0.0], dtype=float)

    @property
    def position(self):
        """Position [m]."""
        return self.y[4:6]

    @property
    def velocity(self):
        """Velocity [m/s]."""
        return self.y[6:8]

    def features(self):
        return np.asarray(limited(self.y[4:8] / self.p.radius, 50.0))

    def move(self, action):
        force = self.s.force * action
        self.y = moved(self.y, np.array([*force, 0.0, 0.0]), self.p, self.s.dt)
        distance = math.hypot(*self.position)
        there = distance <= self.s.position_tolerance and angle(self.q) <= self.s.angle_tolerance
        parked = bool(there and math.hypot(*self.velocity) <= self.s.speed_tolerance)
        off = bool(distance > math.sqrt(2.0) * self.s.start_half_width + self.s.margin)
        terms = pose_terms(self.position / self.p.radius, rotation_vector(self.q))
        ends = {"parked": float(parked), "off": -float(off)}
        cost = self.s.dt * math.hypot(*force)
        return Judged({**terms, **ends}, cost, parked, parked or off)

    def stopped(self):
        """Offset [radii] and rotation vector after braking by the largest force."""
        middle_m, middle_beta = np.mean(self.s.m), np.mean(self.s.beta)
        deceleration = self.s.force / (middle_m * (1.0 + middle_beta))
        v = self.velocity / self.p.radius
        way = v * math.hypot(*self.velocity) / (2.0 * deceleration)
        rolled = of_rotation_vector([-way[1], way[0], 0.0])
        return self.position / self.p.radius + way, rotation_vector(compose(rolled, self.q))

    def frame(self):
        """Of the pose after braking; not mirrored on a turntable."""
        frame = pose_frame(*self.stopped())
        mirrored = self.p.turntable_rate == 0.0
        return frame if mirrored else Frame(frame.cosine, frame.sine)

    def reduced(self):
        frame = self.frame()
        pose = pose_features(frame, *self.stopped())
        place = frame.seen(*self.position / self.p.radius)
        pace = frame.seen(*self.velocity / self.p.radius)
        return np.array([*pose, *limited([*place, *pace, math.hypot(*pace)], 50.0)])

    def turn(self, action):
        return self.frame().back(action)


class BallPlate(PushedBall):
    """Hold a ball at a point of a table."""

    def draw(self, rng, params):
        def in_disk(radius):
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

    def beside(self, aux):
        return {"point": aux[:2]}

    def place(self, point, **state):
        """Take a start; the point is beside the state."""
        names = ("q", "position", "velocity", "spin", "tilt", "tilt_rate")
        self.y = np.concatenate([np.atleast_1d(state[k]).astype(float) for k in names])
        self.point = np.array(point, dtype=float)
        self.held = Held(self.s.hold, self.s.dt)

    def offset(self):
        """From the point to the ball [m]."""
        return np.asarray(self.y[4:6] - self.point)

    def features(self):
        tilt = np.concatenate([self.y[9:11] / self.s.tilt_limit, self.y[11:] / self.s.tilt_rate])
        moving = limited([*self.offset(), *self.y[4:9]], 20.0)
        return np.array([*moving, *limited(tilt, 2.0)])

    def motor(self, action):
        """Accelerations of the angles: to a rate from which the table stops within its limit."""
        dt, limit, largest = self.s.dt, self.s.tilt_limit, self.s.tilt_rate
        angles, rates = self.y[9:11], self.y[11:]
        rest = angles + 0.5 * dt * rates
        wanted = np.clip(largest * action, (-limit - rest) / dt, (limit - rest) / dt)
        return np.asarray((limited(wanted, largest) - rates) / dt)

    def move(self, action):
        self.y = moved(self.y, np.array([0.0, 0.0, *self.motor(action)]), self.p, self.s.dt)
        distance = math.hypot(*self.offset())
        rate = math.hypot(*self.y[11:])
        terms = {
            "near": 1.0 / (1.0 + 5.0 * distance),
            "effort": -min(rate**2 / (2.0 * self.s.tilt_rate**2), 1.0),
        }
        success = self.held.after(distance < self.s.tolerance)
        off = math.hypot(*self.y[4:6]) > self.s.start_radius + self.s.margin
        return Judged(terms, self.s.dt * rate, success, off)

    def signs(self):
        """Of X and Y."""
        dx, dy = self.offset()
        if self.p.turntable_rate != 0.0:
            dx = dy = dx + dy
        return np.array([-1.0 if d < 0.0 else 1.0 for d in (dx, dy)])

    def predicted(self):
        """Offset after a while, near level and at constant tilt."""
        r, pull, half = self.p.radius, self.p.g / (1.0 + self.p.beta), 0.5 * self.s.dt
        time = 3.5 * math.sqrt(r / pull)
        near = self.offset() / max(math.hypot(*self.offset()), 1.0)
        (vx, vy), (ax, ay), (bx, by) = self.y[6:8], self.y[9:11], self.y[11:]
        pace = np.array([vx + r * by, vy - r * bx])
        fall = pull * np.array([ay + half * by, -ax - half * bx])
        return np.asarray(near + time * pace + 0.5 * time**2 * fall)

    def logarithm(self, d):
        """log(1 + |d| / tolerance) with the sign of d."""
        return np.asarray(np.sign(d) * np.log1p(np.minimum(np.abs(d), 20.0) / self.s.tolerance))

    def reduced(self):
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

    def turn(self, action):
        return self.signs()[::-1] * action
