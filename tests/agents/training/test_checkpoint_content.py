"""A checkpoint that is whole, but holds what no run can have written, is refused by name."""

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

import tests.agents.drift  # noqa: F401, registers the environment
from agents.cli.command_line import main
from agents.config.entries import config_from
from agents.training.trainer import train
from rigid_envs.base.files import load_tensors, save_tensors
from tests.agents.training.test_resume import VARIANTS, assert_same, base, newest


def swap(member, change):
    """Put what becomes of an array in its place."""
    return lambda arrays, _: arrays.update({member: change(arrays[member])})


def put(member, value, place=...):
    """Put a value into an array."""
    return lambda arrays, _: arrays[member].__setitem__(place, value)


def shape(member, *sizes):
    """Cut an array to a shape, which numbers of the old shape may broadcast to."""
    return swap(member, lambda array: np.resize(array, sizes))


def cast(member, kind):
    """Give an array another type."""
    return swap(member, lambda array: array.astype(kind))


def drop(member):
    """Leave an array out."""
    return lambda arrays, _: arrays.pop(member)


def add(member):
    """Add an array."""
    return lambda arrays, _: arrays.update({member: np.zeros(3)})


def say(place, value):
    """Put a value into the document; a function is given the old one."""

    def change(_, document):
        inner, last = _found(document, place)
        inner[last] = value(inner[last]) if callable(value) else value

    return change


def forget(place):
    """Leave an entry of the document out."""

    def change(_, document):
        inner, last = _found(document, place)
        del inner[last]

    return change


def both(*changes):
    """Make several changes."""
    return lambda arrays, document: [each(arrays, document) for each in changes]


def _found(document, place):
    """What holds an entry, and its key or number there."""
    *path, last = (int(key) if key.isdecimal() else key for key in place.split("."))
    for key in path:
        document = document[key]
    return document, last


UPDATES = 12


def run_of(folder, variant, updates=UPDATES):
    values = base(VARIANTS[variant]) | {"total_timesteps": 512 * updates, "checkpoint_every": 4}
    values |= {"log_dir": str(folder), "run_name": "r"}
    return train(config_from(values), quiet=True).folder


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """A complete run of each algorithm, with its newest checkpoint alone."""
    runs = {}
    for algo, variant in (
        ("ppo", "normalized"),
        ("sac", "sac, hindsight, normalized, overflowing"),
        ("dqn", "dqn"),
    ):
        runs[algo] = run_of(tmp_path_factory.mktemp(algo), variant)
        for path in sorted((runs[algo] / "checkpoints").iterdir())[:-1]:
            path.unlink()
    return runs


def content(run):
    """Every file of a run, but that of its lock, which names the process."""
    files = (path for path in run.rglob("*") if path.is_file() and path.name != "run.lock")
    return {str(path.relative_to(run)): path.read_bytes() for path in files}


def refused(run, capsys):
    """What is said where a run does not go on, in one line; no file of it changes."""
    before = content(run)
    assert main(["train", "--resume", str(run), "--quiet"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and content(run) == before
    return said


def damage(run, change):
    """Change the newest checkpoint of a run, with a checksum that is right."""
    path = newest(run)
    arrays, document = load_tensors(path, 10**9)
    change(arrays, document)
    save_tensors(path, arrays, document)


NAN, INF = float("nan"), float("inf")
WEIGHT, BIAS = "weights/action_net.weight", "weights/value_net.bias"
MOMENT = "optimizer/policy/1/exp_avg"
KINDS = [
    # weights and optimiser
    ("ppo", put(WEIGHT, NAN, (0, 3)), rf"{WEIGHT}\[0, 3\] = nan; expected finite"),
    ("ppo", shape(WEIGHT, 1, 16), rf"{WEIGHT} is float32 of shape \(1, 16\); expected .*\(2, 16\)"),
    ("ppo", cast(WEIGHT, "float64"), rf"{WEIGHT} is float64 .*; expected float32"),
    ("ppo", drop(WEIGHT), rf"{WEIGHT} is missing; expected float32 of shape \(2, 16\)"),
    ("ppo", add("weights/more"), r"weights/more is float64 .*; expected no such array"),
    ("ppo", shape(MOMENT, 1, 2), rf"{MOMENT} is float32 of shape \(1, 2\)"),
    ("ppo", put(f"{MOMENT}_sq", -0.5, (1, 1)), rf"{MOMENT}_sq\[1, 1\] = -0.5; expected .*\[0"),
    ("ppo", put("optimizer/policy/2/step", -3), r"optimizer/policy/2/step = -3.0; expected .*\[1"),
    ("ppo", add("optimizer/policy/99/step"), "optimizer/policy/99/step is float64"),
    ("ppo", say("learning_rates.policy.0", -1e-3), "learning_rates.policy = -0.001; expected"),
    ("ppo", say("learning_rates.policy", []), r"learning_rates.policy = \[\]; expected a list"),
    ("sac", forget("learning_rates.ent_coef"), r"learning_rates = \['actor', 'critic'\]"),
    # counters and clock
    ("ppo", say("counters.num_timesteps", -512), "counters.num_timesteps = -512; expected 6144"),
    ("ppo", say("counters.num_timesteps", "6144"), "num_timesteps = '6144'; expected an integer"),
    ("ppo", say("counters._n_updates", -1), "counters._n_updates = -1; expected"),
    ("ppo", say("counters._current_progress_remaining", 2.0), "remaining = 2.0; expected 0.0"),
    ("ppo", forget("counters._episode_num"), r"document.counters = .*; expected entries"),
    ("ppo", say("counters", []), r"document.counters = \[\]; expected a mapping"),
    ("ppo", say("iterations", -12), "iterations = -12; expected"),
    (
        "ppo",
        both(say("iterations", 10**15), say("counters.num_timesteps", 512 * 10**15)),
        r"iterations = 1000000000000000; expected an integer in \[0, 12\]",
    ),
    ("ppo", say("spent", [-1.0, 0.0]), r"spent\[0\] = -1.0; expected a number of at least 0"),
    ("ppo", say("config", None), "document.config = None; expected a mapping"),
    ("ppo", forget("logs"), "document = .*; expected entries"),
    ("dqn", say("counters.exploration_rate", 1.5), "exploration_rate = 1.5; expected"),
    ("dqn", say("counters._n_calls", 0.5), "_n_calls = 0.5; expected an integer"),
    # positions in the logs
    ("ppo", say("logs.progress", 10**6), r"progress.csv: \d+ bytes; the .* knows of 1000000"),
    ("ppo", say("logs.progress", lambda n: n - 1), "progress.csv: byte .* is not behind a row"),
    ("ppo", say("logs.monitor", lambda n: n - 2), "monitor.csv: byte .* is not behind a row"),
    ("ppo", say("logs.times", 1.5), "logs.times = 1.5; expected an integer"),
    ("ppo", say("logs.timesteps", 512), "logs.timesteps = 512; expected 6144"),
    ("ppo", say("logs.seconds", -2.0), "logs.seconds = -2.0; expected"),
    # random streams
    ("ppo", put("random/python", 700, 624), "random = .*; expected states"),
    ("ppo", say("random.python", [4, None]), "random = .*; expected states"),
    ("ppo", say("random.numpy.1", 700), "random.numpy = .*700.*; expected a position"),
    ("ppo", say("random.numpy.0", "PCG64"), r"random.numpy\[0\] = 'PCG64'; expected 'MT19937'"),
    ("ppo", shape("random/numpy", 1), r"random/numpy is uint32 of shape \(1,\)"),
    ("ppo", put("random/torch", 255), "random = .*; expected states"),
    ("ppo", say("random.actions.state.state", -5), "random = .*; expected states"),
    # statistics of VecNormalize, last observations, episodes
    ("ppo", put("normalize/observation.var", -1.0), "normalize/observation.var.* = -1.0; expected"),
    ("ppo", put("normalize/observation.mean", NAN), "normalize/observation.mean.* = nan; expected"),
    ("ppo", put("normalize/reward.count", 0.0), "normalize/reward.count = 0.0; expected"),
    ("ppo", drop("normalize/reward.var"), "normalize/reward.var is missing"),
    ("ppo", put("_last_obs", NAN, (3, 1)), r"_last_obs\[3, 1\] = nan; expected finite"),
    ("ppo", drop("_last_original_obs"), "_last_original_obs is missing"),
    ("sac", drop("_last_obs/desired_goal"), "_last_obs/desired_goal is missing"),
    ("ppo", put("window/returns", INF, 0), r"window/returns\[0\] = inf; expected finite"),
    ("ppo", put("window/lengths", 0, 0), r"window/lengths\[0\] = 0; expected"),
    ("ppo", shape("window/lengths", 7), "window/lengths"),
    # evaluations
    ("ppo", put("validation/timesteps", 1, 0), r"validation/timesteps = .*; expected \[2560, 5120"),
    ("ppo", shape("validation/costs", 1, 8), r"validation/costs is float64 of shape \(1, 8\)"),
    ("ppo", put("validation/ep_lengths", -4, (0, 0)), r"validation/ep_lengths\[0, 0\] = -4"),
    # the environment
    ("ppo", put("adapter/env/x", NAN, (2, 0)), r"adapter/env/x\[2, 0\] = nan; expected finite"),
    ("sac", put("adapter/env/digest", 7.0, 1), r"env/digest\[1, 0\] = 7.0; expected .*marks"),
    ("ppo", put("adapter/steps", -1), "adapter/steps = -1; expected 384"),
    ("ppo", put("adapter/lengths", -1, 4), r"adapter/lengths\[4\] = -1; expected"),
    # the replay buffer
    ("sac", put("memory/place", -3, 0), r"memory/place = \[-3, 0\]; expected \[384, 0\]"),
    ("sac", put("memory/rewards", NAN, (5, 2)), r"memory/rewards\[5, 2\] = nan; expected finite"),
    ("sac", shape("memory/actions", 1, 16, 2), r"memory/actions is float32 of shape \(1, 16, 2\)"),
    ("sac", put("memory/ep_start", 10**6, (0, 0)), r"memory/ep_start\[0, 0\] = 1000000; expected"),
    ("sac", put("memory/ep_length", -2, (0, 0)), r"memory/ep_length\[0, 0\] = -2; expected"),
    ("sac", put("memory/current_start", -1, 0), r"memory/current_start\[0\] = -1; expected"),
    ("sac", drop("memory/next_observations/observation"), "observations/observation is missing"),
    ("dqn", put("memory/actions", 99, (0, 0, 0)), r"memory/actions\[0, 0, 0\] = 99; expected"),
]  # fmt: skip


def _id(part):
    return re.sub(r"[^\w/.-]+", " ", part)[:50] if isinstance(part, str) else ""


@pytest.mark.parametrize(("algo", "change", "message"), KINDS, ids=_id)
def test_bad_content_is_refused_by_name_and_no_file_changes(
    runs, tmp_path, capsys, algo, change, message
):
    run = Path(shutil.copytree(runs[algo], tmp_path / "run"))
    damage(run, change)
    said = refused(run, capsys)
    assert said.startswith(f"agents: {newest(run)}: ") and re.search(message, said), said


def test_of_two_checkpoints_a_bad_one_is_passed_over_and_the_run_ends_as_it_would(runs, tmp_path):
    run = run_of(tmp_path, "normalized")
    damage(run, put(WEIGHT, NAN, (0, 3)))
    assert len(list((run / "checkpoints").iterdir())) == 2
    train(run, quiet=True)
    assert_same(runs["ppo"], run)


def test_bad_content_in_both_checkpoints_is_told_of_both(tmp_path, capsys):
    run = run_of(tmp_path, "plain", updates=8)
    arrays, document = load_tensors(newest(run), 10**9)
    for path in (run / "checkpoints").iterdir():
        save_tensors(path, arrays | {BIAS: np.array([NAN], dtype=np.float32)}, document)
    assert refused(run, capsys).count(f"{BIAS}[0] = nan") == 2


@pytest.mark.parametrize("name", ["progress", "monitor", "times"])
def test_a_log_that_is_gone_or_cut_is_named_and_no_file_changes(runs, tmp_path, capsys, name):
    run = Path(shutil.copytree(runs["ppo"], tmp_path / "run"))
    log = run / f"{name}.csv"
    for spoil in (lambda: log.write_bytes(log.read_bytes()[:-9]), log.unlink, log.mkdir):
        spoil()
        said = refused(run, capsys)
        assert f"{log}: " in said and "the checkpoint knows of" in said
