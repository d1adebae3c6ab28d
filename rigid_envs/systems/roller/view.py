"""Views of the wheel on an incline or in a valley."""

import functools
import math
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import rotations
from rigid_envs.tasks.core import Moment
from rigid_envs.watch import meshes, views

MASSES = 6
AXLE = views.from_z((0.0, 1.0, 0.0))  # the axis of the mesh, z, is that of rolling, y


class RollerView(views.View):
    """A spoked wheel in a valley, on a hill or on an incline, with masses on its spokes.

    The motion is in the plane of x and z. The distance of the masses from the axle is as the root
    of the inertia ratio.
    """

    @property
    def largest(self) -> float:
        """Largest inertia ratio."""
        return float(max(self.system.beta + getattr(self.task, "beta_change", 0.0), 1.0))

    @property
    def bend(self) -> float:
        """Radius of the path of the centre [m]; that of a plane for a straight one."""
        curvature = self.system.curvature
        return math.inf if curvature == 0.0 else float(1.0 / curvature)

    def centre(self, moment: Moment) -> Array:
        """Centre of the wheel, from that at s = 0 [m], shape (3,)."""
        x, z = self.system.accessors["place"](moment.y)
        return np.array([x, 0.0, z])

    def attitude(self, moment: Moment) -> Array:
        """Quaternion of the wheel."""
        half = 0.5 * float(self.system.accessors["turn"](moment.y))
        turn = [math.cos(half), 0.0, math.sin(half), 0.0]
        return np.asarray(rotations.multiply(turn, AXLE))

    def parts(self) -> dict[str, views.Part]:
        """Wheel, masses and track."""
        track = slab() if self.bend <= 0.0 or math.isinf(self.bend) else valley()
        masses = {f"mass{k}": views.Part(mass()) for k in range(MASSES)}
        return {"wheel": views.Part(spoked_wheel()), "track": views.Part(track), **masses}

    def camera(self) -> views.Camera:
        """From the side, with the wheel."""
        return views.Camera(distance=12.0 * self.system.radius, azimuth=-80.0, follow="wheel")

    def vectors(self) -> dict[str, views.Arrow]:
        """Velocity and force."""
        width = 0.1 * self.system.radius
        return {
            "velocity": views.Arrow(meshes.SKY, width, "v"),
            "input": views.Arrow(meshes.INPUT, width, "force"),
        }

    def traces(self) -> dict[str, views.Trace]:
        """Path of the centre."""
        return {"path": views.Trace(meshes.PATH, 0.05 * self.system.radius, length=200)}

    def track(self) -> views.Pose:
        """Pose of the track: its middle below the centre at s = 0, or its bottom in a valley."""
        r, bend, slope = self.system.radius, self.bend, self.system.slope
        tilt = np.array([math.cos(0.5 * slope), 0.0, math.sin(0.5 * slope), 0.0])
        if bend <= 0.0 or math.isinf(bend):
            down = np.array([-r * math.sin(slope), 0.0, -r * math.cos(slope)])
            return views.Pose(down, tilt, (60.0 * r, 3.0 * r, 0.2 * r))
        middle = bend * np.array([math.sin(slope), 0.0, math.cos(slope)])
        return views.Pose(middle, scale=(bend + r, 2.4 * r, bend + r))

    def poses(self, moment: Moment) -> dict[str, views.Pose]:
        """The masses stand on the spokes."""
        r, q, centre = self.system.radius, self.attitude(moment), self.centre(moment)
        share = (self.system.beta + moment.input.beta_change) / self.largest
        out = 0.74 * r * math.sqrt(min(share, 1.0))
        poses = {"wheel": views.Pose(centre, q, (r, r, r)), "track": self.track()}
        for k in range(MASSES):
            angle = k * math.pi / 3.0
            spoke = rotations.rotate(q, (out * math.cos(angle), out * math.sin(angle), 0.0))
            poses[f"mass{k}"] = views.Pose(centre + spoke, q, (r, r, r))
        return poses

    def arrows(self, moment: Moment) -> views.Arrows:
        """Both in front of the wheel, from its axle."""
        descent = float(self.system.accessors["descent"](moment.y))
        along = np.array([math.cos(descent), 0.0, -math.sin(descent)])
        r, system = self.system.radius, self.system
        start = self.centre(moment) - (0.0, 0.3 * r, 0.0)
        speed = float(system.accessors["velocity"](moment.y))
        pull = views.scaled(moment.input.force * along, 2.0 * r / (system.m * system.g), 3.0 * r)
        return {
            "velocity": (start, views.scaled(speed * along, 0.5, 3.0 * r)),
            "input": (start, pull),
        }

    def points(self, moment: Moment) -> dict[str, npt.ArrayLike]:
        """The centre, in front of the wheel."""
        return {"path": self.centre(moment) - (0.0, 0.25 * self.system.radius, 0.0)}

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """Inertia ratio and speed."""
        ratio = self.system.beta + moment.input.beta_change
        speed = float(self.system.accessors["velocity"](moment.y))
        return (f"inertia ratio {ratio:.2f}   speed {speed:.2f} m/s",)


class RollPumpView(RollerView):
    """A wheel that is to pass a rim of its valley; the rims are green, with ghosts of the wheel."""

    def parts(self) -> dict[str, views.Part]:
        """The valley ends at the rim; ghosts stand there."""
        ghosts = {f"goal{k}": views.ghost(goal_wheel(), 0.4) for k in (0, 1)}
        return super().parts() | {"track": views.Part(valley(self.task.rim)), **ghosts}

    def camera(self) -> views.Camera:
        """The whole valley from the side."""
        wide = 2.0 * (self.bend + self.system.radius)
        high = 0.5 * self.bend * (1.25 - math.cos(self.task.rim))
        return views.Camera((0.0, 0.0, high), 1.72 * wide, azimuth=-82.0, elevation=14.0)

    def floor(self) -> views.Floor | None:
        """Below the valley, which rests on it."""
        low = self.bend - 1.03 * (self.bend + self.system.radius)
        return views.Floor(low, 8.0 * self.bend, 1.0)

    def poses(self, moment: Moment) -> dict[str, views.Pose]:
        """Also the ghosts."""
        r, bend, rim = self.system.radius, self.bend, self.task.rim
        x, z = bend * math.sin(rim), bend * (1.0 - math.cos(rim))
        ghosts = {
            f"goal{k}": views.Pose((side * x, 0.0, z), AXLE, (r, r, r))
            for k, side in enumerate((-1, 1))
        }
        return super().poses(moment) | ghosts

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """Also the angle."""
        angle = math.degrees(-float(self.system.accessors["descent"](moment.y)))
        rim = math.degrees(self.task.rim)
        return (*super().readings(moment), f"{abs(angle):.0f} deg from the bottom, rim {rim:.0f}")


# Meshes, each made once in a process.


@functools.cache
def spoked_wheel() -> meshes.Mesh:
    """Wheel of radius 1 about z with six spokes and a red mark at +y."""
    ways = meshes.circle(7)[:-1]
    spokes = [meshes.tube([0.1 * way, 0.9 * way], 0.03, meshes.GREY, 8) for way in ways]
    rim = meshes.ring(0.86, 1.0, 0.3, meshes.STEEL, 72)
    return meshes.join(rim, meshes.cylinder(0.14, 0.4, meshes.DARK, 24), *spokes, meshes.mark(0.34))


@functools.cache
def goal_wheel() -> meshes.Mesh:
    """Ring of radius 1 about z: where a wheel is to be."""
    return meshes.ring(0.84, 1.0, 0.3, meshes.GREEN, 48)


@functools.cache
def mass() -> meshes.Mesh:
    """Small ball that slides on a spoke, of radius 0.12."""
    return meshes.ball(0.12, meshes.RED, n=10)


@functools.cache
def slab() -> meshes.Mesh:
    """Board of side 1 below z = 0."""
    return meshes.moved(meshes.box((1.0, 1.0, 1.0), [meshes.LIGHT]), (0.0, 0.0, -0.5))


@functools.cache
def valley(rim: float = 1.2) -> meshes.Mesh:
    """Trough whose bottom is a circle of radius 1 about y, of width 1.

    Args:
        rim: angle from the bottom [rad], on both sides, from which on it is green.
    """
    n = 2 * max(2, round(6.0 * rim))
    ends = np.linspace(-rim, rim, n + 1)
    tones = [(0.66, 0.73, 0.81), (0.80, 0.84, 0.88)]
    bands = [_arc(a, b, tones[k % 2]) for k, (a, b) in enumerate(pairwise(ends))]
    edges = [_arc(-rim - 0.08, -rim, meshes.GREEN), _arc(rim, rim + 0.08, meshes.GREEN)]
    return meshes.join(*bands, *edges)


def _arc(first: float, last: float, color: meshes.Color) -> meshes.Mesh:
    """Part of the trough between two angles."""
    angle = np.linspace(first, last, 3)
    out = np.stack([np.sin(angle), 0.0 * angle, -np.cos(angle)], axis=-1)
    side = np.array([0.0, 0.5, 0.0])
    inner, outer = out, 1.03 * out
    edges = [inner - side, inner + side, outer + side, outer - side]
    normals = [-out, 0.0 * out + side, out, 0.0 * out - side]
    sheets = [meshes.grid([edges[k - 1], edges[k]], [normals[k - 1]] * 2, color) for k in range(4)]
    for k, s in ((0, -1.0), (-1, 1.0)):
        along = s * np.array([math.cos(angle[k]), 0.0, math.sin(angle[k])])
        near, far = (inner[k], outer[k]) if s < 0 else (outer[k], inner[k])
        corners = [[near - side, near + side], [far - side, far + side]]
        sheets.append(meshes.grid(corners, np.broadcast_to(along, (2, 2, 3)), color))
    return meshes.join(*sheets)
