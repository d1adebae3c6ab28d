"""Vector environments by id, and the adapter of a training."""
