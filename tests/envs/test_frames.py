"""The frame of observations and actions, as a user asks for it."""

import pickle
import re
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from rigid_envs.base.checks import ConfigError
from rigid_envs.systems.rolling_ball.tasks.ball_park import BallPark
from rigid_envs.tasks.task import Task
from rigid_envs.tools.pages.writing import with_tables

PAGE = Path(__file__).parents[2] / "docs" / "symmetry.md"
PARK, GOAL = "RigidEnvs/BallPark-v0", "RigidEnvs/BallParkGoal-v0"


class NoReduction(BallPark):
    """Park the ball of a task that declares no symmetry."""

    reduction = None


def test_the_examples_of_the_page_run(capsys: pytest.CaptureFixture[str]) -> None:
    blocks = re.findall(r"```python\n(.+?)```", PAGE.read_text(), flags=re.DOTALL)
    for block in blocks:
        exec(block, {})
    told = capsys.readouterr().out
    assert len(blocks) == 2
    assert told.startswith("False\nTrue\nturn about the vertical")


def test_the_table_of_groups_is_that_of_the_tasks() -> None:
    text = PAGE.read_text()
    assert text == with_tables(text), (
        "write it anew: python -m rigid_envs.tools.pages docs/symmetry.md"
    )


def test_rotation_has_no_effect_in_the_reduced_frame() -> None:
    spaces = {
        str(gym.make(PARK, frame="reduced", rotation=shown).observation_space)
        for shown in ("matrix", "quat", "none")
    }
    assert len(spaces) == 1


def test_delayed_actions_go_on_in_the_other_frame() -> None:
    # the history of actions is that of the task, whatever is shown
    shown = ({}, {"frame": "reduced"}, {"rotation": "quat"})
    worlds = [gym.make(PARK, action_delay=2, **settings).unwrapped for settings in shown]
    first: Any = worlds[0]
    for env in worlds:
        env.reset(seed=1)
    for _ in range(3):
        first.step(np.array([0.5, -0.25], dtype=np.float32))
    state = first.get_state()
    rest = np.zeros(2, dtype=np.float32)
    first.step(rest)
    for env in worlds[1:]:
        other: Any = env
        other.set_state(state)
        other.step(rest)
        for name, part in first.get_state().items():
            np.testing.assert_array_equal(other.get_state()[name], part)


def test_a_task_without_symmetries_refuses_the_reduced_frame() -> None:
    task: Task = NoReduction()
    assert task.frame == "world"
    with pytest.raises(ConfigError, match=r"config\.frame: .*NoReduction has no reduction"):
        NoReduction(frame="reduced")


def test_an_environment_in_the_reduced_frame_pickles() -> None:
    env = gym.make(PARK, frame="reduced").unwrapped
    env.reset(seed=0)
    copy = pickle.loads(pickle.dumps(env))
    action = np.array([0.3, 0.4], dtype=np.float32)
    np.testing.assert_array_equal(env.step(action)[0], copy.step(action)[0])
