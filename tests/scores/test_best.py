"""Best known costs: the least of those who succeeded, and the stored plans that give them."""

import io
import json
import zipfile
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from rigid_envs import load
from rigid_envs.base.files import DamagedFileError, write_document
from rigid_envs.engine.provenance import heading, provenance
from rigid_envs.scores import best, finding, proof
from rigid_envs.scores.evaluation import evaluate
from rigid_envs.scores.optima import searched
from rigid_envs.scores.policies import from_controller, reference_controllers
from rigid_envs.scores.proof import best_of
from rigid_envs.scores.records import read_evaluation, read_record
from rigid_envs.systems.rolling_ball import references
from rigid_envs.systems.rolling_ball.least_path import least_paths
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools.cli import main
from rigid_envs.tools.cli.scoring import verify_scores
from rigid_envs.watch.replays.recording import record_starts
from tests.refusals import refuses

AXIS = "RigidEnvs/IntermediateAxis-v0"
DETUMBLE = "RigidEnvs/Detumble-v0"
GRID = "RigidEnvs/BallGrid-v0"
TOP = "RigidEnvs/SleepingTop-v0"
DOCS = Path(__file__).parents[2] / "docs"
FIVE = {"costs": np.arange(1.0, 6.0), "finders": ("zero", "one", "zero", "one", "zero")}


def test_the_least_cost_of_a_success_is_kept_with_who_found_it():
    known, found = finding.nothing(DETUMBLE, 5).best, evaluate(DETUMBLE, "zero", n=5)

    def of(successes, losses):
        values = {"success": np.array(successes, float), "loss": np.array(losses)}
        return replace(found, values=values)

    known = known.improved(of([1, 1, 0, 1, 0], [3.0, 2.0, 0.0, 0.0, 0.0]), "aaaaa")
    known = known.improved(of([1, 1, 1, 1], [3.0 * (1 - 1e-12), 1.0, 5.0, 0.0]), "bbbb")
    np.testing.assert_array_equal(known.costs, [3.0, 1.0, 5.0, 0.0, np.nan])
    assert known.finders == ("a", "b", "b", "a", "") and known.shares == {"a": 2, "b": 2}


UNSOLVED = {"RigidEnvs/WheelTrack-v0": [30, 279]}
"""Starts from which nobody is known to have succeeded; none of other ids."""


def test_the_data_are_of_every_id_and_say_where_they_come_from():
    assert {path.name for path in best.FOLDER.iterdir()} == {
        best.file_of(i).name for i in ENVIRONMENTS
    }
    for env_id in ENVIRONMENTS:
        data, known = json.loads(best.file_of(env_id).read_text()), best.best_known(env_id)
        assert data["format"] == best.FORMAT and data["env_id"] == env_id
        assert data["evaluation_set"] == {"version": 2, "seed": 314159, "starts": 500}
        assert {"versions", "kernel_hash", "git_commit", "date"} <= data["provenance"].keys()
        assert known.costs.shape == (500,)
        assert np.flatnonzero(~np.isfinite(known.costs)).tolist() == UNSOLVED.get(env_id, [])
        assert list(known.policies) == [*ENVIRONMENTS[env_id].controllers, "zero", "random"]


@pytest.mark.long
@pytest.mark.push
def test_the_data_can_be_computed_again(capsys):
    assert verify_scores([DETUMBLE, TOP])  # a top that already stands succeeds at no cost
    out = capsys.readouterr().out
    assert out.startswith(heading(provenance()).partition("\n")[0]) and out.count("holds") == 10
    assert "best known" in out
    assert out.endswith("\noff by: the larger difference of success and efficiency; 0.001\n")


@pytest.mark.parametrize(("env_id", "policy"), [(DETUMBLE, "random"), (AXIS, "energy_casimir")])
def test_a_policy_takes_the_actions_that_its_figures_are_of(env_id, policy):
    told, found = best.best_known(env_id).policies[policy], evaluate(env_id, policy).summary()
    assert found["return_mean"] == pytest.approx(told["return_mean"], rel=1e-9)


def test_published_policies_are_among_those_who_search():
    (found,) = finding.trained(GRID, 20)
    assert found.n == 20 and found.policy == load(GRID).name and found.successes.all()


@pytest.mark.parametrize("env_id", ENVIRONMENTS)
def test_plans_of_the_repository_give_the_costs_that_the_data_say(env_id):
    known, found = best.best_known(env_id), finding.replayed(env_id)
    solved = np.isfinite(known.costs)
    assert (found.successes == solved).all() and found.actions.shape[1] == 500
    np.testing.assert_allclose(found.costs[solved], known.costs[solved], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("env_id", ENVIRONMENTS)
def test_nobody_that_the_repository_has_a_row_of_is_better_than_what_is_best(env_id):
    """By more than rounding: actions of another frame become float32 again."""
    name, known = env_id.rpartition("/")[2], best.best_known(env_id)
    rows = [read_record(file).evaluation for file in DOCS.glob(f"*/**/{name}/*_[0-9].json")]
    rows += [read_evaluation(file) for file in DOCS.glob(f"rows/{name}_*.json")]
    assert len(rows) >= 10
    for row in rows:
        if proof.objection(env_id, row.config, row.seed, row.n) is None:
            beaten = row.successes & (row.costs < known.costs[: row.n] * (1.0 - 1e-6))
            assert not beaten.any(), f"{row.policy} from starts {np.flatnonzero(beaten)}"


def test_data_that_have_been_changed_are_found(monkeypatch, capsys):
    known = best.best_known(DETUMBLE)
    changed = replace(known, costs=0.99 * known.costs)
    monkeypatch.setattr("rigid_envs.scores.best.best_known", lambda _: changed)
    assert main(["verify", "--scores", DETUMBLE]) == 1
    assert "riccati" in next(x for x in capsys.readouterr().out.splitlines() if "FAILS" in x)


def test_figures_that_differ_are_told_of_their_policies_alone(monkeypatch, capsys):
    known = best.best_known(DETUMBLE)
    for cost, rate, told in ((1e-8, 0.9e-3, {"best"}), (0.0, 1.1e-3, {"zero"})):
        costs, zero = known.costs.copy(), dict(known.policies["zero"])
        costs[3] *= 1.0 - cost
        zero["success_rate"] += rate
        changed = replace(known, costs=costs, policies={**known.policies, "zero": zero})
        monkeypatch.setattr("rigid_envs.scores.best.best_known", lambda _, changed=changed: changed)
        assert main(["verify", "--scores", DETUMBLE]) == 1
        lines = [line.split() for line in capsys.readouterr().out.splitlines()]
        assert {words[1] for words in lines if words[-1:] == ["FAILS"]} == told


def test_a_file_is_read_as_it_was_written(tmp_path):
    known, file = replace(best.best_known(GRID), **FIVE), tmp_path / "grid.json"
    best.write_best(file, replace(known, costs=np.array([*known.costs[:4], np.nan]),
                             finders=(*known.finders[:4], "")))  # fmt: skip
    again = best.read_best(file)
    np.testing.assert_array_equal(again.costs[:4], known.costs[:4])
    assert np.isnan(again.costs[4]) and again.finders == (*known.finders[:4], "")
    assert again.policies == json.loads(json.dumps(known.policies))


def test_the_name_of_a_finder_is_a_text(tmp_path):
    file = tmp_path / "grid.json"
    best.write_best(file, replace(best.best_known(GRID), **FIVE))
    said = {"finders": ["zero", 3], "finder": [0, 1, 0, 1, 0]}
    write_document(file, json.loads(file.read_text()) | said)
    with pytest.raises(DamagedFileError, match="expected names"):
        best.read_best(file)


@pytest.mark.parametrize(
    ("costs", "finders"), [((1.0, 2.0), ("zero", "")), ((1.0, np.nan), ("zero",) * 2),
                           ((1.0, -1.0), ("zero",) * 2)]
)  # fmt: skip
def test_a_cost_has_a_finder_and_a_finder_a_cost_from_0(costs, finders, tmp_path):
    known, file = best.best_known(GRID), tmp_path / "grid.json"
    best.write_best(file, replace(known, costs=np.array(costs), finders=finders))
    with pytest.raises(DamagedFileError, match="expected a cost from 0 and a finder, or neither"):
        best.read_best(file)


def test_what_is_best_is_known_of_the_id_itself_and_of_no_other_of_its_name():
    assert best.best_known(DETUMBLE).env_id == DETUMBLE
    assert best.best_known("Mine/Detumble-v0") is None
    assert best.best_known("Mine/Nothing-v0") is None
    assert best_of("Mine/Nothing-v0", 1) is None and best_of(DETUMBLE, 501) is None


def test_another_finder_is_added_by_its_recorded_actions(tmp_path, capsys):
    brake = from_controller(reference_controllers(DETUMBLE)["brake"], "brake")
    replay = record_starts(brake, DETUMBLE, 5, "somebody").save(tmp_path / "found.npz")
    command = ["best", DETUMBLE, "--starts", "5", "--out", str(tmp_path)]
    file = best.file_of(DETUMBLE, tmp_path)
    assert main(command) == 0
    assert best.read_best(file).shares == {"riccati": 5}
    assert main([*command, "--with", str(replay), "sampling"]) == 0
    assert best.read_best(file).shares == {"riccati": 5}  # a worse one changes nothing
    others = record_starts(brake, DETUMBLE, 2, seed=7).save(tmp_path / "others.npz")
    assert main([*command, "--with", str(others)]) == 2
    assert "start 0 = " in (said := capsys.readouterr().err) and "evaluation_seeds" in said
    command[1] = "RigidEnvs/BallParkDynamic-v0"
    assert main([*command, "--with", str(replay)]) == 2
    assert "expected RigidEnvs/BallParkDynamic-v0" in capsys.readouterr().err
    assert main(["evaluate", DETUMBLE, "--policy", str(replay)]) == 0
    said = capsys.readouterr().out
    assert "somebody, 5 starts" in said
    told = evaluate(DETUMBLE, "brake", n=5).efficiency.mean
    assert f"{told:.3f}" in said


@pytest.mark.parametrize(
    ("env_id", "n", "config", "label", "name"),
    [(DETUMBLE, 1, {"dt": 0.09}, "somebody", "somebody"), (GRID, 5, {}, "", "found")],
)
def test_a_replay_is_evaluated_as_whoever_played_it(
    env_id, n, config, label, name, tmp_path, capsys
):
    told = evaluate(env_id, "reference", n=n, config=config)
    policy = from_controller(reference_controllers(env_id)[told.policy])
    replay = record_starts(policy, env_id, n, label, config=config)
    lengths = {len(episode) for episode in replay.episodes}
    assert (len(lengths) > 1) == (env_id == GRID)  # its episodes end at success
    file = replay.save(tmp_path / "found.npz")
    assert main(["evaluate", env_id, "--policy", str(file), "--json"]) == 0
    row, expected = json.loads(capsys.readouterr().out), told.row()
    assert row["algo"] == name
    assert all(row[key] == expected[key] for key in ("env_id", "config", "policy", "starts"))


def test_data_of_another_package_are_not_kept_in_this_one(monkeypatch, capsys):
    monkeypatch.setattr("rigid_envs.tools.cli.scoring.ENVIRONMENTS", {DETUMBLE: None})
    assert main(["best", "BallGrid"]) == 2
    assert "--out = None; expected a folder: the package keeps" in capsys.readouterr().err


@pytest.mark.parametrize("who", ["breadth_first 500", "nobody"])
def test_the_command_says_who_found_what_and_how_well_each_policy_does(who, monkeypatch, capsys):
    found = best.best_known(GRID)
    if who == "nobody":
        found = replace(found, costs=np.full(500, np.nan), finders=("",) * 500)
    monkeypatch.setattr("rigid_envs.tools.cli.scoring._measured", lambda *_: found)
    assert main(["best", "BallGrid"]) == 0
    title, *lines = capsys.readouterr().out.splitlines()
    assert title.endswith(f" s   best path: {who}")
    rows = {line.split()[0]: line.split()[1:3] for line in lines[2:-2] if line.strip()}
    figures = [(each["success_rate"], each["efficiency"]) for each in found.policies.values()]
    assert rows == {
        name: [f"{each:.4g}" for each in pair]
        for name, pair in zip(found.policies, figures, strict=True)
    }


def test_what_is_stored_stays_with_its_finder_until_somebody_is_better(tmp_path):
    riccati, brake = (evaluate(DETUMBLE, name, n=5) for name in ("riccati", "brake"))
    found = finding.nothing(DETUMBLE, 5).and_of(replace(brake, policy="somebody"))
    best.write_best(best.file_of(DETUMBLE, tmp_path), found.told({}).best)
    best.write_plans(best.file_of_plans(DETUMBLE, tmp_path), found.actions)
    again = finding.stored(DETUMBLE, 7, tmp_path, tmp_path)
    assert again.best.finders == ("somebody",) * 5 + ("",) * 2
    np.testing.assert_array_equal(again.best.costs[:5], brake.costs)
    better = again.and_of(riccati)
    assert better.best.finders == ("riccati",) * 5 + ("",) * 2
    np.testing.assert_array_equal(better.actions[:50, :5], riccati.actions)
    assert better.and_of(brake).best.finders == better.best.finders
    told = finding.nothing(DETUMBLE, 5).and_of(riccati).told({"brake": brake, "riccati": riccati})
    rates = [each["efficiency"] for each in told.best.policies.values()]
    assert rates[0] < rates[1] == 1.0


def test_recipes_are_of_ids_that_say_what_success_is():
    assert all(finding.recipe_of(f"RigidEnvs/{name}-v0") for name in finding.RECIPES)
    told = "^ID = RigidEnvs/Detumble-v0; expected one that is planned"
    refuses(told, finding.plan, "RigidEnvs/Detumble-v0", [], np.arange(2))


def test_plans_are_read_as_they_were_written(tmp_path):
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (10_000, 3, 2)).astype(np.float32)
    file = tmp_path / "plans.npz"
    best.write_plans(file, actions)  # for as long as a plan may last
    np.testing.assert_array_equal(best.read_plans(file), actions)


SOUND = np.zeros((5, 3, 2), np.float32)
WRONG = {
    "nan": np.where(np.arange(2) == 1, np.nan, SOUND),
    "inf": SOUND - np.inf,
    "float64": SOUND.astype(np.float64),
    r"\(0, 3, 2\)": SOUND[:0],
    r"\(5, 0, 2\)": SOUND[:, :0],
    r"\(5, 3, 0\)": SOUND[..., :0],
    "actions = 10001; expected plans of at most 10000": np.zeros((10_001, 1, 1), np.float32),
}


@pytest.mark.parametrize("message", WRONG)
def test_plans_that_nobody_can_play_are_refused(tmp_path, message):
    file = tmp_path / "plans.npz"
    best.write_plans(file, WRONG[message])
    with pytest.raises(DamagedFileError, match=rf"plans\.npz: .*{message}.*rigid-envs best"):
        best.read_plans(file)


def test_plans_of_another_environment_are_refused(tmp_path):
    for env_id, wrong in {
        "RigidEnvs/CoinPark-v0": (SOUND + 7.0, np.zeros((5, 9, 3), np.float32)),
        GRID: (SOUND[..., :1] - 1.0, SOUND[..., :1] + 4.0),
    }.items():
        for actions in wrong:
            best.write_plans(best.file_of_plans(env_id, tmp_path), actions)
            with pytest.raises(DamagedFileError, match=r"expected [12] from (-1 to 1|0 to 3), for"):
                finding.replayed(env_id, 4, tmp_path)


def test_a_small_file_that_unpacks_into_gigabytes_is_refused_before_it_does(tmp_path):
    file, header = tmp_path / "plans.npz", io.BytesIO()
    described = {"descr": "<f4", "fortran_order": False, "shape": (650_000, 500, 2)}
    np.lib.format.write_array_header_1_0(header, described)
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("actions.npy", header.getvalue() + bytes(1000))
    with pytest.raises(DamagedFileError, match="2600000000 bytes unpacked; expected at most"):
        best.read_plans(file)


def test_the_command_plans_and_says_who_found_it(tmp_path, monkeypatch, capsys):
    env_id = "RigidEnvs/CoinPark-v0"
    monkeypatch.setattr(finding, "_BLOCK", 2)
    monkeypatch.setitem(
        finding.RECIPES, "CoinPark", finding.Recipe(n_rounds=2, n_steps=40, n_hops=1)
    )
    for n in (2, 3):  # what is known of two is kept
        words = ["best", env_id, "--plan", "--starts", str(n), "--out", str(tmp_path)]
        assert main(words) == 0
        assert best.PLANNER in capsys.readouterr().out
        known = best.read_best(best.file_of(env_id, tmp_path))
        assert list(known.costs) == list(finding.replayed(env_id, n, tmp_path).costs)
        reference = evaluate(env_id, "reference", n=n)
        assert (known.costs < 0.999 * reference.costs).all()


def test_starts_are_planned_in_blocks_each_from_its_own_first_start(monkeypatch):
    brake, planned = evaluate(DETUMBLE, "brake", n=5), []

    def plan(env_id, firsts, rows, seed):
        planned.append(rows.tolist())
        return brake.actions[:, rows]

    monkeypatch.setattr(finding, "plan", plan)
    monkeypatch.setattr(finding, "_BLOCK", 2)
    *_, found = finding.search(finding.nothing(DETUMBLE, 5), [])
    assert planned == [[0, 1], [2, 3], [4]]
    np.testing.assert_array_equal(found.best.costs, brake.costs)
    assert found.best.finders == (best.PLANNER,) * 5


@pytest.mark.long
@pytest.mark.push
def test_a_policy_that_rests_for_a_time_turns_over_freely_and_needs_less():
    known = finding.nothing(AXIS, 10)
    (policy,) = [each for each, _ in finding.players(AXIS) if each.name == "minimum_fuel"]
    found = finding.rested(known, policy, {}, 16)
    always = evaluate(AXIS, "minimum_fuel", n=10)
    least = proof.bounds_of(AXIS, 10, always.seed, {})
    assert always.successes.all() and np.isfinite(found.best.costs).all()
    assert (least < found.best.costs).all() and found.best.costs.mean() < 0.8 * always.costs.mean()
    again = evaluate(AXIS, finding.of_plans(found.actions), n=10)
    np.testing.assert_array_equal(again.costs, found.best.costs)


@pytest.mark.long
@pytest.mark.push
def test_rests_are_drawn_anew_by_another_seed_and_planned_beside_better_plans(monkeypatch):
    known, planned = finding.stored(AXIS, 3), []

    def plan(env_id, firsts, rows, seed):
        planned.append((seed, *firsts))
        return firsts[1]

    monkeypatch.setattr(finding, "plan", plan)
    monkeypatch.setattr(finding, "_N_TRIALS", 4)
    first_player = finding.players(AXIS)[:1]
    monkeypatch.setattr(finding, "players", lambda _: first_player)
    for seed in (1, 1, 2):
        *_, found = finding.search(known, [], seed)
        np.testing.assert_array_equal(found.best.costs, known.best.costs)
    (one, *first), (_, *again), (two, *other) = planned
    assert (one, two) == (1, 2)
    for a, b in zip(first, again, strict=True):
        np.testing.assert_array_equal(a, b)
    np.testing.assert_array_equal(first[0], other[0])
    assert first[1].any() and (first[1].shape != other[1].shape or (first[1] != other[1]).any())


def test_a_seed_is_refused_below_0_and_where_nothing_is_drawn(capsys):
    assert main(["best", DETUMBLE, "--plan", "--seed", "-1"]) == 2
    assert "--seed = -1; expected a number from 0" in capsys.readouterr().err
    assert main(["best", DETUMBLE, "--seed", "2"]) == 2
    assert "--seed = 2; expected --plan beside it" in capsys.readouterr().err


def test_plans_that_a_wheel_leaves_out_are_asked_for_by_name(tmp_path, monkeypatch, capsys):
    env_id = "RigidEnvs/BallPark-v0"
    monkeypatch.setattr(best.file_of_plans, "__defaults__", (tmp_path,))
    zero = evaluate(env_id, "zero")
    monkeypatch.setattr("rigid_envs.scores.finding.played", lambda *_: {"zero": zero})
    missing = f"{env_id}: no {tmp_path / 'BallPark-v0.npz'}; expected the plans of 500 starts"
    assert main(["verify", "--scores", env_id]) == 0
    (line,) = [x for x in capsys.readouterr().out.splitlines() if x.startswith("not played: ")]
    assert missing in line
    assert main(["best", env_id]) == 2  # rather than to forget what is known
    assert missing in capsys.readouterr().err


def test_a_ball_is_planned_along_extremals_alone_nearly_as_well_as_the_optimum(monkeypatch):
    few = finding.RECIPES["BallPark"]._replace(n_rounds=24, n_hops=0)
    monkeypatch.setitem(finding.RECIPES, "BallPark", few)
    monkeypatch.setattr(references, "least_paths", partial(least_paths, n_rays=1000))
    known = finding.stored_plans("RigidEnvs/BallPark-v0", 3, best.PLANS_FOLDER)
    optima, extremals = searched("RigidEnvs/BallPark-v0", known)
    actions = finding.plan("RigidEnvs/BallPark-v0", [extremals], np.arange(3))
    assert actions.shape == (few.n_steps, 3, 2)
    found = evaluate("RigidEnvs/BallPark-v0", finding.of_plans(actions), n=3)
    assert found.successes.all() and (found.costs < 1.003 * optima).all()


def test_plans_are_spread_over_the_steps_there_are_in_equal_parts():
    actions = np.zeros((3, 3, 1))
    actions[:, 0, 0], actions[:, 1, 0] = [1.0, 0.5, 0.0], [0.6, 0.0, 0.0]  # the third one rests
    slowed = finding.spread(actions, 7, slowed=True)[..., 0].T
    np.testing.assert_allclose(slowed[0], [0.25] * 4 + [0.5 / 3] * 3, rtol=1e-15)
    np.testing.assert_allclose(slowed[1], [0.6 / 7] * 7, rtol=1e-15)
    assert not slowed[2].any()
    as_they_are = finding.spread(actions, 7, slowed=False)[..., 0].T
    np.testing.assert_array_equal(as_they_are[:2, :3], [[1.0, 0.5, 0.0], [0.6, 0.0, 0.0]])
    assert not as_they_are[:, 3:].any()
    turns = np.zeros((3, 1, 2))
    turns[0, 0, 0] = 1.0  # a row moves if one of its entries does
    np.testing.assert_array_equal(finding.spread(turns, 4, slowed=True)[:, 0, 0], [0.25] * 4)
    for slowed in (False, True):  # there is room for one step
        np.testing.assert_array_equal(finding.spread(actions, 1, slowed)[0, :, 0], [1.0, 0.6, 0.0])
