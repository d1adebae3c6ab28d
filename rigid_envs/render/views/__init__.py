"""Views of the tasks: what each looks like, as data. One file per system."""

from rigid_envs.render.views.registry import add_view, view_class, view_of

__all__ = ["add_view", "view_class", "view_of"]
