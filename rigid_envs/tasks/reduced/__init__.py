"""Reductions of the tasks, one file for each family."""
