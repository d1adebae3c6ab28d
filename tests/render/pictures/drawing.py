"""The pictures that are stored, and how far a new one is from them."""

from pathlib import Path

import gymnasium as gym
import numpy as np
from PIL import Image

import rigid_envs  # noqa: F401 - registers the environments

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
    return Path(__file__).parent / f"{env_id.split('/')[1]}.png"


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
