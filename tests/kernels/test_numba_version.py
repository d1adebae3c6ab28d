"""A numba that the kernels were not tested with is named, with what to install instead."""

import importlib
import logging
import subprocess
import sys
import tomllib
from pathlib import Path

import numba
import pytest

from rigid_envs import engine as numba_version

PROJECT = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]
(WANTED,) = (each for each in PROJECT["dependencies"] if each.startswith("numba"))
INSTALL = f'pip install "{WANTED}"'


def test_the_range_is_that_of_the_package_and_has_the_numba_of_this_run() -> None:
    assert "numba>={}.{},<{}.{}".format(*numba_version.OLDEST, *numba_version.NEXT) == WANTED
    assert numba_version.OLDEST <= numba.version_info.short < numba_version.NEXT


def check(version: tuple[int | None, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    """What an import of the kernels does with a version of numba."""
    monkeypatch.setattr(numba, "version_info", numba.version_info._replace(short=version))
    monkeypatch.setattr(numba, "__version__", "{}.{}.0".format(*version))
    numba_version.check()


@pytest.mark.parametrize("version", [(0, 61), (0, 68)])
def test_of_a_numba_in_the_range_nothing_is_said(
    version: tuple[int | None, ...],
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    check(version, monkeypatch)
    assert not caplog.records


@pytest.mark.parametrize("version", [(0, 60), (0, 69), (1, 0), (None, None)])
def test_another_one_that_has_all_that_is_needed_is_used_with_a_warning(
    version: tuple[int | None, ...],
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    check(version, monkeypatch)
    (record,) = caplog.records
    assert record.levelno == logging.WARNING
    assert record.getMessage().startswith("numba = {}.{}.0; expected {}".format(*version, WANTED))
    assert INSTALL in record.getMessage()


@pytest.mark.parametrize("mistake", [AttributeError, ImportError, TypeError])
def test_of_one_in_which_anything_is_missing_or_changed_a_sentence_says_what_to_install(
    mistake: type[Exception], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(_name: str) -> None:
        raise mistake("no such part")

    monkeypatch.setattr(importlib, "import_module", fail)
    with pytest.raises(ImportError, match=r"^numba = 0\.69\.0; expected ") as error:
        check((0, 69), monkeypatch)
    assert str(error.value).endswith(f": {INSTALL} (no such part)")


WITHOUT_A_PART = """
import numba
from numba.core import codegen

numba.__version__, numba.version_info = "0.70.0", numba.version_info._replace(short=(0, 70))
del codegen.JITCodeLibrary
import rigid_envs.engine.rows
"""


def test_so_it_does_of_a_part_that_is_taken_from_this_one() -> None:
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_A_PART], capture_output=True, text=True, check=False
    )
    last = done.stderr.splitlines()[-1]
    assert last.startswith(f"ImportError: numba = 0.70.0; expected {WANTED}: {INSTALL} (")
    assert "JITCodeLibrary" in last
