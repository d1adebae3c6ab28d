"""Stored plans: what they are said to cost, they cost in the environment."""

import io
import zipfile
from dataclasses import replace

import numpy as np
import pytest

from rigid_envs.base.files import DamagedFileError
from rigid_envs.envs.lookup import task_of
from rigid_envs.scores.best import (
    PLANNER,
    PLANS_FOLDER,
    StoredPlans,
    best_known,
    file_of,
    file_of_plans,
    missing_plans,
    read_best,
    read_plans,
)
from rigid_envs.scores.best import write_plans as write
from rigid_envs.scores.evaluation import evaluate
from rigid_envs.scores.finding import RECIPES, _guess, plan, recipe_of, replayed, spread
from rigid_envs.tools.cli import main

PLANNED = sorted(f"RigidEnvs/{file.stem}" for file in PLANS_FOLDER.glob("*.npz"))


def test_there_are_plans_of_no_other_ids_than_have_a_recipe():
    assert PLANNED and all(recipe_of(env_id) is not None for env_id in PLANNED)


@pytest.mark.parametrize("env_id", PLANNED)
def test_plans_cost_what_the_data_say(env_id):
    known, (found,) = best_known(env_id), replayed(env_id)
    own = np.array([name == PLANNER for name in known.finders])
    assert own.mean() > 0.5 and found.successes[own].all()
    np.testing.assert_allclose(found.costs[own], known.costs[own], rtol=1e-9, atol=1e-12)
    better = found.successes & (found.costs < known.costs * (1.0 - 1e-9))
    assert not better.any()


def test_plans_are_read_as_they_were_written(tmp_path):
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (5, 3, 2)).astype(np.float32)
    file = tmp_path / "plans.npz"
    write(file, StoredPlans(actions, 4))
    again = read_plans(file)
    np.testing.assert_array_equal(again.actions, actions)
    assert again.hold == 4


SOUND = np.zeros((5, 3, 2), np.float32)
WRONG = {
    "nan": StoredPlans(np.where(np.arange(2) == 1, np.nan, SOUND), 1),
    "inf": StoredPlans(SOUND - np.inf, 1),
    "7.0; expected numbers from -1 to 1": StoredPlans(SOUND + 7.0, 1),
    r"\(0, 3, 2\)": StoredPlans(SOUND[:0], 1),
    r"\(5, 0, 2\)": StoredPlans(SOUND[:, :0], 1),
    r"\(5, 3, 0\)": StoredPlans(SOUND[..., :0], 1),
    "hold = 0; expected an integer of at least 1": StoredPlans(SOUND, 0),
    "hold = 2001; expected plans of at most 10000": StoredPlans(SOUND, 2001),
}


@pytest.mark.parametrize("message", WRONG)
def test_plans_that_nobody_can_play_are_refused(tmp_path, message):
    file = tmp_path / "plans.npz"
    write(file, WRONG[message])
    with pytest.raises(DamagedFileError, match=rf"plans\.npz: .*{message}.*--plan"):
        read_plans(file)


def test_plans_of_fewer_starts_or_of_another_environment_are_refused(tmp_path):
    env_id = "RigidEnvs/CoinPark-v0"
    for plans in (StoredPlans(SOUND, 1), StoredPlans(np.zeros((5, 9, 3), np.float32), 1)):
        write(file_of_plans(env_id, tmp_path), plans)
        with pytest.raises(DamagedFileError, match="expected 2 from at least 4"):
            replayed(env_id, 4, tmp_path)


def test_a_small_file_that_unpacks_into_gigabytes_is_refused_before_it_does(tmp_path):
    file, header = tmp_path / "plans.npz", io.BytesIO()
    described = {"descr": "<f4", "fortran_order": False, "shape": (650_000, 500, 2)}
    np.lib.format.write_array_header_1_0(header, described)
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("actions.npy", header.getvalue() + bytes(1000))
        archive.writestr("hold.npy", b"")
    with pytest.raises(DamagedFileError, match="2600000000 bytes unpacked; expected at most"):
        read_plans(file)


def test_the_command_plans_and_says_who_found_it(tmp_path, capsys):
    env_id = "RigidEnvs/CoinPark-v0"
    assert main(["best", env_id, "--plan", "--starts", "3", "--out", str(tmp_path)]) == 0
    assert PLANNER in capsys.readouterr().out
    file = file_of(env_id, tmp_path)
    assert list(read_best(file).costs[:3]) == list(replayed(env_id, 3, tmp_path)[0].costs)
    assert main(["best", env_id, "--plan", "--starts", "4", "--out", str(tmp_path)]) == 0
    assert len(read_best(file).costs) == 4  # those of three starts are no beginning


def test_plans_that_a_wheel_leaves_out_are_asked_for_by_name(tmp_path, monkeypatch, capsys):
    env_id = "RigidEnvs/BallPark-v0"
    for function in (file_of_plans, replayed):
        before = function.__defaults__
        monkeypatch.setattr(function, "__defaults__", (*before[:-1], tmp_path))
    zero = evaluate(env_id, "zero")
    monkeypatch.setattr("rigid_envs.scores.finding.played", lambda *_: {"zero": zero})
    monkeypatch.setattr("rigid_envs.scores.finding.trained", lambda *_: [])
    assert main(["verify", "--scores", env_id]) == 0
    (line,) = [x for x in capsys.readouterr().out.splitlines() if x.startswith("not played: ")]
    assert f"{env_id}: no {tmp_path / 'BallPark-v0.npz'}; expected the plans of 486 starts" in line
    assert missing_plans("RigidEnvs/Detumble-v0") is None  # whose best costs are of no plan


def test_every_recipe_names_an_id():
    from rigid_envs.tasks.registry import ENVIRONMENTS

    assert {f"RigidEnvs/{name}-v0" for name in RECIPES} <= set(ENVIRONMENTS)


def test_a_ball_is_planned_from_guesses_alone_nearly_as_well_as_is_known(monkeypatch):
    few = replace(RECIPES["BallPark"], n_rounds=8, n_guesses=2)
    monkeypatch.setitem(RECIPES, "BallPark", few)
    plans = plan("RigidEnvs/BallPark-v0", 3)
    assert plans.actions.shape == (few.n_steps, 3, 2) and plans.hold == 1
    # of few guesses not all lead to the shortest path
    found = evaluate("RigidEnvs/BallPark-v0", plans.policy(3), n=3).efficiencies
    assert (found > 0.7).all() and (found > 0.99).sum() >= 2


def test_guesses_roll_a_ball_3_to_9_radii_along_a_curve():
    n_steps, task = 24, task_of("RigidEnvs/BallPark-v0")
    guess = _guess(np.random.default_rng(0), n_steps, 200, task)
    steps = np.linalg.norm(guess, axis=-1) * task.roll_per_step
    np.testing.assert_allclose(steps, np.broadcast_to(steps[0], steps.shape), rtol=1e-12)
    length = n_steps * steps[0]
    assert 3.0 < length.min() < 3.3 and 8.7 < length.max() < 9.0
    heading = guess[..., 0] + 1j * guess[..., 1]
    assert np.abs(np.angle(heading[1:] / heading[:-1])).max() < 1.0


def test_plans_are_spread_over_the_steps_there_are_in_equal_parts():
    actions = np.zeros((3, 3, 1))
    actions[:, 0, 0], actions[:, 1, 0] = [1.0, 0.5, 0.0], [0.6, 0.0, 0.0]  # the third one rests
    slowed = spread(actions, 7, slowed=True)[..., 0].T
    np.testing.assert_allclose(slowed[0], [1 / 3] * 3 + [0.5 / 3] * 3 + [0.0], rtol=1e-15)
    np.testing.assert_allclose(slowed[1], [0.6 / 7] * 7, rtol=1e-15)
    assert not slowed[2].any()
    as_they_are = spread(actions, 7, slowed=False)[..., 0].T
    np.testing.assert_array_equal(as_they_are[:2, :3], [[1.0, 0.5, 0.0], [0.6, 0.0, 0.0]])
    assert not as_they_are[:, 3:].any()
    turns = np.zeros((3, 1, 2))
    turns[0, 0, 0] = 1.0  # a row moves if one of its entries does
    np.testing.assert_array_equal(spread(turns, 4, slowed=True)[:, 0, 0], [0.25] * 4)
    # there is no room to split two steps into halves
    np.testing.assert_array_equal(spread(actions, 3, slowed=True)[:, 0, 0], [1.0, 0.5, 0.0])
