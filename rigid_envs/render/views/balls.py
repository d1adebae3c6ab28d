"""What the views of rolling balls share: ball, its path on the plane and on the ball itself."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.moment import Moment
from rigid_envs.render.scene import Arrow, Floor, Part, Pose, Trace
from rigid_envs.render.views import palette as look
from rigid_envs.render.views import solids
from rigid_envs.render.views.common import Array, Arrows, SystemView, ghost, scaled

__all__ = ["BallView"]

OUTSIDE = 1.02  # distance of the path on the ball from its centre [radii]: chords stay outside


class BallView(SystemView):
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

    def parts(self) -> dict[str, Part]:
        """The ball."""
        return {"ball": Part(solids.octant_ball())}

    def vectors(self) -> dict[str, Arrow]:
        """The input."""
        return {"input": Arrow(look.INPUT, 0.12 * self.radius, "velocity")}

    def traces(self) -> dict[str, Trace]:
        """Path of the contact on the plane, and on the ball (in radii, as its mesh)."""
        return {
            "path": Trace(look.PATH, 0.06 * self.radius),
            "on_ball": Trace(look.PATH, 0.05, part="ball"),
        }

    def floor(self) -> Floor | None:
        """Chequered, a metre a cell."""
        return Floor(0.0, 40.0, 1.0)

    def ball_pose(self, moment: Moment) -> Pose:
        """Pose of the ball."""
        q = self.system.accessors["q"](moment.y)
        return Pose(self.centre(moment), q, (self.radius,) * 3)

    def poses(self, moment: Moment) -> dict[str, Pose]:
        """The ball."""
        return {"ball": self.ball_pose(moment)}

    def arrows(self, moment: Moment) -> Arrows:
        """The input, from the side of the ball to which it points."""
        push = self.push(moment)
        arrow = scaled(push, 1.2 * self.radius / self.strongest, 1.5 * self.radius)
        length = float(np.linalg.norm(push))
        side = push / length if length > 0.0 else push
        return {"input": (self.centre(moment) + self.radius * side, arrow)}

    def points(self, moment: Moment) -> dict[str, npt.ArrayLike]:
        """Point of contact on the plane, and on the ball in radii."""
        down, q = -self.normal(moment), self.system.accessors["q"](moment.y)
        foot = self.centre(moment) + 0.985 * self.radius * down
        return {"path": foot, "on_ball": OUTSIDE * rotations.rotate_inverse(q, down)}

    def upright_goal(self) -> dict[str, Part]:
        """Ghost of the ball."""
        return {"goal": ghost(solids.octant_ball())}

    def off_goal(self, moment: Moment, position: npt.ArrayLike, q: npt.ArrayLike) -> str:
        """Distance and angle from a goal, as a reading."""
        read = self.system.accessors
        away = float(np.linalg.norm(read["position"](moment.y) - np.asarray(position)))
        angle = float(np.degrees(rotations.distance(read["q"](moment.y), q)))
        return f"{away:.2f} m and {angle:.0f} deg from the goal"
