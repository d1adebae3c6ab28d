"""Numerical optima as data, and that they refuse nobody."""

import numpy as np
import pytest

from rigid_envs.base.files import DamagedFileError
from rigid_envs.scores import optima
from rigid_envs.scores.best import PLANS_FOLDER, best_known, file_of
from rigid_envs.scores.evaluation import evaluate
from rigid_envs.scores.finding import of_plans, stored_plans
from rigid_envs.scores.starts import N_STARTS
from rigid_envs.tasks.registry import ENVIRONMENTS

PARK = "RigidEnvs/BallPark-v0"


def test_every_id_with_a_search_has_its_optima():
    with_one = {env_id for env_id, record in ENVIRONMENTS.items() if record.optimum}
    assert {file_of(env_id).name for env_id in with_one} == {
        file.name for file in optima.FOLDER.iterdir()
    }
    assert all(len(optima.numerical_optima(env_id)) == N_STARTS for env_id in with_one)
    assert optima.numerical_optima("RigidEnvs/SleepingTop-v0") is None


def test_a_policy_that_beats_a_numerical_optimum_is_not_refused(monkeypatch):
    """As if the search had missed by far: the best known plans beat it, and are ranked."""
    too_high = 2.0 * optima.numerical_optima(PARK)
    monkeypatch.setattr(optima, "numerical_optima", lambda _: too_high)
    found = evaluate(PARK, of_plans(stored_plans(PARK, 3, PLANS_FOLDER)), n=3)
    assert found.unranked is None and found.successes.all()
    assert (found.costs < too_high[:3]).all()
    np.testing.assert_allclose(found.costs, best_known(PARK).costs[:3], rtol=1e-9)


def test_where_there_is_no_search_it_says_where_there_is_one():
    with pytest.raises(ValueError, match=r"SleepingTop.*expected one of .*BallPark-v0"):
        optima.searched("RigidEnvs/SleepingTop-v0", np.zeros((1, 1, 2), np.float32))


def test_a_file_is_read_as_it_was_written(tmp_path):
    file, values = file_of(PARK, tmp_path / "new"), np.array([0.0, 1.5, 1.0 / 3.0])
    optima.write_optima(file, PARK, values)
    np.testing.assert_array_equal(optima.read_optima(file), values)


@pytest.mark.parametrize(("old", "new"), [('"starts":3', '"starts":4'), ("1.5", "-1.5")])
def test_a_file_that_was_changed_is_refused(tmp_path, old, new):
    file = file_of(PARK, tmp_path)
    optima.write_optima(file, PARK, np.array([0.0, 1.5, 1.0 / 3.0]))
    text = file.read_text()
    assert text.replace(": ", ":").count(old) == 1
    file.write_text(text.replace(": ", ":").replace(old, new))
    with pytest.raises(DamagedFileError, match="write it anew: rigid-envs optima"):
        optima.read_optima(file)
