"""Multilayer perceptrons: the same bits on every processor.

Weights are float32, as they were trained; the arithmetic is float64. Sums run over the inputs one
by one, for all outputs of a layer side by side, so that they are vectorised and their order is
fixed. No BLAS: its sums are ordered as suits the processor.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.engine.compiler import kernel, routine
from rigid_envs.engine.elementary import expm1, fma, select, tanh

Array = npt.NDArray[Any]

ACTIVATIONS = ("identity", "tanh", "relu", "elu", "silu")
"""Activations by the number that `perceptron` takes."""

_TANH, _RELU, _ELU, _SILU = 1, 2, 3, 4


@routine
def _activate(kind: int, h: Array) -> None:
    """Apply an activation to each entry, in place."""
    if kind == _TANH:
        for k in range(len(h)):
            h[k] = tanh(h[k])
    elif kind == _RELU:
        for k in range(len(h)):
            h[k] = max(h[k], 0.0)
    elif kind == _ELU:
        for k in range(len(h)):
            h[k] = select(h[k] > 0.0, h[k], expm1(min(h[k], 0.0)))
    elif kind == _SILU:
        for k in range(len(h)):
            h[k] = h[k] / (2.0 + expm1(min(-h[k], 700.0)))


@kernel
def perceptron(
    x: Array, weights: Array, sizes: Array, activation: int, last: int, out: Array
) -> None:
    """Outputs of a multilayer perceptron for n inputs.

    Args:
        x: Inputs, shape (n, sizes[0]), float32.
        weights: Of layer after layer its biases and its matrix, shape (sizes[k], sizes[k + 1]) row
            by row, in one array of float32.
        sizes: Number of inputs, and of the outputs of each layer, int64.
        activation: Index in `ACTIVATIONS` of what follows all layers but the last.
        last: The same for the last layer.
        out: Outputs, shape (n, sizes[-1]), float64; written.
    """
    widest = sizes.max()
    one, two = np.empty(widest), np.empty(widest)
    n_layers = len(sizes) - 1
    for row in range(len(x)):
        for i in range(sizes[0]):
            one[i] = x[row, i]
        at = 0
        for layer in range(n_layers):
            n_in, n_out = sizes[layer], sizes[layer + 1]
            h = two[:n_out]
            for k in range(n_out):
                h[k] = weights[at + k]
            at += n_out
            for i in range(n_in):
                column, value = weights[at : at + n_out], one[i]
                for k in range(n_out):
                    h[k] = fma(value, float(column[k]), h[k])
                at += n_out
            _activate(last if layer == n_layers - 1 else activation, h)
            one, two = two, one
        for k in range(sizes[n_layers]):
            out[row, k] = one[k]


@kernel
def relative_rotations(x: Array, achieved: int, desired: int, out: Array) -> None:
    """Inputs x, and after them ``R^T R'`` and ``R' R^T`` of two matrices R and R' among them.

    Args:
        x: Inputs, shape (n, m), float32.
        achieved: Index of the first of the 9 entries of R, row by row.
        desired: The same for R'.
        out: Shape (n, m + 18), float32; written.
    """
    m = x.shape[1]
    for row in range(len(x)):
        for i in range(m):
            out[row, i] = x[row, i]
        here, there = x[row, achieved : achieved + 9], x[row, desired : desired + 9]
        for i in range(3):
            for k in range(3):
                back, forth = 0.0, 0.0
                for j in range(3):
                    back = fma(float(here[3 * j + i]), float(there[3 * j + k]), back)
                    forth = fma(float(there[3 * i + j]), float(here[3 * k + j]), forth)
                out[row, m + 3 * i + k] = back
                out[row, m + 9 + 3 * i + k] = forth
