"""The activations are what their names say."""

import torch
from torch import nn

from rigid_envs.scores.layers import Tanh


def test_tanh_and_its_derivative_are_those_of_torch() -> None:
    ours, theirs = Tanh(), nn.Tanh()
    x = torch.linspace(-20.0, 20.0, 40_001, requires_grad=True)
    y = x.detach().double().requires_grad_()
    found, expected = ours(x), theirs(y)
    found.sum().backward()
    expected.sum().backward()
    # two roundings near 1, and one of the factor 2
    assert (found - expected).abs().max() < 3e-7
    assert (x.grad - y.grad).abs().max() < 6e-7
