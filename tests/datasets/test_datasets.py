"""Data sets load with Minari, play again to the bit, and are there whole or not at all."""

import json
import os
import shlex
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path

import h5py
import minari
import numpy as np
import pytest

from rigid_envs.envs.shells import RigidEnv, RigidVectorEnv
from rigid_envs.scores.best import best_known
from rigid_envs.scores.starts import evaluation_seeds
from rigid_envs.scores.trained import FOLDER
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools import datasets
from rigid_envs.tools.cli import main
from tests.page_code import run_page

DRAWN = "--radius 0.8,1.2 --observe_params true --observation_noise 0.01 --action_delay 2"
AT_ONCE = "--position_tolerance 9 --angle_tolerance 3.2"  # parked in the first step


@pytest.fixture(autouse=True)
def root(tmp_path, monkeypatch):
    """The folder of all data sets."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "sets"))
    return tmp_path / "sets"


def everything(name):
    """All numbers of a data set, by place."""
    found = {}
    place = Path(minari.load_dataset(name).spec.data_path) / "main_data.hdf5"
    with h5py.File(place) as file:
        file.visititems(
            lambda key, each: found.update({key: each[()]}) if hasattr(each, "dtype") else None
        )
        found |= {f"{key}/seed": group.attrs["seed"] for key, group in file.items()}
    return found


@pytest.mark.parametrize(
    ("words", "name"),
    [
        ("BallPark --policy BallPark", "BallPark/ppo-reduced"),
        ("BallParkGoal --policy three_rolls", "BallParkGoal/three_rolls"),
        ("BallGrid --policy reference", "BallGrid/breadth_first"),
        ("IntermediateAxisRandom --policy random", "IntermediateAxisRandom/random"),
        ("SleepingTopRandom --policy lqr --rotation quat", "SleepingTopRandom/lqr"),
        (f"BallPark --policy random {DRAWN}", "BallPark/random"),
        (f"BallPark --policy random {AT_ONCE}", "BallPark/random"),
    ],
)
def test_what_is_written_loads_and_plays_again_to_the_bit(words, name, capsys):
    assert main(["dataset", *words.split(), "--episodes", "4", "--seed", "3"]) == 0
    name = f"rigid-envs/{name}-v0"
    told = f"written: {name}\nto play it again: rigid-envs dataset --check {name}\n"
    assert capsys.readouterr().out == told
    dataset = minari.load_dataset(name)
    assert dataset.total_episodes == 4 and name in minari.list_local_datasets()
    env = dataset.recover_environment()
    assert env.observation_space == dataset.observation_space
    assert env.action_space == dataset.action_space
    for episode in dataset:
        n = len(episode)
        assert len(episode.actions) == n and episode.rewards.dtype == np.float64
        assert not (episode.terminations | episode.truncations)[:-1].any()
        assert (episode.terminations | episode.truncations)[-1]
        seen = episode.observations
        parts = seen.values() if isinstance(seen, dict) else [seen]
        assert {len(column) for column in (*episode.infos.values(), *parts)} == {n + 1}
    assert main(["dataset", "--check", name]) == 0
    assert capsys.readouterr().out == (
        f"{name}: 4 episodes, {dataset.total_steps} steps, bit for bit: holds\n"
    )


def test_one_changed_bit_is_found_and_named(capsys):
    name = datasets.write("BallPark", "three_rolls", 3)
    place = Path(minari.load_dataset(name).spec.data_path) / "main_data.hdf5"
    for key, message in (
        ("episode_1/rewards", "episode 1: step 2: rewards = "),
        ("episode_2/observations", "episode 2: step 1: observation  = "),
        ("episode_0/infos/cost", "episode 0: step 1: info cost = "),
    ):
        with h5py.File(place, "r+") as file:
            values = file[key]
            before = values[2]
            values[2] = np.nextafter(before, np.inf, dtype=values.dtype)
        assert main(["dataset", "--check", name]) == 1
        told = capsys.readouterr().out
        assert told.startswith(f"FAILS: {message}") and told.count("FAILS: ") == 1
        assert told.endswith("bit for bit: FAILS\n")
        with h5py.File(place, "r+") as file:
            file[key][2] = before
    assert not datasets.check(name).differences


def test_kernels_that_have_changed_are_named_where_something_differs(root):
    name = datasets.write("BallPark", "three_rolls", 1)
    file = root / name / "data/metadata.json"
    about = json.loads(file.read_text())
    about["rigid_envs"]["kernel_hash"] = "other"
    file.write_text(json.dumps(about))
    assert not datasets.check(name).differences
    with h5py.File(root / name / "data/main_data.hdf5", "r+") as main_data:
        main_data["episode_0/rewards"][0] += 1.0
    _, kernels = datasets.check(name).differences
    assert kernels.startswith("written with kernels other; these: ")


def test_nothing_is_left_open_or_said_or_changed_in_the_process(tmp_path, monkeypatch, recwarn):
    closed = []
    for kind in (RigidEnv, RigidVectorEnv):
        monkeypatch.setattr(kind, "close", lambda env, **_: closed.append(type(env)))
    monkeypatch.setattr(datasets, "_ROWS", 2)
    for before in (None, "elsewhere"):
        if before is None:
            monkeypatch.delenv("MINARI_DATASETS_PATH")
        else:
            monkeypatch.setenv("MINARI_DATASETS_PATH", before)
        told = []
        closed.clear()
        options = {"folder": tmp_path / str(before), "tell": told.append}
        name = datasets.write("BallGrid", "random", 5, **options)
        assert told == [f"{k} of 5 episodes" for k in (0, 2, 4)]
        assert not datasets.check(name, options["folder"]).differences
        assert os.environ.get("MINARI_DATASETS_PATH") == before
        assert Counter(closed) == {RigidVectorEnv: 3, RigidEnv: 2}  # one of them to check
    assert not [each for each in recwarn if each.category is UserWarning]


def test_provenance_says_how_it_came_about():
    file = FOLDER / "BallReorient-v0.safetensors"
    settings = {"radius": (0.8, 1.2)}
    name = datasets.write("BallReorient", str(file), 2, seed=5, name="mine/a-v3", config=settings)
    assert name == "mine/a-v3"
    about = minari.load_dataset(name).storage.metadata
    summary = "RigidEnvs/BallReorient-v0, played by ppo reduced: Turn the ball upright and return"
    assert about["description"].startswith(summary)
    told = about["rigid_envs"]
    assert told["env_id"] == "RigidEnvs/BallReorient-v0" and told["seed"] == 5
    assert told["env_kwargs"] == {"frame": "reduced", "radius": [0.8, 1.2]}
    policy = told["policy"]
    assert policy["kind"] == "trained" and len(policy["sha256"]) == 64 and policy["algo"] == "ppo"
    assert "--policy" in told["command"] and "--radius" in told["command"]
    assert {"versions", "kernel_hash", "git_commit", "date"} <= told.keys()
    again = shlex.split(told["command"])[1:]
    before = everything(name)
    assert main([*again, "--overwrite"]) == 0
    for key, values in everything(name).items():
        np.testing.assert_array_equal(values, before[key])


def test_the_command_and_the_function_write_the_same_by_default(root, monkeypatch):
    written = []

    def fill(name, env_id, _, seeds, origin, __):
        (Path(os.environ["MINARI_DATASETS_PATH"]) / name / "data").mkdir(parents=True)
        written.append((name, env_id, seeds, origin))

    monkeypatch.setattr(datasets, "_fill", fill)
    assert datasets.write("Detumble", "random") == "rigid-envs/Detumble/random-v0"
    words = ["dataset", "Detumble", "--policy", "random"]
    assert main(words) == 2  # it is there already
    assert main([*words, "--overwrite"]) == 0
    first, again = written
    assert first == again and len(first[2]) == 100 and first[3]["seed"] == 0


def test_starts_are_none_of_the_evaluation_and_all_differ():
    found = everything(datasets.write("Detumble", "random", 40, seed=314159))
    seeds = [int(value) for key, value in found.items() if key.endswith("/seed")]
    assert len(set(seeds)) == 40 and not set(seeds) & set(evaluation_seeds())


@pytest.mark.parametrize("policy", ["riccati", "random", "Detumble"])
def test_how_many_are_played_together_makes_no_difference_but_to_what_is_drawn(policy, monkeypatch):
    whole = everything(datasets.write("Detumble", policy, 7, name="whole-v0"))
    monkeypatch.setattr(datasets, "_ROWS", 3)
    parts = everything(datasets.write("Detumble", policy, 7, name="parts-v0"))
    assert whole.keys() == parts.keys()
    drawn = [parts[f"episode_{k}/actions"] for k in range(7)]
    if policy == "random":
        assert len({each.tobytes() for each in drawn}) == 7
    else:
        for key, values in whole.items():
            np.testing.assert_array_equal(parts[key], values)
    assert not datasets.check("parts-v0").differences


def test_scores_are_between_the_random_policy_and_the_reference():
    mean = {}
    for policy in ("random", "riccati"):
        dataset = minari.load_dataset(datasets.write("Detumble", policy, 200))
        returns = np.array([episode.rewards.sum() for episode in dataset])
        mean[policy] = minari.get_normalized_score(dataset, returns).mean()
    assert mean["random"] == pytest.approx(0.0, abs=0.05)
    assert mean["riccati"] == pytest.approx(1.0, abs=0.05)
    known = best_known("RigidEnvs/Detumble-v0")
    for key, policy in (("ref_min_score", "random"), ("ref_max_score", "riccati")):
        assert dataset.storage.metadata[key] == known.policies[policy]["return_mean"]


def test_there_are_scores_of_the_task_that_is_known_alone(monkeypatch):
    env_id = "RigidEnvs/Detumble-v0"
    known = datasets._scores(env_id, {})
    assert known["ref_min_score"] < known["ref_max_score"]
    assert known["num_episodes_average_score"] == 500
    assert datasets._scores(env_id, {"rotation": "quat", "frame": "reduced"}) == known  # as seen
    assert datasets._scores(env_id, {"impulse": 0.3}) == {}
    record = replace(ENVIRONMENTS[env_id], controllers={})
    with monkeypatch.context() as patch:
        patch.setattr(datasets, "ENVIRONMENTS", {env_id: record})
        assert datasets._scores(env_id, {}) == {}  # no reference
    monkeypatch.setattr(datasets, "best_known", lambda _: None)
    assert datasets._scores(env_id, {}) == {}


def test_another_folder_is_used_for_this_one_only(root, tmp_path, capsys):
    out = tmp_path / "elsewhere"
    words = ["dataset", "Detumble", "--policy", "random", "--episodes", "2", "--out", str(out)]
    assert main(words) == 0
    assert not root.exists() and (out / "rigid-envs/Detumble/random-v0/data").is_dir()
    again = ["dataset", "--check", "rigid-envs/Detumble/random-v0", "--out", str(out)]
    assert capsys.readouterr().out.endswith(f"to play it again: rigid-envs {shlex.join(again)}\n")
    assert main(again) == 0


@pytest.mark.parametrize("overwrite", [False, True])
@pytest.mark.parametrize("error", [KeyboardInterrupt, OSError(28, "No space left on device")])
def test_what_is_stopped_leaves_nothing_and_what_was_there_stays(
    overwrite, error, root, monkeypatch, capsys
):
    name = datasets.write("Detumble", "riccati", 3)
    before, files = everything(name), sorted(root.rglob("*"))
    monkeypatch.setattr(datasets, "_ROWS", 2)
    calls, collect = [], datasets.collect

    def stopped(*arguments):
        calls.append(arguments)
        if len(calls) == 2:
            raise error
        return collect(*arguments)

    monkeypatch.setattr(datasets, "collect", stopped)
    words = ["dataset", "Detumble", "--policy", "riccati" if overwrite else "random"]
    status = main([*words, "--episodes", "5", *(["--overwrite"] if overwrite else [])])
    assert len(calls) == 2 and status == (130 if error is KeyboardInterrupt else 1)
    assert "Traceback" not in capsys.readouterr().err
    assert sorted(root.rglob("*")) == files
    for key, values in everything(name).items():
        np.testing.assert_array_equal(values, before[key])


@pytest.mark.parametrize(
    ("settings", "said"), [({"task": "trap:Code"}, "config.task: unknown key"), (3, "not iterable")]
)
def test_code_that_a_data_set_names_is_not_run(settings, said, root, monkeypatch, capsys):
    (root.parent / "trap.py").write_text("raise SystemExit('run')")
    monkeypatch.syspath_prepend(root.parent)
    file = root / datasets.write("Detumble", "random", 1) / "data/metadata.json"
    about = json.loads(file.read_text())
    about["env_spec"] = about["env_spec"].replace("rigid_envs.envs:RigidEnv", "trap:Code")
    file.write_text(json.dumps(about))
    name = file.parents[1].relative_to(root).as_posix()
    assert "trap:Code" in about["env_spec"]
    assert main(["dataset", "--check", name]) == 0  # of its own environment, not of Minari's entry
    about["rigid_envs"]["env_kwargs"] = settings
    file.write_text(json.dumps(about))
    assert main(["dataset", "--check", name]) == 2
    assert said in capsys.readouterr().err and "trap" not in sys.modules
    del about["rigid_envs"]  # as in a data set that another library has written
    file.write_text(json.dumps(about))
    assert main(["dataset", "--check", name]) == 2
    assert "expected a data set that `rigid-envs dataset` has written" in capsys.readouterr().err


def test_one_that_is_there_or_not_there_is_refused(root, capsys):
    assert main(["dataset", "--check", "none/there-v0"]) == 1
    assert "none/there-v0 not found" in capsys.readouterr().err
    name = datasets.write("Detumble", "random", 2)
    words = ["dataset", "Detumble", "--policy", "random", "--episodes", "1"]
    assert main(words) == 2
    assert "--overwrite" in capsys.readouterr().err
    assert minari.load_dataset(name).total_episodes == 2
    assert main([*words, "--overwrite"]) == 0
    assert minari.load_dataset(name).total_episodes == 1
    (root / "full-v0" / "of-v0").mkdir(parents=True)  # a folder of data sets is none
    assert main([*words, "--overwrite", "--name", "full-v0"]) == 2
    assert (root / "full-v0" / "of-v0").is_dir()


@pytest.mark.parametrize("module", ["minari", "h5py", "PIL"])
def test_without_minari_the_extra_is_named(module, root, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, module, None)
    assert main(["dataset", "BallPark", "--policy", "random"]) == 1
    told = capsys.readouterr().err
    assert 'pip install "rigid-envs[dataset]"' in told and len(told.splitlines()) == 1
    assert not root.exists()  # refused before anything is begun


def test_the_page_runs(root):
    names = run_page("datasets.md")
    assert names["parked"].total_episodes == 20
    assert names["score"].mean() == pytest.approx(1.0, abs=0.3)
    made = {path.name for path in (root / "rigid-envs" / "BallPark").iterdir()}
    assert made == {"namespace_metadata.json", "random-v0", "three_rolls-v0", "trained-v0"}
