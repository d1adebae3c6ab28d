"""The satellite with magnetic coils, written again from its page alone."""

import numpy as np

from tests.from_pages import attitudes
from tests.from_pages.bodies import FreeBody
from tests.from_pages.model import in_disk, near, single, uniform
from tests.vectors import cross


class MagneticDetumble(FreeBody):
    """docs/environments/MagneticDetumble.md; beside the state: nothing."""

    physical = ("I1", "I2", "I3", "n", "b", "inclination")
    clip = staticmethod(in_disk)

    @property
    def rate(self):
        """The largest of |omega|, |I omega| / I2 and 2 n."""
        return max(super().rate, 2 * self.n)

    @property
    def fastest_start(self):
        """Omega, the largest of `start_rate`."""
        return float(np.max(self.start_rate))

    def components(self, y):
        """The parts of a state, by name."""
        return dict(zip(("q", "omega_body", "latitude"), np.split(y, [4, 7]), strict=True))

    def input_of(self, action):
        """The dipole."""
        return self.dipole * action

    def outward(self, y):
        """r in body axes."""
        return attitudes.matrix(y[:4]).T @ [np.cos(y[7]), np.sin(y[7]), 0.0]

    def field(self, y):
        """B in body axes."""
        axis = [0.0, np.sin(self.inclination), np.cos(self.inclination)]
        e, r = attitudes.matrix(y[:4]).T @ axis, self.outward(y)
        return self.b * (e - 3 * (e @ r) * r)

    def rhs(self, y, u):
        """Euler's equations, by gravity gradient and dipole, and the orbit."""
        r = self.outward(y)
        torque = 3 * self.n**2 * cross(r, self.moments * r) + cross(u, self.field(y))
        return np.concatenate([super().rhs(y[:7], torque), [self.n]])

    def place_in_orbit(self):
        """cos 2u, sin 2u, and h in body axes."""
        c, s = np.cos(2 * self.y[7]), np.sin(2 * self.y[7])
        return c, s, attitudes.matrix(self.y[:4]).T @ [c, s, 0.0]

    def features(self):
        """Angular velocity, field, h, place."""
        c, s, h = self.place_in_orbit()
        rates = np.clip(self.omega / self.fastest_start, -100, 100)
        return np.concatenate([rates, self.field(self.y) / self.b, h, [c, s]])

    def success(self):
        """Section *Episode End*."""
        return bool(np.linalg.norm(self.omega) <= self.rate_tolerance)

    ended = success

    def cost(self, u):
        """Time."""
        return self.dt

    def values(self, u):
        """Section *Rewards*."""
        over = max(float(np.linalg.norm(self.omega)) / self.rate_tolerance, 1.0)
        left = np.log(over) / np.log(self.fastest_start / self.rate_tolerance)
        return {"rate": -min(left, 1.0), "rest": float(self.success())}

    def directions(self):
        """L, n, d and t of *Reduced Frame*."""
        L, B = self.middle_moments * self.omega, self.field(self.y)
        n = B / np.linalg.norm(B)
        d = cross(L, n)
        if np.linalg.norm(d) <= 1e-9 * np.linalg.norm(L):
            d = cross(n, np.eye(3)[np.argmin(np.abs(n))])
        d = d / np.linalg.norm(d)
        return L, n, d, cross(n, d)

    def reduced(self):
        """Section *Reduced Frame*."""
        (L, n, d, t), (c, s, h) = self.directions(), self.place_in_orbit()
        size, rate = float(np.linalg.norm(L)), float(np.linalg.norm(self.omega))
        part = L / size if size else L
        return [
            min(np.log(1 + rate / self.rate_tolerance), 20.0),
            near(rate, self.rate_tolerance),
            near(rate, 0.3 * self.fastest_start),
            *(part @ n, part @ t),
            *np.clip([self.omega @ v / self.fastest_start for v in (n, d, t)], -100, 100),
            *(h @ n, h @ d, h @ t),
            np.linalg.norm(self.field(self.y)) / self.b,
            *(c, s),
            *np.abs(part),
        ]

    def turn(self, action):
        """Section *Reduced Frame*."""
        _, n, d, t = self.directions()
        return single(action[0] * d + action[1] * t + action[2] * n)

    def draw_state(self, rng):
        """The body, and its place in the orbit."""
        return np.concatenate([super().draw_state(rng), [rng.uniform(0, 2 * np.pi)]])

    def draw_omega(self, rng):
        """Any direction, rate in its range."""
        direction = rng.normal(size=3)
        return uniform(rng, self.start_rate) * direction / np.linalg.norm(direction)
