"""A run that goes on from a checkpoint ends with the bits of one that never stopped.

Of every algorithm, in one process. `test_resume` kills processes.
"""

import random
from pathlib import Path

import numpy as np
import pytest
import torch

import tests.agents.drift  # noqa: F401, registers the environment
from agents.config.entries import config_from
from agents.training.trainer import Trainer, train
from tests.agents.training.test_resume import VARIANTS, assert_same, base

UPDATES = 18


class PowerCutError(Exception):
    """What ends a run without a word."""


def stir() -> None:
    """Bring the global streams to where no run has left them."""
    random.seed(5)
    np.random.seed(5)  # noqa: NPY002
    torch.manual_seed(5)


def cut(folder: Path, variant: str, after: int) -> Path:
    """A run that ends after so many updates, one of them behind its newest checkpoint."""
    values = base(VARIANTS[variant]) | {"total_timesteps": 512 * UPDATES, "checkpoint_every": 2}
    values |= {"log_dir": str(folder), "run_name": str(after)}
    made = []

    def iterate(self: Trainer) -> None:
        if len(made) == after:
            raise PowerCutError
        made.append(self)
        whole(self)

    whole = Trainer.iterate
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Trainer, "iterate", iterate)
        if after == UPDATES:
            train(config_from(values), quiet=True)
        else:
            with pytest.raises(PowerCutError):
                train(config_from(values), quiet=True)
    return folder / str(values.get("algo", "ppo")) / str(after)


@pytest.mark.parametrize(
    "variant",
    [
        name if name == "normalized" else pytest.param(name, marks=pytest.mark.long)
        for name in VARIANTS
    ],
)
def test_a_run_that_goes_on_is_bitwise_the_one_that_never_stopped(
    tmp_path: Path, variant: str
) -> None:
    reference = cut(tmp_path, variant, UPDATES)
    # with a memory: before its first gradient step, and when its first steps are overwritten
    for after in (3, 17):
        run = cut(tmp_path, variant, after)
        stir()
        outcome = train(resume=run, quiet=True)
        assert outcome.timesteps == 512 * UPDATES
        assert_same(reference, run)
