"""Options of the command: the defaults that its help tells, and where a shell completes ids."""

import re

import pytest

from rigid_envs.tools.cli import main
from rigid_envs.tools.cli.command_line import _parser
from rigid_envs.tools.cli.words import _actions


def test_the_default_of_a_number_is_the_one_that_help_tells() -> None:
    found = {}
    for action in _actions(_parser()):
        option, default = action.option_strings[:1], action.default
        if type(default) in (int, float) and option != ["--jobs"]:  # as many as there are cores
            (told,) = re.findall(r"\((\d+)", action.help or "")
            found[action] = option[0]
            assert float(told) == default, option
    assert sorted(found.values()) == ["--episodes", "--seed", "--seed", "--size", "--speed"]


def test_ids_are_completed_wherever_one_is_expected_and_nowhere_else(
    capsys: pytest.CaptureFixture[str],
) -> None:
    pytest.importorskip("shtab")
    assert main(["completion", "bash"]) == 0
    script = capsys.readouterr().out
    first = ("describe", "compile", "play", "evaluate", "best", "dataset")
    after = ("docs", "bench", "frames", "films")
    places = [*(f"{verb}_pos_0" for verb in first), *(f"{verb}___ids" for verb in after)]
    pattern = r"^_shtab_rigid_envs_(\w+)_COMPGEN=_rigid_envs_ids$"
    assert sorted(re.findall(pattern, script, re.MULTILINE)) == sorted(places)
