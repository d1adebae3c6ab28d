"""Keys of the random streams of rows."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from gymnasium.error import Error
from gymnasium.utils import seeding

from rigid_envs.checks import safe_repr

__all__ = ["python_seed", "seeded_key", "seeds_of", "stream_key", "undone_if_refused"]


def stream_key(generator: np.random.Generator) -> np.uint64:
    """Key of the random stream of one row, drawn from its generator."""
    return np.uint64(generator.integers(0, 2**64, dtype=np.uint64))


def seeded_key(seed: int) -> np.uint64:
    """Key of a row with a given seed, the same in single and vector environments."""
    return stream_key(seeding.np_random(python_seed(seed))[0])


def python_seed(seed: Any) -> Any:
    """A seed as a Python integer, which is what Gymnasium takes, or None.

    Raises:
        gymnasium.error.Error: no integer of at least 0.
    """
    whole = isinstance(seed, int | np.integer) and not isinstance(seed, bool)
    if seed is None or (whole and seed >= 0):
        return seed if seed is None else int(seed)
    raise Error(f"Seed = {safe_repr(seed)}; expected an integer of at least 0, or None")


def seeds_of(seed: Any, num_envs: int, env_id: str) -> list[Any]:
    """Seed of each row: s + i for row i of one seed s; None where there is none.

    Raises:
        gymnasium.error.Error: no integer of at least 0, and no sequence of such or None.
        ValueError: another number of seeds than rows.
    """
    if isinstance(seed, np.ndarray) and seed.ndim == 1:
        seed = list(seed)
    if not isinstance(seed, list | tuple):
        first = python_seed(seed)
        return [None if first is None else first + i for i in range(num_envs)]
    if len(seed) != num_envs:
        raise ValueError(
            f"{env_id}: seed has {len(seed)} entries; expected {num_envs}, one for each row"
        )
    return [python_seed(each) for each in seed]


@contextmanager
def undone_if_refused(env: Any) -> Iterator[None]:
    """A reset to a given start that is refused, as it may be after all has been drawn: undo it.

    Rows, random streams and generator are then as before.
    """
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
