"""Random streams are restored to the bit, and a state that is none is refused."""

import random
from typing import Any

import numpy as np
import pytest
import torch

from agents.training.snapshots import Streams, capture_random, check_random, restore_random


def streams(actions: np.random.Generator) -> Streams:
    return Streams(random, np.random, torch.default_generator, actions.bit_generator)


def draws(actions: np.random.Generator) -> list[float]:
    """Two numbers of each stream; the normal ones are drawn in pairs, of which one is kept."""
    return [
        *(random.gauss(0, 1) for _ in range(2)),
        *(float(np.random.standard_normal()) for _ in range(2)),  # noqa: NPY002
        *(float(torch.rand(())) for _ in range(2)),
        *(float(actions.standard_normal()) for _ in range(2)),
    ]


@pytest.mark.parametrize("odd", [False, True])
def test_every_stream_goes_on_where_it_was(odd: bool) -> None:
    actions = np.random.default_rng(3)
    if odd:  # one of a pair is used, the other one is kept
        random.gauss(0, 1)
        np.random.standard_normal()  # noqa: NPY002
        actions.integers(5, dtype=np.uint32)
    arrays, document = capture_random(streams(actions))
    arrays = {name: array.copy() for name, array in arrays.items()}
    check_random(actions.bit_generator, arrays, document)
    expected = draws(actions)
    draws(actions)
    restore_random(streams(actions), arrays, document)
    assert draws(actions) == expected


@pytest.mark.parametrize("kind", ["torch", "numpy", "python"])
def test_what_is_no_state_is_refused_and_no_stream_changes(kind: str) -> None:
    actions: Any = np.random.default_rng(3)
    arrays, document = capture_random(streams(actions))
    bad = {**arrays, kind: np.zeros_like(arrays[kind][:7])}
    with pytest.raises(ValueError, match=rf"random/{kind} = .*expected a state"):
        check_random(actions.bit_generator, bad, document)
    restored, again = capture_random(streams(actions))
    assert again == document
    for name, array in arrays.items():
        np.testing.assert_array_equal(restored[name], array)
