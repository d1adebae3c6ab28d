"""A run that goes on from a checkpoint ends with the bits of one that never stopped.

Of every algorithm, in one process. `test_resume` kills processes.
"""

import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

import tests.agents.drift  # noqa: F401, registers the environment
from agents.config.entries import config_from
from agents.training.snapshots import Streams, capture_random, check_random, restore_random
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
        outcome = train(run, quiet=True)
        assert outcome.timesteps == 512 * UPDATES
        assert_same(reference, run)


def streams(actions: np.random.Generator) -> Streams:
    return Streams(random, np.random, torch.default_generator, actions.bit_generator)


def draws(actions: np.random.Generator) -> list[float]:
    """Two numbers of each stream; the normal ones are drawn in pairs, of which one is kept."""
    return [
        *(random.gauss(0, 1) for _ in range(2)),
        *(float(np.random.standard_normal()) for _ in range(2)),  # noqa: NPY002
        *(float(torch.rand(())) for _ in range(2)),
        *(float(actions.standard_normal()) for _ in range(2)),
    ]


@pytest.mark.parametrize("odd", [False, True])
def test_every_stream_goes_on_where_it_was(odd: bool) -> None:
    actions = np.random.default_rng(3)
    if odd:  # one of a pair is used, the other one is kept
        random.gauss(0, 1)
        np.random.standard_normal()  # noqa: NPY002
        actions.integers(5, dtype=np.uint32)
    arrays, document = capture_random(streams(actions))
    arrays = {name: array.copy() for name, array in arrays.items()}
    check_random(actions.bit_generator, arrays, document)
    expected = draws(actions)
    draws(actions)
    restore_random(streams(actions), arrays, document)
    assert draws(actions) == expected


@pytest.mark.parametrize("kind", ["torch", "numpy", "python"])
def test_what_is_no_state_is_refused_and_no_stream_changes(kind: str) -> None:
    actions: Any = np.random.default_rng(3)
    arrays, document = capture_random(streams(actions))
    bad = {**arrays, kind: np.zeros_like(arrays[kind][:7])}
    with pytest.raises(ValueError, match=r"random = .*expected states"):
        check_random(actions.bit_generator, bad, document)
    restored, again = capture_random(streams(actions))
    assert again == document
    for name, array in arrays.items():
        np.testing.assert_array_equal(restored[name], array)
