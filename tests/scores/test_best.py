"""Best known costs: the least of those who succeeded, and the stored plans that give them."""

import io
import json
import zipfile
from dataclasses import replace

import numpy as np
import pytest

from rigid_envs import load
from rigid_envs.base.files import DamagedFileError, write_document
from rigid_envs.engine.provenance import heading, provenance
from rigid_envs.envs.lookup import task_of
from rigid_envs.scores import best, finding
from rigid_envs.scores.best import write_plans as write
from rigid_envs.scores.evaluation import evaluate
from rigid_envs.scores.policies import from_controller, reference_controllers
from rigid_envs.scores.proof import best_of
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools.cli import main
from rigid_envs.tools.cli.scoring import verify_scores
from rigid_envs.watch.replays.recording import record_starts
from tests.refusals import refuses

AXIS = "RigidEnvs/IntermediateAxis-v0"
DETUMBLE = "RigidEnvs/Detumble-v0"
GRID = "RigidEnvs/BallGrid-v0"


def test_the_least_cost_of_a_success_is_kept_with_who_found_it():
    known = best.nobody(DETUMBLE, "loss", 5)
    known = known.improved("a", [1, 1, 0, 1, 0], [3.0, 2.0, 0.0, 0.0, 0.0])
    known = known.improved("b", [1, 1, 1, 1], [3.0 * (1 - 1e-12), 1.0, 5.0, 0.0])
    np.testing.assert_array_equal(known.costs, [3.0, 1.0, 5.0, 0.0, np.nan])
    assert known.finders == ("a", "b", "b", "a", "") and known.shares == {"a": 2, "b": 2}


def test_the_data_are_of_every_id_and_say_where_they_come_from():
    assert {path.name for path in best.FOLDER.iterdir()} == {
        best.file_of(i).name for i in ENVIRONMENTS
    }
    for env_id in ENVIRONMENTS:
        data, known = json.loads(best.file_of(env_id).read_text()), best.best_known(env_id)
        assert data["format"] == best.FORMAT and data["env_id"] == env_id
        assert data["evaluation_set"] == {"version": 1, "seed": 314159, "starts": 500}
        assert {"versions", "kernel_hash", "git_commit", "date"} <= data["provenance"].keys()
        assert known.costs.shape == (500,) and np.isfinite(known.costs).all()
        assert list(known.policies) == [*ENVIRONMENTS[env_id].controllers, "zero", "random"]


def test_the_data_can_be_computed_again(capsys):
    assert verify_scores([DETUMBLE])
    out = capsys.readouterr().out
    assert out.startswith(heading(provenance()).partition("\n")[0]) and out.count("holds") == 5


@pytest.mark.parametrize(("env_id", "policy"), [(DETUMBLE, "random"), (AXIS, "energy_casimir")])
def test_a_policy_takes_the_actions_that_its_figures_are_of(env_id, policy):
    told, found = best.best_known(env_id).policies[policy], evaluate(env_id, policy).summary()
    assert found["return_mean"] == pytest.approx(told["return_mean"], rel=1e-9)


def test_published_policies_are_among_those_who_search():
    (found,) = finding.trained(GRID, 20)
    assert found.n == 20 and found.policy == load(GRID).name and found.successes.all()


def test_data_that_have_been_changed_are_found(monkeypatch, capsys):
    known = best.best_known(DETUMBLE)
    changed = replace(known, costs=0.99 * known.costs)
    monkeypatch.setattr("rigid_envs.scores.best.best_known", lambda _: changed)
    assert main(["verify", "--scores", DETUMBLE]) == 1
    assert "riccati" in next(x for x in capsys.readouterr().out.splitlines() if "FAILS" in x)


def test_figures_that_differ_are_told_of_their_policies_alone(monkeypatch, capsys):
    known = best.best_known(DETUMBLE)
    (found,) = finding.trained(DETUMBLE)
    start = int(np.flatnonzero(found.successes)[0])
    finders = (*known.finders[:start], found.policy, *known.finders[start + 1 :])
    who = found.policy.split()[0]
    for cost, rate, told in ((1e-8, 0.9e-3, {who}), (0.0, 1.1e-3, {"zero"})):
        costs, zero = known.costs.copy(), dict(known.policies["zero"])
        costs[start] = found.costs[start] * (1.0 - cost)
        zero["success_rate"] += rate
        policies = {**known.policies, "zero": zero}
        changed = replace(known, costs=costs, finders=finders, policies=policies)
        monkeypatch.setattr("rigid_envs.scores.best.best_known", lambda _, changed=changed: changed)
        assert main(["verify", "--scores", DETUMBLE]) == 1
        lines = [line.split() for line in capsys.readouterr().out.splitlines()]
        assert {words[1] for words in lines if words[-1:] == ["FAILS"]} == told


def test_a_file_is_read_as_it_was_written(tmp_path):
    known, file = finding.find(GRID, n=5), tmp_path / "grid.json"
    best.write_best(file, replace(known, costs=np.array([*known.costs[:4], np.nan]),
                             finders=(*known.finders[:4], "")))  # fmt: skip
    again = best.read_best(file)
    np.testing.assert_array_equal(again.costs[:4], known.costs[:4])
    assert np.isnan(again.costs[4]) and again.finders == (*known.finders[:4], "")
    assert again.policies == json.loads(json.dumps(known.policies))


def test_the_name_of_a_finder_is_a_text(tmp_path):
    file = tmp_path / "grid.json"
    best.write_best(file, finding.find(GRID, n=2))
    said = {"finders": ["zero", 3], "finder": [0, 1]}
    write_document(file, json.loads(file.read_text()) | said)
    with pytest.raises(DamagedFileError, match="expected names"):
        best.read_best(file)


@pytest.mark.parametrize(
    ("costs", "finders"), [((1.0, 2.0), ("zero", "")), ((1.0, np.nan), ("zero",) * 2),
                           ((1.0, -1.0), ("zero",) * 2)]
)  # fmt: skip
def test_a_cost_has_a_finder_and_a_finder_a_cost_from_0(costs, finders, tmp_path):
    known, file = finding.find(GRID, n=2), tmp_path / "grid.json"
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
    assert main([*command, "--with", str(replay)]) == 0
    assert best.read_best(file).shares == {"riccati": 5}  # a worse one changes nothing
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


def test_what_others_found_stays_when_the_controllers_are_played_anew():
    better = finding.find(DETUMBLE, n=5).improved("somebody", [1, 0, 1], [0.0, 0.0, 0.0])
    again = finding.find(DETUMBLE, better, n=5)
    assert again.cost == ENVIRONMENTS[DETUMBLE].metrics[0] == "loss"
    assert again.finders == ("somebody", "riccati", "somebody", "riccati", "riccati")
    assert again.policies["riccati"]["efficiency"] < 0.7


def test_what_a_finder_found_stays_when_another_one_of_its_name_plays():
    riccati = evaluate(DETUMBLE, "riccati", n=5)

    def trained_to(shares):
        values = {**riccati.values, riccati.cost.name: riccati.costs * shares}
        return replace(riccati, policy="ppo", values=values)

    before = finding.find(DETUMBLE, None, [trained_to([0.5, 2.0, 0.5, 2.0, 2.0])], n=5)
    anew = trained_to([0.6, 0.6, 0.4, 2.0, 2.0])
    after = finding.find(DETUMBLE, before, [anew], n=5)
    assert after.finders == ("ppo, earlier", "ppo", "ppo", "riccati", "riccati")
    np.testing.assert_allclose(after.costs / riccati.costs, [0.5, 0.6, 0.4, 1.0, 1.0], rtol=1e-12)
    assert finding.find(DETUMBLE, after, [anew], n=5).finders == after.finders


PLANNED = sorted(f"RigidEnvs/{file.stem}" for file in best.PLANS_FOLDER.glob("*.npz"))


def test_recipes_are_of_ids_and_there_are_plans_of_no_others():
    assert {f"RigidEnvs/{name}-v0" for name in finding.RECIPES} <= set(ENVIRONMENTS)
    assert PLANNED and all(finding.recipe_of(env_id) is not None for env_id in PLANNED)
    refuses("^ID = RigidEnvs/Detumble-v0; expected one that", finding.plan, "RigidEnvs/Detumble-v0")


@pytest.mark.parametrize("env_id", PLANNED)
def test_plans_cost_what_the_data_say(env_id):
    known, (found,) = best.best_known(env_id), finding.replayed(env_id)
    own = np.array([name == best.PLANNER for name in known.finders])
    assert own.mean() > 0.5 and found.successes[own].all()
    np.testing.assert_allclose(found.costs[own], known.costs[own], rtol=1e-9, atol=1e-12)
    better = found.successes & (found.costs < known.costs * (1.0 - 1e-9))
    assert not better.any()


def test_plans_are_read_as_they_were_written(tmp_path):
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (5, 3, 2)).astype(np.float32)
    file = tmp_path / "plans.npz"
    write(file, best.StoredPlans(actions, 2000))  # for as long as a plan may last
    again = best.read_plans(file)
    np.testing.assert_array_equal(again.actions, actions)
    assert again.hold == 2000


SOUND = np.zeros((5, 3, 2), np.float32)
WRONG = {
    "nan": best.StoredPlans(np.where(np.arange(2) == 1, np.nan, SOUND), 1),
    "inf": best.StoredPlans(SOUND - np.inf, 1),
    "7.0; expected numbers from -1 to 1": best.StoredPlans(SOUND + 7.0, 1),
    r"\(0, 3, 2\)": best.StoredPlans(SOUND[:0], 1),
    r"\(5, 0, 2\)": best.StoredPlans(SOUND[:, :0], 1),
    r"\(5, 3, 0\)": best.StoredPlans(SOUND[..., :0], 1),
    "hold = 0; expected an integer of at least 1": best.StoredPlans(SOUND, 0),
    "hold = 2001; expected plans of at most 10000": best.StoredPlans(SOUND, 2001),
}


@pytest.mark.parametrize("message", WRONG)
def test_plans_that_nobody_can_play_are_refused(tmp_path, message):
    file = tmp_path / "plans.npz"
    write(file, WRONG[message])
    with pytest.raises(DamagedFileError, match=rf"plans\.npz: .*{message}.*--plan"):
        best.read_plans(file)


def test_plans_of_fewer_starts_or_of_another_environment_are_refused(tmp_path):
    env_id = "RigidEnvs/CoinPark-v0"
    for plans in (best.StoredPlans(SOUND, 1), best.StoredPlans(np.zeros((5, 9, 3), np.float32), 1)):
        write(best.file_of_plans(env_id, tmp_path), plans)
        with pytest.raises(DamagedFileError, match="expected 2 from at least 4"):
            finding.replayed(env_id, 4, tmp_path)


def test_a_small_file_that_unpacks_into_gigabytes_is_refused_before_it_does(tmp_path):
    file, header = tmp_path / "plans.npz", io.BytesIO()
    described = {"descr": "<f4", "fortran_order": False, "shape": (650_000, 500, 2)}
    np.lib.format.write_array_header_1_0(header, described)
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("actions.npy", header.getvalue() + bytes(1000))
        archive.writestr("hold.npy", b"")
    with pytest.raises(DamagedFileError, match="2600000000 bytes unpacked; expected at most"):
        best.read_plans(file)


def test_the_command_plans_and_says_who_found_it(tmp_path, capsys):
    env_id = "RigidEnvs/CoinPark-v0"
    assert main(["best", env_id, "--plan", "--starts", "3", "--out", str(tmp_path)]) == 0
    assert best.PLANNER in capsys.readouterr().out
    file = best.file_of(env_id, tmp_path)
    assert list(best.read_best(file).costs[:3]) == list(
        finding.replayed(env_id, 3, tmp_path)[0].costs
    )
    assert main(["best", env_id, "--plan", "--starts", "4", "--out", str(tmp_path)]) == 0
    assert len(best.read_best(file).costs) == 4  # those of three starts are no beginning


def test_plans_that_a_wheel_leaves_out_are_asked_for_by_name(tmp_path, monkeypatch, capsys):
    env_id = "RigidEnvs/BallPark-v0"
    for function in (best.file_of_plans, finding.replayed):
        before = function.__defaults__
        monkeypatch.setattr(function, "__defaults__", (*before[:-1], tmp_path))
    zero = evaluate(env_id, "zero")
    monkeypatch.setattr("rigid_envs.scores.finding.played", lambda *_: {"zero": zero})
    monkeypatch.setattr("rigid_envs.scores.finding.trained", lambda *_: [])
    assert main(["verify", "--scores", env_id]) == 0
    (line,) = [x for x in capsys.readouterr().out.splitlines() if x.startswith("not played: ")]
    assert f"{env_id}: no {tmp_path / 'BallPark-v0.npz'}; expected the plans of 486 starts" in line
    assert best.missing_plans("RigidEnvs/Detumble-v0") is None  # whose best costs are of no plan


def test_a_ball_is_planned_from_guesses_alone_nearly_as_well_as_is_known(monkeypatch):
    few = finding.RECIPES["BallPark"]._replace(n_rounds=8, n_guesses=2)
    monkeypatch.setitem(finding.RECIPES, "BallPark", few)
    plans = finding.plan("RigidEnvs/BallPark-v0", 3)
    assert plans.actions.shape == (few.n_steps, 3, 2) and plans.hold == 1
    # of few guesses not all lead to the shortest path
    found = evaluate("RigidEnvs/BallPark-v0", plans.policy(3), n=3).efficiencies
    assert (found > 0.7).all() and (found > 0.99).sum() >= 2


def test_guesses_roll_a_ball_3_to_9_radii_along_a_curve():
    n_steps, task = 24, task_of("RigidEnvs/BallPark-v0")
    guess = finding._guess(np.random.default_rng(0), n_steps, 200, task)
    steps = np.linalg.norm(guess, axis=-1) * task.roll_per_step
    np.testing.assert_allclose(steps, np.broadcast_to(steps[0], steps.shape), rtol=1e-12)
    length = n_steps * steps[0]
    assert 3.0 < length.min() < 3.3 and 8.7 < length.max() < 9.0
    heading = guess[..., 0] + 1j * guess[..., 1]
    assert np.abs(np.angle(heading[1:] / heading[:-1])).max() < 1.0


def test_plans_are_spread_over_the_steps_there_are_in_equal_parts():
    actions = np.zeros((3, 3, 1))
    actions[:, 0, 0], actions[:, 1, 0] = [1.0, 0.5, 0.0], [0.6, 0.0, 0.0]  # the third one rests
    slowed = finding.spread(actions, 7, slowed=True)[..., 0].T
    np.testing.assert_allclose(slowed[0], [1 / 3] * 3 + [0.5 / 3] * 3 + [0.0], rtol=1e-15)
    np.testing.assert_allclose(slowed[1], [0.6 / 7] * 7, rtol=1e-15)
    assert not slowed[2].any()
    as_they_are = finding.spread(actions, 7, slowed=False)[..., 0].T
    np.testing.assert_array_equal(as_they_are[:2, :3], [[1.0, 0.5, 0.0], [0.6, 0.0, 0.0]])
    assert not as_they_are[:, 3:].any()
    turns = np.zeros((3, 1, 2))
    turns[0, 0, 0] = 1.0  # a row moves if one of its entries does
    np.testing.assert_array_equal(finding.spread(turns, 4, slowed=True)[:, 0, 0], [0.25] * 4)
    # there is no room to split two steps into halves
    np.testing.assert_array_equal(finding.spread(actions, 3, slowed=True)[:, 0, 0], [1.0, 0.5, 0.0])
