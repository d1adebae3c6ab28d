"""Views of the disk that rolls and falls."""

import functools
import math

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import rotations
from rigid_envs.tasks.core import Moment
from rigid_envs.watch import meshes, views


class RollingDiskView(views.View):
    """A disk with two different faces, its path, omega and the torque."""

    @property
    def radius(self) -> float:
        """Radius of the rim [m]."""
        return float(self.system.radius)

    def along(self, moment: Moment) -> Array:
        """Horizontal direction of travel l = e3 x n, shape (3,)."""
        axis = rotations.rotate(self.system.accessors["q"](moment.y), (0.0, 0.0, 1.0))
        ahead = np.array([axis[1], -axis[0], 0.0])
        return np.asarray(ahead / np.linalg.norm(ahead))

    def parts(self) -> dict[str, views.Part]:
        """The disk."""
        return {"disk": views.Part(disk())}

    def camera(self) -> views.Camera:
        """With the disk."""
        return views.Camera(distance=10.0 * self.radius, elevation=34.0, follow="disk")

    def vectors(self) -> dict[str, views.Arrow]:
        """Angular velocity and torque."""
        return {
            "omega": views.Arrow(meshes.OMEGA, 0.06 * self.radius, "omega"),
            "input": views.Arrow(meshes.INPUT, 0.1 * self.radius, "torque"),
        }

    def traces(self) -> dict[str, views.Trace]:
        """Path of the contact."""
        return {"path": views.Trace(meshes.PATH, 0.07 * self.radius)}

    def floor(self) -> views.Floor | None:
        """Chequered, a metre a cell."""
        return views.Floor(0.0, 70.0, 1.0)

    def poses(self, moment: Moment) -> dict[str, views.Pose]:
        """The disk."""
        read = self.system.accessors
        return {
            "disk": views.Pose(read["centre"](moment.y), read["q"](moment.y), (self.radius,) * 3)
        }

    def arrows(self, moment: Moment) -> views.Arrows:
        """Both from the centre."""
        read, r, along = self.system.accessors, self.radius, self.along(moment)
        centre, rate = read["centre"](moment.y), math.sqrt(self.system.g / r)
        axis = rotations.rotate(read["q"](moment.y), (0.0, 0.0, 1.0))
        steer, lean, drive = moment.u
        torque = steer * np.cross(along, axis) + lean * along + drive * axis
        torque = views.scaled(torque, 1.8 * r / getattr(self.task, "torque", 1.0))
        omega = views.scaled(read["omega_world"](moment.y), 1.5 * r / rate, 3.0 * r)
        return {"omega": (centre, omega), "input": (centre, torque)}

    def points(self, moment: Moment) -> dict[str, npt.ArrayLike]:
        """The contact, a little above the floor."""
        foot = self.system.accessors["contact"](moment.y)
        return {"path": np.append(foot, 0.02 * self.radius)}

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """Lean."""
        lean = math.degrees(float(self.system.accessors["tilt"](moment.y))) - 90.0
        return (f"lean {lean:.1f} deg",)


class DiskRollView(RollingDiskView):
    """A disk that is to roll on a circle: the one that touches its path now is green."""

    def parts(self) -> dict[str, views.Part]:
        """Also the circle."""
        return super().parts() | {"goal": views.ghost(goal_ring(), 0.9)}

    def poses(self, moment: Moment) -> dict[str, views.Pose]:
        """The circle of the commanded curvature that the direction of travel touches."""
        foot = np.append(self.system.accessors["contact"](moment.y), 0.015 * self.radius)
        wide = self.radius / moment.aux["goal_curvature"]
        left = np.cross((0.0, 0.0, 1.0), self.along(moment))
        circle = views.Pose(foot + wide * left, scale=(abs(wide), abs(wide), 1.0))
        return super().poses(moment) | {"goal": circle}

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """Also the commanded circle."""
        wide = self.radius / abs(moment.aux["goal_curvature"])
        return (*super().readings(moment), f"commanded circle: radius {wide:.1f} m")


# Meshes, each made once in a process.


@functools.cache
def disk() -> meshes.Mesh:
    """Disk of radius 1 about z with sectors, orange on +z, blue on -z, a red mark at +y."""
    below = [(0.0, -0.05), (0.93, -0.05), (1.0, -0.02), (1.0, 0.0)]
    above = [(1.0, 0.0), (1.0, 0.02), (0.93, 0.05), (0.0, 0.05)]
    return meshes.join(
        meshes.sectors(below, [meshes.BLUE, meshes.CREAM] * 4, 64),
        meshes.sectors(above, [meshes.ORANGE, meshes.CREAM] * 4, 64),
        meshes.cylinder(0.12, 0.2, meshes.STEEL, 20),
        meshes.mark(0.12),
    )


@functools.cache
def goal_ring() -> meshes.Mesh:
    """Flat ring of radius 1 across z, open, seen from above."""
    return meshes.lathe([(1.015, 0.0), (0.985, 0.0)], meshes.GREEN, 96)
