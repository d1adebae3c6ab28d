"""The registry is what Gymnasium, tasks and scores have; other packages can add to it."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

import rigid_envs
from rigid_envs.base.checks import ConfigError
from rigid_envs.envs.lookup import checked_id, families, full_id, task_of
from rigid_envs.mechanics import rotations
from rigid_envs.scores.starts import METRICS
from rigid_envs.scores.theory import TheoreticalLimit
from rigid_envs.tasks.core import Core
from rigid_envs.tasks.registry import COSTS, ENVIRONMENTS, EnvironmentRecord, add, load
from tests.fixtures import Patch
from tests.programs import printed

each_id = pytest.mark.parametrize("env_id", list(ENVIRONMENTS))
PARK = "RigidEnvs/BallPark-v0"

_NO_TASKS = ("other.Park", "other:Park:Goal", "")
_HOOP = '''
import rigid_envs
from rigid_envs.systems.rolling_ball.tasks import BallPark

class HoopRoll(BallPark):
    """Park a hoop.

    It is a ball under another name.

    Reference:
        None yet.
    """

rigid_envs.register("Hoops/Roll-v0", task="hoops:HoopRoll", max_episode_steps=70, family="Hoop")
'''
_USE = """
import gymnasium, numpy as np
from rigid_envs.envs.lookup import checked_id
from rigid_envs.tools.pages import describe, list_all, write_pages
from rigid_envs.scores import evaluate, metrics_of, uniform
from pathlib import Path
from typing import Any

env_id = checked_id("hoops:Hoops/Roll-v0")
assert gymnasium.make(env_id).spec.max_episode_steps == 70
assert gymnasium.make_vec(env_id, num_envs=3).reset(seed=0)[0].shape[0] == 3
assert "Park a hoop." in describe(env_id, {}) and env_id in list_all()
write_pages(Path("pages"), [env_id])
assert "One of the [Hoop](README.md#hoop)" in Path("pages/Hoops-Roll.md").read_text()
assert "## Hoop" in Path("pages/README.md").read_text()
assert [metric.name for metric in metrics_of(env_id)] == ["time", "success", "return"]
assert evaluate(env_id, uniform(), n=3).values["success"].shape == (3,)
"""


@each_id
def test_a_record_is_what_gymnasium_and_the_task_have(env_id: str) -> None:
    record, task, spec = ENVIRONMENTS[env_id], task_of(env_id), gymnasium.spec(env_id)
    assert record.id == env_id == spec.id
    assert record.max_episode_steps == spec.max_episode_steps
    assert record.goal == (task.n_goal > 0) == ("Goal" in str(spec.entry_point))
    assert set(record.metrics) <= set(METRICS) and {"success", "return"} <= set(record.metrics)
    assert (record.error is not None) == ("error" in record.metrics)
    assert record.error is None or record.error.term in task.terms
    assert record.metrics[0] in COSTS and set(record.limits) <= set(record.metrics)
    assert all(callable(load(name)) for name in record.controllers.values())
    assert all(isinstance(load(name), TheoreticalLimit) for name in record.limits.values())
    task_of(env_id, record.early_end)


def test_families_are_all_ids_in_the_order_of_registration() -> None:
    found = families()
    assert list(found) == ["Free body", "Top", "Ball", "Coin and wheel"]
    assert sorted(env_id for ids in found.values() for env_id in ids) == sorted(ENVIRONMENTS)
    assert families([PARK]) == {"Ball": [PARK]}


def test_wrong_records_are_refused_and_equal_ones_harmless() -> None:
    record = ENVIRONMENTS[PARK]
    add(record)
    with pytest.raises(ConfigError, match="expected an id that is not registered yet"):
        add(replace(record, max_episode_steps=99))
    other = EnvironmentRecord("Other/Park-v0", "other:Park", 10, "Ball")
    for change, complaint in (
        *(({"task": task}, f"task = '{task}'; expected 'module:Class'") for task in _NO_TASKS),
        *(({"max_episode_steps": no}, "expected an integer from 1") for no in (True, 0, -1, 2.0)),
        ({"metrics": ("time", "error")}, "expected an ErrorTerm"),
        ({"metrics": ("return", "time")}, "expected one of .* first"),
        ({"metrics": ()}, "expected one of .* first"),
    ):
        with pytest.raises(ConfigError, match=f"^Other/Park-v0: .*{complaint}"):
            add(replace(other, **change))
    with pytest.raises(ConfigError, match=r"'rigid_envs\.systems:Nothing'; expected 'module:name'"):
        rigid_envs.register("Other/Park-v0", "rigid_envs.systems:Nothing", 10)
    assert "Other/Park-v0" not in ENVIRONMENTS


def test_an_episode_may_have_one_step_alone(monkeypatch: Patch) -> None:
    known: dict[str, EnvironmentRecord] = {}
    for name in ("_RECORDS", "ENVIRONMENTS"):
        monkeypatch.setattr(f"rigid_envs.tasks.registry.{name}", known)
    add(other := EnvironmentRecord("Other/Park-v0", "other:Park", 1, "Ball"))
    assert known == {other.id: other}


def test_an_id_may_be_short() -> None:
    for short in ("BallPark", "BallPark-v0", "RigidEnvs/BallPark", PARK):
        assert checked_id(short) == full_id(short) == PARK
    for other in ("Ball", "ballpark", "CartPole-v1", "", "-v0", "Other/BallPark"):
        assert full_id(other) == other
    assert len({full_id(env_id.rpartition("-")[0]) for env_id in ENVIRONMENTS}) == len(ENVIRONMENTS)


def test_a_short_id_means_the_newest_version_and_never_one_of_two_namespaces(
    monkeypatch: Patch,
) -> None:
    balls = (f"RigidEnvs/BallPark-v{k}" for k in (0, 10, 9))
    coins = ("RigidEnvs/Coin-v0", "Other/Coin-v0")
    known = dict.fromkeys((*balls, *coins, "Plain", "RigidEnvs/Top", "RigidEnvs/Top-v1"))
    monkeypatch.setattr("rigid_envs.envs.lookup.ENVIRONMENTS", known)
    assert full_id("BallPark") == "RigidEnvs/BallPark-v10"
    assert full_id("BallPark-v9") == "RigidEnvs/BallPark-v9"
    assert full_id("Coin") == "Coin"
    assert full_id("Plain") == "Plain"
    assert full_id("Top") == "RigidEnvs/Top-v1"  # without a version it is older than any


@pytest.mark.parametrize("no_text", [7, None, [], b"BallPark"])
def test_what_is_no_text_is_no_id(no_text: Any) -> None:
    with pytest.raises(ValueError, match=r"^env_id = .*; expected the id of an environment"):
        task_of(no_text)


@pytest.mark.parametrize("no_dict", [3, 0, "", "dt", [("dt", 0.1)]])
def test_hyperparameters_that_are_no_dict_are_refused(no_dict: Any) -> None:
    with pytest.raises(ConfigError, match=r"^config = .*; expected a dict of hyperparameters"):
        task_of(PARK, no_dict)


def test_an_id_may_name_the_module_that_registers_it() -> None:
    assert checked_id(f"rigid_envs:{PARK}") == PARK
    with pytest.raises(ConfigError, match="expected a module that can be imported: No module"):
        checked_id("no_such_package:Hoops/Roll-v0")


def test_another_package_gets_all_that_ours_get(tmp_path: Path) -> None:
    (tmp_path / "hoops.py").write_text(_HOOP)
    path = [str(tmp_path), str(Path(__file__).parents[1])]
    code = f"import sys; sys.path[:0] = {path!r}\n{_USE}"
    printed("-c", code, cwd=tmp_path)


def turned(core: Core) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """The third body axis in world axes."""
    return rotations.rotate(core.y[:, :4], np.array([0.0, 0.0, 1.0]))


def off(core: Core) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Distance from the commanded spin, in target rates."""
    task: Any = core.task
    sense = -1.0 if type(task).__name__ == "AxisFlip" else 1.0
    goal = np.array([0.0, sense * task.spin_rate, 0.0])
    return np.linalg.norm(core.y[:, 4:7] - goal, axis=1) / task.spin_rate


ERRORS: dict[str, Any] = {
    "spin": off,
    "axis": lambda core: np.arctan2(np.hypot(core.y[:, 4], core.y[:, 6]), core.y[:, 5]),
    "upright": lambda core: np.arctan2(np.hypot(*turned(core).T[:2]), turned(core)[:, 2]),
}
"""Errors by the name of their reward term, from the state; those of moving goals are left out."""
KNOWN = {
    env_id: record.error
    for env_id, record in ENVIRONMENTS.items()
    if record.error is not None and record.error.term in ERRORS
}


@pytest.mark.parametrize("env_id", KNOWN)
def test_the_error_that_is_read_from_a_reward_term_is_that_of_the_state(env_id: str) -> None:
    error, core = KNOWN[env_id], Core(task_of(env_id), 8)
    core.seed(np.arange(8), np.arange(8, dtype=np.uint64))
    core.reset(np.arange(8))
    core.actions[...] = np.random.default_rng(0).uniform(-1.0, 1.0, core.actions.shape)
    core.step()
    term = core.results[1 + core.task.terms.index(error.term)]
    np.testing.assert_allclose((1.0 / term - 1.0) / error.sharpness, ERRORS[error.term](core))
