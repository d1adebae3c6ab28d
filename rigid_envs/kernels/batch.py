"""Loops of the NumPy interface of the systems, on arrays of shape (N, n)."""

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.kernels.algebra import Row
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.rows import LANES, Restore, Step, advance_rows, load, restore_rows, store

__all__ = ["evaluate", "measure", "rates", "simulate"]

Array = npt.NDArray[Any]
Function = Callable[..., Row]


@scalar
def evaluate(
    function: Function, prototypes: tuple[Row, Row, Row], y: Array, u: Array, p: Array, out: Array
) -> None:
    """``out[i] = function(y[i], u[i], p)``; real or complex."""
    state, inputs, parameters = prototypes
    p_row = load(p, 0, parameters, 1)
    for i in range(y.shape[0]):
        y_row = load(y, i * len(state), state, 1)
        u_row = load(u, i * len(inputs), inputs, 1)
        values = function(y_row, u_row, p_row)
        store(out, i * len(values), values, 1)


@scalar
def measure(
    invariants: Function, prototypes: tuple[Row, Row, Row], y: Array, p: Array, out: Array
) -> None:
    """``out[i] = invariants(y[i], p)``."""
    state, _, parameters = prototypes
    p_row = load(p, 0, parameters, 1)
    for i in range(y.shape[0]):
        values = invariants(load(y, i * len(state), state, 1), p_row)
        store(out, i * len(values), values, 1)


@scalar
def rates(
    rate: Callable[..., float], prototypes: tuple[Row, Row, Row], y: Array, p: Array, out: Array
) -> None:
    """``out[i] = rate(y[i], p)``."""
    state, _, parameters = prototypes
    p_row = load(p, 0, parameters, 1)
    for i in range(y.shape[0]):
        out[i] = rate(load(y, i * len(state), state, 1), p_row)


@scalar
def simulate(
    step: Step,
    restore: Restore,
    weights: Array,
    prototypes: tuple[Row, Row, Row],
    p: Array,
    u: Array,
    u_per_stage: bool,
    h: Array,
    n_substeps: Array,
    y: Array,
) -> None:
    """Fill ``y[m + 1]`` from ``y[m]``, shape (M + 1, N, n_state), for all M intervals.

    Interval m is integrated in ``n_substeps[m]`` steps of length ``h[m]`` [s]. The input is
    ``u[0]`` throughout; with `u_per_stage` each stage has its own input, in sequence.
    """
    state, inputs, parameters = prototypes
    block = np.empty((len(state) + len(inputs) + len(parameters)) * LANES)
    p_row = load(p, 0, parameters, 1)
    n_rows = y.shape[1]
    for row in range(0, n_rows, LANES):
        n = min(LANES, n_rows - row)
        for i in range(n):
            store(block, (len(state) + len(inputs)) * LANES + i, p_row, LANES)
            store(block, i, load(y, (row + i) * len(state), state, 1), LANES)
        k = 0
        _hold(block, inputs, len(state) * LANES, u, k, row, n)
        for m in range(h.size):
            for _ in range(n_substeps[m]):
                for j in range(weights.size):
                    if u_per_stage:
                        _hold(block, inputs, len(state) * LANES, u, k, row, n)
                        k += 1
                    advance_rows(step, prototypes, block, 0, n, weights[j] * h[m])
                restore_rows(restore, state, block, 0, n)
            target = ((m + 1) * n_rows + row) * len(state)
            for i in range(n):
                store(y, target + i * len(state), load(block, i, state, LANES), 1)


@scalar
def _hold(block: Array, inputs: Row, slot: int, u: Array, k: int, row: int, n: int) -> None:
    """Copy input k of n rows into the block; a shared input has ``u.shape[1] == 1``."""
    n_inputs, shared = len(inputs), u.shape[1] == 1
    for i in range(n):
        source = k * u.shape[1] * n_inputs + (0 if shared else row + i) * n_inputs
        store(block, slot + i, load(u, source, inputs, 1), LANES)
