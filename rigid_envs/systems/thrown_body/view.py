"""View of a thrown body: it flies above a floor, and leaves the path of its centre of mass."""

import functools
import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array
from rigid_envs.systems.free_body.view import FreeBodyView, racket_frame, sides
from rigid_envs.tasks.core import Moment
from rigid_envs.watch import meshes, views

HIGHEST = 1.5  # of a centre of mass that is still in the picture [m]


class ThrownBodyView(FreeBodyView):
    """A body of real size in flight, with omega, L and the torque, above a ring at Z = 0."""

    @property
    def size(self) -> float:
        """Unit of the lengths of free bodies, whose diagonal is 2.1 [m]."""
        return math.sqrt(6.0 * float(self.system.moments.sum()) / float(self.system.m)) / 2.1

    @property
    def reach(self) -> float:
        """Largest distance of a point of the body from its centre of mass [m]."""
        return 1.05 * self.size

    @property
    def rate(self) -> float:
        """Rate that is drawn 1.5 units long [rad/s]: two turns a second."""
        return 4.0 * math.pi

    def body(self) -> tuple[meshes.Mesh, tuple[float, float, float]]:
        """A racket, where the box would be narrow along e2 and flat along e3."""
        x, y, z = sides(self.system.moments)
        if 2.0 * y < x and 2.0 * z < y:
            return racket(), (1.0, 1.0, 1.0)
        return super().body()

    def centre(self, moment: Moment) -> Array:
        """Centre of mass [m], shape (3,)."""
        return np.asarray(self.system.accessors["position"](moment.y))

    def parts(self) -> dict[str, views.Part]:
        """The body, and a ring at the height of the hand."""
        mesh, self.scale = self.body()
        return {"body": views.Part(mesh), "hand": views.ghost(hoop())}

    def camera(self) -> views.Camera:
        """With the body, from the floor to the top of a throw, and the text above it."""
        far = 3.6 * (0.5 * HIGHEST + self.reach)
        return views.Camera((0.0, 0.0, 0.6 * HIGHEST), far, elevation=12.0, follow="body")

    def vectors(self) -> dict[str, views.Arrow]:
        """Those of a free body, of the size of this one."""
        return {
            name: replace(arrow, width=self.size * arrow.width)
            for name, arrow in super().vectors().items()
        }

    def traces(self) -> dict[str, views.Trace]:
        """Path of the centre of mass."""
        return {"centre": views.Trace(meshes.PATH, 0.03 * self.size)}

    def floor(self) -> views.Floor | None:
        """So far below the hand that the body does not dip into it."""
        return views.Floor(-self.reach, 40.0 * self.reach, self.reach)

    def poses(self, moment: Moment) -> dict[str, views.Pose]:
        """The ring goes below the body."""
        centre, wide = self.centre(moment), self.reach
        x, y, z = self.scale
        q = self.system.accessors["q"](moment.y)
        return {
            "body": views.Pose(centre, q, (self.size * x, self.size * y, self.size * z)),
            "hand": views.Pose((centre[0], centre[1], 0.0), scale=(wide, wide, wide)),
        }

    def arrows(self, moment: Moment) -> views.Arrows:
        """Those of a free body, at this one."""
        return {
            name: (self.centre(moment) + self.size * np.asarray(start), self.size * np.asarray(way))
            for name, (start, way) in super().arrows(moment).items()
        }

    def points(self, moment: Moment) -> dict[str, npt.ArrayLike]:
        """The centre of mass."""
        return {"centre": self.centre(moment)}

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """Also height, |L|, and the twist: angle of L about e1, from e3 towards e2."""
        read = self.system.accessors
        L = read["L_body"](moment.y)
        height, rise = np.round([self.centre(moment)[2], read["velocity"](moment.y)[2]], 2) + 0.0
        twist = round(math.degrees(math.atan2(L[1], L[2])))
        return (
            f"height {height:.2f} m   upward velocity {rise:.2f} m/s",
            *super().readings(moment),
            f"|L| {np.linalg.norm(L):.3g} N m s   twist about e1 {twist} deg",
        )


class RacketCatchView(ThrownBodyView):
    """A racket, and a ghost at the height of the hand as it is to be caught."""

    def parts(self) -> dict[str, views.Part]:
        """The ghost instead of the ring."""
        return {"body": super().parts()["body"], "catch": views.ghost(racket())}

    def poses(self, moment: Moment) -> dict[str, views.Pose]:
        """The ghost does not move."""
        body = super().poses(moment)["body"]
        x, y, _ = self.centre(moment)
        goal = np.array([moment.aux[f"goal_{name}"] for name in "wxyz"])
        return {"body": body, "catch": views.Pose((x, y, 0.0), goal, body.scale)}

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """Also the time left."""
        left = max(moment.aux["time_left"], 0.0)
        return (*super().readings(moment), f"{left:.2f} s left to the catch")


# Meshes, each made once in a process.


@functools.cache
def racket() -> meshes.Mesh:
    """Racket with a face, orange on +z and blue on -z."""
    upper = meshes.lathe([(1.0, 0.0), (1.0, 0.03), (0.0, 0.03)], meshes.ORANGE)
    lower = meshes.lathe([(0.0, -0.03), (1.0, -0.03), (1.0, 0.0)], meshes.SKY)
    face = meshes.moved(meshes.join(upper, lower), (0.45, 0.0, 0.0), scale=(0.49, 0.39, 1.0))
    return meshes.join(racket_frame(), face)


@functools.cache
def hoop() -> meshes.Mesh:
    """Thin hoop of radius 1 about z."""
    return meshes.loop(meshes.circle(65)[:-1], 0.015, meshes.STEEL, 6)
