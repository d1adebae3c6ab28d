"""View of a system that has none of its own."""

from __future__ import annotations

from rigid_envs.moment import Moment
from rigid_envs.render.scene import Camera, Part, Pose
from rigid_envs.render.views import bodies
from rigid_envs.render.views.common import SystemView

__all__ = ["GenericView"]

_MOST = 8  # lines of state


class GenericView(SystemView):
    """A box with the attitude of a state that has one, and the state in words."""

    def parts(self) -> dict[str, Part]:
        """A box, where there is an attitude."""
        return {"body": Part(bodies.brick())} if "q" in self.system.components else {}

    def camera(self) -> Camera:
        """The box."""
        return Camera(distance=5.0)

    def poses(self, moment: Moment) -> dict[str, Pose]:
        """The box, with three different sides."""
        part = self.system.components.get("q")
        return {} if part is None else {"body": Pose(q=moment.y[part], scale=(1.6, 1.1, 0.6))}

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """The entries of the state."""
        part = self.system.components.get("q", slice(0, 0))
        entries = list(zip(self.system.state_entries, moment.y, strict=True))
        del entries[part]
        return tuple(f"{name} {value:.3f}" for name, value in entries[:_MOST])
