"""Views of satellites with reaction wheels, and the path of L in the carrier beside them."""

import functools
import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import rotations
from rigid_envs.systems.free_body.view import (
    SPHERE,
    TO_X,
    TO_Y,
    FreeBodyView,
    ReorientView,
    panelled,
)
from rigid_envs.systems.gyrostat.pointing import FlyOver
from rigid_envs.tasks.core import Moment
from rigid_envs.watch import meshes, views

_SMALLER = 0.62  # satellite, so that its panels are in the sphere
_HUB, _STANDS = 0.4, 0.03  # radius of a wheel, of the smaller side of its face; height above it [m]
_COLORS = meshes.ORANGE, meshes.SKY, meshes.YELLOW  # of the wheels along e1, e2 and e3
_CAMERA = views.Camera((0.0, 0.0, -0.03), 7.5, azimuth=-55.0, elevation=24.0)
_BAR, _LOW, _ROW = 1.3, -1.8, 0.19  # length of a full bar, height of the first, to the next [m]
_END = _BAR + 0.03  # of the middle of a red end
_LEAST = 1e-9  # N m s; L of a smaller size has no direction
_EMPTY = 1e-3  # length of the bar of a wheel at rest: no size is 0
_AXES = np.eye(3)
_SPOT = 0.12  # radius of the target, and of the beam where it is [m]


class GyrostatView(FreeBodyView):
    """A satellite with its wheels, omega, L and the torque on the carrier.

    A wheel is seen on both faces that it is in. Its mark goes round once until it is full, as its
    motor turns it. Below, a bar of its colour is its spin momentum, positive to the right; where
    the bar meets a red end the wheel is full.
    """

    @property
    def capacity(self) -> float:
        """Spin momentum of a full wheel; of one of no task, that of I2 at 1 rad/s [N m s]."""
        return float(getattr(self.task, "capacity", self.system.moments[1]))

    @property
    def rate(self) -> float:
        """Rate about e2 that the momentum of a full wheel gives the carrier [rad/s]."""
        return self.capacity / float(self.system.moments[1])

    @property
    def momentum(self) -> float:
        """Largest at the start; where that is 0, of a full wheel [N m s]."""
        return float(getattr(self.task, "bias", 0.0)) or self.capacity

    @property
    def strongest(self) -> float:
        """All motors at their largest torque [N m]."""
        return math.sqrt(3.0) * super().strongest

    @property
    def wheels(self) -> list[int]:
        """Axes that have a wheel, 0 to 2."""
        return [k for k in range(3) if self.system.wheel_moments[k] > 0.0]

    def body(self) -> tuple[meshes.Mesh, tuple[float, float, float]]:
        """A box with the moments of the carrier, and panels along e1."""
        return panelled(self.system.moments, _SMALLER)

    def camera(self) -> views.Camera:
        """The whole sphere, and the bars below it."""
        return _CAMERA

    def parts(self) -> dict[str, views.Part]:
        """Also the wheels and their bars."""
        parts = super().parts()
        for k in self.wheels:
            parts[f"wheel{k + 1}"] = views.Part(wheel(k))
            parts[f"limits{k + 1}"] = views.Part(limits(), shiny=False)
            parts[f"bar{k + 1}"] = views.Part(bar(k), shiny=False)
        return parts

    def poses(self, moment: Moment) -> dict[str, views.Pose]:
        """The wheels turn in the carrier, the bars stand still."""
        poses, shares = super().poses(moment), self.shares(moment).tolist()
        for row, k in enumerate(self.wheels):
            turn = rotations.quaternion_from_axis_angle(_AXES[k], 2.0 * math.pi * shares[k])
            wide = _HUB * float(np.delete(self.scale, k).min())
            x, y, z = np.where(_AXES[k], self.scale[k] + 2.0 * _STANDS, wide).tolist()
            poses[f"wheel{k + 1}"] = views.Pose(
                q=rotations.multiply(poses["body"].q, turn), scale=(x, y, z)
            )
            azimuth = self.scene.camera.azimuth
            place, long = (0.0, 0.0, _LOW - row * _ROW), min(max(abs(shares[k]), _EMPTY), 1.0)
            poses[f"limits{k + 1}"] = views.Pose(place, to_side(azimuth, 1.0))
            way = to_side(azimuth, math.copysign(1.0, shares[k]))
            poses[f"bar{k + 1}"] = views.Pose(place, way, (long, 1.0, 1.0))
        return poses

    def shares(self, moment: Moment) -> Array:
        """Spin momenta of the wheels over the capacity, shape (3,)."""
        return np.asarray(self.system.accessors["spin_momenta"](moment.y) / self.capacity)

    def torque(self, moment: Moment) -> Array:
        """Torque on the carrier, of motors and from outside, in body axes [N m], shape (3,)."""
        motors = np.where(self.system.wheel_moments > 0.0, moment.u[:3], 0.0)
        return np.asarray(moment.u[3:] - motors)

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """Also how full the wheels are."""
        percent = np.round(100.0 * self.shares(moment)[self.wheels]) + 0.0
        full = ", ".join(f"{share:.0f} %" for share in percent)
        lines = (f"wheels at {full} of {self.capacity:g} N m s",) if self.wheels else ()
        return (*super().readings(moment), *lines)

    @staticmethod
    def insets(system: Any, y: Array, times: Array, driven: bool) -> list[views.Panel]:
        """Path of L in the carrier, where there is one."""
        L = system.L_body(y)
        size = np.linalg.norm(L, axis=-1, keepdims=True)
        return [_momentum_sphere(L / size, times)] if size.min() > _LEAST else []


class WheelReorientView(GyrostatView, ReorientView):
    """A satellite with three wheels, and its goal attitude as a larger outline."""

    def parts(self) -> dict[str, views.Part]:
        """An outline as the goal: a solid ghost would hide the wheels."""
        return super().parts() | {"goal": views.ghost(outline(), 0.6)}


class TwoWheelsView(WheelReorientView):
    """A satellite with two wheels, and its goal attitude as a larger outline."""


class DualSpinView(GyrostatView):
    """A satellite whose rotor is to take up L: its axis e1 is to point into one of two rings.

    The bar is full when the rotor has all of L.
    """

    axis = (1.0, 0.0, 0.0)

    @property
    def capacity(self) -> float:
        """Angular momentum of a flat spin in the middle of the starts [N m s]."""
        rates = self.task.least_start_rate + self.task.largest_start_rate
        return 0.5 * float(self.system.moments[2] * rates)

    def parts(self) -> dict[str, views.Part]:
        """Also the rings."""
        return super().parts() | {"goal": views.ghost(rings(), 0.8)}

    def poses(self, moment: Moment) -> dict[str, views.Pose]:
        """The rings are about L, which stays."""
        q = views.from_z(self.direction(moment))
        return super().poses(moment) | {"goal": views.Pose(q=q, scale=(SPHERE,) * 3)}

    def direction(self, moment: Moment) -> Array:
        """Of L in the world, shape (3,); upwards where there is none."""
        L = self.system.accessors["L_world"](moment.y)
        size = float(np.linalg.norm(L))
        return np.asarray(L / size) if size > _LEAST else _AXES[2]

    def shares(self, moment: Moment) -> Array:
        """Spin momenta over L, shape (3,)."""
        read = self.system.accessors
        size = float(np.linalg.norm(read["L_body"](moment.y)))
        return np.asarray(read["spin_momenta"](moment.y) / max(size, _LEAST))

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """Angle between the rotor and L, rate of the carrier, what the rotor has of L."""
        e1 = rotations.rotate(self.system.accessors["q"](moment.y), self.axis)
        off = math.degrees(math.acos(min(abs(float(e1 @ self.direction(moment))), 1.0)))
        rate = float(np.linalg.norm(self.system.accessors["omega_body"](moment.y)))
        share = round(100.0 * float(self.shares(moment)[0])) + 0.0
        return (
            f"{off:.1f} deg from L to the rotor   {rate:.3f} rad/s",
            f"rotor has {share:.0f} % of L",
        )


class WheelTrackView(GyrostatView):
    """A satellite over the Earth, seen from a place that flies with it and does not turn.

    The axes are those of the pass: y along the flight, z up in its middle. On the sphere are the
    target, a green disk, where the camera looks, at the end of its beam, and the paths of both.
    """

    axis = (0.0, 0.0, 1.0)

    @property
    def rate(self) -> float:
        """Largest rate of the line of sight [rad/s]."""
        return float(self.task.overhead_rate)

    def camera(self) -> views.Camera:
        """Beside the plane of the orbit: the satellite flies to the right."""
        return replace(super().camera(), azimuth=-15.0, elevation=18.0)

    def parts(self) -> dict[str, views.Part]:
        """Also the beam of the camera, the target and the Earth."""
        return super().parts() | {
            "earth": views.ghost(earth(self.task.ground / (self.task.ground + 1.0)), 0.3),
            "target": views.ghost(meshes.goal_disk(), 1.0),
            "beam": views.ghost(beam(), 1.0),
        }

    def traces(self) -> dict[str, views.Trace]:
        """Also the path of the target."""
        return super().traces() | {"target": views.Trace(meshes.GREEN, 0.025, length=120)}

    def poses(self, moment: Moment) -> dict[str, views.Pose]:
        """The Earth turns as the satellite flies."""
        poses, sight = super().poses(self.seen(moment)), self.sight(moment)
        up = views.from_z([0.0, moment.aux["sine"], moment.aux["cosine"]])
        poses["earth"] = views.Pose(q=up, scale=(SPHERE,) * 3)
        poses["target"] = views.Pose(SPHERE * sight, views.from_z(-sight), (_SPOT, _SPOT, 1.0))
        poses["beam"] = views.Pose(q=poses["body"].q, scale=(_SPOT, _SPOT, SPHERE))
        return poses

    def arrows(self, moment: Moment) -> views.Arrows:
        """In the axes of the pass."""
        return super().arrows(self.seen(moment))

    def points(self, moment: Moment) -> dict[str, npt.ArrayLike]:
        """Where camera and target are on the sphere."""
        return super().points(self.seen(moment)) | {"target": SPHERE * self.sight(moment)}

    def seen(self, moment: Moment) -> Moment:
        """The moment in the axes of the pass."""
        y, part = moment.y.copy(), self.system.components["q"]
        frame = np.array([moment.aux[f"pass_{name}"] for name in "wxyz"])
        y[part] = rotations.multiply(rotations.conjugate(frame), y[part])
        return replace(moment, y=y)

    def sight(self, moment: Moment) -> Array:
        """Direction of the target in the axes of the pass, shape (3,)."""
        aux, path = moment.aux, FlyOver(self.task.orbit_rate, 1.0 / self.task.ground)
        phi = math.atan2(aux["sine"], aux["cosine"])
        return path.sight(phi, math.atan2(aux["target_sine"], aux["target_cosine"])).direction

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """Pointing error, its mean, how full the wheels are."""
        camera = rotations.rotate(self.seen(moment).y[:4], self.axis)
        off = math.degrees(math.acos(min(max(float(camera @ self.sight(moment)), -1.0), 1.0)))
        n = moment.aux["n_errors"]
        mean = math.degrees(moment.aux["error_sum"] / n) if n else 0.0
        allowed = math.degrees(self.task.bound)
        error = f"{off:.1f} deg from the target, mean {mean:.2f} of at most {allowed:.2f} deg"
        return (error, *super().readings(moment)[1:])


def to_side(azimuth: float, side: float) -> Array:
    """Quaternion of the turn of x to the right of a camera, of side 1, or to its left, of -1."""
    return rotations.quaternion_from_axis_angle(_AXES[2], math.radians(azimuth + 90.0 * side))


# Inset of a replay page.


def _momentum_sphere(direction: Array, times: Array) -> views.Panel:
    """Path of the direction of L on the unit sphere, in body axes."""
    scene = views.Scene(
        parts={"sphere": views.Part(meshes.chequered_ball(), opacity=0.55)},
        camera=views.Camera((0.0, 0.0, 0.12), 5.0, 40.0, 22.0, 32.0),
        arrows={"L": views.Arrow(views.INSET_BLUE, 0.035, "L"), **views.body_axes()},
        traces={"L": views.Trace(views.INSET_RED, 0.045)},
    )
    axes = {f"e{k + 1}": (e, 0.28 * e) for k, e in enumerate(_AXES)}
    frames = [
        views.SceneFrame(
            {"sphere": views.Pose()},
            {**axes, "L": ((0.0, 0.0, 0.0), 1.25 * point)},
            {"L": views.LIFT * point},
        )
        for point in direction
    ]
    return views.Panel("L on the momentum sphere", scene, frames, times)


# Meshes, each made once in a process.


@functools.cache
def outline() -> meshes.Mesh:
    """Edges of the box of a satellite, and its panels."""
    edges = []
    for k in range(3):
        size = np.where(_AXES[k], 1.035, 0.035)
        for place in itertools.product((-0.5, 0.5), repeat=2):
            edges.append(meshes.moved(meshes.box(size, [meshes.GREEN]), np.insert(place, k, 0.0)))
    return meshes.join(*edges, *meshes.panels())


@functools.cache
def wheel(k: int) -> meshes.Mesh:
    """Wheel of radius 1 and height 1 about an axis, dark, with a rim and a mark of its colour."""
    rim = meshes.cylinder(1.0, 1.0, _COLORS[k], 24)
    core = meshes.cylinder(0.82, 1.01, meshes.DARK, 24)
    mark = meshes.moved(meshes.box((0.8, 0.2, 1.02), [_COLORS[k]]), (0.45, 0.0, 0.0))
    return meshes.moved(meshes.join(rim, core, mark), rotation=(TO_X, TO_Y, _AXES)[k])


@functools.cache
def bar(k: int) -> meshes.Mesh:
    """Bar of a full wheel, from the origin along x."""
    return meshes.moved(meshes.box((_BAR, 0.12, 0.12), [_COLORS[k]]), (0.5 * _BAR, 0.0, 0.0))


@functools.cache
def limits() -> meshes.Mesh:
    """Line along x on which a bar grows, with its middle and red ends."""
    line = meshes.box((2.0 * _BAR, 0.03, 0.03), [meshes.GREY])
    middle = meshes.box((0.03, 0.15, 0.15), [meshes.STEEL])
    end = meshes.box((0.06, 0.15, 0.15), [meshes.RED])
    return meshes.join(line, middle, *(meshes.moved(end, (x, 0.0, 0.0)) for x in (-_END, _END)))


@functools.cache
def rings() -> meshes.Mesh:
    """Rings about both ends of the z-axis of the unit sphere."""
    ring = meshes.loop(0.13 * meshes.circle(49)[:-1], 0.02, meshes.GREEN, 8)
    return meshes.join(*(meshes.moved(ring, (0.0, 0.0, z)) for z in (1.0, -1.0)))


@functools.cache
def beam() -> meshes.Mesh:
    """Cone from its tip in the origin to a circle of radius 1 at z = 1."""
    return meshes.lathe([(0.0, 0.0), (1.0, 1.0), (0.0, 1.0)], meshes.ORANGE, 24)


@functools.cache
def earth(sine: float) -> meshes.Mesh:
    """The part about -z of the unit sphere that is the Earth in the sky; seen from inside.

    Args:
        sine: of the angle from its middle to its rim.
    """
    angle = np.linspace(math.asin(sine), 0.0, 6)
    return meshes.lathe(np.stack([np.sin(angle), -np.cos(angle)], axis=-1), meshes.SKY, 32)
