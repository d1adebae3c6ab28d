"""The thrown racket, written again from its page alone."""

import numpy as np

from tests.from_pages import attitudes
from tests.from_pages.bodies import FreeBody
from tests.from_pages.model import in_ball, moved, near, uniform
from tests.vectors import cross


class RacketCatch(FreeBody):
    """docs/environments/RacketCatch.md; beside the state: time left, attitude of the catch."""

    physical = ("I1", "I2", "I3", "m", "g")

    def components(self, y):
        """The parts of a state, by name."""
        names = ("q", "omega_body", "position", "velocity")
        return dict(zip(names, np.split(y, [4, 7, 10]), strict=True))

    def rhs(self, y, u):
        """Euler's equations, and the fall."""
        return np.concatenate([super().rhs(y[:7], u), y[10:13], [0.0, 0.0, -self.g]])

    def moved(self, u):
        """The time passes too."""
        self.aux[0] -= self.dt
        return super().moved(u)

    def from_catch(self, y):
        """The attitude in a state, from that of the catch."""
        return attitudes.compose(attitudes.inverse(self.aux[1:]), y[:4])

    def time_left(self):
        """Over the longest, rounded up to control periods."""
        longest = self.dt * np.ceil(np.max(self.flight_time) / self.dt - 1e-9)
        return np.clip(self.aux[0] / longest, 0.0, 1.0)

    def features(self):
        """Attitude from that of the catch, rates, time left."""
        E = attitudes.matrix(self.from_catch(self.y))
        return np.concatenate([E.ravel(), super().features(), [self.time_left()]])

    def angle(self):
        """Of the racket from the attitude of the catch."""
        return float(np.linalg.norm(attitudes.rotation_vector(self.from_catch(self.y))))

    def ended(self):
        """Section *Episode End*."""
        return self.aux[0] < 1e-9 * self.dt

    def success(self):
        """Section *Episode End*."""
        return self.ended() and self.angle() <= self.tolerance

    def values(self, u):
        """Section *Rewards*."""
        return {
            "catch": 1 / (1 + 5 * self.angle()) if self.ended() else 0.0,
            "impulse": -float(np.linalg.norm(u)) / (np.sqrt(3) * self.torque),
        }

    def cost(self, u):
        """In mN m s."""
        return 1000.0 * super().cost(u)

    # -- reduced frame, of the racket in the middle of the ranges

    def saddle(self):
        """r of the page of `IntermediateAxis`."""
        I1, I2, I3 = self.middle_moments
        return np.sqrt(I3 * (I3 - I2) / (I1 * (I2 - I1)))

    def signs(self):
        """S1, S2, S3."""
        omega = np.clip(self.omega, -20.0, 20.0)
        S2 = -1.0 if omega[1] < 0 else 1.0
        S1 = -1.0 if omega[0] - S2 * self.saddle() * omega[2] < 0 else 1.0
        return np.array([S1, S2, S1 * S2])

    def miss(self):
        """Rotation vector at the catch, without torque."""
        moments, omega = self.middle_moments, np.clip(self.omega, -20.0, 20.0)

        def free(y):
            turn = cross(moments * y[4:], y[4:]) / moments
            return np.concatenate([attitudes.quaternion_rate(y[:4], y[4:]), turn])

        y = np.concatenate([self.from_catch(self.y), omega])
        left = max(self.aux[0], 0.0)
        end = y if left == 0.0 else moved(free, y, left)
        return attitudes.rotation_vector(end[:4])

    def reduced(self):
        """Section *Reduced Frame*."""
        S = self.signs()
        omega, e = S * np.clip(self.omega, -20.0, 20.0), S * self.miss()
        ds = omega[0] + np.array([-1.0, 1.0]) * self.saddle() * omega[2]
        shares = [near(x, self.tolerance) for x in e], near(ds, 0.2)
        return np.concatenate([omega, [self.time_left()], e, *shares])

    def turn(self, action):
        """By half turns."""
        return self.signs() * action

    # -- starts

    def draw_state(self, rng):
        """Level, of any heading."""
        heading, T = rng.uniform(-np.pi, np.pi), uniform(rng, self.flight_time)
        q = [np.cos(heading), 0.0, 0.0, np.sin(heading)]
        return np.concatenate([q, self.draw_omega(rng), np.zeros(5), [self.g * T / 2]])

    def draw_omega(self, rng):
        """About one turn about e2."""
        omega = in_ball(rng, self.start_spread)
        omega[1] += 2 * np.pi * uniform(rng, self.turns) / uniform(rng, self.flight_time)
        return omega
