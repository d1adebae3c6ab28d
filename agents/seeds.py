"""Seeds of the rows: independent between runs, and apart for training, selection and test."""

from __future__ import annotations

from typing import Literal

import numpy as np

__all__ = ["TEST_SEED", "VALIDATION_SEED", "row_seeds"]

VALIDATION_SEED = 271828
"""Starts of the evaluations during training, which choose the best policy."""

TEST_SEED = 314159
"""Starts of the final evaluation, which nothing was chosen by."""

_PURPOSES = ("train", "validation", "test", "random policy", "learner")


def row_seeds(
    seed: int, n: int, purpose: Literal["train", "validation", "test", "random policy", "learner"]
) -> list[int]:
    """One seed per row, spawned from a `SeedSequence`.

    Gymnasium's own rule, row i has seed s + i, gives the runs of seeds 0 and 1 all but one start in
    common; these have none, and no purpose shares one with another.

    Args:
        seed: Seed of the run, at least 0.
        n: Number of rows.
        purpose: What the rows are for.

    Returns:
        n integers in [0, 2^63).
    """
    root = np.random.SeedSequence(int(seed), spawn_key=(_PURPOSES.index(purpose),))
    return [int(child.generate_state(1, np.uint64)[0]) >> 1 for child in root.spawn(n)]
