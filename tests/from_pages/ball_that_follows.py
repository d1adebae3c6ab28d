"""`BallSteer`: a ball that follows another one along an elastica."""

import math
from typing import Any, ClassVar

import numpy as np

from rigid_envs.base.checks import Array
from tests.from_pages.attitudes import compose, inverse, of_rotation_vector, rotation_vector
from tests.from_pages.balls import RolledBall
from tests.from_pages.rolling import Frame, Judged, Settings, limited, single

EIGHT = 0.9089085575485415  # modulus of the closed elastica
SHARES = {"eight": 1.0, "both": 0.5, "elastica": 0.0}


def cross(a: Array, b: Array) -> float:
    """Vertical component of the product of two horizontal vectors."""
    return float(a[0] * b[1] - a[1] * b[0])


class BallSteer(RolledBall):
    """Follow a reference ball."""

    SETTINGS: ClassVar[Settings] = {
        **RolledBall.SETTINGS,
        "rotation": "none",
        "reference_speed": 0.5,
        "path": "both",
        "wavenumber": 0.6,
        "start_offset": 1.0,
        "start_angle": 1.0,
        "bound": 0.3,
        "weight_close": 1.0,
    }

    def draw(self, rng: np.random.Generator) -> dict[str, Any]:
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

    def beside(self, aux: Array) -> dict[str, Any]:
        return {"aux": aux}

    def place(self, q: Any, position: Any, aux: Any) -> None:
        """Take a start; `aux` is what the task keeps beside the state."""
        super().place(q, position)
        aux = np.array(aux, dtype=float)
        self.reference_q, self.reference_position = aux[:4], aux[4:6]
        self.heading, self.curvature, self.force = aux[6:8], float(aux[8]), aux[9:11]
        self.errors: list[float] = []

    def leading(self) -> Array:
        """Action of the reference."""
        return single(self.s.reference_speed * self.heading)

    def offset(self) -> tuple[Array, Array]:
        """Offset in radii, and rotation vector, from the reference."""
        p = (self.position - self.reference_position) / self.p.radius
        return p, rotation_vector(compose(self.q, inverse(self.reference_q)))

    def bend(self) -> None:
        """The heading and the curvature of the next side of the reference's polygon."""
        side = self.s.roll_per_step * self.s.reference_speed * self.p.radius
        self.curvature += 0.5 * side * cross(self.heading, self.force)
        c, s = math.cos(side * self.curvature), math.sin(side * self.curvature)
        self.heading = np.array([[c, -s], [s, c]]) @ self.heading
        self.curvature += 0.5 * side * cross(self.heading, self.force)

    def features(self) -> Array:
        p, theta = self.offset()
        bent = self.p.radius * self.curvature
        shape = [bent, *(self.p.radius**2 * self.force)]
        return np.array([*limited(p, 50.0), *theta, *self.leading(), *limited(shape, 5.0)])

    def frame(self) -> Frame:
        """Along the heading, y on the side to which the path bends."""
        return Frame(*self.heading, -1.0 if self.curvature < 0.0 else 1.0)

    def reduced(self) -> Array:
        frame = self.frame()
        p, theta = self.offset()
        shape = [self.p.radius * abs(self.curvature), *frame.seen(*self.p.radius**2 * self.force)]
        return np.array([*limited(frame.seen(*p), 50.0), *frame.axial(theta), *limited(shape, 5.0)])

    def turn(self, action: Array) -> Array:
        return self.frame().back(action)

    def move(self, action: Array) -> Judged:
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
