"""Views of the coin that is held upright."""

import functools

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array
from rigid_envs.tasks.core import Moment
from rigid_envs.watch import meshes, views


class UprightCoinView(views.View):
    """A coin with two different faces, its path, its velocity and the rate of steering."""

    @property
    def radius(self) -> float:
        """Radius of the rim [m]."""
        return float(self.system.radius)

    def centre(self, moment: Moment) -> Array:
        """Centre of the coin [m], shape (3,)."""
        return np.append(self.system.accessors["contact"](moment.y), self.radius)

    def parts(self) -> dict[str, views.Part]:
        """The coin."""
        return {"coin": views.Part(coin())}

    def camera(self) -> views.Camera:
        """With the coin."""
        return views.Camera(distance=10.0 * self.radius, elevation=30.0, follow="coin")

    def vectors(self) -> dict[str, views.Arrow]:
        """The two rates that are controlled."""
        width = 0.1 * self.radius
        return {
            "input": views.Arrow(meshes.INPUT, width, "velocity"),
            "steer": views.Arrow(meshes.OMEGA, width, "steering"),
        }

    def traces(self) -> dict[str, views.Trace]:
        """Path of the contact."""
        return {"path": views.Trace(meshes.PATH, 0.07 * self.radius)}

    def floor(self) -> views.Floor | None:
        """Chequered, a metre a cell."""
        return views.Floor(0.0, 40.0, 1.0)

    def poses(self, moment: Moment) -> dict[str, views.Pose]:
        """The coin."""
        q = self.system.accessors["q"](moment.y)
        return {"coin": views.Pose(self.centre(moment), q, (self.radius,) * 3)}

    def arrows(self, moment: Moment) -> views.Arrows:
        """Velocity from the rim in front, rate of steering from the top."""
        read, r, centre = self.system.accessors, self.radius, self.centre(moment)
        roll, turn = (
            float(getattr(self.task, f"largest_{name}_rate", 1.0)) for name in ("roll", "steer")
        )
        velocity = np.append(read["velocity"](moment.y), 0.0)
        speed = float(np.linalg.norm(velocity))
        front = centre + r * velocity / speed if speed > 0.0 else centre
        upwards = np.array([0.0, 0.0, float(read["steer_rate"](moment.y))])
        return {
            "input": (front, views.scaled(velocity, 1.2 / roll, 1.5 * r)),
            "steer": (views.above(centre, 1.05 * r), views.scaled(upwards, r / turn, 1.2 * r)),
        }

    def points(self, moment: Moment) -> dict[str, npt.ArrayLike]:
        """The contact, a little above the floor."""
        foot = self.system.accessors["contact"](moment.y)
        return {"path": np.append(foot, 0.004 * self.radius)}

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """Heading and roll phase."""
        read = self.system.accessors
        heading, phase = (round(np.degrees(read[k](moment.y))) for k in ("heading", "phase"))
        return (f"heading {heading} deg   roll phase {phase} deg",)


class CoinParkView(UprightCoinView):
    """A coin that is to be parked at the origin, where its ghost stands."""

    steered = "coin"

    def parts(self) -> dict[str, views.Part]:
        """Also the ghost."""
        return super().parts() | {"goal": views.ghost(coin(), 0.35)}

    def camera(self) -> views.Camera:
        """The start square and room for manoeuvres."""
        far = 8.0 + 2.6 * self.task.start_half_width
        return views.Camera((0.0, 0.0, 0.5), far, azimuth=-65.0, elevation=34.0)

    def poses(self, moment: Moment) -> dict[str, views.Pose]:
        """Also the ghost, with heading and phase 0."""
        q, r = self.system.attitude(0.0, 0.0), self.radius
        return super().poses(moment) | {"goal": views.Pose((0.0, 0.0, r), q, (r, r, r))}

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """Also the distance."""
        away = float(np.linalg.norm(self.system.accessors["contact"](moment.y)))
        return (f"{away:.2f} m from the goal", *super().readings(moment))


# Meshes, each made once in a process.


@functools.cache
def coin() -> meshes.Mesh:
    """Coin of radius 1 about z: gold with a square, silver with a cross, a red mark at +y."""
    front = meshes.moved(meshes.box((0.7, 0.7, 0.02), [meshes.CREAM]), (0.0, 0.0, 0.07))
    bar = meshes.box((1.1, 0.22, 0.02), [meshes.CREAM])
    cross = meshes.join(bar, meshes.moved(bar, rotation=[[0, -1, 0], [1, 0, 0], [0, 0, 1]]))
    back = [(0.0, -0.06), (0.9, -0.06), (0.9, -0.08), (1.0, -0.08), (1.0, 0.0)]
    face = [(r, -z) for r, z in back[::-1]]
    halves = [meshes.lathe(back, meshes.BLUE, 64), meshes.lathe(face, meshes.ORANGE, 64)]
    return meshes.join(*halves, front, meshes.moved(cross, (0.0, 0.0, -0.07)), meshes.mark(0.17))
