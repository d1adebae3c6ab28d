"""The adapter of a training lists its episodes and continues to the bit."""

import numpy as np

from agents.environments import TrainingRows, make
from tests.agents.drift import Drift
from tests.sb3.script import Script, steps


def test_ended_episodes_are_listed_once() -> None:
    env = TrainingRows(Script())
    env.reset()
    steps(env, 3)
    one, two = env.pop_episodes()
    assert (one.step, one.rows.tolist(), one.returns.tolist()) == (2, [0], [3.0])
    assert (two.step, two.rows.tolist(), two.lengths.tolist()) == (3, [1, 2], [3, 3])
    assert two.successes is not None and two.successes.tolist() == [False, True]
    assert env.pop_episodes() == []


def test_continuation_from_a_state_is_bitwise() -> None:
    env = TrainingRows(Drift(5))
    env.seed(1)
    env.reset()
    steps(env, 13)
    state = env.get_state()
    expected = steps(env, 40)
    other = TrainingRows(Drift(5))
    other.reset()
    other.set_state(state)
    for a, b in zip(expected, steps(other, 40), strict=True):
        for mine, theirs in zip(a[:3], b[:3], strict=True):
            np.testing.assert_array_equal(mine, theirs)
        assert str(a[3]) == str(b[3])


def test_a_state_of_dictionaries_continues_to_the_bit() -> None:
    env, other = (TrainingRows(make("RigidEnvs/BallParkGoal-v0", {}, 3)) for _ in range(2))
    env.seed(1)
    env.reset()
    other.reset()
    push = np.full((3, 2), 0.3, np.float32)
    for _ in range(70):
        env.step(push)
    other.set_state(env.get_state())
    for _ in range(70):
        a, b = env.step(push), other.step(push)
        for key in a[0]:
            np.testing.assert_array_equal(a[0][key], b[0][key])
        for mine, theirs in zip(a[1:3], b[1:3], strict=True):
            np.testing.assert_array_equal(mine, theirs)
