"""Numerical optima and proven bounds as data, and whom they refuse."""

import numpy as np
import pytest

from rigid_envs.base.files import DamagedFileError
from rigid_envs.scores import optima, proof
from rigid_envs.scores.best import PLANS_FOLDER, best_known, file_of
from rigid_envs.scores.evaluation import evaluate
from rigid_envs.scores.finding import of_plans, stored_plans
from rigid_envs.scores.starts import N_STARTS, TEST_SEED
from rigid_envs.tasks.registry import ENVIRONMENTS

PARK = "RigidEnvs/BallPark-v0"
SOME = optima.Optima(np.array([0.0, 1.5, 1.0 / 3.0]), np.array([0.0, 1.25, 0.0]))


def stored_as(monkeypatch, **columns):
    """As if other data came with the package."""
    data = optima.stored_optima(PARK)._replace(**columns)
    for module in (optima, proof):
        monkeypatch.setattr(module, "stored_optima", lambda _: data)
    return data


def test_every_id_with_a_search_has_its_optima():
    with_one = {env_id for env_id, record in ENVIRONMENTS.items() if record.optimum}
    assert {file_of(env_id).name for env_id in with_one} == {
        file.name for file in optima.FOLDER.iterdir()
    }
    assert all(len(optima.stored_optima(env_id).costs) == N_STARTS for env_id in with_one)
    assert optima.stored_optima("RigidEnvs/SleepingTop-v0") is None


def test_a_policy_that_beats_a_numerical_optimum_is_not_refused(monkeypatch):
    """As if the search had missed by far: the best known plans beat it, and are ranked."""
    too_high = stored_as(monkeypatch, costs=2.0 * optima.stored_optima(PARK).costs).costs
    found = evaluate(PARK, of_plans(stored_plans(PARK, 3, PLANS_FOLDER)), n=3)
    assert found.unranked is None and found.successes.all()
    assert (found.costs < too_high[:3]).all()
    np.testing.assert_allclose(found.costs, best_known(PARK).costs[:3], rtol=1e-9)


def test_what_beats_a_proven_bound_is_refused(monkeypatch):
    """As if a proof were wrong: no plan is that good."""
    stored_as(monkeypatch, proven=1.1 * best_known(PARK).costs)
    with pytest.raises(ValueError, match="the bound of theory"):
        evaluate(PARK, of_plans(stored_plans(PARK, 3, PLANS_FOLDER)), n=3)


def test_proven_bounds_count_for_the_registered_task_on_the_evaluation_set(monkeypatch):
    closed = proof.bounds_of(PARK, 3, 1, {})
    proven = stored_as(monkeypatch, proven=np.full(N_STARTS, 100.0)).proven
    np.testing.assert_array_equal(proof.bounds_of(PARK, 3, TEST_SEED, {}), proven[:3])
    np.testing.assert_array_equal(proof.bounds_of(PARK, 3, 1, {}), closed)
    laxer = {"angle_tolerance": 1.0}
    assert (proof.bounds_of(PARK, 3, TEST_SEED, laxer) < 100.0).all()


def test_where_there_is_no_search_and_no_proof_it_says_where_there_is_one():
    with pytest.raises(ValueError, match=r"SleepingTop.*expected one of .*BallPark-v0"):
        optima.searched("RigidEnvs/SleepingTop-v0", np.zeros((1, 1, 2), np.float32))
    with pytest.raises(ValueError, match=r"SleepingTop.*expected one of .*BallPark-v0"):
        optima.proven("RigidEnvs/SleepingTop-v0", optima.SHARE)


def test_a_file_is_read_as_it_was_written(tmp_path):
    file = file_of(PARK, tmp_path / "new")
    optima.write_optima(file, PARK, SOME)
    for read, written in zip(optima.read_optima(file), SOME, strict=True):
        np.testing.assert_array_equal(read, written)


@pytest.mark.parametrize(
    ("old", "new"), [('"starts":3', '"starts":4'), ("1.5", "-1.5"), ("1.25", "1.75")]
)
def test_a_file_that_was_changed_is_refused(tmp_path, old, new):
    file = file_of(PARK, tmp_path)
    optima.write_optima(file, PARK, SOME)
    text = file.read_text()
    assert text.replace(": ", ":").count(old) == 1
    file.write_text(text.replace(": ", ":").replace(old, new))
    with pytest.raises(DamagedFileError, match="write it anew: rigid-envs optima"):
        optima.read_optima(file)
