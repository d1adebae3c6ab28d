"""View of a satellite on its orbit, in the Earth's magnetic field."""

import functools
import math
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import rotations
from rigid_envs.systems.free_body.view import LONGEST, OUTSIDE, SPHERE, FreeBodyView, panelled
from rigid_envs.tasks.core import Moment
from rigid_envs.watch import meshes, views

_CAMERA = views.Camera((0.0, 0.0, -0.45), 8.5, azimuth=-55.0, elevation=24.0)
_SMALLER = 0.5  # satellite, so that L is seen when it is small
_ORBIT = (0.0, 0.0, -2.3)  # middle of the small Earth [m]
_GLOBE, _RADIUS = 0.36, 0.72  # radii of the Earth and of the orbit, which is drawn wider [m]
_FIELD = meshes.ORANGE
_ACROSS = 1.2  # longest dipole [m]
_LEAST = 1e-30  # of L and B that have a direction


class SatelliteView(FreeBodyView):
    """A satellite in the axes of space, L, the field B and the dipole of its coils.

    The arrow of the field goes through the satellite, and from one side of the sphere to the other
    where the field is strongest. Below is the Earth with lines of its field, and the orbit, not to
    scale, with the place of the satellite and the field there. On the sphere, whose equator is in
    the plane of the orbit, is the Earth as the satellite sees it.
    """

    @property
    def rate(self) -> float:
        """Largest rate at the start; without a task, twice that of the orbit, if any [rad/s]."""
        return float(getattr(self.task, "largest_start_rate", 2.0 * self.system.n or 1.0))

    @property
    def strongest(self) -> float:
        """Largest dipole [A m^2]."""
        return float(getattr(self.task, "dipole", 1.0))

    def body(self) -> tuple[meshes.Mesh, tuple[float, float, float]]:
        """A box with the moments of the satellite, and panels along e1."""
        return panelled(self.system.moments, _SMALLER)

    def camera(self) -> views.Camera:
        """The whole sphere, and the orbit below it."""
        return _CAMERA

    def parts(self) -> dict[str, views.Part]:
        """Also the Earth on the sphere, and the Earth, the orbit and the place on it below."""
        return super().parts() | {
            "nadir": views.Part(globe()),
            "earth": views.Part(globe()),
            "lines": views.Part(lines(), shiny=False),
            "orbit": views.Part(orbit(), shiny=False),
            "place": views.Part(place()),
        }

    def vectors(self) -> dict[str, views.Arrow]:
        """Angular momentum, field, dipole; the field in the orbit."""
        return {
            "L": views.Arrow(meshes.MOMENTUM, 0.06, "L"),
            "field": views.Arrow(_FIELD, 0.045, "B"),
            "input": views.Arrow(meshes.INPUT, 0.07, "dipole"),
            "here": views.Arrow(_FIELD, 0.03, "B"),
        }

    def traces(self) -> dict[str, views.Trace]:
        """Path of the tip of L."""
        return {"L": views.Trace(meshes.MOMENTUM, 0.025)}

    def poses(self, moment: Moment) -> dict[str, views.Pose]:
        """The Earth's axis stays, as does the orbit."""
        tilt, r = self.system.inclination, self.radial(moment)
        q = views.from_z((0.0, math.sin(tilt), math.cos(tilt)))
        return super().poses(moment) | {
            "nadir": views.Pose(-SPHERE * r, q, (0.16,) * 3),
            "earth": views.Pose(_ORBIT, q, (_GLOBE,) * 3),
            "lines": views.Pose(_ORBIT, q, (_RADIUS,) * 3),
            "orbit": views.Pose(_ORBIT, scale=(_RADIUS,) * 3),
            "place": views.Pose(np.add(_ORBIT, _RADIUS * r), scale=(0.07,) * 3),
        }

    def radial(self, moment: Moment) -> Array:
        """Direction away from the Earth's centre in the world, shape (3,)."""
        return self.world(moment, "radial_body")

    def world(self, moment: Moment, name: str) -> Array:
        """A vector of the system in body axes, in the world, shape (3,)."""
        read = self.system.accessors
        return rotations.rotate(read["q"](moment.y), read[name](moment.y))

    def arrows(self, moment: Moment) -> views.Arrows:
        """L begins in the middle, the field goes through it; the dipole stands out of the body."""
        centre, y = (0.0, 0.0, 0.0), moment.y
        B = self.world(moment, "field_body") / max(2.0 * self.system.b, _LEAST)
        m = rotations.rotate(self.system.accessors["q"](y), moment.u[:3])
        push = views.scaled(m, _ACROSS / self.strongest, LONGEST)
        outside = OUTSIDE * push / max(float(np.linalg.norm(push)), _LEAST)
        here = np.add(_ORBIT, _RADIUS * self.radial(moment))
        return {
            "L": (centre, self.momentum_arrow(moment)),
            "field": (-SPHERE * B, 2.0 * SPHERE * B),
            "input": (outside, push),
            "here": (here, 0.55 * B),
        }

    def momentum_arrow(self, moment: Moment) -> Array:
        """L as the length of its arrow [m], shape (3,)."""
        L = self.system.accessors["L_world"](moment.y)
        return views.scaled(L, SPHERE / self.momentum, LONGEST)

    def points(self, moment: Moment) -> dict[str, npt.ArrayLike]:
        """Tip of L."""
        return {"L": self.momentum_arrow(moment)}

    def angle(self, moment: Moment) -> float:
        """Angle between L and the line of the field [deg]; 90 where there is no direction."""
        L, B = (self.system.accessors[name](moment.y) for name in ("L_body", "field_body"))
        along, sizes = abs(float(L @ B)), float(np.linalg.norm(L) * np.linalg.norm(B))
        return math.degrees(math.acos(min(along / max(sizes, _LEAST), 1.0)))

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """Rate, and the angle between L and the field."""
        rate = float(np.linalg.norm(self.system.accessors["omega_body"](moment.y)))
        return (f"|omega| {rate:.3g} rad/s   L is {self.angle(moment):.0f} deg from B",)

    @staticmethod
    def insets(system: Any, y: Array, times: Array, driven: bool) -> list[views.Panel]:
        """The polhode; where gravity turns the body, its ellipsoid rolls on no plane."""
        return FreeBodyView.insets(system, y, times, driven or system.n > 0.0)


class MagneticDetumbleView(SatelliteView):
    """A tumbling satellite; what L has across the field can be braked."""

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """Also the rate that is to be reached."""
        rate = float(np.linalg.norm(self.system.accessors["omega_body"](moment.y)))
        return (
            f"|omega| {rate:.3g} rad/s, to be below {self.task.rate_tolerance:g}",
            f"L is {self.angle(moment):.0f} deg from the line of B",
        )


# Meshes, each made once in a process.


@functools.cache
def globe() -> meshes.Mesh:
    """Earth of radius 1, its axis along z, white about its poles."""
    angle = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 19)
    profile = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    profile[[0, -1], 0] = 0.0
    bands = ((0, 3, meshes.CREAM), (2, 17, meshes.SKY), (16, 19, meshes.CREAM))
    return meshes.join(*(meshes.lathe(profile[i:j], color, 28) for i, j, color in bands))


@functools.cache
def lines() -> meshes.Mesh:
    """Lines of the field of a dipole along z, out to radius 1 on its equator."""
    theta = np.linspace(0.5, math.pi - 0.5, 21)
    r = np.sin(theta) ** 2
    line = np.stack([r * np.sin(theta), 0.0 * theta, r * np.cos(theta)], axis=-1)
    return meshes.join(
        *(
            meshes.moved(meshes.tube(line, 0.012, _FIELD, 3), rotation=_about_z(k * math.pi / 4.0))
            for k in range(8)
        )
    )


def _about_z(angle: float) -> Array:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


@functools.cache
def orbit() -> meshes.Mesh:
    """Thin circle of radius 1 across z."""
    return meshes.loop(meshes.circle(61)[:-1], 0.02, meshes.STEEL, 4)


@functools.cache
def place() -> meshes.Mesh:
    """Ball of radius 1."""
    return meshes.ball(1.0, meshes.RED, 8)
