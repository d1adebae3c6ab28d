"""A correct environment, as small as can be, for bugs to be planted in; and the list of them."""

from collections.abc import Callable
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
from gymnasium import spaces

__all__ = ["LIMIT", "PLANTED", "Planted", "Slider", "planted"]

LIMIT = 30


class Slider(gym.Env):
    """A mass on a line that is pushed; it cannot reach the ends within the time limit."""

    metadata = {"render_modes": ["rgb_array"], "render_fps": 10}  # noqa: RUF012 - as Gymnasium's

    def __init__(self, render_mode: str | None = None) -> None:
        self.render_mode = render_mode
        self.observation_space = spaces.Box(-2.0, 2.0, (2,), np.float32)
        self.action_space = spaces.Box(-1.0, 1.0, (1,), np.float32)
        self.x, self.v = 0.0, 0.0

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        super().reset(seed=seed)
        self.x, self.v = self.np_random.uniform(-0.1, 0.1, 2)
        return self.observation(), {"x": self.x}

    def step(self, action: Any) -> Any:
        push = float(np.clip(np.nan_to_num(action), -1.0, 1.0)[0])
        self.v = 0.5 * self.v + 0.01 * push
        self.x += self.v
        return self.observation(), -self.x * self.x, abs(self.x) > 1.0, False, {"x": self.x}

    def observation(self) -> Any:
        return np.array([self.x, self.v], dtype=np.float32)

    def render(self) -> Any:
        picture = np.zeros((4, 8, 3), dtype=np.uint8)
        picture[:, int(np.clip(4 + 4 * self.x, 0, 7))] = 255
        return picture


class Planted(NamedTuple):
    """A bug: the environment or wrapper that has it, and which check must name it."""

    bug: type
    found_by: str
    options: dict[str, Any]


PLANTED: list[Planted] = []


def planted(found_by: str, **options: Any) -> Callable[[type], type]:
    """Note a class as a bug that a check of this name finds."""

    def note(bug: type) -> type:
        PLANTED.append(Planted(bug, found_by, options))
        return bug

    return note
