"""`BallGrid`: a ball that takes quarter rolls."""

import itertools
import math
from typing import Any, ClassVar

import numpy as np

from rigid_envs.base.checks import Array
from tests.from_pages.attitudes import compose, matrix, of_rotation_vector
from tests.from_pages.balls import RolledBall
from tests.from_pages.rolling import Judged, Settings

SIDES = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
QUARTER = math.pi / 2
# of R, as they decide between images: row and column of R12, R11, R22, R13, R31, R23, R32, R21
ORDER = ((0, 1), (0, 0), (1, 1), (0, 2), (2, 0), (1, 2), (2, 1), (1, 0))
IMAGES = [
    np.diag([a, b])[::order] for a, b, order in itertools.product((1, -1), (1, -1), (1, -1))
]  # the eight symmetries of the square


def as_choice(action: Array) -> tuple[Array, bool]:
    """The choice itself: any other is refused."""
    return action, False


def quarter(side: int) -> Array:
    """The rotation of a quarter roll."""
    x, y = SIDES[side]
    return of_rotation_vector([-QUARTER * y, QUARTER * x, 0.0])


def by_parity() -> tuple[list[Array], list[Array]]:
    """Attitudes that an even, and that an odd number of quarter rolls leads to."""
    found: tuple[list[Array], list[Array]] = ([np.array([1.0, 0.0, 0.0, 0.0])], [])
    for parity in (0, 1, 0, 1, 0, 1):
        for q, side in itertools.product(found[parity], range(4)):
            new = compose(quarter(side), q)
            if all(abs(new @ known) < 0.9 for known in found[1 - parity]):
                found[1 - parity].append(new)
    return found


class BallGrid(RolledBall):
    """Bring a ball home by quarter rolls."""

    clip = staticmethod(as_choice)
    SETTINGS: ClassVar[Settings] = {
        "radius": 1.0,
        "dt": 1.0,
        "start_cells": 4,
        "weight_moves": 0.05,
        "weight_home": 1.0,
    }
    SOLVABLE = by_parity()

    @property
    def n_action(self) -> int:
        return 1

    def draw(self, rng: np.random.Generator) -> dict[str, Any]:
        cell = rng.integers(-self.s.start_cells, self.s.start_cells, 2, endpoint=True)
        attitudes = self.SOLVABLE[int(cell.sum()) % 2]
        return {
            "q": attitudes[rng.integers(12)],
            "position": QUARTER * cell * np.mean(self.s.radius),
        }

    def step(self, action: Any) -> Any:
        return super().step([action])

    def cell(self) -> Array:
        """Position in cells."""
        return self.position / (QUARTER * self.p.radius)

    def features(self) -> Array:
        return np.clip(self.cell(), -100.0, 100.0)

    def move(self, action: Array) -> Judged:
        side = int(action[0])
        self.q = compose(quarter(side), self.q)
        self.position = self.position + QUARTER * self.p.radius * SIDES[side]
        near = math.hypot(*self.position) < 0.5 * self.p.radius
        home = bool(near and self.q[0] ** 2 > 0.95)
        cost = QUARTER * self.p.radius
        return Judged({"moves": -1.0, "home": float(home)}, cost, home, home)

    def image(self) -> tuple[tuple[float, ...], Array, Array, Array]:
        """Cell and R of the image that is observed, and its symmetry of the plane."""
        found = []
        for S in IMAGES:
            space = np.eye(3)
            space[:2, :2] = S
            cell = np.round(S @ self.cell())
            R = np.round(space @ matrix(self.q) @ space.T)
            found.append(((*cell, *(R[k] for k in ORDER)), cell, R, S))
        return max(found, key=lambda image: image[0])

    def reduced(self) -> Array:
        _, cell, R, _ = self.image()
        return np.array([*cell, *R.ravel()])

    def turn(self, action: Array) -> Array:
        *_, S = self.image()
        (side,) = np.flatnonzero((SIDES == S.T @ SIDES[int(action[0])]).all(axis=1))
        return np.array([float(side)])
