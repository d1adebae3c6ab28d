"""Views of the ball that rolls at a given velocity: parking, following, the grid."""

import functools
import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import rotations
from rigid_envs.tasks.core import Moment
from rigid_envs.watch import meshes, views

OUTSIDE = 1.02  # distance of the path on the ball from its centre [radii]: chords stay outside
INSIDE = 0.98  # size of the ghost [radii]: the ball hides it where they coincide
HOME, UPRIGHT = (0.0, 0.0), (1.0, 0.0, 0.0, 0.0)


class BallView(views.View):
    """A ball with octants in eight colours, the path of its contact, and the input."""

    @property
    def radius(self) -> float:
        """Radius of the ball [m]."""
        return float(self.system.radius)

    @property
    def strongest(self) -> float:
        """Input that is drawn 1.2 radii long."""
        return 1.0

    def centre(self, moment: Moment) -> Array:
        """Centre of the ball in the world [m], shape (3,)."""
        return np.append(self.system.accessors["position"](moment.y), self.radius)

    def normal(self, moment: Moment) -> Array:
        """Normal of the plane in the world, shape (3,)."""
        return np.array([0.0, 0.0, 1.0])

    def push(self, moment: Moment) -> Array:
        """Input in world axes, shape (3,)."""
        return np.append(moment.u[:2], 0.0)

    def parts(self) -> dict[str, views.Part]:
        """The ball."""
        return {"ball": views.Part(octant_ball())}

    def vectors(self) -> dict[str, views.Arrow]:
        """The input."""
        return {"input": views.Arrow(meshes.INPUT, 0.12 * self.radius, "velocity")}

    def traces(self) -> dict[str, views.Trace]:
        """Path of the contact on the plane, and on the ball (in radii, as its mesh)."""
        return {
            "path": views.Trace(meshes.PATH, 0.06 * self.radius),
            "on_ball": views.Trace(meshes.PATH, 0.05, part="ball"),
        }

    def floor(self) -> views.Floor | None:
        """Chequered, a metre a cell."""
        return views.Floor(0.0, 40.0, 1.0)

    def poses(self, moment: Moment) -> dict[str, views.Pose]:
        """The ball."""
        q = self.system.accessors["q"](moment.y)
        return {"ball": views.Pose(self.centre(moment), q, (self.radius,) * 3)}

    def arrows(self, moment: Moment) -> views.Arrows:
        """The input, from the side of the ball to which it points."""
        push = self.push(moment)
        arrow = views.scaled(push, 1.2 * self.radius / self.strongest, 1.5 * self.radius)
        length = float(np.linalg.norm(push))
        side = push / length if length > 0.0 else push
        return {"input": (self.centre(moment) + self.radius * side, arrow)}

    def points(self, moment: Moment) -> dict[str, npt.ArrayLike]:
        """Point of contact on the plane, and on the ball in radii."""
        down, q = -self.normal(moment), self.system.accessors["q"](moment.y)
        foot = self.centre(moment) + 0.985 * self.radius * down
        return {"path": foot, "on_ball": OUTSIDE * rotations.rotate_inverse(q, down)}


class RollingBallView(BallView):
    """A ball that the camera follows, and its velocity."""

    @property
    def strongest(self) -> float:
        """Largest speed [m/s]; a radius per second where the task has none."""
        return self.radius * float(getattr(self.task, "largest_roll_rate", 1.0))

    def camera(self) -> views.Camera:
        """From above, with the ball."""
        return views.Camera((0.0, 0.0, 0.5 * self.radius), 12.0 * self.radius, follow="ball")


class BallParkView(RollingBallView):
    """A ball that is to be parked upright at the origin, where its ghost stands."""

    steered = "ball"

    def camera(self) -> views.Camera:
        """The start square and room for manoeuvres."""
        far = 9.6 + 1.6 * self.task.start_half_width
        return views.Camera((0.0, 0.0, 0.7), far, azimuth=-65.0, elevation=38.0)

    def parts(self) -> dict[str, views.Part]:
        """Also the ghost."""
        return super().parts() | {"goal": views.ghost(octant_ball())}

    def goal(self, moment: Moment) -> tuple[npt.ArrayLike, npt.ArrayLike]:
        """Position [m] and attitude of the goal."""
        return HOME, UPRIGHT

    def poses(self, moment: Moment) -> dict[str, views.Pose]:
        """Also the ghost."""
        position, q = self.goal(moment)
        centre = np.append(position, self.radius)
        return super().poses(moment) | {"goal": views.Pose(centre, q, (INSIDE * self.radius,) * 3)}

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """How far the goal is."""
        read, (position, q) = self.system.accessors, self.goal(moment)
        away = float(np.linalg.norm(read["position"](moment.y) - np.asarray(position)))
        angle = float(np.degrees(rotations.distance(read["q"](moment.y), q)))
        return (f"{away:.2f} m and {angle:.0f} deg from the goal",)


class BallParkGoalView(BallParkView):
    """A ball that is to be parked at a drawn pose."""

    def goal(self, moment: Moment) -> tuple[npt.ArrayLike, npt.ArrayLike]:
        """Position [m] and attitude of the goal of the episode."""
        aux = moment.aux
        return [aux["goal_X"], aux["goal_Y"]], [aux[f"goal_{k}"] for k in "wxyz"]


class BallSteerView(BallParkView):
    """A ball that is to follow a ghost, which rolls along its own path."""

    def camera(self) -> views.Camera:
        """It follows the ghost."""
        far = 11.0 * self.radius
        return views.Camera((0.0, 0.0, 0.5 * self.radius), far, -65.0, 38.0, follow="goal")

    def goal(self, moment: Moment) -> tuple[npt.ArrayLike, npt.ArrayLike]:
        """Position [m] and attitude of the reference."""
        aux = moment.aux
        position = [aux["reference_X"], aux["reference_Y"]]
        return position, [aux[f"reference_{k}"] for k in "wxyz"]

    def floor(self) -> views.Floor | None:
        """As far as the reference rolls."""
        return views.Floor(0.0, 60.0, 1.0)

    def traces(self) -> dict[str, views.Trace]:
        """Also the path of the reference."""
        paths = super().traces()
        paths["on_ball"] = replace(paths["on_ball"], length=60)
        return paths | {"reference": views.Trace(meshes.GREEN, 0.05 * self.radius)}

    def points(self, moment: Moment) -> dict[str, npt.ArrayLike]:
        """Also the contact of the reference."""
        foot = np.append(self.goal(moment)[0], 0.003 * self.radius)
        return super().points(moment) | {"reference": foot}

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """Also the mean error so far."""
        mean = moment.aux["error_sum"] / max(moment.aux["n_errors"], 1.0)
        return (*super().readings(moment), f"mean error {mean:.2f}, bound {self.task.bound:.2f}")


class BallGridView(BallParkView):
    """A ball that rolls from cell to cell, home to the origin.

    A quarter roll is one step, so the path on the ball would be chords through it, and is left out.
    """

    @property
    def cell(self) -> float:
        """Side of a cell [m]."""
        return 0.5 * math.pi * self.radius

    def camera(self) -> views.Camera:
        """The cells of the start, and one more."""
        far = (5.0 + 2.4 * self.task.start_cells) * self.cell
        return views.Camera(
            (0.0, 0.0, 0.0), min(far, 24.0 * self.cell), azimuth=-65.0, elevation=48.0
        )

    def parts(self) -> dict[str, views.Part]:
        """Also the home cell."""
        home = views.ghost(goal_cell(), 0.9)
        return super().parts() | {"home": home}

    def floor(self) -> views.Floor | None:
        """The origin is the middle of a cell."""
        return views.Floor(0.0, 25.0 * self.cell, self.cell)

    def traces(self) -> dict[str, views.Trace]:
        """The path on the plane alone."""
        return {"path": super().traces()["path"]}

    def points(self, moment: Moment) -> dict[str, npt.ArrayLike]:
        """The contact on the plane."""
        return {"path": super().points(moment)["path"]}

    def poses(self, moment: Moment) -> dict[str, views.Pose]:
        """Also the home cell."""
        side = self.cell
        return super().poses(moment) | {
            "home": views.Pose((0.0, 0.0, 0.02 * side), scale=(side, side, 0.02 * side))
        }

    @property
    def strongest(self) -> float:
        """Speed of a quarter roll [m/s]."""
        return self.radius * float(self.task.roll_rate)

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """Cell and angle."""
        x, y = np.round(self.system.accessors["position"](moment.y) / self.cell)
        return (f"cell ({x:.0f}, {y:.0f})", *super().readings(moment))


# Meshes, each made once in a process.


@functools.cache
def octant_ball() -> meshes.Mesh:
    """Ball of radius 1 with octants in eight colours."""
    return meshes.octants(1.0, meshes.OCTANTS)


@functools.cache
def goal_cell() -> meshes.Mesh:
    """Square of side 1 across z, with a border."""
    border = meshes.moved(meshes.box((1.0, 1.0, 1.0), [meshes.GREEN]), (0.0, 0.0, -0.5))
    inner = meshes.moved(meshes.box((0.8, 0.8, 1.0), [meshes.CREAM]), (0.0, 0.0, -0.4))
    return meshes.join(border, inner)
