"""The command line does what its help says, and says what to do next."""

import json
import os
import re
import shlex
import shutil
import signal
from dataclasses import replace
from pathlib import Path

import pytest
import yaml

from agents.cli import verbs
from agents.cli.command_line import main
from agents.config.reading import load_config, recipe_for
from agents.training.trainer import Trainer
from rigid_envs.scores.trained import file_of
from rigid_envs.watch.replays.replay import load_replay
from tests.programs import printed

ENV = ["--env_id", "tests.agents.drift:Drift-v0", "--allow-import", "tests.agents.drift"]
SMALL = [
    *("--n_envs", "16", "--n_steps", "32", "--batch_size", "128", "--n_epochs", "2"),
    *("--eval_every", "4000", "--eval_episodes", "16", "--learning_rate", "1e-3"),
]
ROOT = Path(__file__).parents[3]
BALL_PARK = "RigidEnvs/BallPark-v0"
IN_THE_WORLD = {"env_id": BALL_PARK, "total_timesteps": 3_990_000}


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    logs = tmp_path_factory.mktemp("logs")
    words = [*SMALL, "--total_timesteps", "1.2e4", "--log_dir", str(logs)]
    said = printed("-m", "agents", "train", *ENV, *words, cwd=ROOT)
    return logs / "ppo" / "Drift-v0_1", said


def test_training_ends_with_the_table_and_where_everything_is(finished):
    folder, said = finished
    assert "500 unseen starts" in said and "random policy" in said and str(folder) in said
    listed, after = said.split(f"In {folder}:")[1].split("Next:")
    named = re.findall(r"[\w.]+\.(?:json|csv|png|npz)|\w+(?=/)", listed)
    assert len(named) == 9
    assert all((folder / name).exists() for name in named)
    watch, _, again = re.findall(r"^  (\w.+)$", after, flags=re.MULTILINE)
    assert watch.startswith("python -m agents enjoy ")
    assert main([*watch.split()[3:], "--table"]) == 0
    assert f"--config {folder / 'config.yaml'} --seed 1 {ENV[2]} {ENV[3]}" in again
    results = json.loads((folder / "results.json").read_text())
    assert results["policy"]["episodes"] == results["random_policy"]["episodes"] == 500
    keys = {"versions", "training_seed", "git_commit", "git_dirty", "training_seconds", "command",
            "kernel_hash", "test_seed", "policy_sha256", "starts"}  # fmt: skip
    assert keys <= results.keys()
    assert (folder / "learning_curve.png").read_bytes().startswith(b"\x89PNG")
    assert list((folder / "tensorboard").glob("events.*"))


def test_evaluate_gives_the_same_figures_again(finished, tmp_path, capsys):
    trained, said = finished
    folder = shutil.copytree(trained, tmp_path / "run")  # others see what the training wrote
    written = (folder / "results.json").read_bytes()
    before = json.loads(written)
    assert main(["evaluate", str(folder), *ENV[2:]]) == 0
    told = capsys.readouterr().out
    found = folder / "evaluated" / f"best-500-{before['test_seed']}" / "results.json"
    assert f"written to {found.parent}" in told
    after = json.loads(found.read_text())
    assert after["policy"] == before["policy"]
    assert after["random_policy"] == before["random_policy"]
    assert told.splitlines()[1] in said
    assert (folder / "results.json").read_bytes() == written


def test_evaluate_saves_replays_and_rows_of_the_leaderboard(finished, tmp_path, capsys):
    options = ("--episodes", "3", "--save-replays", "2", "--out", str(tmp_path))
    assert main(["evaluate", str(file_of("Detumble")), *options]) == 0
    file = tmp_path / "replays.npz"
    assert capsys.readouterr().out.endswith(f"2 episodes; see rigid-envs replay {file}\n")
    assert len(load_replay(file).episodes) == 2
    assert main(["leaderboard", str(tmp_path)]) == 0
    assert "expected all 500 starts" in (tmp_path / "leaderboard.md").read_text()
    folder, _ = finished
    assert main(["evaluate", str(folder), *ENV[2:], *options]) == 2
    assert "--save-replays: env_id = 'Drift-v0'" in capsys.readouterr().err


def test_evaluate_says_which_modules_the_command_for_its_replays_needs(tmp_path, capsys):
    words = ["evaluate", str(file_of("Detumble")), *ENV[2:], "--episodes", "1", "--save-replays"]
    assert main([*words, "--out", str(tmp_path)]) == 0
    command = f"rigid-envs replay {tmp_path / 'replays.npz'} --allow-import tests.agents.drift"
    assert capsys.readouterr().out.endswith(f"1 episodes; see {command}\n")


def test_enjoy_prints_steps_if_asked(finished, capsys):
    folder, _ = finished
    words = ["enjoy", str(folder / "best_model"), *ENV[2:], "--seed", "3"]
    assert main([*words, "--table"]) == 0
    head, names, _, *steps, end = capsys.readouterr().out.splitlines()
    assert main(words) == 0
    assert capsys.readouterr().out.splitlines() == [head, end]
    assert "seed 3" in head and "reward" in names and "cost" in names
    assert len(steps) == int(re.search(r"in (\d+) steps", end)[1])
    width = len(names.removesuffix("  notes"))
    assert {len(line) for line in steps if "is_success" not in line} == {width}


def test_sigterm_says_how_to_go_on_and_that_works(tmp_path, monkeypatch, capsys):
    def stopped(self):
        iterate(self)
        monkeypatch.undo()
        os.kill(os.getpid(), signal.SIGTERM)

    iterate = Trainer.iterate
    monkeypatch.setattr(Trainer, "iterate", stopped)
    words = ["train", *ENV, *SMALL, "--total_timesteps", "2000", "--log_dir", str(tmp_path)]
    assert main(words) == 128 + signal.SIGTERM
    again = capsys.readouterr().out.splitlines()[-1].split()
    assert again[:4] == ["python", "-m", "agents", "train"]
    assert main(again[3:]) == 0
    log = (tmp_path / "ppo" / "Drift-v0_1" / "progress.csv").read_text()
    assert log.count("\n") == 1 + 4  # one update before, three after


def test_without_a_word_the_flagship_is_trained_for_a_short_time(monkeypatch):
    seen = []

    def train(options):
        seen.append(options)
        return 0

    monkeypatch.setattr(verbs, "train", replace(verbs.train, act=train))
    assert main([]) == main(["train"]) == main(["--quiet"]) == 0
    short, *others = (getattr(options, "total_timesteps", None) for options in seen)
    assert others == [None, None]
    recipe = recipe_for(BALL_PARK)
    assert int(short) < load_config(recipe, {}, []).total_timesteps
    assert load_config(recipe, {"total_timesteps": short}, []).total_timesteps == int(short)


@pytest.mark.parametrize(
    ("words", "entries"),
    [
        ("", {"env_id": BALL_PARK, "algo": "ppo", "env_kwargs": {"frame": "reduced"}}),
        ("--env_id Reorient", {"env_id": "RigidEnvs/Reorient-v0", "algo": "ppo"}),
        ("--config ball_park_ppo", {"env_id": BALL_PARK, "env_kwargs": {}}),
        ("--env_kwargs.radius 1.5", {"env_kwargs": {"frame": "reduced", "radius": 1.5}}),
        ("--env_kwargs.frame world", IN_THE_WORLD | {"env_kwargs": {"frame": "world"}}),
        ("--env_kwargs '{radius: 1.5}'", IN_THE_WORLD | {"env_kwargs": {"radius": 1.5}}),
        ("--env_id Reorient --env_kwargs.frame=world", {"algo": "sac", "goal_turn": True}),
        ("--env_id Reorient --algo sac", {"goal_turn": True}),
        ("--env_id BallGrid --algo dqn", {"gamma": 0.97, "seed": 0}),
        ("--env_id BallGrid --seed 7", {"seed": 7}),
    ],
)
def test_an_environment_is_trained_with_its_own_recipe(words, entries, capsys):
    assert main(["train", *shlex.split(words), "--print-config"]) == 0
    shown = yaml.safe_load(capsys.readouterr().out)
    assert {key: shown[key] for key in entries} == entries


@pytest.mark.parametrize(
    ("words", "status", "message"),
    [
        ("train --gama 1", 2, r"config\.gama: unknown key; did you mean 'gamma'\?"),
        ("train --gamma 7", 2, r"config\.gamma: gamma = 7; expected a number in \[0, 1\]"),
        ("train --env_id os:system", 2, r"config\.env_id: "),
        ("train --env_id BallPrk", 2, r"did you mean 'RigidEnvs/BallPark-v0'\?$"),
        ("train BallPark", 2, r"argument = .BallPark.; expected options .* --env_id BallPark$"),
        ("trian", 2, r"VERB = 'trian'; expected one of train, .*: did you mean 'train'\?"),
        ("train --sead 1", 2, r"config\.sead: unknown key; did you mean 'seed'\?"),
        ("train --resum x", 2, r": did you mean --resume\?$"),
        ("evaluate x --sead 1", 2, r"argument = '--sead'; .*: did you mean --seed\?$"),
        ("train --config nowhere.yaml", 1, "agents: nowhere.yaml: No such file or directory$"),
        ("train --resume nowhere", 1, "nowhere: no run here"),
        ("train --resume x --seed 1", 2, r"leave out \['seed'\]"),
        ("train --run_name ../x", 2, r"config\.run_name: run_name = '\.\./x'; expected"),
        ("train --allow-import no_such_module", 1, "no_such_module"),
        ("evaluate nowhere", 1, r"no policy here \(nowhere is not there\); expected a run"),
        ("enjoy .", 1, r"\(policy\.safetensors is not there\); expected a run, or the folder or"),
        ("evaluate nowhere --episodes 0", 2, "--episodes = 0; expected an integer in"),
        ("enjoy x --fast", 2, "argument = '--fast'; expected one of those that --help lists"),
        ("benchmark --ids BalPark-v0", 2, r"config\.env_id: .*BallPark-v0"),
        ("benchmark --steps 0", 2, r"config\.total_timesteps: total_timesteps = 0; expected"),
    ],
)
def test_a_mistake_is_answered_in_one_line(words, status, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(words.split()) == status
    said = capsys.readouterr().err
    assert re.search(message, said) and said.startswith("agents: ") and said.count("\n") == 1
    assert list(tmp_path.rglob("config.yaml")) == []


def test_the_config_is_printed_and_nothing_is_made(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["train", "--print-config", "--seed", "7", "--env_kwargs.dt", "1e-2"]) == 0
    printed = capsys.readouterr().out
    assert "seed: 7" in printed and "env_kwargs: {frame: reduced, dt: 0.01}" in printed
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "again.yaml").write_text(printed)
    assert main(["train", "--print-config", "--config", "again.yaml"]) == 0
    assert capsys.readouterr().out == printed


@pytest.mark.parametrize("verb", [[], ["train"], ["evaluate"], ["enjoy"], ["benchmark"]], ids=str)
def test_help_is_there(verb, capsys):
    with pytest.raises(SystemExit) as stop:
        main([*verb, "--help"])
    assert stop.value.code == 0
    assert len(capsys.readouterr().out) > 200
