"""Views of the tasks."""

from typing import Any

from rigid_envs.moment import Moment
from rigid_envs.render.props import arrow_shaft
from rigid_envs.render.scene import Camera, Frame, Part, Pose, Scene
from rigid_envs.render.view import View

__all__ = ["view_of"]


class _Body(View):
    """A rod with the attitude of the body, where the system has one."""

    def make_scene(self) -> Scene:
        return Scene(parts={"body": Part(arrow_shaft())}, camera=Camera(distance=6.0))

    def frame(self, moment: Moment) -> Frame:
        part = self.task.system_type.components.get("q")
        q = (1.0, 0.0, 0.0, 0.0) if part is None else moment.y[part]
        text = (f"t = {moment.time:.2f} s   reward {moment.reward:.3g}",)
        return Frame({"body": Pose(q=q)}, text=text)


def view_of(task: Any, parameters: dict[str, float]) -> View:
    """The view of a task."""
    return _Body(task, parameters)
