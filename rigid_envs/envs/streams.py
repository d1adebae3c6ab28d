"""Keys of the random streams of rows."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from gymnasium.utils import seeding

__all__ = ["python_seed", "seeded_key", "seeds_of", "stream_key", "undone_if_refused"]


def stream_key(generator: np.random.Generator) -> np.uint64:
    """Key of the random stream of one row, drawn from its generator."""
    return np.uint64(generator.integers(0, 2**64, dtype=np.uint64))


def seeded_key(seed: int) -> np.uint64:
    """Key of a row with a given seed, the same in single and vector environments."""
    return stream_key(seeding.np_random(python_seed(seed))[0])


def python_seed(seed: Any) -> Any:
    """Convert a NumPy integer to a Python one; Gymnasium refuses other types."""
    return int(seed) if isinstance(seed, np.integer) else seed


def seeds_of(seed: int | Sequence[int | None] | None, num_envs: int, env_id: str) -> list[Any]:
    """Seed of each row: s + i for row i of one seed s; None where there is none.

    Raises:
        ValueError: another number of seeds than rows.
    """
    if isinstance(seed, int | np.integer):
        return [int(seed) + i for i in range(num_envs)]
    seeds = [None] * num_envs if seed is None else list(seed)
    if len(seeds) != num_envs:
        raise ValueError(
            f"{env_id}: seed has {len(seeds)} entries; expected {num_envs}, one for each row"
        )
    return seeds


@contextmanager
def undone_if_refused(env: Any) -> Iterator[None]:
    """A reset that is refused changes nothing: rows, random streams and generator are as before."""
    attributes, rows = dict(env.__dict__), env._core.buffer.copy()
    generator = env._np_random
    drawn = None if generator is None else generator.bit_generator.state
    try:
        yield
    except Exception:
        env.__dict__.clear()
        env.__dict__.update(attributes)
        env._core.buffer[:] = rows
        if generator is not None:
            generator.bit_generator.state = drawn
        raise
