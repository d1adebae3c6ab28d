"""Trainings that are led by hand, update after update."""

from agents.storage.runs import create_run
from agents.training.trainer import Trainer
from agents.training.validation import Progress


def begun(config):
    """A training before its first update; it says nothing."""
    run = create_run(config)
    run.begin()
    return Trainer(run, config, Progress(quiet=True))
