"""`rigid-envs`: what each command prints and writes, with what it exits, and what is compiled."""

import argparse
import dataclasses
import inspect
import json
import os
import re
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace

import gymnasium
import pytest
from gymnasium import spaces

from rigid_envs.envs.lookup import _compile, compile_all, kernels_of, one_of_each
from rigid_envs.envs.spaces import info_keys
from rigid_envs.tasks.core import Core
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools.cli import main
from rigid_envs.tools.cli.command_line import _parser
from rigid_envs.tools.pages.document import describe, example
from rigid_envs.tools.pages.tables import size_of, table
from tests.programs import printed, python

IDS = list(ENVIRONMENTS)


def said(capsys, *words):
    """What a command that succeeds prints."""
    assert main(words) == 0
    return capsys.readouterr().out


def task_of(env_id, **config):
    return gymnasium.make(env_id, **config).unwrapped.task


def section(text, title):
    """The lines under a heading, up to the next one."""
    body = re.split(r"\n(?=[^\n]+\n=+\n)", text)
    (found,) = (part for part in body if part.startswith(title))
    return found


def test_list_shows_every_id_with_its_summary_limit_and_cost_also_as_json(capsys):
    text = said(capsys, "list")
    words = " ".join(text.split())
    for env_id in IDS:
        env, task = gymnasium.make(env_id), task_of(env_id)
        assert f"{env_id} {' '.join(str(type(task).__doc__).splitlines()[0].split())[:40]}" in words
        *_, row = (line for line in text.splitlines() if line.startswith(f"{env_id} "))
        for space in (env.action_space, env.observation_space):
            assert f" {size_of(space)} " in row
        assert f"{env.spec.max_episode_steps} x {task.dt:g} s" in row
        assert task.cost_unit.split()[0] in row
    assert max(map(len, text.splitlines())) <= 100
    found = json.loads(said(capsys, "list", "--json"))
    limits = [(each["id"], each["max_episode_steps"]) for each in found]
    assert limits == [(env_id, gymnasium.spec(env_id).max_episode_steps) for env_id in IDS]


def test_size_of_a_space_is_told_in_few_words():
    box = spaces.Box(-1.0, 1.0, (3,))
    assert size_of(box) == "3"
    assert size_of(spaces.Discrete(4)) == "4 choices"
    parts = {"observation": box, "achieved_goal": box, "desired_goal": box}
    assert size_of(spaces.Dict(parts)) == "3, goal 3"


@pytest.mark.parametrize("env_id", IDS)
def test_description_names_every_entry_term_hyperparameter_and_key_on_100_columns(capsys, env_id):
    text, task = said(capsys, "describe", env_id), task_of(env_id)
    for entry in task.actions():
        assert entry.symbol in section(text, "Action")
    for entry in task.observations():
        assert entry.symbol in section(text, "Observation")
    for term in task.terms:
        assert re.search(rf"^  {term} ", section(text, "Reward"), re.MULTILINE)
    shared = section(text, "What all environments share")
    places = section(text, "Arguments") + section(text, "Rewards") + shared
    for field in dataclasses.fields(task):
        assert re.search(rf"^  .*\b{field.name} ", places, re.MULTILINE)
    for key in info_keys(task):
        shown = f"`{re.sub('/.*', '/TERM', key)}`" in shared.partition("\nInfo\n")[2]
        assert shown or key in section(text, "Info")
    assert f"{ENVIRONMENTS[env_id].max_episode_steps} steps" in section(text, "Episode")
    assert max(map(len, text.splitlines())) <= 100


@pytest.mark.parametrize("env_id", IDS)
def test_example_of_a_description_runs(capsys, env_id):
    for config in ({}, {"observe_params": True, "rotation": "none"}):
        exec(example(env_id, config), {})
        assert "is_success" in capsys.readouterr().out


def test_description_tells_choices_and_goals():
    for env_id in IDS:
        text, task = describe(env_id, {}), task_of(env_id)
        assert (f"one of {task.n_choices} choices" in text) == bool(task.n_choices)
        assert ("achieved_goal and desired_goal" in text) == bool(task.n_goal)
        n_rows = len(re.findall(r"^ +\d+  ", section(text, "Observation"), re.MULTILINE))
        assert n_rows == len(task.observations()) - task.n_goal  # the two goals are alike


def test_description_takes_hyperparameters(capsys):
    words = ("--I1", "1,1.4", "--observe_params=true", "--weight_effort", "-0.25")
    text = said(capsys, "describe", "RigidEnvs/IntermediateAxis-v0", *words)
    assert re.search(r"3 +I1 +kg m\^2 +drawn +1 +1\.4", section(text, "Observation"))
    assert re.search(r"effort +-0\.25", section(text, "Reward"))
    assert re.search(r"I1 +\(1, 1\.4\) +1 ", section(text, "Arguments"))
    assert "'I1': (1, 1.4)" in section(text, "Example")


def test_a_missing_verb_is_refused():
    with pytest.raises(SystemExit, match="2"):
        main([])


@pytest.mark.parametrize("env_id", one_of_each())
def test_a_description_as_json_has_the_entries_of_the_spaces(capsys, env_id):
    found = json.loads(said(capsys, "describe", env_id, "--json", "--rotation", "quat"))
    env = gymnasium.make(env_id, rotation="quat")
    space = env.observation_space
    space = space["observation"] if found["goal"] else space
    assert len(found["observation"]) == space.shape[0]
    assert found["choices"] == getattr(env.action_space, "n", 0)
    values = {each["name"]: each["value"] for each in found["arguments"]}
    assert values["rotation"] == "quat"
    assert values.keys() == {field.name for field in dataclasses.fields(task_of(env_id))}


def test_an_evaluation_as_json_is_a_row_of_the_leaderboard(capsys, tmp_path):
    words = "evaluate BallGrid --policy zero --starts 5 --rotation quat --json --out".split()
    row = json.loads(said(capsys, *words, str(tmp_path / "row.json")))
    assert row == json.loads((tmp_path / "row.json").read_text())
    assert len(row["starts"]["success"]) == 5 and row["config"] == {"rotation": "quat"}
    told, silent = said(capsys, *words[:6], "--out", str(tmp_path / "b")), said(capsys, *words[:6])
    assert told == f"{silent}written to {tmp_path / 'b'}\n"


def arguments_of(parser):
    """All arguments and options of a parser and of its verbs."""
    for action in parser._actions:
        yield action
        if isinstance(action, argparse._SubParsersAction):
            for verb in action.choices.values():
                yield from arguments_of(verb)


def test_the_default_of_a_number_is_the_one_that_help_tells():
    found = []
    for action in arguments_of(_parser()):
        option, default = action.option_strings[:1], action.default
        if type(default) in (int, float) and option != ["--jobs"]:  # as many as there are cores
            (told,) = re.findall(r"\((\d+)", action.help or "")
            found += option
            assert float(told) == default, option
    assert sorted(found) == ["--episodes", *3 * ["--seed"], "--size", "--speed", "--starts"]


def test_help_of_a_verb_says_what_its_docstring_says():
    for verb in _parser()._subparsers._group_actions[0].choices.values():
        about = inspect.getdoc(verb.get_default("act")).partition("\n\n")[2]
        assert "".join(about.split()) in "".join(verb.format_help().split())


@pytest.mark.long
@pytest.mark.push
def test_ctrl_c_ends_a_command_without_a_word():
    words = ("evaluate", "BallPark", "--policy", "shortest_path")
    command = [sys.executable, "-m", "rigid_envs.tools.cli", *words]
    # while LLVM compiles an interrupt can be lost: Python ignores what is raised in its callbacks
    subprocess.run([*command, "--starts", "1"], capture_output=True, check=True)
    process = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # also where these tests run in the background, in which interrupts are ignored
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    time.sleep(3.0)  # it plans for minutes
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert out == "" and "Traceback" not in err


def test_lines_fit_a_narrow_terminal(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "60")
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    narrow = said(capsys, "list")
    assert 40 < max(map(len, narrow.splitlines())) <= 60
    monkeypatch.setenv("COLUMNS", "100")
    assert set(said(capsys, "list").split()) - {"-" * k for k in range(100)} <= set(narrow.split())


def test_command_survives_a_reader_that_stops_reading():
    command = f"{sys.executable} -m rigid_envs.tools.cli describe {IDS[0]} | head -1"
    words = ["bash", "-o", "pipefail", "-c", command]
    done = subprocess.run(words, cwd=Path(__file__).parents[2], capture_output=True, text=True)
    assert (done.returncode, done.stdout.strip(), done.stderr) == (0, IDS[0], "")


SHORT = ["play", IDS[0], "--help-keys"]  # less than a buffer holds


# buffered to the end, and written with each line, before the status is known
@pytest.mark.parametrize(("words", "buffering"), [(["list"], -1), (["list"], 1), (SHORT, -1)])
def test_nothing_is_left_to_be_written_when_a_command_is_over(words, buffering, monkeypatch):
    reading, writing = os.pipe()
    os.close(reading)
    with open(writing, "w", buffering) as out:  # a reader that has gone
        monkeypatch.setattr("sys.stdout", out)
        assert main(words) == 0


def test_long_cells_are_wrapped_and_columns_stay_aligned():
    text = table(("key", "meaning"), [("a", "word " * 30), ("bb", "short")], indent=0, width=40)
    lines = text.splitlines()
    assert max(map(len, lines)) <= 40
    assert {line[:5].strip() for line in lines} == {"key", "---", "a", "", "bb"}
    assert all(line[5] != " " for line in lines)


def test_what_has_no_blank_is_wrapped_last():
    rows = [("RigidEnvs/IntermediateAxisRandom-v0", "word " * 9)]
    lines = table(("id", "meaning"), rows, indent=0, width=50).splitlines()
    assert max(map(len, lines)) <= 50
    assert rows[0][0] in lines[2]
    narrow = table(("id", "meaning"), rows, indent=0, width=40).splitlines()
    assert max(map(len, narrow)) <= 40


def test_one_of_each_has_numbers_choices_and_goals():
    chosen = [task_of(env_id) for env_id in one_of_each()]
    kinds = [(bool(task.n_choices), bool(task.n_goal)) for task in chosen]
    assert kinds == [(False, False), (False, True), (True, False)]
    assert one_of_each(IDS[1:3]) == [IDS[1]]


STEP = """
import logging

logging.basicConfig(level="INFO")
import gymnasium, rigid_envs

env = gymnasium.make("RigidEnvs/BallGrid-v0")
env.reset(seed=0)
env.step(0)
"""


@pytest.mark.long
def test_later_processes_find_what_was_compiled(tmp_path):
    words = "-m rigid_envs.tools.cli compile BallGrid --frame world --jobs 2"
    command = words.split()
    cache = {"NUMBA_CACHE_DIR": str(tmp_path)}
    assert printed(*command, **cache).startswith("2 kernels compiled in ")
    assert len(list(tmp_path.rglob("*.nbc"))) == 2
    step = python("-c", STEP, **cache)
    assert step.returncode == 0 and "compiled" not in step.stdout + step.stderr
    assert "0 kernels compiled in " in printed(*command, **cache)


def test_both_frames_are_compiled_and_the_rewards_of_goals():
    assert [(dict(kernel.config), kernel.part) for kernel in kernels_of("BallParkGoal")] == [
        (config, part)
        for config in ({}, {"frame": "reduced"})
        for part in ("step", "reset", "reward")
    ]
    assert [str(kernel) for kernel in kernels_of("BallPark", {"frame": "reduced"})] == [
        "BallPark-v0 step, frame = reduced",
        "BallPark-v0 reset, frame = reduced",
    ]


@pytest.mark.parametrize(("jobs", "started"), [(1, 1), (2, 2), (100, 3)])
def test_no_more_processes_are_started_than_asked_for_and_than_there_are_kernels(
    jobs, started, monkeypatch
):
    asked = []

    def pool(count, *of_processes):
        asked.append(count)
        return ThreadPoolExecutor(count)

    monkeypatch.setattr("rigid_envs.envs.lookup.ProcessPoolExecutor", pool)
    monkeypatch.setattr("rigid_envs.envs.lookup._compile", lambda kernel: True)
    kernels = kernels_of("BallParkGoal", {"frame": "world"})
    found = [str(kernel) for kernel, _ in compile_all(kernels, jobs)]
    assert sorted(found) == sorted(map(str, kernels))
    assert asked == [started]


def test_each_kernel_is_compiled_by_using_it(monkeypatch):
    used, env_id, config = [], "RigidEnvs/BallParkGoal-v0", {"frame": "reduced"}
    kernels, task = kernels_of(env_id, config), task_of(env_id, **config)
    for kind, name in ((Core, "step"), (Core, "reset"), (type(task), "goal_reward")):
        monkeypatch.setattr(kind, name, lambda *_, name=name: used.append(name))
    compiled, plain = vars(task.compiled), vars(task.episode)
    for place, name, hits in ((compiled, "step", 1), (compiled, "reset", 0), (plain, "reward", 1)):
        stats = SimpleNamespace(cache_hits=[()] * hits)
        monkeypatch.setitem(place, name, SimpleNamespace(stats=stats))
    assert [_compile(kernel) for kernel in kernels] == [True, False, True]
    assert used == ["step", "reset", "goal_reward"]


def test_what_was_compiled_and_what_was_there_is_told(monkeypatch, capsys):
    asked = []

    def compiled(kernels, jobs):
        asked.append(([str(kernel) for kernel in kernels], jobs))
        return [("reset", True), ("step", False), ("reward", True)]

    monkeypatch.setattr("rigid_envs.envs.lookup.compile_all", compiled)
    assert main(["compile", "BallParkGoal", "BallParkGoal", "--frame", "world", "--jobs", "1"]) == 0
    parts = ("step", "reset", "reward")
    assert asked == [([f"BallParkGoal-v0 {part}, frame = world" for part in parts], 1)]
    said = capsys.readouterr().out
    assert said.startswith("1 kernels compiled in ") and ", 2 were there; in /" in said
    monkeypatch.setattr("rigid_envs.tools.cli.collecting.cache_directory", lambda: None)
    assert main(["compile", "BallParkGoal"]) == 2 and len(asked) == 1  # nothing could be kept
    assert "no private folder for compiled code" in capsys.readouterr().err
