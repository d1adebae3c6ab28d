"""Many trainings: on one machine, on a cluster, and in search of a recipe."""
