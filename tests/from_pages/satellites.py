"""The satellites with reaction wheels, written again from their pages alone."""

import numpy as np

from tests.from_pages import attitudes
from tests.from_pages.bodies import FreeBody, Reorient
from tests.from_pages.model import in_ball, near, uniform
from tests.vectors import cross


class Satellite(FreeBody):
    """What the pages of the satellites have in common."""

    physical = ("I1", "I2", "I3", "J1", "J2", "J3")

    @property
    def wheels(self):
        """Moments of the wheels."""
        return np.array([*(self.parameters[name] for name in self.physical[3:]), 0.0, 0.0])[:3]

    @property
    def rate(self):
        """The largest of |omega|, |L| / A2 and |omega - L / A2|."""
        sphere = self.momentum(self.y) / (self.moments - self.wheels)[1]
        return max(map(np.linalg.norm, (self.omega, sphere, self.omega - sphere)))

    def components(self, y):
        """The parts of a state, by name."""
        return dict(zip(("q", "omega_body", "wheel_rates"), np.split(y, [4, 7]), strict=True))

    def stored(self, y):
        """Spin momenta l of the wheels."""
        return self.wheels * (y[4:7] + y[7:])

    def momentum(self, y):
        """L in the carrier."""
        return self.moments * y[4:7] + self.wheels * y[7:]

    def input_of(self, action):
        """Torques of the motors, of wheels that have a capacity."""
        u = self.torque * np.array([*action, 0.0, 0.0])[:3]
        room = (np.array([[-1.0], [1.0]]) * self.capacity - self.stored(self.y)) / self.dt
        return np.clip(u, np.minimum(room[0], 0.0), np.maximum(room[1], 0.0))

    def rhs(self, y, u):
        """`L' = L x omega`, `l' = u`."""
        spun = (cross(self.momentum(y), y[4:7]) - u) / (self.moments - self.wheels)
        there = self.wheels > 0.0
        wheels = np.where(there, u / np.where(there, self.wheels, 1.0) - spun, 0.0)
        return np.concatenate([attitudes.quaternion_rate(y[:4], y[4:7]), spun, wheels])

    def draw_state(self, rng):
        """The carrier, and its wheels."""
        return np.concatenate([super().draw_state(rng), self.draw_wheels(rng)])

    def draw_omega(self, rng):
        """At rest."""
        return np.zeros(3)

    def draw_wheels(self, rng):
        """Spin momenta uniform in a ball."""
        return in_ball(rng, self.bias) / self.wheels


class WheelReorient(Satellite, Reorient):
    """docs/environments/WheelReorient.md; beside the state: the attitude of the goal."""

    def poses(self):
        """Achieved and desired goal, as observed."""
        rates = np.clip(self.omega, -20.0, 20.0)
        achieved = [*attitudes.matrix(self.y[:4]).ravel(), *rates]
        desired = [*attitudes.matrix(self.aux).ravel(), 0.0, 0.0, 0.0]
        return np.array(achieved, dtype=np.float32), np.array(desired, dtype=np.float32)

    def shares(self):
        """Spin momenta over the capacity, limited."""
        return np.clip(self.stored(self.y) / self.capacity, -2.0, 2.0)

    def features(self):
        """Angular velocity and spin momenta."""
        return np.concatenate([np.clip(self.omega, -20.0, 20.0), self.shares()])

    def seen(self):
        """What both reduced frames have: theta, I omega / capacity, spare, shares, signs."""
        theta, spare, S = self.turn_left()
        carried = np.clip(self.middle_moments * self.omega / self.capacity, -2.0, 2.0)
        close = [
            near(float(np.linalg.norm(theta)), min(self.angle_tolerance, np.pi)),
            near(float(np.linalg.norm(self.omega)), self.rate_tolerance),
        ]
        return S * theta, S * carried, S * np.clip(spare, -10.0, 10.0), close, S

    def reduced(self):
        """Section *Reduced Frame*."""
        theta, carried, spare, close, S = self.seen()
        gyro = cross(self.momentum(self.y), self.omega) / self.torque
        return [*theta, *carried, *(S * self.shares()), *spare, *np.clip(S * gyro, -10, 10), *close]


class TwoWheels(WheelReorient):
    """docs/environments/TwoWheels.md; beside the state: the attitude of the goal."""

    physical = ("I1", "I2", "I3", "J1", "J2")
    n_action = 2

    def features(self):
        """Without the wheel that is not there."""
        return super().features()[:5]

    def reduced(self):
        """Section *Reduced Frame*."""
        theta, carried, spare, close, _ = self.seen()
        return [*theta, *carried[:2], *spare[:2], *close]

    def turn(self, action):
        """By half turns."""
        return self.turn_left()[2][:2] * action

    def draw_wheels(self, rng):
        """At rest."""
        return np.zeros(3)


class DualSpin(Satellite):
    """docs/environments/DualSpin.md; beside the state: nothing."""

    physical = ("I1", "I2", "I3", "J1")
    n_action = 1

    def direction(self):
        """|L|, and n = L / |L| in the carrier."""
        L = self.momentum(self.y)
        size = float(np.linalg.norm(L))
        return size, L / size

    def latitude(self):
        """s of the section *Rewards*, without a sign."""
        _, n = self.direction()
        return float(np.log((1 + abs(n[0])) / np.sqrt(max(n[1] ** 2 + n[2] ** 2, 1e-18))))

    def goal(self, A2):
        """The latitude at which `turning` ends."""
        return max(float(np.log(2 * self.direction()[0] / (A2 * self.rate_tolerance))), 1.0)

    def features(self):
        """Angular velocity, direction of L, spin momentum over |L|."""
        size, n = self.direction()
        stored = np.clip(self.stored(self.y)[0] / size, -2.0, 2.0)
        return np.concatenate([np.clip(self.omega, -20.0, 20.0), n, [stored]])

    def success(self):
        """Section *Episode End*."""
        return bool(np.linalg.norm(self.omega) <= self.rate_tolerance)

    ended = success

    def cost(self, u):
        """Time."""
        return self.dt

    def values(self, u):
        """Section *Rewards*."""
        carrier, size = self.moments - self.wheels, self.direction()[0]
        return {
            "cone": min(self.latitude() / self.goal(carrier[1]), 1.0) - 1.0,
            "turning": -min(carrier[0] * abs(self.omega[0]) / size, 1.0),
            "rest": float(self.success()),
        }

    def angles(self):
        """s with its sign, cos 2 phi, sin 2 phi and the sign S of *Reduced Frame*."""
        size, n = self.direction()
        across = max(n[1] ** 2 + n[2] ** 2, 1e-18)
        s = self.latitude() * (-1.0 if n[0] < 0 else 1.0)
        c2, s2 = (n[1] ** 2 - n[2] ** 2) / across, 2 * n[1] * n[2] / across
        S = -1.0 if 10 * self.stored(self.y)[0] / size + s - s2 < 0 else 1.0
        return s, c2, s2, S

    def reduced(self):
        """Section *Reduced Frame*."""
        (size, n), (s, c2, s2, S) = self.direction(), self.angles()
        I2, I3 = self.middle_moments[1:]
        turning = size * n[0] * ((1 + c2) / I2 + (1 - c2) / I3) / 2 - self.omega[0]
        return [
            *(np.clip(S * s, -10, 10), c2, -S * s2),
            *np.clip([S * turning, S * self.omega[0]], -20, 20),
            np.clip(S * self.stored(self.y)[0] / size, -2, 2),
            min(size / self.capacity, 2.0),
            near(self.goal(I2) - S * s, 0.2),
            near(S * self.omega[0], self.rate_tolerance),
            near(float(np.linalg.norm(self.omega)), self.rate_tolerance),
        ]

    def turn(self, action):
        """By a half turn."""
        return self.angles()[3] * action

    def draw_omega(self, rng):
        """A flat spin, perturbed."""
        omega = in_ball(rng, self.start_spread)
        omega[2] += uniform(rng, self.start_rate)
        return omega

    def draw_wheels(self, rng):
        """The rotor turns with the carrier."""
        return np.zeros(3)


class WheelTrack(Satellite):
    """docs/environments/WheelTrack.md.

    Beside the state: axes of the pass, sines and cosines of phi and beta, sum and number of errors.
    """

    EARTH, MU = 6371e3, 3.986004418e14

    @property
    def orbit(self):
        """Radius of the orbit [m], and n [rad/s]."""
        r = self.EARTH + self.altitude
        return r, float(np.sqrt(self.MU / r**3))

    def sight(self, phi):
        """Line of sight, its rate and the derivative of that, in the axes of the pass."""
        (r, n), beta = self.orbit, np.arctan2(*self.aux[6:8])
        d = self.EARTH * np.array([np.sin(beta), 0.0, np.cos(beta)])
        d -= r * np.array([0.0, np.sin(phi), np.cos(phi)])
        d1 = -r * n * np.array([0.0, np.cos(phi), -np.sin(phi)])
        d2 = r * n**2 * np.array([0.0, np.sin(phi), np.cos(phi)])
        rate = cross(d, d1) / (d @ d)
        return d / np.linalg.norm(d), rate, (cross(d, d2) - 2 * (d @ d1) * rate) / (d @ d)

    def phi(self):
        """Angle of the satellite from the middle of the pass."""
        return float(np.arctan2(*self.aux[4:6]))

    def in_body(self, vectors):
        """Vectors along the axes of the pass, in the carrier."""
        return np.array(vectors) @ attitudes.matrix(self.aux[:4]).T @ attitudes.matrix(self.y[:4])

    def error(self):
        """The angle between e3 and the line of sight."""
        x, y, z = self.in_body([self.sight(self.phi())[0]])[0]
        return float(np.arctan2(np.hypot(x, y), z))

    def moved(self, u):
        """The satellite flies on, and what it misses is counted."""
        y = super().moved(u)
        phi, before = self.phi() + self.orbit[1] * self.dt, self.y
        self.aux[4:6], self.y = [np.sin(phi), np.cos(phi)], y
        self.aux[8:] += [self.error(), 1.0]
        self.y = before
        return y

    def success(self):
        """Section *Episode End*."""
        return bool(self.aux[8] <= self.bound * self.aux[9])

    def values(self, u):
        """Section *Rewards*."""
        return {"close": 1 / (1 + 20 * self.error())}

    @property
    def overhead(self):
        """The largest rate of a line of sight."""
        r, n = self.orbit
        return n * r / self.altitude

    def shares(self):
        """Spin momenta over the capacity, limited."""
        return np.clip(self.stored(self.y) / self.capacity, -2.0, 2.0)

    def distances(self):
        """To go and across, in altitudes."""
        beta = float(np.arctan2(*self.aux[6:8]))
        here = np.array([-self.orbit[0] * self.phi(), self.EARTH * beta]) / self.altitude
        return np.clip(here, -10.0, 10.0)

    def features(self):
        """Line of sight, rates, spin momenta, place."""
        s, rate, _ = self.in_body(self.sight(self.phi()))
        omega = np.clip(self.omega / self.overhead, -5, 5)
        return np.concatenate([s, rate / self.overhead, omega, self.shares(), self.distances()])

    def signs(self):
        """S1, S2, S3."""
        rate = self.in_body(self.sight(self.phi()))[1]
        S1, S2 = (-1.0 if x < 0 else 1.0 for x in rate[:2])
        return np.array([S1, S2, S1 * S2])

    def ahead(self):
        """What wheels 1 and 2 will hold in the middle of the pass."""
        s, rate, _ = self.sight(0.0)
        now = self.in_body(self.sight(self.phi()))[1][:2]
        C, S = now / np.linalg.norm(now)
        to_pass = attitudes.matrix(self.aux[:4]).T @ attitudes.matrix(self.y[:4])
        L, w = to_pass @ self.momentum(self.y), float(np.linalg.norm(rate))
        h, (I1, I2, _) = rate / w, self.middle_moments
        across = L @ cross(s, h)
        return np.array([C * (L @ h - I1 * w) - S * across, S * (L @ h - I2 * w) + C * across])

    def reduced(self):
        """Section *Reduced Frame*."""
        (s, rate, change), S = self.in_body(self.sight(self.phi())), self.signs()
        angle, w = self.error(), self.overhead
        off = np.array([-s[1], s[0]]) * (angle / np.hypot(s[0], s[1]) if angle else 1.0) * S[:2]
        gyro = cross(self.momentum(self.y), self.omega)
        needed = (gyro - self.middle_moments * change) / self.torque
        return [
            *(*off, *(off / (angle + self.bound))),
            *(S * np.clip((rate - self.omega) / w, -5, 5)),
            *(S * rate / w),
            *(S * np.clip(change / w**2, -2, 2)),
            *(S * self.shares()),
            *(S * np.clip(needed, -10, 10)),
            *(S[:2] * np.clip(self.ahead() / self.capacity, -5, 5)),
            *(self.distances() * [1.0, S[2]]),
        ]

    def turn(self, action):
        """By reflections."""
        return self.signs() * action


KINDS = (WheelReorient, TwoWheels, DualSpin, WheelTrack)
