"""Views of the tasks of tops, and the path of the axis beside them."""

import functools
import math
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import rotations
from rigid_envs.tasks.core import Moment
from rigid_envs.watch import meshes, views

# Views of tops: on a stand or a carriage, inside a faint dome on which their tip writes.

HEIGHT = 1.5  # of the top, nominal [m]
STAND = 1.7  # height of the stand: more than that of the top, which may hang down [m]


class HeavyTopView(views.View):
    """A top on a stand, its rotor as long and wide as its moments; L, omega and the torque.

    Attributes:
        size: factor of all lengths, which are nominal.
    """

    size: ClassVar[float] = 1.0

    @property
    def strongest(self) -> float:
        """Torque that is drawn 0.9 m long [N m]."""
        return float(getattr(self.task, "torque", 1.0))

    @property
    def spin(self) -> float:
        """Spin that is drawn 0.6 m long [rad/s]."""
        start = getattr(self.task, "start_spin", 1.0) + getattr(self.task, "start_spread", 0.0)
        return float(self.system.critical_spin * max(1.0, start))

    def scale(self) -> tuple[float, float, float]:
        """Factors of the mesh: 1 for I1 = I2 and I3 = m (1 m)^2 / 2."""
        half = 0.5 * self.system.moments.sum()
        across = np.maximum(half - self.system.moments[:2], 0.05 * half) / self.system.m
        x, y = np.clip(2.0 * np.sqrt(across), 0.4, 1.4).tolist()
        return self.size * x, self.size * y, self.size

    def parts(self) -> dict[str, views.Part]:
        """Top, stand and dome."""
        return {
            "top": views.Part(top()),
            "stand": views.Part(meshes.stand()),
            "dome": views.Part(dome(), shadow=False, shiny=False),
        }

    def camera(self) -> views.Camera:
        """From the foot of the stand to the tip, with L."""
        return views.Camera(target=(0.0, 0.0, 0.4), distance=8.0, azimuth=-60.0, elevation=20.0)

    def vectors(self) -> dict[str, views.Arrow]:
        """Angular momentum, angular velocity, torque."""
        return {
            "L": views.Arrow(meshes.MOMENTUM, 0.04, "L"),
            "omega": views.Arrow(meshes.OMEGA, 0.06, "omega"),
            "input": views.Arrow(meshes.INPUT, 0.07, "torque"),
        }

    def traces(self) -> dict[str, views.Trace]:
        """Path of the tip."""
        return {"tip": views.Trace(meshes.PATH, 0.03, length=250)}

    def floor(self) -> views.Floor | None:
        """Below the stand."""
        return views.Floor(-STAND, 16.0, 1.0)

    def pivot(self, moment: Moment) -> Array:
        """Place of the pivot [m], shape (3,)."""
        return np.append(self.system.accessors["pivot"](moment.y), 0.0)

    def tip(self, moment: Moment) -> Array:
        """Place of the tip [m], shape (3,)."""
        axis = rotations.rotate(
            self.system.accessors["q"](moment.y), (0.0, 0.0, self.size * HEIGHT)
        )
        return np.asarray(self.pivot(moment) + axis)

    def poses(self, moment: Moment) -> dict[str, views.Pose]:
        """The stand and the dome go with the pivot."""
        pivot, q = self.pivot(moment), self.system.accessors["q"](moment.y)
        return {
            "top": views.Pose(pivot, q, self.scale()),
            "stand": views.Pose(pivot, scale=(1.0, 1.0, STAND)),
            "dome": views.Pose(pivot, scale=(self.size * HEIGHT,) * 3),
        }

    def arrows(self, moment: Moment) -> views.Arrows:
        """All from the tip; L is drawn longer than omega, with which it often coincides."""
        read, tip = self.system.accessors, self.tip(moment)
        L = float(self.system.I3) * self.spin
        torque = rotations.rotate(read["q"](moment.y), moment.u[:3]) + moment.u[3:6]
        return {
            "L": (tip, views.scaled(read["L_world"](moment.y), 1.1 / L, 1.6)),
            "omega": (tip, views.scaled(read["omega_world"](moment.y), 0.6 / self.spin, 1.2)),
            "input": (tip, views.scaled(torque, 0.9 / self.strongest, 1.2)),
        }

    def points(self, moment: Moment) -> dict[str, npt.ArrayLike]:
        """The tip."""
        return {"tip": self.tip(moment)}

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """Tilt and spin."""
        tilt = math.degrees(float(self.system.accessors["tilt"](moment.y)))
        spin = float(self.system.accessors["omega_body"](moment.y)[2])
        share = spin / self.system.critical_spin
        return (f"tilt {tilt:.1f} deg   spin {spin:.2f} rad/s, {share:.2f} of critical",)

    @staticmethod
    def insets(system: Any, y: Array, times: Array, driven: bool) -> list[views.Panel]:
        """The path of the axis on a sphere."""
        return [views.axis_sphere(y, times)]


class SleepingTopView(HeavyTopView):
    """A top that is to stand upright: a green rod, and a ring in which the tip is to be."""

    def angle(self, moment: Moment) -> float:
        """Tilt of the tip on the ring [rad]."""
        return float(self.task.tolerance)

    def parts(self) -> dict[str, views.Part]:
        """Also rod and ring."""
        goals = {"goal": views.ghost(rod(), 0.6), "goal_ring": views.ghost(goal_hoop(), 0.9)}
        return super().parts() | goals

    def poses(self, moment: Moment) -> dict[str, views.Pose]:
        """The ring is where the tip is at its angle."""
        pivot, angle = self.pivot(moment), self.angle(moment)
        size = self.size * HEIGHT
        wide, high = size * math.sin(angle), size * math.cos(angle)
        return super().poses(moment) | {
            "goal": views.Pose(pivot, scale=(self.size, self.size, size + 0.5)),
            "goal_ring": views.Pose(views.above(pivot, high), scale=(wide, wide, 1.0)),
        }


class TopRandomView(SleepingTopView):
    """An asymmetric top that is to stand upright."""


class PivotTopView(SleepingTopView):
    """A top on a carriage in its arena, whose acceleration is the input."""

    size = 1.6

    def angle(self, moment: Moment) -> float:
        """The tolerance."""
        return float(self.task.tilt_tolerance)

    @property
    def strongest(self) -> float:
        """Acceleration that is drawn 0.9 m long [m/s^2]."""
        return float(self.task.push)

    def parts(self) -> dict[str, views.Part]:
        """A carriage for the stand; the middle and the edge of the arena."""
        flat = {"shadow": False, "shiny": False}
        return super().parts() | {
            "stand": views.Part(puck()),
            "edge": views.Part(meshes.edge_ring(), **flat),
            "centre": views.Part(meshes.goal_disk(), **flat),
        }

    def camera(self) -> views.Camera:
        """The whole arena."""
        high = 0.3 * self.size * HEIGHT
        return views.Camera((0.0, 0.0, high), 3.4 * self.task.arena, azimuth=-60.0, elevation=32.0)

    def vectors(self) -> dict[str, views.Arrow]:
        """The input is an acceleration."""
        return super().vectors() | {"input": views.Arrow(meshes.INPUT, 0.12, "acceleration")}

    def traces(self) -> dict[str, views.Trace]:
        """Also the path of the pivot."""
        return {
            "tip": views.Trace(meshes.STEEL, 0.03, length=40),
            "pivot": views.Trace(meshes.PATH, 0.05),
        }

    def floor(self) -> views.Floor | None:
        """The arena and some more."""
        return views.Floor(-0.2, 6.0 * self.task.arena, 1.0)

    def poses(self, moment: Moment) -> dict[str, views.Pose]:
        """No stretched stand; the arena rests."""
        edge, centre = self.task.arena, max(self.task.centre_tolerance, 0.15)
        return super().poses(moment) | {
            "stand": views.Pose(self.pivot(moment)),
            "edge": views.Pose((0.0, 0.0, -0.18), scale=(edge, edge, 1.0)),
            "centre": views.Pose((0.0, 0.0, -0.18), scale=(centre, centre, 1.0)),
        }

    def arrows(self, moment: Moment) -> views.Arrows:
        """The acceleration, from the pivot."""
        push = np.append(moment.u[6:8], 0.0)
        arrow = views.scaled(push, 1.5 / self.strongest, 1.6)
        return super().arrows(moment) | {"input": (views.above(self.pivot(moment), -0.1), arrow)}

    def points(self, moment: Moment) -> dict[str, npt.ArrayLike]:
        """Also the pivot, on the floor."""
        return super().points(moment) | {"pivot": views.above(self.pivot(moment), -0.17)}

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """Also the distance of the pivot from the middle."""
        away = float(np.linalg.norm(self.system.accessors["pivot"](moment.y)))
        return (*super().readings(moment), f"pivot {away:.2f} m from the middle")


class TopPrecessionView(SleepingTopView):
    """A top whose axis is to move on a cone of the commanded tilt."""

    def angle(self, moment: Moment) -> float:
        """The commanded tilt."""
        return moment.aux["goal_tilt"]

    def parts(self) -> dict[str, views.Part]:
        """A cone for the rod."""
        return super().parts() | {"goal": views.ghost(goal_cone(), 0.2)}

    def poses(self, moment: Moment) -> dict[str, views.Pose]:
        """The cone ends at the ring."""
        size, angle = self.size * HEIGHT, self.angle(moment)
        wide, high = size * math.sin(angle), size * math.cos(angle)
        return super().poses(moment) | {"goal": views.Pose(scale=(wide, wide, high))}

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """Also the commanded tilt."""
        goal = math.degrees(moment.aux["goal_tilt"])
        return (*super().readings(moment), f"commanded tilt {goal:.1f} deg, {self.task.branch}")


# Meshes, each made once in a process.


@functools.cache
def dome() -> meshes.Mesh:
    """Equator and two meridians of the upper half of the unit sphere, thin."""
    arc = meshes.circle(61)[:31]
    bars = [meshes.tube(arc[:, axes], 0.004, meshes.LIGHT, 3) for axes in ([0, 2, 1], [2, 0, 1])]
    return meshes.join(meshes.loop(meshes.circle(31)[:-1], 0.004, meshes.LIGHT, 3), *bars)


@functools.cache
def goal_hoop() -> meshes.Mesh:
    """Thin hoop of radius 1 about z."""
    return meshes.loop(meshes.circle(65)[:-1], 0.022, meshes.GREEN, 6)


@functools.cache
def goal_cone() -> meshes.Mesh:
    """Open cone from the origin to the unit circle at z = 1, seen from both sides."""
    around, up = meshes.circle(49), np.array([0.0, 0.0, 1.0])
    rim, outward = around + up, around - up
    mesh = meshes.grid([0.0 * rim, rim], [outward, outward], meshes.GREEN)
    inside = meshes.Mesh(mesh.vertices, -mesh.normals, mesh.colors, mesh.triangles[:, ::-1])
    return meshes.join(mesh, inside)


@functools.cache
def rod() -> meshes.Mesh:
    """Thin round bar from the origin to z = 1."""
    return meshes.frustum(0.02, 0.02, 1.0, meshes.GREEN, 12)


@functools.cache
def top() -> meshes.Mesh:
    """Top of height 1.5 about z, its point at the origin; a rotor of radius 1 with sectors."""
    shaft = [(0.0, 0.0), (0.06, 0.16), (0.06, 1.4), (0.04, 1.46), (0.0, 1.5)]
    below = [(0.0, 0.5), (0.95, 0.66), (1.0, 0.7), (1.0, 0.75)]
    upper = [(1.0, 0.75), (1.0, 0.8), (0.95, 0.84), (0.0, 0.95)]
    return meshes.join(
        meshes.lathe(shaft, meshes.DARK, 20),
        meshes.sectors(below, [meshes.BLUE, meshes.SKY] * 3, 48),
        meshes.sectors(upper, [meshes.ORANGE, meshes.CREAM, *[meshes.BLUE, meshes.CREAM] * 2], 48),
    )


@functools.cache
def puck() -> meshes.Mesh:
    """Sliding carriage of height 0.2 whose upper face is at z = 0."""
    profile = [(0.0, -0.2), (0.42, -0.2), (0.45, -0.16), (0.45, -0.1), (0.14, -0.04), (0.0, 0.0)]
    return meshes.lathe(profile, meshes.STEEL, 32)
