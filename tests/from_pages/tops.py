"""The environments of the heavy top, written again from their pages alone."""

from abc import abstractmethod
from typing import ClassVar

import numpy as np

from tests.from_pages.attitudes import matrix, quaternion_rate, tilted
from tests.from_pages.model import Page, in_ball, in_disk, near, share, single
from tests.vectors import cross


class HeavyTop(Page):
    """What the pages of the top have in common.

    The input is the torque in body axes, the torque in world axes, the acceleration of the pivot.
    """

    physical = ("I_perp", "I3", "m", "g", "ell")
    bound: ClassVar[float] = 20.0
    """Of observed rates."""

    @property
    def moments(self):
        """Of the top of the episode."""
        return np.array([self.I_perp, self.I_perp, self.I3])

    @property
    def R(self):
        """Attitude."""
        return matrix(self.y[:4])

    def rhs(self, y, u):
        """Euler's equations about the pivot, whose frame may be accelerated."""
        to_body = matrix(y[:4]).T
        fx, fy, _ = to_body @ (self.m * np.array([-u[6], -u[7], -self.g]))
        weight = self.ell * np.array([-fy, fx, 0.0])  # ell e3 x force
        spin = self.spun(y[4:7], u[:3] + to_body @ u[3:6] + weight)
        return np.concatenate([quaternion_rate(y[:4], y[4:7]), spin, y[9:11], u[6:8]])

    def tilt(self):
        """Angle from the vertical to e3."""
        R = self.R
        return float(np.arctan2(np.hypot(R[2, 0], R[2, 1]), R[2, 2]))

    def critical(self):
        """The least spin at which the top sleeps."""
        return 2 * np.sqrt(self.moments[0] * self.m * self.g * self.ell) / self.I3

    def effort(self, u, most):
        """Minus the square of the input over its maximum."""
        return -(u @ u) / most

    def success(self):
        """Section *Episode End*."""
        return self.held(self.tilt() < self.tolerance)

    def draw_state(self, rng):
        """Tilt and rates, pivot at rest in the centre."""
        return np.concatenate([tilted(rng, self.draw_tilt(rng)), self.draw_omega(rng), np.zeros(4)])

    def draw_tilt(self, rng):
        """Uniform up to `start_tilt`."""
        return float(rng.uniform(0.0, self.start_tilt))

    @abstractmethod
    def draw_omega(self, rng):
        """Angular velocity at the start, in body axes."""

    # -- reduced frame

    def inertia(self):
        """Moment I across e3, of the middle of the ranges."""
        return self.middle("I_perp")

    def fall(self):
        """`m g ell / I`."""
        return self.middle("m") * self.middle("g") * self.middle("ell") / self.inertia()

    def kappa(self):
        """`I3 omega3 / I`."""
        return self.middle("I3") * float(self.omega[2]) / self.inertia()

    def lean(self):
        """e and e', in world axes."""
        R = self.R
        rate = R @ cross(self.omega, [0, 0, 1])
        return complex(*R[:2, 2]), complex(*rate[:2])

    def growth(self):
        """Of the lean."""
        return float(np.sqrt(max(self.fall() - self.kappa() ** 2 / 4, 0.0)))

    def parts(self):
        """u, which grows, and s."""
        e, rate = self.lean()
        b = rate - 0.5j * self.kappa() * e
        return b + self.growth() * e, b - self.growth() * e

    def axes(self):
        """Vectors along which the x-axis of the frame is: the second where the first is 0."""
        return self.parts()

    def frame_axis(self):
        """The x-axis of the frame, of length 1."""
        for v in self.axes():
            if abs(v) ** 2 >= 1e-18:
                return v / abs(v)
        return 1.0 + 0.0j

    def side(self):
        """The sign S: -1 where y is to the right of x."""
        return -1.0 if self.omega[2] < 0 else 1.0

    def seen(self, v):
        """Components of a vector in the frame."""
        turned = v * self.frame_axis().conjugate()
        return complex(turned.real, self.side() * turned.imag)

    def unseen(self, a):
        """The vector of components in the frame."""
        return complex(a[0], self.side() * a[1]) * self.frame_axis()

    def upright(self):
        """Entries of the lean, height and spin."""
        u, s = self.parts()
        s, e = self.seen(s), self.seen(self.lean()[0])
        root = np.sqrt(self.fall())
        return [
            min(3 * abs(u), 3.0),
            near(abs(u), 0.2),
            near(abs(u), 0.01),
            *share(s, 0.2),
            *share(s, 0.01),
            *share(e, 0.1),
            self.R[2, 2],
            min(abs(self.kappa()) / (2 * root), 4.0),
            self.growth() / root,
        ]


class SleepingTop(HeavyTop):
    """docs/environments/SleepingTop.md."""

    n_action = 2
    clip = staticmethod(in_disk)
    ACCEPTED = 1.1

    def input_of(self, action):
        """Horizontal torque in world axes."""
        return np.array([0, 0, 0, *(self.torque * action), 0, 0, 0])

    def features(self):
        """Angular velocity in world axes."""
        return np.clip(self.R @ self.omega, -self.bound, self.bound)

    def values(self, u):
        """Section *Rewards*."""
        return {"upright": 1 / (1 + 10 * self.tilt()), "effort": self.effort(u, self.torque**2)}

    def reduced(self):
        """Section *Reduced Frame*."""
        return self.upright()

    def turn(self, action):
        """At right angles to the push."""
        p = self.unseen(action)
        return single([-p.imag, p.real])

    def draw_omega(self, rng):
        """Spin in critical ones."""
        spin = rng.uniform(self.start_spin_low, self.start_spin_high)
        return np.array([0.0, 0.0, self.critical() * spin])


class SleepingTopRandom(SleepingTop):
    """docs/environments/SleepingTopRandom.md."""

    ACCEPTED = 0.5


class TopPrecession(HeavyTop):
    """docs/environments/TopPrecession.md; beside the state: counter, and commanded tilt."""

    n_action = 2
    bound = 30.0

    def input_of(self, action):
        """Torque about e1 and e2."""
        return np.array([*(self.torque * action), 0, 0, 0, 0, 0, 0])

    def precession(self):
        """phi', limited."""
        G, omega = self.R[2], self.omega
        rate = (omega[0] * G[0] + omega[1] * G[1]) / max(G[0] ** 2 + G[1] ** 2, 1e-12)
        return float(np.clip(rate, -30, 30))

    def goal(self):
        """The rate of steady precession at the commanded tilt, limited."""
        a = self.I_perp * np.cos(self.aux[1])
        b = self.I3 * self.omega[2]
        c = self.m * self.g * self.ell
        root = np.sqrt(max(b * b - 4 * a * c, 0.0))
        n = b - root if b < 0 else b + root
        slow, fast = 2 * c / (n if abs(n) >= 1e-9 else 1e-9), n / (2 * a)
        return float(np.clip(fast if self.branch == "fast" else slow, -30, 30))

    def errors(self):
        """Of the tilt [rad], and relative of the rate."""
        late = abs(self.precession() - self.goal()) / max(abs(self.goal()), 1e-9)
        return abs(self.tilt() - self.aux[1]), late

    def features(self):
        """Rates, tilt and rate of precession and their goals."""
        omega = np.clip(self.omega, -30, 30)
        return [*omega, self.tilt(), self.precession(), self.aux[1], self.goal()]

    def values(self, u):
        """Section *Rewards*."""
        off, late = self.errors()
        return {
            "tilt": 1 / (1 + 10 * off),
            "rate": 1 / (1 + 10 * late),
            "effort": self.effort(u, 2 * self.torque**2),
        }

    def success(self):
        """Section *Episode End*."""
        off, late = self.errors()
        return self.held(off <= self.tolerance * self.aux[1] and late <= self.tolerance)

    def axes(self):
        """Section *Reduced Frame*."""
        return complex(*self.R[2, :2]), complex(-self.omega[1], self.omega[0])

    def reduced(self):
        """Section *Reduced Frame*."""
        x, S, omega = self.frame_axis(), self.side(), self.omega
        v = S * (x.real * omega[0] + x.imag * omega[1])
        falling = x.imag * omega[0] - x.real * omega[1]
        rate, f = S * self.precession(), S * self.goal()
        tilt, goal, fall, M = self.tilt(), self.aux[1], self.fall(), abs(self.kappa())
        d = np.sin(tilt) * v - np.sin(goal) ** 2 * f + M * (np.cos(tilt) - np.cos(goal))
        bend = v * (rate * np.cos(tilt) - M) + fall * np.sin(tilt)
        Omega = np.hypot(M - 2 * f * np.cos(goal), f * np.sin(goal))
        off = complex(tilt - goal, v - f * np.sin(tilt))
        moving = complex(falling, bend / max(Omega, 1e-3))
        return [
            tilt,
            goal,
            min(abs(omega[2]), 30) / 5,
            f,
            np.clip(v, -2, 2),
            np.clip(falling, -2, 2),
            *(entry for w in (off, moving) for half in (0.3, 0.02) for entry in share(w, half)),
            near(d, 0.3),
            near(d, 0.02),
        ]

    def turn(self, action):
        """Section *Reduced Frame*."""
        p = self.side() * self.unseen(in_disk(action)[0])
        return single([p.real, p.imag])

    def draw_omega(self, rng):
        """Spin in critical ones, and rates across e3."""
        spin = rng.uniform(self.start_spin, self.start_spin + self.start_spread)
        return np.array([*in_ball(rng, self.start_rate, 2), self.critical() * spin])

    def draw_aux(self, rng):
        """The commanded tilt."""
        return np.array([0.0, rng.uniform(self.goal_tilt, self.goal_tilt + self.goal_spread)])


class TopRandom(HeavyTop):
    """docs/environments/TopRandom.md."""

    physical = ("I1", "I2", "I3", "m", "g", "ell")
    bound = 30.0

    @property
    def moments(self):
        """Three different ones."""
        return np.array([self.I1, self.I2, self.I3])

    def input_of(self, action):
        """Torque in body axes."""
        return np.array([*(self.torque * action), 0, 0, 0, 0, 0])

    def features(self):
        """Angular velocity in body axes."""
        return np.clip(self.omega, -self.bound, self.bound)

    def values(self, u):
        """Section *Rewards*."""
        return {"upright": 1 / (1 + 10 * self.tilt()), "effort": self.effort(u, 3 * self.torque**2)}

    def inertia(self):
        """The mean of I1 and I2."""
        return (self.middle("I1") + self.middle("I2")) / 2

    def lean(self):
        """In body axes."""
        return -complex(*self.R[2, :2]), complex(self.omega[1], -self.omega[0])

    def reduced(self):
        """Section *Reduced Frame*."""
        twice = self.frame_axis() ** 2
        across = float(np.hypot(*self.omega[:2]))
        return [*self.upright(), near(across, 1.0), twice.real, self.side() * twice.imag]

    def turn(self, action):
        """Section *Reduced Frame*."""
        p = self.unseen(in_disk(action[:2])[0])
        return np.array([*single([-p.imag, p.real]), self.side() * action[2]])

    def draw_omega(self, rng):
        """Spin in either sense, and rates across e3."""
        spin = rng.uniform(-self.start_spin, self.start_spin)
        return np.array([*in_ball(rng, self.start_rate, 2), spin])


class PivotTop(HeavyTop):
    """docs/environments/PivotTop.md."""

    n_action = 2
    clip = staticmethod(in_disk)

    def input_of(self, action):
        """Acceleration of the pivot."""
        return np.array([0, 0, 0, 0, 0, 0, *(self.push * action)])

    def distance(self):
        """Of the pivot from the centre."""
        return float(np.hypot(*self.y[7:9]))

    def features(self):
        """Rates in world axes, pivot."""
        omega = np.clip(self.R @ self.omega, -20, 20)
        return [*omega, *np.clip(self.y[7:9] / self.arena, -2, 2), *np.clip(self.y[9:11], -20, 20)]

    def values(self, u):
        """Section *Rewards*."""
        upright = 1 / (1 + 10 * self.tilt())
        return {
            "upright": upright,
            "centre": upright / (1 + 10 * self.distance() / self.arena),
            "effort": self.effort(u, self.push**2),
        }

    def success(self):
        """Section *Episode End*."""
        central = self.distance() < self.centre_tolerance
        return self.held(self.tilt() < self.tilt_tolerance and central)

    def ended(self):
        """Section *Episode End*."""
        return self.distance() > self.arena or self.tilt() > self.settings["fall"]

    def returning(self):
        """w of *Reduced Frame*."""
        k = 0.35 * np.sqrt(self.fall())
        pivot, velocity = complex(*self.y[7:9]), complex(*self.y[9:11])
        lean = k * (k * pivot + 2 * velocity) / self.middle("g")
        return self.parts()[0] + (self.growth() - 0.5j * self.kappa()) * lean

    def axes(self):
        """Section *Reduced Frame*."""
        return self.returning(), self.parts()[0]

    def reduced(self):
        """Section *Reduced Frame*."""
        w = abs(self.returning())
        s, e = self.seen(self.parts()[1]), self.seen(self.lean()[0])
        pivot, velocity = self.seen(complex(*self.y[7:9])), self.seen(complex(*self.y[9:11]))
        return [
            min(3 * w, 3.0),
            near(w, 0.2),
            near(w, 0.02),
            *share(s, 0.2),
            *share(e, 0.1),
            *np.clip([pivot.real, pivot.imag], -5, 5),
            *share(pivot, 0.2),
            *np.clip([velocity.real, velocity.imag], -5, 5),
            *share(velocity, 0.2),
            self.R[2, 2],
            min(abs(self.kappa()) / (2 * np.sqrt(self.fall())), 4.0),
        ]

    def turn(self, action):
        """Section *Reduced Frame*."""
        p = self.unseen(action)
        return single([p.real, p.imag])

    def draw_tilt(self, rng):
        """From a third of `start_tilt` on."""
        return float(rng.uniform(self.start_tilt / 3, self.start_tilt))

    def draw_omega(self, rng):
        """Spin in critical ones."""
        spin = rng.uniform(0.3 * self.start_spin, self.start_spin)
        return np.array([0.0, 0.0, self.critical() * spin])


KINDS = (*(SleepingTop, SleepingTopRandom, TopPrecession, TopRandom, PivotTop),)
