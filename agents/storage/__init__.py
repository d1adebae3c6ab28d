"""Files of a run: tensors, checkpoints, logs, the run folder and its lock."""
