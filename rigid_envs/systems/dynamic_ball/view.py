"""Views of the ball with inertia: on a table that tilts or turns, and parking by a force."""

import functools
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import rotations
from rigid_envs.systems.rolling_ball.view import INSIDE, BallParkView, BallView
from rigid_envs.tasks.core import Moment
from rigid_envs.watch import meshes, views

BELOW = 1.0  # height of the middle of the table above the floor, at least [m]


class DynamicBallView(BallView):
    """A ball on a round table, its path on both, its velocity and the force."""

    @property
    def edge(self) -> float:
        """Radius of the table [m]."""
        return float(getattr(self.task, "edge", 5.0 * self.radius))

    @property
    def strongest(self) -> float:
        """Force that is drawn 1.2 radii long [N]."""
        return float(getattr(self.task, "force", self.system.m * self.system.g))

    def plate(self, moment: Moment) -> Array:
        """Matrix of the plate axes, plate to world."""
        return np.asarray(self.system.accessors["plate"](moment.y))

    def centre(self, moment: Moment) -> Array:
        """Centre of the ball in the world [m], shape (3,)."""
        return np.asarray(self.system.accessors["centre"](moment.y))

    def normal(self, moment: Moment) -> Array:
        """Normal of the table in the world, shape (3,)."""
        return self.plate(moment)[:, 2]

    def push(self, moment: Moment) -> Array:
        """Force in world axes [N], shape (3,)."""
        return np.asarray(self.plate(moment)[:, :2] @ moment.u[:2])

    def table_attitude(self, moment: Moment) -> Array:
        """Quaternion of the surface of the table, turned by its own rate."""
        half = 0.5 * self.system.turntable_rate * moment.time
        turn = [np.cos(half), 0.0, 0.0, np.sin(half)]
        return np.asarray(rotations.multiply(self.tilted(moment), turn))

    def tilted(self, moment: Moment) -> Array:
        """Quaternion of the plate axes, Rx(alpha_x) Ry(alpha_y)."""
        half = 0.5 * self.system.accessors["tilt"](moment.y)
        (c, d), (s, t) = np.cos(half), np.sin(half)
        return np.array([c * d, s * d, c * t, s * t])

    def parts(self) -> dict[str, views.Part]:
        """Also the table and its foot."""
        plate = views.Part(table(self.edge, 0.04 * self.edge))
        return super().parts() | {"plate": plate, "foot": views.Part(meshes.stand())}

    def camera(self) -> views.Camera:
        """The whole table."""
        high = 0.2 * self.radius
        return views.Camera((0.0, 0.0, high), 3.9 * self.edge, azimuth=-60.0, elevation=32.0)

    def floor(self) -> views.Floor | None:
        """Below the table."""
        return views.Floor(-BELOW - 0.15 * self.edge, 8.0 * self.edge, 1.0)

    def vectors(self) -> dict[str, views.Arrow]:
        """Force and velocity."""
        return driven(self.radius)

    def traces(self) -> dict[str, views.Trace]:
        """The path on the table goes with it."""
        path = views.Trace(meshes.PATH, 0.06 * self.radius, part="plate")
        return super().traces() | {"path": path}

    def poses(self, moment: Moment) -> dict[str, views.Pose]:
        """The table turns about its middle."""
        foot = (0.04 * self.edge, 0.3 * self.edge, BELOW + 0.11 * self.edge)
        return super().poses(moment) | {
            "plate": views.Pose(q=self.table_attitude(moment)),
            "foot": views.Pose((0.0, 0.0, -foot[0]), scale=(foot[1], foot[1], foot[2])),
        }

    def arrows(self, moment: Moment) -> views.Arrows:
        """Also the velocity, from the top of the ball."""
        velocity = self.system.accessors["velocity_world"](moment.y)
        top = self.centre(moment) + 1.05 * self.radius * self.normal(moment)
        return super().arrows(moment) | {"velocity": (top, views.scaled(velocity, 1.0, 4.0))}

    def points(self, moment: Moment) -> dict[str, npt.ArrayLike]:
        """The contact on the table is given in its axes."""
        points = super().points(moment)
        foot = rotations.rotate_inverse(self.table_attitude(moment), points["path"])
        return points | {"path": foot}


class BallParkDynamicView(BallParkView):
    """A ball that a force is to park upright at the origin, on a level plate with an edge."""

    @property
    def strongest(self) -> float:
        """Largest force [N]."""
        return float(self.task.force)

    def camera(self) -> views.Camera:
        """From higher above."""
        return replace(super().camera(), elevation=46.0)

    def parts(self) -> dict[str, views.Part]:
        """The floor is the plate; a ring is its edge."""
        ring = views.Part(meshes.edge_ring(), shadow=False, shiny=False)
        return super().parts() | {"edge": ring}

    def floor(self) -> views.Floor | None:
        """The plate."""
        return views.Floor(0.0, 5.0 * self.task.edge, 1.0)

    def vectors(self) -> dict[str, views.Arrow]:
        """Force and velocity."""
        return driven(self.radius)

    def poses(self, moment: Moment) -> dict[str, views.Pose]:
        """Also the edge."""
        edge = views.Pose((0.0, 0.0, 0.01), scale=(self.task.edge, self.task.edge, 1.0))
        return super().poses(moment) | {"edge": edge}

    def arrows(self, moment: Moment) -> views.Arrows:
        """Also the velocity, from the top of the ball."""
        velocity = self.system.accessors["velocity_world"](moment.y)
        top = views.above(self.centre(moment), 1.05 * self.radius)
        return super().arrows(moment) | {"velocity": (top, views.scaled(velocity, 1.0, 4.0))}

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """Also the speed."""
        speed = float(np.linalg.norm(self.system.accessors["velocity"](moment.y)))
        return (*super().readings(moment), f"speed {speed:.2f} m/s")


class BallPlateView(DynamicBallView):
    """A ball that is to rest at a point of a tilting table, where a green ghost stands."""

    def parts(self) -> dict[str, views.Part]:
        """Also the place and the ghost."""
        goals = {
            "goal": views.ghost(goal_ball(), 0.35),
            "place": views.ghost(meshes.goal_disk(), 0.9),
        }
        return super().parts() | goals

    def vectors(self) -> dict[str, views.Arrow]:
        """The input is the rate of tilting, a vector along the axis of that turn."""
        return super().vectors() | {"input": views.Arrow(meshes.INPUT, 0.12, "rate of tilt")}

    def goal(self, moment: Moment) -> Array:
        """The commanded point in plate axes [m], shape (3,)."""
        return np.array([moment.aux["point_X"], moment.aux["point_Y"], 0.0])

    def poses(self, moment: Moment) -> dict[str, views.Pose]:
        """The goal goes with the table."""
        plate = self.plate(moment)
        q, goal = self.tilted(moment), self.goal(moment)
        place = plate @ views.above(goal, 0.02)
        ball = plate @ views.above(goal, self.radius)
        return super().poses(moment) | {
            "place": views.Pose(place, q, (0.3, 0.3, 1.0)),
            "goal": views.Pose(ball, q, (INSIDE * self.radius,) * 3),
        }

    def arrows(self, moment: Moment) -> views.Arrows:
        """The rate of tilting, at the edge of the table nearest to the camera."""
        plate = self.plate(moment)
        rate = plate @ np.append(self.system.accessors["tilt_rate"](moment.y), 0.0)
        start = plate @ np.array([0.0, 0.0, 0.06])
        return super().arrows(moment) | {
            "input": (start, views.scaled(rate, 0.6 * self.edge / self.task.tilt_rate))
        }

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """Distance to the point, tilt."""
        read = self.system.accessors
        away = float(np.linalg.norm(read["position"](moment.y) - self.goal(moment)[:2]))
        a, b = np.round(np.degrees(read["tilt"](moment.y)), 1) + 0.0
        return (f"{away:.2f} m from the point   tilt ({a:.1f}, {b:.1f}) deg",)


def driven(radius: float) -> dict[str, views.Arrow]:
    """Look of force and velocity of a ball of this radius [m]."""
    width = 0.12 * radius
    return {
        "input": views.Arrow(meshes.INPUT, width, "force"),
        "velocity": views.Arrow(meshes.SKY, width, "v"),
    }


# Meshes, each made once in a process.


@functools.cache
def goal_ball() -> meshes.Mesh:
    """Ball of radius 1 in one colour: a place, whatever the attitude."""
    return meshes.ball(1.0, meshes.GREEN, n=14)


@functools.cache
def table(radius: float = 1.0, thickness: float = 0.1) -> meshes.Mesh:
    """Disk below z = 0, its upper face with rings and sectors.

    Args:
        radius: of the disk [m].
        thickness: of the disk [m].
    """
    rings = []
    for k in range(4):
        profile = [(0.25 * radius * (k + 1), 0.0), (0.25 * radius * k, 0.0)]
        pair = [(0.68, 0.75, 0.83), (0.80, 0.84, 0.88)]
        rings.append(meshes.sectors(profile, (pair if k % 2 else pair[::-1]) * 6, 48))
    low = -thickness
    return meshes.join(
        *rings, meshes.lathe([(0.0, low), (radius, low), (radius, 0.0)], meshes.STEEL, 48)
    )
