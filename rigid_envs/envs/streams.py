"""Keys of the random streams of rows."""

from typing import Any

import numpy as np
from gymnasium.utils import seeding

__all__ = ["python_seed", "seeded_key", "stream_key"]


def stream_key(generator: np.random.Generator) -> np.uint64:
    """Key of the random stream of one row, drawn from its generator."""
    return np.uint64(generator.integers(0, 2**64, dtype=np.uint64))


def seeded_key(seed: int) -> np.uint64:
    """Key of a row with a given seed, the same in single and vector environments."""
    return stream_key(seeding.np_random(python_seed(seed))[0])


def python_seed(seed: Any) -> Any:
    """Convert a NumPy integer to a Python one; Gymnasium refuses other types."""
    return int(seed) if isinstance(seed, np.integer) else seed
