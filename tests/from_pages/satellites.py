"""The satellites with reaction wheels, written again from their pages alone."""

import numpy as np

from tests.from_pages import attitudes
from tests.from_pages.bodies import Reorient
from tests.from_pages.model import in_ball, near
from tests.vectors import cross


class WheelReorient(Reorient):
    """docs/environments/WheelReorient.md; beside the state: the attitude of the goal."""

    physical = ("I1", "I2", "I3", "J1", "J2", "J3")

    @property
    def moments(self):
        """Of the satellite of the episode, wheels locked."""
        return super().moments[:3]

    @property
    def middle_moments(self):
        """Of the satellite in the middle of the ranges."""
        return super().middle_moments[:3]

    @property
    def wheels(self):
        """Moments of the wheels."""
        return np.array([*(self.parameters[name] for name in self.physical[3:]), 0.0])[:3]

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
        u = self.torque * np.array([*action, 0.0])[:3]
        room = (np.array([[-1.0], [1.0]]) * self.capacity - self.stored(self.y)) / self.dt
        return np.clip(u, np.minimum(room[0], 0.0), np.maximum(room[1], 0.0))

    def rhs(self, y, u):
        """`L' = L x omega`, `l' = u`."""
        spun = (cross(self.momentum(y), y[4:7]) - u) / (self.moments - self.wheels)
        there = self.wheels > 0.0
        wheels = np.where(there, u / np.where(there, self.wheels, 1.0) - spun, 0.0)
        return np.concatenate([attitudes.quaternion_rate(y[:4], y[4:7]), spun, wheels])

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

    def draw_state(self, rng):
        """At rest, with spin momenta uniform in a ball."""
        return np.concatenate(
            [attitudes.draw(rng), np.zeros(3), in_ball(rng, self.bias) / self.wheels]
        )


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

    def draw_state(self, rng):
        """At rest, with wheels at rest."""
        return np.concatenate([attitudes.draw(rng), np.zeros(6)])


KINDS = (WheelReorient, TwoWheels)
