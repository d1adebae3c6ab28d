"""Leaderboard: results of policies in one table and one plot."""

from rigid_envs.leaderboard.page import markdown, read_results, write_leaderboard
from rigid_envs.leaderboard.rows import Row, packaged_rows, row_of, sorted_rows

__all__ = [
    "Row",
    "markdown",
    "packaged_rows",
    "read_results",
    "row_of",
    "sorted_rows",
    "write_leaderboard",
]
