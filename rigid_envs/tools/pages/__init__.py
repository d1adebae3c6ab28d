"""Descriptions of environments, for a terminal and as Markdown pages, made from the code."""

from rigid_envs.tools.pages.document import describe
from rigid_envs.tools.pages.tables import list_all
from rigid_envs.tools.pages.writing import write_pages

__all__ = ["describe", "list_all", "write_pages"]
