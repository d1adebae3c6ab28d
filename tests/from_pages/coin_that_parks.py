"""`CoinPark`: an upright coin that is to be parked."""

import math
from typing import Any, ClassVar

import numpy as np

from rigid_envs.base.checks import Array
from tests.from_pages.attitudes import compose, matrix
from tests.from_pages.rolling import Judged, Model, Settings, in_box, limited, root, smooth


def within_half_a_turn(angle: float) -> float:
    """The same angle from -pi to pi."""
    return math.remainder(angle, 2.0 * math.pi)


def attitude_of(heading: float, phase: float) -> Array:
    """q of R = Rz(heading) Rx(pi / 2) Rz(phase)."""
    half = math.sqrt(0.5)
    first = [math.cos(0.5 * heading), 0.0, 0.0, math.sin(0.5 * heading)]
    last = [math.cos(0.5 * phase), 0.0, 0.0, math.sin(0.5 * phase)]
    return compose(compose(first, [half, half, 0.0, 0.0]), last)


def angles_of(q: Any) -> tuple[float, float]:
    """Heading and phase of an upright attitude."""
    R = matrix(q)
    return math.atan2(R[0, 2], -R[1, 2]), math.atan2(R[2, 0], R[2, 1])


class CoinPark(Model):
    """Park a coin."""

    clip = staticmethod(in_box)
    SETTINGS: ClassVar[Settings] = {
        "m": 1.0,
        "radius": 1.0,
        "roll_per_step": math.pi / 8,
        "steer_per_step": math.pi / 8,
        "start_half_width": 2.0,
        "position_tolerance": 0.1,
        "heading_tolerance": 0.1,
        "phase_tolerance": 0.15,
        "weight_position": 0.01,
        "weight_heading": 0.01,
        "weight_side": 0.02,
        "weight_mismatch": 0.02,
        "weight_parked": 10.0,
    }

    def draw(self, rng: np.random.Generator) -> dict[str, Any]:
        half = self.s.start_half_width
        return {
            "q": attitude_of(*rng.uniform(-math.pi, math.pi, 2)),
            "contact": rng.uniform(-half, half, 2),
        }

    def place(self, q: Any, contact: Any, **_: Any) -> None:
        self.heading, self.phase = angles_of(q)
        self.contact = np.array(contact, dtype=float)

    @property
    def q(self) -> Array:
        return attitude_of(self.heading, self.phase)

    def features(self) -> Array:
        return np.asarray(limited(self.contact / self.p.radius, 50.0))

    def move(self, action: Array) -> Judged:
        rolled, turned = self.s.roll_per_step * action[0], self.s.steer_per_step * action[1]
        between = self.heading + 0.5 * turned
        chord = rolled * np.sinc(0.5 * turned / math.pi)  # of an arc of length `rolled`
        ahead = np.array([math.cos(between), math.sin(between)])
        self.contact = self.contact - self.p.radius * chord * ahead
        self.heading = within_half_a_turn(self.heading + turned)
        self.phase = within_half_a_turn(self.phase + rolled)
        return self.judge(float(self.p.radius * abs(rolled)))

    def judge(self, cost: float) -> Judged:
        """Terms and end of the present state."""
        x, y = self.contact / self.p.radius
        m = self.mismatch()
        parked = bool(
            math.hypot(*self.contact) <= self.s.position_tolerance
            and abs(self.heading) <= self.s.heading_tolerance
            and abs(self.phase) <= self.s.phase_tolerance
        )
        terms = {
            "position": -min(math.hypot(x, y), 50.0),
            "heading": -abs(self.heading),
            "side": -math.sqrt(smooth(min(abs(y), 50.0))),
            "mismatch": -float(np.cbrt(smooth(m))),
            "parked": float(parked),
        }
        return Judged(terms, cost, parked, parked)

    def mismatch(self) -> float:
        """Of rolled offset and phase."""
        return within_half_a_turn(limited(self.contact[0] / self.p.radius, 50.0) + self.phase)

    def signs(self) -> tuple[float, float]:
        """Of X and Y."""
        return -1.0 if self.mismatch() < 0.0 else 1.0, -1.0 if self.contact[1] < 0.0 else 1.0

    def reduced(self) -> Array:
        a, b = self.signs()
        X, Y = np.array([a, b]) * self.features()
        psi, m = a * self.phase, abs(self.mismatch())
        cos, sin = math.cos(self.heading), a * b * math.sin(self.heading)
        ahead, aside = X * cos + Y * sin, Y * cos - X * sin
        room, missing = -psi - ahead, psi**2 - X**2 - Y**2
        first = missing * room / (2.0 * max(room**2, 1e-4))
        rest = limited([room, root(missing)], 10.0)
        roots = (math.sqrt(Y), math.sqrt(m))
        return np.array(
            [X, Y, roots[0], cos, sin, psi, m, roots[1], ahead, aside, *rest, limited(first, 4.0)]
        )

    def turn(self, action: Array) -> Array:
        a, b = self.signs()
        return np.array([a, a * b]) * action
