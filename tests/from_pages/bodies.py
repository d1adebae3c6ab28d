"""The environments of the free body, written again from their pages alone."""

from abc import abstractmethod

import numpy as np

from tests.from_pages import attitudes
from tests.from_pages.model import Page, in_ball, in_disk, near, single, uniform
from tests.vectors import cross


class FreeBody(Page):
    """What the pages of the free body have in common."""

    physical = ("I1", "I2", "I3")

    @property
    def moments(self):
        """Of the body of the episode."""
        return np.array([self.parameters[name] for name in self.physical[:3]])

    @property
    def middle_moments(self):
        """Of the body in the middle of the ranges."""
        return np.array([self.middle(name) for name in self.physical[:3]])

    def rhs(self, y, u):
        """Euler's equations."""
        return np.concatenate([attitudes.quaternion_rate(y[:4], y[4:7]), self.spun(y[4:7], u)])

    def features(self):
        """Angular velocity, limited."""
        return np.clip(self.omega, -20.0, 20.0)

    def draw_state(self, rng):
        """Attitude uniform on SO(3)."""
        return np.concatenate([attitudes.draw(rng), self.draw_omega(rng)])

    @abstractmethod
    def draw_omega(self, rng):
        """Angular velocity at the start."""


class Spinning(FreeBody):
    """What the pages about a spin at e2 at the rate Omega have in common."""

    def features(self):
        """Angular velocity over Omega, limited."""
        return np.clip(self.omega / self.spin_rate, -20.0, 20.0)

    def error(self):
        """`|omega - Omega e2| / Omega`."""
        return float(np.linalg.norm(self.omega / self.spin_rate - [0, 1, 0]))

    def success(self):
        """Section *Episode End*."""
        return self.held(self.error() < self.tolerance)

    def draw_omega(self, rng):
        """`Omega e2` and a perturbation in a ball."""
        return np.array([0, self.spin_rate, 0]) + in_ball(rng, self.start_spread)

    def saddle(self):
        """The numbers r and growth of *Reduced Frame*."""
        I1, I2, I3 = self.middle_moments
        r = np.sqrt(I3 * (I3 - I2) / (I1 * (I2 - I1)))
        return float(r), float(np.sqrt((I2 - I1) * (I3 - I2) / (I1 * I3)))

    def split(self, limit=20.0):
        """w, and its parts d and s."""
        w, (r, _) = np.clip(self.omega / self.spin_rate, -limit, limit), self.saddle()
        return w, w[0] - r * w[2], w[0] + r * w[2]

    def sign(self, limit=20.0):
        """The sign S of *Reduced Frame*: of d."""
        _, d, _ = self.split(limit)
        return -1.0 if d < 0 else 1.0

    def turn(self, action):
        """By the half turn about e2."""
        S = self.sign(np.inf)
        return action * [S, 1.0, S]


class IntermediateAxis(Spinning):
    """docs/environments/IntermediateAxis.md."""

    ACCEPTED = 1.1

    def values(self, u):
        """Section *Rewards*."""
        effort = -(u @ u) / (3 * self.torque**2)
        return {"spin": 1 / (1 + 10 * self.error()), "effort": effort}

    def reduced(self):
        """Section *Reduced Frame*."""
        (w, d, s), (r, growth), S = self.split(), self.saddle(), self.sign()
        I1, _, I3 = self.middle_moments
        k = self.spin_rate**2 * growth / (self.torque * (1 / I1 + r / I3))
        seen = [S * w[0], w[1], S * w[2], k * abs(d), S * k * s]
        close = [near(x, self.tolerance) for x in (abs(d), S * s, w[1] - 1)]
        return [*np.clip(seen, -20, 20), *close]


class IntermediateAxisRandom(IntermediateAxis):
    """docs/environments/IntermediateAxisRandom.md."""


class IntermediateAxisSingle(Spinning):
    """docs/environments/IntermediateAxisSingle.md."""

    n_action = 1

    def input_of(self, action):
        """Torque about e3."""
        return np.array([0.0, 0.0, self.torque * action[0]])

    def angle(self):
        """From e2 to omega."""
        return float(np.arctan2(np.hypot(self.omega[0], self.omega[2]), self.omega[1]))

    def values(self, u):
        """Section *Rewards*."""
        return {"axis": 1 / (1 + 10 * self.angle()), "effort": -((u[2] / self.torque) ** 2)}

    def success(self):
        """Section *Episode End*."""
        return self.held(self.angle() < self.tolerance)

    def reduced(self):
        """Section *Reduced Frame*."""
        (w, d, s), (r, growth), S = self.split(), self.saddle(), self.sign()
        k = self.spin_rate**2 * growth * self.middle_moments[2] / (self.torque * r)
        seen = [S * w[0], w[1], S * w[2], k * abs(d), S * k * s]
        return [*np.clip(seen, -20, 20), near(abs(d), self.tolerance), near(S * s, self.tolerance)]

    def turn(self, action):
        """By the half turn about e2."""
        return self.sign(np.inf) * action


class Flipping(Spinning):
    """What the reduced frames of `SpinCapture` and `AxisFlip` have in common."""

    def energy_share(self):
        """The number k of *Reduced Frame*."""
        I1, I2, I3 = self.middle_moments
        return float(I1 * (I3 - I1) / (4 * I2 * (I3 - I2)))

    def sign(self, limit=20.0):
        """The sign S: of what grows, d at e2 and s at -e2."""
        w, d, s = self.split(limit)
        return -1.0 if w[1] * (d - s) + d + s < 0 else 1.0


class SpinCapture(Flipping):
    """docs/environments/SpinCapture.md."""

    @property
    def powered(self):
        """1 for an axis with actuator, 0 without."""
        return np.array([float(f"e{axis}" in self.actuators) for axis in (1, 2, 3)])

    def input_of(self, action):
        """Torque about the axes that have an actuator."""
        return self.torque * action * self.powered

    def values(self, u):
        """Section *Rewards*."""
        L2 = float(np.sum((self.moments * self.omega) ** 2))
        T = float(self.moments @ self.omega**2) / 2
        L0 = self.I2 * self.spin_rate
        off = (abs(2 * T * self.I2 - L2) + abs(L2 - L0**2)) / L0**2
        return {
            "spin": 1 / (1 + 10 * self.error()),
            "manifold": 1 / (1 + 10 * off),
            "effort": -(u @ u) / (self.powered.sum() * self.torque**2),
        }

    def reduced(self):
        """Section *Reduced Frame*."""
        (w, d, s), (r, _), S, k = self.split(), self.saddle(), self.sign(), self.energy_share()
        p, E = s * d, w[1] ** 2 + k * (d**2 + s**2) - 1
        slopes = (
            2 * S * w[0] * (2 * k * E + p),
            2 * w[1] * E,
            2 * S * r**2 * w[2] * (2 * k * E - p),
        )
        return [
            *np.clip([S * w[0], w[1], S * w[2], p, E], -20, 20),
            *(near(slope, 0.1) for slope in slopes),
            *(near(x, self.tolerance) for x in (S * d, S * s, w[1] - 1)),
        ]

    def draw_omega(self, rng):
        """Any direction, rate in its range."""
        direction = rng.normal(size=3)
        return uniform(rng, self.start_rate) * direction / np.linalg.norm(direction)


class AxisFlip(Flipping):
    """docs/environments/AxisFlip.md; beside the state: the time left, and whether all was well."""

    def time_left(self):
        """At least 0."""
        return max(self.aux[0], 0.0)

    def is_due(self):
        """Whether it is from T on."""
        return self.aux[0] < 1e-9 * self.dt

    def moved(self, u):
        """The time passes too."""
        self.aux[0] -= self.dt
        return super().moved(u)

    def longest(self):
        """The largest of `flip_time`."""
        return float(np.max(self.flip_time))

    def features(self):
        """Angular velocity over Omega, and the time left."""
        return [*super().features(), min(self.time_left() / self.longest(), 1.0)]

    def error(self):
        """`|omega + Omega e2| / Omega`."""
        return float(np.linalg.norm(self.omega / self.spin_rate + [0, 1, 0]))

    def values(self, u):
        """Section *Rewards*."""
        return {
            "spin": 1 / (1 + 10 * self.error()) if self.is_due() else 0.0,
            "impulse": -float(np.linalg.norm(u)) / (np.sqrt(3) * self.torque),
        }

    def success(self):
        """Section *Episode End*."""
        if self.is_due() and self.error() >= self.tolerance:
            self.aux[1] = 0.0
        return self.is_due() and bool(self.aux[1])

    def reduced(self):
        """Section *Reduced Frame*."""
        (w, d, s), (r, growth), S, k = self.split(), self.saddle(), self.sign(), self.energy_share()
        w1, w2, w3, d, s = S * w[0], w[1], S * w[2], S * d, S * s
        left, most = self.time_left(), 1 / np.sqrt(k)
        last = 1.2 * self.tolerance / np.sqrt(1 + 1 / r**2)
        W = self.spin_rate * growth * left - np.log(max(2 * most / last, 1.0))
        n = np.sqrt(w2**2 + k * (d**2 + s**2))
        C = np.log(max((n + abs(w2)) * most, 1e-9) / max(abs(d), 1e-9)) * (-1 if w2 < 0 else 1)
        late = np.clip((C - W) / np.log(10), -20, 20)
        D, timed = (-most if d < 0 else most) / np.cosh(np.clip(W, -16, 16)), np.tanh(W)
        if left == 0:
            late, D, timed = 0.0, d, -np.sqrt(max(1 - k * d**2, 0.0))
        errors = (w1 - D / 2, w2 - timed, w3 + D / (2 * r))
        return [
            *(w1, w2, w3),
            min(left / self.longest(), 1.0),
            np.clip(W / np.log(10), -20, 20),
            late,
            *(near(x, self.tolerance) for x in errors),
        ]

    def draw_aux(self, rng):
        """The commanded time."""
        return np.array([uniform(rng, self.flip_time), 1.0])


class Detumble(FreeBody):
    """docs/environments/Detumble.md."""

    clip = staticmethod(in_disk)

    def input_of(self, action):
        """The impulse."""
        return self.settings["impulse"] * action

    def moved(self, u):
        """The impulse acts at once; then the body is free."""
        self.y[4:7] += u / self.moments
        return super().moved(np.zeros(3))

    def momentum(self):
        """|L| over the largest at the start."""
        return float(np.linalg.norm(self.moments * self.omega)) / self.start_momentum

    def values(self, u):
        """Section *Rewards*."""
        return {
            "momentum": max(-100.0, -(self.momentum() ** 2)),
            "impulse": -(u @ u) / self.settings["impulse"] ** 2,
        }

    def cost(self, u):
        """The impulse is no rate: there is no time in it."""
        return float(np.linalg.norm(u))

    def success(self):
        """Section *Episode End*."""
        return self.momentum() < self.tolerance

    def direction(self, omega):
        """Direction n of L, and |L|."""
        L = self.middle_moments * omega
        size = float(np.linalg.norm(L))
        n = np.array([0.0, 0.0, 1.0]) if size < 1e-9 * self.start_momentum else L / size
        return n, size

    def reduced(self):
        """Section *Reduced Frame*."""
        n, size = self.direction(self.features())
        part, impulses = size / self.start_momentum, size / self.settings["impulse"]
        return [
            min(part, 100.0),
            min(impulses, 1.0),
            min(impulses, 100.0),
            np.log(min(1 + part / self.tolerance, 1e8)),
            *np.abs(n),
            3 * np.sqrt(3) * np.prod(n),
        ]

    def turn(self, action):
        """Section *Reduced Frame*."""
        n, _ = self.direction(self.omega)
        b = cross(n, self.omega)
        if np.linalg.norm(b) < 1e-9:
            S = -1.0 if n[2] < 0 else 1.0
            b = np.array([1 - S * n[0] ** 2 / (S + n[2]), -S * n[0] * n[1] / (S + n[2]), -S * n[0]])
        b = b / np.linalg.norm(b)
        impulse = -action[0] * n + action[1] * b + action[2] * cross(n, b)
        return single(impulse)

    def draw_omega(self, rng):
        """The angular momentum is in a ball."""
        return in_ball(rng, self.start_momentum) / self.moments

    def draw_aux(self, rng):
        """Nothing."""
        return np.empty(0)


class Reorient(FreeBody):
    """docs/environments/Reorient.md; beside the state: the attitude of the goal."""

    def poses(self):
        """Achieved and desired goal, as observed."""
        achieved = [*attitudes.matrix(self.y[:4]).ravel(), *self.features()]
        desired = [*attitudes.matrix(self.aux).ravel(), 0.0, 0.0, 0.0]
        return np.array(achieved, dtype=np.float32), np.array(desired, dtype=np.float32)

    def observe(self):
        """A dictionary."""
        achieved, desired = self.poses()
        seen = super().observe()
        return {"observation": seen, "achieved_goal": achieved, "desired_goal": desired}

    def judged(self):
        """Angle and rate off the goal, and whether it is reached."""
        achieved, desired = (pose.astype(float) for pose in self.poses())
        c = min(float(np.linalg.norm((achieved - desired)[:9])), np.sqrt(8))
        rate = float(np.linalg.norm((achieved - desired)[9:]))
        near_it = achieved[:9] @ desired[:9] >= 1 + 2 * np.cos(min(self.angle_tolerance, np.pi))
        return 2 * np.arcsin(c / np.sqrt(8)), rate, bool(near_it and rate <= self.rate_tolerance)

    def values(self, u):
        """Section *Rewards*."""
        angle, rate, reached = self.judged()
        return {"reached": 0.0 if reached else -1.0, "angle": -angle, "rate": -rate}

    def success(self):
        """Section *Episode End*."""
        return self.judged()[2]

    def turn_left(self):
        """theta, spare and the signs of *Reduced Frame*."""
        theta = attitudes.rotation_vector(
            attitudes.compose(attitudes.inverse(self.y[:4]), self.aux)
        )
        braking = self.middle_moments * self.omega * np.abs(self.omega) / (2 * self.torque)
        spare = theta - braking
        S1, S2 = (-1.0 if x < 0 else 1.0 for x in spare[:2])
        return theta, spare, np.array([S1, S2, S1 * S2])

    def reduced(self):
        """Section *Reduced Frame*."""
        theta, _, S = self.turn_left()
        omega, angle = self.features(), float(np.linalg.norm(theta))
        spare = theta - self.middle_moments * omega * np.abs(omega) / (2 * self.torque)
        gyro = cross(self.middle_moments * omega, omega) / (2 * self.torque)
        return [
            *(S * theta),
            *(S * omega),
            *np.clip(S * spare, -10, 10),
            *np.clip(S * gyro, -10, 10),
            angle,
            near(angle, min(self.angle_tolerance, np.pi)),
            near(float(np.linalg.norm(omega)), self.rate_tolerance),
        ]

    def turn(self, action):
        """By half turns."""
        return self.turn_left()[2] * action

    def draw_omega(self, rng):
        """At rest."""
        return np.zeros(3)

    def draw_aux(self, rng):
        """The attitude of the goal."""
        return attitudes.draw(rng)


KINDS = (
    *(IntermediateAxis, IntermediateAxisRandom, IntermediateAxisSingle),
    *(SpinCapture, AxisFlip, Detumble, Reorient),
)
