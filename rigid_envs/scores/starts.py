"""The evaluation set: starts from a published seed, the same for all policies."""

from __future__ import annotations

from typing import Literal

import numpy as np

__all__ = ["N_STARTS", "TEST_SEED", "VERSION", "evaluation_seeds", "row_seeds"]

VERSION = 1
"""Version of the evaluation sets; figures on other starts have another one."""

TEST_SEED = 314159
"""Seed of the starts of an evaluation, which no training and no selection has seen."""

N_STARTS = 500
"""Number of starts of every id."""

_PURPOSES = ("train", "validation", "test", "random policy", "learner")


def evaluation_seeds(n: int = N_STARTS) -> list[int]:
    """Seeds of the first n starts of the evaluation set; `reset(seed=...)` of a row gives one.

    The same for every id and every policy. More than 500 continue the same sequence.

    Args:
        n: Number of starts.
    """
    return row_seeds(TEST_SEED, n, "test")


def row_seeds(
    seed: int, n: int, purpose: Literal["train", "validation", "test", "random policy", "learner"]
) -> list[int]:
    """One seed per row, spawned from a `SeedSequence`.

    Gymnasium's own rule, row i has seed s + i, gives the runs of seeds 0 and 1 all but one start in
    common; these have none, and no purpose shares one with another.

    Args:
        seed: Root seed, at least 0.
        n: Number of seeds.
        purpose: What the rows are for.

    Returns:
        n integers in [0, 2^63).
    """
    root = np.random.SeedSequence(int(seed), spawn_key=(_PURPOSES.index(purpose),))
    return [int(child.generate_state(1, np.uint64)[0]) >> 1 for child in root.spawn(n)]
