"""Every id looks as its stored picture does, which a person has looked at."""

import numpy as np
import pytest

from rigid_envs.tasks.registry import ENVIRONMENTS
from tests.render.pictures.drawing import distance, picture_of, stored

MEAN, LARGEST = 0.5, 16.0
"""Tolerance, of 255: less than one sees in two pictures side by side; another processor may round
a vertex otherwise and so move an edge by a pixel of the drawing, half one of the picture."""


@pytest.mark.parametrize("env_id", tuple(ENVIRONMENTS))
def test_an_environment_looks_as_it_did(env_id):
    mean, largest = distance(picture_of(env_id), stored(env_id))
    assert mean < MEAN
    assert largest < LARGEST


def test_pictures_of_different_ids_differ():
    ids = tuple(ENVIRONMENTS)
    pictures = [stored(env_id) for env_id in ids]
    for k, one in enumerate(pictures):
        for other in pictures[:k]:
            assert distance(one, other)[1] > LARGEST


@pytest.mark.parametrize("change", ["mirrored", "upside down", "red and blue swapped"])
def test_a_wrong_picture_is_noticed(change):
    for env_id in ENVIRONMENTS:
        picture = stored(env_id)
        wrong = {
            "mirrored": picture[:, ::-1],
            "upside down": picture[::-1],
            "red and blue swapped": picture[..., ::-1],
        }[change]
        mean, largest = distance(np.asarray(wrong), picture)
        assert mean > MEAN or largest > LARGEST
