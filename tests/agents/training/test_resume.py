"""A run that is killed, stopped or damaged ends with the bits of one that never was."""

import os
import random
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import torch
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

import tests.agents.drift  # noqa: F401, registers the environment
from agents.config.entries import config_from
from agents.training.snapshots import capture_random, check_random, restore_random
from agents.training.trainer import StopSignals, Trainer, train
from rigid_envs.base.files import load_tensors
from tests.agents.sessions import SAME, SMALL, assert_same_files, finish, rows, start, wait_for
from tests.programs import python
from tests.refusals import refuses

PPO_ONLY = ("n_steps", "batch_size", "n_epochs")
MEMORY = {"log_every": 512, "learning_starts": 2000, "batch_size": 64, "train_freq": 2,
          "gradient_steps": 1, "buffer_size": 50_000}  # fmt: skip
VARIANTS = {
    "plain": {},
    "normalized": {"normalize_observation": True, "normalize_reward": True, "seed": 2**40},
    "ball park": {
        "env_id": "RigidEnvs/BallPark-v0",
        "env_kwargs": {"radius": [0.9, 1.1], "observation_noise": 0.01, "action_delay": 2}
        | {"frame": "reduced"},
        "train_kwargs": {"dt": 0.2, "weight_parked": 5.0},
        "success_bonus": 2.0,
        "cost_price": [0.0, 2.0],
        "action_std": [0.6, 0.1],
        "policy_gain": 1.5,
    },
    "sac, hindsight, normalized, overflowing": MEMORY
    | {
        "algo": "sac",
        "env_id": "RigidEnvs/BallParkGoal-v0",
        "train_freq": 8,
        "buffer_size": 7000,  # not a number of whole episodes
        "normalize_observation": True,
    },
    "tqc": MEMORY | {"algo": "tqc", "env_id": "RigidEnvs/BallPark-v0"},
    "dqn": MEMORY
    | {"algo": "dqn", "env_id": "RigidEnvs/BallGrid-v0", "target_update_interval": 700},
    "dagger, overflowing": {
        "algo": "dagger",
        "env_id": "RigidEnvs/SpinCapture-v0",
        "env_kwargs": {"frame": "reduced"},
        "n_steps": 32,
        "batch_size": 64,
        "gradient_steps": 2,
        "buffer_size": 7000,
        "dead_band": 0.2,
    },
}


def base(values):
    """The small run; of another algorithm only what all have in common."""
    algo = values.get("algo", "ppo")
    return {k: v for k, v in SMALL.items() if algo == "ppo" or k not in PPO_ONLY} | values


def whole(folder, **values):
    entries = base(values) | {"log_dir": str(folder), "run_name": "whole"}
    assert finish(start(entries)) == 0
    return folder / str(entries.get("algo", "ppo")) / "whole"


def newest(run):
    return max((run / "checkpoints").glob("*.safetensors"))


def assert_same(run, other):
    assert_same_files(run, other)
    ours, ours_too = (load_tensors(newest(r), 10**8) for r in (run, other))
    assert ours[0].keys() == ours_too[0].keys()
    for key, array in ours[0].items():
        np.testing.assert_array_equal(array, ours_too[0][key], err_msg=key)


def age(run):
    """Updates that a run has logged."""
    path = run / "progress.csv"
    return max(path.read_bytes().count(b"\n") - 1, 0) if path.exists() else 0


def kill_at_random(folder, values, kills, seed):
    """Start a run and kill it that often, at random moments of its life."""
    rng = np.random.default_rng(seed)
    run = folder / str(values.get("algo", "ppo")) / "killed"
    updates = values["total_timesteps"] // 512
    moments = np.sort(rng.choice(np.arange(1, updates - 5), kills, replace=False))
    session = start({**values, "log_dir": str(folder), "run_name": "killed"})
    checkpoints = set()
    for moment in moments:
        wait_for(lambda moment=moment: age(run) >= moment)
        time.sleep(float(rng.uniform(0, 0.05)))
        session.kill()
        assert finish(session) == -signal.SIGKILL
        found = sorted((run / "checkpoints").glob("*.safetensors"))
        checkpoints.add(found[-1].stem if found else "none")
        print(f"killed after {age(run)} updates, newest checkpoint {found[-1:]}")
        session = start(None, run)
    assert len(checkpoints) > kills // 2
    assert finish(session) == 0
    return run


@pytest.mark.long
@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("seed", range(5))
def test_a_run_killed_ten_times_is_bitwise_the_one_that_never_was(tmp_path, variant, seed):
    values = base(VARIANTS[variant]) | {"total_timesteps": 512 * 300, "checkpoint_every": 1}
    reference = whole(tmp_path, **values)
    assert_same(reference, kill_at_random(tmp_path, values, kills=10, seed=seed))


OTHERS = (signal.SIGINT, signal.SIGHUP)


@pytest.mark.parametrize(
    "number",
    [
        pytest.param(signal.SIGTERM, marks=(pytest.mark.long, pytest.mark.push)),
        *(pytest.param(each, marks=pytest.mark.long) for each in OTHERS),
    ],
)
def test_a_signal_saves_and_exits_with_its_number(tmp_path, number):
    values = {**SMALL, "checkpoint_every": None}
    run = tmp_path / "ppo" / "stopped"
    session = start({**values, "log_dir": str(tmp_path), "run_name": "stopped"})
    wait_for(lambda: age(run) >= 3)
    signalled = time.perf_counter()
    os.kill(session.pid, number)
    assert finish(session) == 128 + number
    assert time.perf_counter() - signalled < 10
    logged = rows(run / "progress.csv")
    assert 0 < len(logged) < 40
    assert int(logged[-1]["time/total_timesteps"]) == int(newest(run).stem)
    if number == signal.SIGTERM:
        assert finish(start(None, run)) == 0
        assert_same(whole(tmp_path, **values), run)


@pytest.mark.push
@pytest.mark.long
def test_no_row_and_no_event_is_doubled_or_missing_after_a_kill(tmp_path):
    run = kill_at_random(tmp_path, {**SMALL, "total_timesteps": 512 * 60}, kills=2, seed=1)
    steps = [*range(512, 512 * 60 + 1, 512)]
    for name in ("progress.csv", "times.csv"):
        assert [int(row["time/total_timesteps"]) for row in rows(run / name)] == steps
    events = EventAccumulator(str(run / "tensorboard")).Reload()
    assert [event.step for event in events.Scalars("train/loss")] == steps


LIMITED = """
import resource, sys
import tests.agents.drift
from agents.cli.command_line import main
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]),) * 2)
sys.exit(main(["train", *sys.argv[2:]]))
"""


@pytest.mark.long
@pytest.mark.parametrize(
    ("every", "updates", "limit", "name"),
    [
        (3, 20, 16_000, "checkpoints"),
        (1000, 20, 6_000, ""),  # monitor.csv or tensorboard, before there is a checkpoint
        (1000, 2, 2_000, "checkpoints"),
    ],
)
def test_a_run_on_a_full_disk_says_so_and_goes_on_when_there_is_room(
    tmp_path, every, updates, limit, name
):
    values = base({"checkpoint_every": every, "total_timesteps": 512 * updates})
    run = tmp_path / "ppo" / "full"
    options = values | {"log_dir": str(tmp_path), "run_name": "full"}
    words = [word for key, value in options.items() for word in (f"--{key}", str(value))]
    ended = python("-c", LIMITED, str(limit), *words, "--quiet")
    assert ended.returncode == 1, ended.stderr
    (said,) = ended.stderr.splitlines()
    assert re.fullmatch(rf"agents: .*File too large.*{re.escape(str(run / name))}.*", said)
    assert list(run.rglob("*.tmp")) == []
    assert finish(start(None, run)) == 0
    assert_same(whole(tmp_path, **values), run)


@pytest.mark.long
@pytest.mark.push
def test_a_finished_run_stays_as_it_is(tmp_path):
    run = whole(tmp_path)
    before = {name: (run / name).read_bytes() for name in SAME}
    assert finish(start(None, run)) == 0
    assert {name: (run / name).read_bytes() for name in SAME} == before


def test_a_changed_config_without_a_digest_is_refused_by_its_checkpoint(tmp_path):
    run = whole(tmp_path, total_timesteps=512 * 4)
    _, _, text = (run / "config.yaml").read_text().partition("\n")  # as older versions wrote it
    (run / "config.yaml").write_text(text.replace("gamma: 0.99", "gamma: 0.9"))
    with pytest.raises(ValueError, match=r"config\.yaml .*gamma: 0\.99 -> 0\.9"):
        train(run, quiet=True)


UPDATES = 18


class PowerCutError(Exception):
    """What ends a run without a word."""


def stir():
    """Bring the global streams to where no run has left them."""
    random.seed(5)
    np.random.seed(5)  # noqa: NPY002
    torch.manual_seed(5)


def cut(folder, variant, after):
    """A run that ends after so many updates, one of them behind its newest checkpoint."""
    values = base(VARIANTS[variant]) | {"total_timesteps": 512 * UPDATES, "checkpoint_every": 2}
    values |= {"log_dir": str(folder), "run_name": str(after)}
    made = []

    def iterate(self):
        if len(made) == after:
            raise PowerCutError
        made.append(self)
        whole(self)

    whole = Trainer.iterate
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Trainer, "iterate", iterate)
        if after == UPDATES:
            train(config_from(values), quiet=True)
        else:
            with pytest.raises(PowerCutError):
                train(config_from(values), quiet=True)
    return folder / str(values.get("algo", "ppo")) / str(after)


@pytest.mark.parametrize(
    "variant",
    [
        name if name == "normalized" else pytest.param(name, marks=pytest.mark.long)
        for name in VARIANTS
    ],
)
def test_a_run_that_goes_on_is_bitwise_the_one_that_never_stopped(tmp_path, variant):
    reference = cut(tmp_path, variant, UPDATES)
    # with a memory: before its first gradient step, and when its first steps are overwritten
    for after in (3, 17):
        run = cut(tmp_path, variant, after)
        stir()
        outcome = train(run, quiet=True)
        assert outcome.timesteps == 512 * UPDATES
        assert_same(reference, run)


def draws(actions):
    """Two numbers of each stream; the normal ones are drawn in pairs, of which one is kept."""
    return [
        *(random.gauss(0, 1) for _ in range(2)),
        *(float(np.random.standard_normal()) for _ in range(2)),  # noqa: NPY002
        *(float(torch.rand(())) for _ in range(2)),
        *(float(actions.standard_normal()) for _ in range(2)),
    ]


@pytest.mark.parametrize("odd", [False, True])
def test_every_stream_goes_on_where_it_was(odd):
    actions = np.random.default_rng(3)
    if odd:  # one of a pair is used, the other one is kept
        random.gauss(0, 1)
        np.random.standard_normal()  # noqa: NPY002
        actions.integers(5, dtype=np.uint32)
    arrays, document = capture_random(actions.bit_generator)
    arrays = {name: array.copy() for name, array in arrays.items()}
    check_random(actions.bit_generator, arrays, document)
    expected = draws(actions)
    draws(actions)
    restore_random(actions.bit_generator, arrays, document)
    assert draws(actions) == expected


@pytest.mark.parametrize("kind", ["torch", "numpy", "python"])
def test_what_is_no_state_is_refused_and_no_stream_changes(kind):
    actions = np.random.default_rng(3)
    arrays, document = capture_random(actions.bit_generator)
    bad = {**arrays, kind: np.zeros_like(arrays[kind][:7])}
    refuses(r"random = .*expected states", check_random, actions.bit_generator, bad, document)
    restored, again = capture_random(actions.bit_generator)
    assert again == document
    for name, array in arrays.items():
        np.testing.assert_array_equal(restored[name], array)


BUSY = """
import sys, time
from agents.training.trainer import StopSignals
with StopSignals() as signals:
    print("ready", flush=True)
    time.sleep(60)
    time.sleep(60)
"""
STOPS = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]


@pytest.mark.parametrize(
    ("first", "second"),
    [
        pytest.param(signal.SIGINT, signal.SIGTERM, marks=(pytest.mark.long, pytest.mark.push)),
        pytest.param(signal.SIGTERM, signal.SIGHUP, marks=pytest.mark.long),
        pytest.param(signal.SIGHUP, signal.SIGINT, marks=pytest.mark.long),
    ],
)
def test_a_second_signal_ends_at_once_with_its_number(first, second):
    process = subprocess.Popen(
        [sys.executable, "-c", BUSY], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        assert process.stdout.readline() == "ready\n"
        process.send_signal(first)
        said = process.stderr.readline() + process.stderr.readline()
        assert (
            said == f"\n{first.name}: finishing this update, then saving; once more ends at once\n"
        )
        assert process.poll() is None
        begin = time.perf_counter()
        process.send_signal(second)
        assert process.wait(10) == 128 + second
        assert time.perf_counter() - begin < 5
    finally:
        process.kill()
        process.communicate()


@pytest.mark.parametrize("number", STOPS)
def test_a_signal_is_noted_and_handlers_come_back(number):
    before = [signal.getsignal(each) for each in STOPS]
    with StopSignals() as signals:
        assert not signals.stopping() and signals.received is None
        os.kill(os.getpid(), number)
        assert signals.stopping() and signals.received == number
    assert [signal.getsignal(each) for each in STOPS] == before
