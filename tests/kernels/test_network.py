"""Compiled networks against NumPy, which sums in another order with functions of the C library."""

from itertools import pairwise

import numpy as np
import pytest

from rigid_envs.engine.network import ACTIVATIONS, perceptron, relative_rotations

SIZES = np.array([21, 64, 13, 3])
NUMPY = {
    "identity": lambda x: x,
    "tanh": np.tanh,
    "relu": lambda x: np.maximum(x, 0.0),
    "elu": lambda x: np.where(x > 0.0, x, np.expm1(np.minimum(x, 0.0))),
    "silu": lambda x: x / (1.0 + np.exp(-x)),
}


def layers(stream):
    """Biases and matrices of float32, of a scale at which activations bend."""
    return [
        (stream.normal(size=m).astype(np.float32), stream.normal(size=(n, m)).astype(np.float32))
        for n, m in pairwise(SIZES)
    ]


@pytest.mark.parametrize("last", ["identity", "tanh"])
@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_a_network_is_what_numpy_makes_of_it(activation, last):
    stream = np.random.default_rng(1)
    own, x = layers(stream), stream.normal(size=(70, 21)).astype(np.float32)
    flat = np.concatenate([part.ravel() for layer in own for part in layer])
    out = np.empty((70, 3))
    perceptron(x, flat, SIZES, ACTIVATIONS.index(activation), ACTIVATIONS.index(last), out)
    h = x.astype(np.float64)
    for k, (bias, matrix) in enumerate(own):
        h = NUMPY[activation if k < 2 else last](h @ matrix.astype(np.float64) + bias)
    np.testing.assert_allclose(out, h, rtol=1e-12, atol=1e-12)


def test_a_row_is_the_same_alone_and_among_others():
    stream = np.random.default_rng(2)
    flat = np.concatenate([part.ravel() for layer in layers(stream) for part in layer])
    x, out, alone = stream.normal(size=(33, 21)).astype(np.float32), np.empty((33, 3)), np.empty(3)
    perceptron(x, flat, SIZES, 1, 0, out)
    for row, expected in zip(x, out, strict=True):
        perceptron(row[None], flat, SIZES, 1, 0, alone[None])
        np.testing.assert_array_equal(alone, expected)


def test_relative_rotations_are_products_of_the_matrices_in_the_inputs():
    x = np.random.default_rng(3).normal(size=(5, 20)).astype(np.float32)
    out = np.empty((5, 38), np.float32)
    relative_rotations(x, 1, 11, out)
    here, there = (x[:, at : at + 9].reshape(-1, 3, 3).astype(np.float64) for at in (1, 11))
    back = here.transpose(0, 2, 1)
    np.testing.assert_array_equal(out[:, :20], x)
    products = np.stack([back @ there, there @ back], axis=1).reshape(5, 18)
    np.testing.assert_allclose(out[:, 20:], products, rtol=1e-6, atol=1e-6)
