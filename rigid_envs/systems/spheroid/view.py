"""Views of the spheroid on a plane, and of the tippe top that is to turn over."""

import functools
import math
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import rotations
from rigid_envs.tasks.core import Moment
from rigid_envs.watch import meshes, views


class SpheroidView(views.View):
    """A spheroid with sectors, the path of its contact, omega and the torque.

    The arrows of omega and of the torque stand on the upper side of the body, and point away from
    it or towards it: neither is inside the body or below the plane.
    """

    @property
    def size(self) -> float:
        """Larger semi-axis [m]."""
        return float(max(self.system.radius, self.system.half_height))

    @property
    def spin(self) -> float:
        """Angular velocity that is drawn as long as the larger semi-axis [rad/s]."""
        return 3.0 * math.sqrt(self.system.g / self.size)

    def centre(self, moment: Moment) -> Array:
        """Centre of the surface in the world [m], shape (3,)."""
        read = self.system.accessors
        mass = np.append(read["centre"](moment.y), read["height"](moment.y))
        lever = (0.0, 0.0, self.system.offset)
        return np.asarray(mass + rotations.rotate(read["q"](moment.y), lever))

    def parts(self) -> dict[str, views.Part]:
        """The body: a sphere that is heavy below is a tippe top."""
        system = self.system
        is_top = system.radius == system.half_height and system.offset > 0.0
        return {"body": views.Part(tippe_top() if is_top else halves())}

    def camera(self) -> views.Camera:
        """With the body."""
        return views.Camera((0.0, 0.0, 1.35 * self.size), 8.0 * self.size, follow="body")

    def vectors(self) -> dict[str, views.Arrow]:
        """Angular velocity and torque."""
        return {
            "omega": views.Arrow(meshes.OMEGA, 0.07 * self.size, "omega"),
            "input": views.Arrow(meshes.INPUT, 0.1 * self.size, "torque"),
        }

    def traces(self) -> dict[str, views.Trace]:
        """Path of the contact."""
        return {"path": views.Trace(meshes.PATH, 0.03 * self.size)}

    def floor(self) -> views.Floor | None:
        """Chequered, a radius a cell."""
        return views.Floor(0.0, 40.0 * self.size, self.size)

    def poses(self, moment: Moment) -> dict[str, views.Pose]:
        """The body."""
        wide, high = float(self.system.radius), float(self.system.half_height)
        q = self.system.accessors["q"](moment.y)
        return {"body": views.Pose(self.centre(moment), q, (wide, wide, high))}

    def arrows(self, moment: Moment) -> views.Arrows:
        """Both on the upper side."""
        read, size = self.system.accessors, self.size
        torque = rotations.rotate(read["q"](moment.y), moment.u[:3])
        torque = views.scaled(torque, 0.7 * size / getattr(self.task, "torque", 1.0), size)
        omega = views.scaled(read["omega_world"](moment.y), size / self.spin, 1.5 * size)
        return {
            "omega": (self._beside(moment, omega), omega),
            "input": (self._beside(moment, torque), torque),
        }

    def _beside(self, moment: Moment, arrow: Array) -> Array:
        """Where an arrow starts that stands on the upper side of the body, shape (3,)."""
        length, centre = float(np.linalg.norm(arrow)), self.centre(moment)
        if length == 0.0:
            return centre
        inside = rotations.rotate_inverse(self.system.accessors["q"](moment.y), arrow / length)
        axes = np.array([self.system.radius, self.system.radius, self.system.half_height])
        reach = 1.04 / float(np.linalg.norm(inside / axes))  # of the surface in this direction
        return np.asarray(centre + (reach if arrow[2] >= 0.0 else -reach - length) * arrow / length)

    def points(self, moment: Moment) -> dict[str, npt.ArrayLike]:
        """The contact, a little above the floor."""
        foot = self.system.accessors["contact"](moment.y)
        return {"path": np.append(foot, 0.01 * self.size)}

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """Tilt and spin."""
        read = self.system.accessors
        tilt = math.degrees(float(read["tilt"](moment.y)))
        spin = float(read["omega_body"](moment.y)[2])
        return (f"tilt {tilt:.1f} deg   spin in the body {spin:.2f} rad/s",)

    @staticmethod
    def insets(system: Any, y: Array, times: Array, driven: bool) -> list[views.Panel]:
        """The path of the axis on a sphere."""
        return [views.axis_sphere(y, times, elevation=12.0)]


class TippeTopView(SpheroidView):
    """A tippe top that is to stand on its stem, with its green pole in a ring."""

    def parts(self) -> dict[str, views.Part]:
        """Also the ring."""
        return super().parts() | {"goal": views.ghost(goal_hoop(), 0.9)}

    def poses(self, moment: Moment) -> dict[str, views.Pose]:
        """The ring is where the pole is at the tolerance."""
        far, angle = 1.06 * float(self.system.radius), float(self.task.tolerance)
        place = views.above(self.centre(moment), far * math.cos(angle))
        wide = far * math.sin(angle)
        return super().poses(moment) | {"goal": views.Pose(place, scale=(wide, wide, wide))}

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """Also how much of Jellett's integral there is."""
        top = self.system
        share = abs(float(top.invariants(moment.y)["jellett"])) / top.standing_jellett
        return (*super().readings(moment), f"Jellett's integral {share:.2f} of what standing needs")


# Meshes, each made once in a process.

_LOWER = [meshes.SKY, meshes.BLUE, meshes.CREAM, meshes.BLUE]
_UPPER = [meshes.ORANGE, meshes.CREAM, meshes.YELLOW, meshes.CREAM]


def _arc(first: float, last: float, n: int) -> list[tuple[float, float]]:
    """Points (distance from z, z) of the unit circle, angles from -z [deg]."""
    angles = np.radians(np.linspace(first, last, n))
    return [(abs(math.sin(a)), -math.cos(a)) for a in angles]


@functools.cache
def halves() -> meshes.Mesh:
    """Ball of radius 1 about z with sectors, blue on -z, orange on +z."""
    below, above = _arc(0.0, 90.0, 13), _arc(90.0, 180.0, 13)
    return meshes.join(meshes.sectors(below, _LOWER, 48), meshes.sectors(above, _UPPER, 48))


@functools.cache
def tippe_top() -> meshes.Mesh:
    """Ball of radius 1 that is hollow on +z, with a stem inside; nothing is outside the ball."""
    pole, below, above = _arc(0.0, 9.0, 4), _arc(9.0, 90.0, 13), _arc(90.0, 130.0, 7)
    hollow = [above[-1], (0.66, 0.6), (0.5, 0.42), (0.3, 0.32), (0.15, 0.3)]
    stem = [hollow[-1], (0.13, 0.85), *_arc(172.0, 180.0, 4)]
    return meshes.join(
        meshes.lathe(pole, meshes.GREEN, 48),
        meshes.sectors(below, _LOWER, 48),
        meshes.sectors(above, _UPPER, 48),
        meshes.lathe(hollow, meshes.CREAM, 48),
        meshes.lathe(stem, meshes.DARK, 48),
    )


@functools.cache
def goal_hoop() -> meshes.Mesh:
    """Hoop of radius 1 about z."""
    return meshes.loop(meshes.circle(65)[:-1], 0.08, meshes.GREEN, 6)
