"""Rows in memory: what is written to a block and to an array."""

from typing import NamedTuple

import numpy as np

from rigid_envs.engine.compiler import kernel, scalar
from rigid_envs.engine.rows import LANES, put, store


class Place(NamedTuple):
    x: float
    height: float = 2.0
    turns: float = 3.0


@scalar
def at(x):
    return Place(x)


@kernel
def write(block, array):
    put(block, 0, 0, 5, at(1.0))
    store(array, 0, at(4.0), 1)


def test_entries_that_a_compiled_function_leaves_out_have_their_defaults():
    """Numba makes a shorter row of them, whose other places would keep what was there before."""
    block, array = np.full(3 * LANES, np.nan), np.full(3, np.nan)
    write(block, array)
    assert block[5::LANES].tolist() == [1.0, 2.0, 3.0]
    assert array.tolist() == [4.0, 2.0, 3.0]
