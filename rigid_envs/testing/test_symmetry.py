"""The declared symmetries are symmetries, and the reduced frame is invariant under them.

A symmetry changes state, parameters and action of many rows at once, by formulas that share nothing
with the compiled functions. The step must change in the same way; reward, flags and cost must not
change at all, up to rounding.
"""

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from rigid_envs.envs.vector import RigidVectorEnv
from rigid_envs.tasks.symmetry import Point
from rigid_envs.tasks.task import Task
from rigid_envs.testing.environments import (
    DISCRETE,
    IDS,
    actions,
    assert_same_bits,
    flat,
    in_full,
    pick,
    ranges,
    single,
    task_of,
    vector,
)

N, STEPS, SEED = 512, 12, 3
# States and rewards are compared after one step from numbers of order 1 to 10: a few hundred
# roundings of 1e-16, times rates and inverse tolerances of up to some hundreds.
ROUNDING = 1e-11
SINGLE = 2.0**-23  # actions and goals are rounded to float32
# of random actions, whose entries reach 1.2: then every pair of entries lies in the unit disk, and
# a turn of the body keeps torques in the box
INSIDE = 0.58


@pytest.fixture
def task(env_id: str) -> Task:
    """The task, where it declares its symmetry."""
    if task_of(env_id).reduction is None:
        pytest.skip(f"{env_id} declares no reduction")
    return task_of(env_id)


def under_way(env_id: str, **config: Any) -> RigidVectorEnv:
    """Rows after some steps of random actions, all in the same episode."""
    envs = vector(env_id, N, autoreset_mode="NextStep", **ranges(env_id), **config)
    envs.reset(seed=SEED)
    for batch in actions(env_id, STEPS, N, seed=SEED):
        envs.step(batch)
    return envs


def point_of(envs: RigidVectorEnv, action: npt.NDArray[Any]) -> Point:
    """States, parameters and an action of all rows."""
    task, state = envs.task, envs.get_state()
    names = task.system_type.parameter_names()
    raw = state["parameters"].T
    return Point(
        y=task.episode.dynamics.State(*state["y"].T),
        aux=task.episode.Auxiliary(*state["aux"].T) if "aux" in state else (),
        parameters=dict(zip(names, raw, strict=True)),
        action=task.episode.Action(*np.asarray(action, dtype=np.float64).reshape(N, -1).T),
    )


def put(envs: RigidVectorEnv, point: Point) -> None:
    """Set states and parameters of all rows."""
    state = envs.get_state()
    state["y"] = np.stack(point.y, axis=-1)
    if len(point.aux):
        state["aux"] = np.stack(point.aux, axis=-1)
    values = [point.parameters[name] for name in envs.task.system_type.parameter_names()]
    state["parameters"] = np.stack(values, axis=-1)
    envs.set_state(state)


def action_of(env_id: str, point: Point) -> npt.NDArray[Any]:
    """The action of a point, as `step` takes it."""
    columns = np.stack(point.action, axis=-1)
    if env_id in DISCRETE:
        return np.rint(columns[:, 0]).astype(np.int64)
    return columns.astype(np.float32)


def transformed(task: Task, point: Point, rng: np.random.Generator) -> tuple[Point, Any]:
    """A point under random elements of all symmetries, and the same change for other points."""
    assert task.reduction is not None
    drawn = [(symmetry, symmetry.draw(rng, N)) for symmetry in task.reduction.symmetries]

    def change(other: Point) -> Point:
        for symmetry, element in drawn:
            other = symmetry.apply(other, element)
        return other

    return change(point), change


def assert_same_states(found: Point, expected: Point, task: Task, atol: float) -> None:
    """Compare states; q and -q are the same attitude."""
    a, b = np.stack(found.y, axis=-1), np.stack(expected.y, axis=-1)
    if "q" in task.system_type.components:
        q = task.system_type.components["q"]
        a[:, q] *= np.sign(np.sum(a[:, q] * b[:, q], axis=1, keepdims=True))
    scale = 1.0 + float(np.abs(b).max())
    np.testing.assert_allclose(a, b, rtol=0, atol=scale * atol)


def test_a_step_commutes_with_every_symmetry(env_id: str, task: Task) -> None:
    rng = np.random.default_rng(SEED)
    envs, image = under_way(env_id), under_way(env_id)
    action = actions(env_id, 1, N, seed=5)[0]
    point = point_of(envs, INSIDE * action if env_id not in DISCRETE else action)
    moved, change = transformed(task, point, rng)
    put(envs, point)
    put(image, moved)
    results = envs.step(action_of(env_id, point))
    images = image.step(action_of(env_id, moved))
    expected = change(point_of(envs, action))
    found = point_of(image, action)
    assert_same_states(found, expected, task, tolerance(env_id))
    alike = unchanged(results, images)
    assert alike.mean() > 0.995  # the others lie within rounding of a tolerance
    for a, b in ((results[1], images[1]), (results[4]["cost"], images[4]["cost"])):
        np.testing.assert_allclose(
            np.asarray(b)[alike], np.asarray(a)[alike], rtol=0, atol=1e3 * tolerance(env_id)
        )


def unchanged(a: Any, b: Any) -> npt.NDArray[np.bool_]:
    """Rows whose flags agree."""
    keys = ("is_success", "physics_error")
    same = (a[2] == b[2]) & (a[3] == b[3])
    for key in keys:
        same &= a[4][key] == b[4][key]
    return np.asarray(same)


def tolerance(env_id: str) -> float:
    """Discrete actions are exact; others are rounded to float32 after they are turned."""
    return ROUNDING if env_id in DISCRETE else SINGLE


@in_full(IDS)
def test_the_reduced_observation_is_invariant(env_id: str, task: Task) -> None:
    envs = under_way(env_id, frame="reduced")
    point = point_of(envs, actions(env_id, 1, N)[0])
    put(envs, point)
    before = reduced_part(task, envs)
    put(envs, transformed(task, point, np.random.default_rng(SEED))[0])
    after = reduced_part(task, envs)
    # roots of differences of rounded numbers lose half of the digits, cube roots two thirds
    np.testing.assert_allclose(after, before, rtol=0, atol=2e-5)


def reduced_part(task: Task, envs: RigidVectorEnv) -> npt.NDArray[np.float32]:
    """Observations of all rows without the goals, which a symmetry changes."""
    core: Any = envs
    return np.array(flat(core._core.observations)[:, 2 * task.n_goal :])


@in_full(IDS)
def test_an_action_in_the_reduced_frame_is_that_of_the_task_turned(env_id: str, task: Task) -> None:
    # the same action from a state and from its image: the images of the same step
    rng = np.random.default_rng(SEED)
    envs, image = under_way(env_id, frame="reduced"), under_way(env_id, frame="reduced")
    action = actions(env_id, 1, N, seed=5)[0]
    point = point_of(envs, action)
    moved, change = transformed(task, point, rng)
    put(envs, point)
    put(image, moved)
    results, images = envs.step(action), image.step(action)
    expected, found = change(point_of(envs, action)), point_of(image, action)
    if env_id in DISCRETE:
        # a pose on the grid that a symmetry leaves unchanged has several frames: from there the
        # same action leads to images of one another, which look the same
        np.testing.assert_array_equal(reduced_part(task, image), reduced_part(task, envs))
    else:
        assert_same_states(found, expected, task, 1e-6)
    assert unchanged(results, images).mean() > 0.995


@in_full(IDS)
def test_a_reduced_row_is_the_single_environment(env_id: str, task: Task) -> None:
    settings = {"frame": "reduced", **ranges(env_id)}
    envs, env = vector(env_id, 70, **settings), single(env_id, **settings)
    assert_same_bits(pick(envs.reset(seed=SEED)[0], 69), env.reset(seed=SEED + 69)[0])
    for batch in actions(env_id, STEPS, 70):
        rows, alone = envs.step(batch), env.step(batch[69])
        assert_same_bits(pick(rows[0], 69), alone[0])
        assert rows[1][69] == alone[1]
        if alone[2]:
            break


@in_full(IDS)
def test_the_reduced_frame_changes_no_motion(env_id: str, task: Task) -> None:
    # the same motion, to the bit, as in the frame of the task under the turned actions
    turned, given = under_way(env_id, frame="reduced"), under_way(env_id)
    given.set_state(turned.get_state())
    results = turned.step(actions(env_id, 1, N, seed=5)[0])
    core: Any = turned
    last = np.stack([core._core.moment(row).action for row in range(N)])
    columns = Point((), (), {}, task.episode.Action(*last.T))
    images = given.step(action_of(env_id, columns))
    assert_same_bits(turned.get_state(), given.get_state())
    for a, b in zip(results[1:4], images[1:4], strict=True):
        assert_same_bits(a, b)
