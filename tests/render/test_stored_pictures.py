"""Every id looks as its stored picture does, which a person has looked at.

Run this file to draw them anew; look at them before they are committed.
"""

from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from PIL import Image

from rigid_envs.tasks.registry import ENVIRONMENTS

MEAN, LARGEST = 0.5, 16.0
"""Tolerance, of 255: less than one sees in two pictures side by side; another processor may round
a vertex otherwise and so move an edge by a pixel of the drawing, half one of the picture."""
SIZE = 160
STEPS = 12
BLUR = 4
"""Side of the squares of pixels whose means are compared: differences that one cannot see, of the
letters and along edges, vanish in them."""


def picture_of(env_id):
    """Picture after some steps of fixed actions from a fixed start; a line from every step."""
    env = gym.make(env_id, render_mode="rgb_array", width=SIZE, height=SIZE)
    env.reset(seed=11)
    env.action_space.seed(12)
    for _ in range(STEPS):
        picture = env.render()
        if any(env.step(env.action_space.sample())[2:4]):
            break
    env.close()
    return picture


def file_of(env_id):
    """File of the stored picture of an id."""
    return Path(__file__).parent / "pictures" / f"{env_id.split('/')[1]}.png"


def stored(env_id):
    """Stored picture of an id."""
    return np.asarray(Image.open(file_of(env_id)).convert("RGB"))


def distance(one, other):
    """Mean and largest difference between squares of pixels, of 255."""
    n = SIZE // BLUR
    means = [
        image.reshape(n, BLUR, n, BLUR, 3).mean(axis=(1, 3)).astype(float) for image in (one, other)
    ]
    difference = np.abs(means[0] - means[1])
    return difference.mean(), difference.max()


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


if __name__ == "__main__":
    for env_id in ENVIRONMENTS:
        Image.fromarray(picture_of(env_id)).save(file_of(env_id), optimize=True)
        print(file_of(env_id))
