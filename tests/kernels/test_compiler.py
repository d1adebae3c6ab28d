"""Compiled code is kept in a private folder of its own sources, never stale, for tested numbas."""

import ctypes
import gc
import importlib
import logging
import os
import random
import re
import shutil
import stat
import sysconfig
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import llvmlite
import numba
import pytest
from numba.core.registry import cpu_target

import rigid_envs
from rigid_envs import engine as numba_version
from rigid_envs.engine import compiler as cache
from tests.programs import python

# Compiled code is kept in a private folder of its own sources, and is never stale.


# The vertical momentum of a body, which a kernel of one file makes by `rotate` of another one.
REPORT = """
from rigid_envs.engine.compiler import cache_directory
from rigid_envs.systems.free_body.dynamics import FREE_BODY
from rigid_envs.systems import FreeBody

body = FreeBody(1.0, 1.0, 1.0)
momentum = body.invariants(body.state(omega_body=(0.0, 0.0, 3.0)))["L_world_z"]
stats = FREE_BODY.measure_rows.stats
print(float(momentum), sum(stats.cache_hits.values()), cache_directory())
"""
EDIT = """

@scalar
def rotate(q, v):
    return (2.0 * v[0], 2.0 * v[1], 2.0 * v[2])
"""


def program(code, cache, *words, source=None, **environment):
    """A finished program, with a cache folder, of the package or of a copy of it."""
    where = {"PYTHONPATH": str(source)} if source else {}
    environment |= {"NUMBA_CACHE_DIR": str(cache), **where}
    done = python("-c", code, *words, cwd=source, **environment)
    assert done.returncode == 0, done.stderr
    return done


def report(cache, **more):
    """The finished program REPORT."""
    return program(REPORT, cache, **more)


def found(done):
    """Momentum, number of kernels loaded from the cache, and where that is."""
    momentum, hits, path = done.stdout.split(maxsplit=2)
    return float(momentum), int(hits), path.strip()


def run(source, cache):
    """What REPORT says of a copy of the package."""
    return found(report(cache, source=source))


@pytest.fixture
def source(tmp_path):
    """A checkout with a copy of the package."""
    ignore = shutil.ignore_patterns("__pycache__")
    shutil.copytree(Path(rigid_envs.__file__).parent, tmp_path / "src/rigid_envs", ignore=ignore)
    return tmp_path / "src"


@pytest.mark.long
@pytest.mark.push
def test_an_edited_helper_is_compiled_anew_and_an_edited_docstring_or_comment_compiles_nothing(
    source, tmp_path
):
    cache, helper = tmp_path / "cache", source / "rigid_envs/engine/algebra.py"
    cold = run(source, cache)
    assert cold[:2] == (3.0, 0) and Path(cold[2]).is_relative_to(cache / "rigid-envs")
    for path in (source / "rigid_envs").rglob("*.py"):
        text = re.sub(r'"""(?=\w)', '"""Edited.\n\n    ', path.read_text())
        path.write_text(f"# An edited file.\n\n{text}")
    assert run(source, cache)[:2] == (3.0, 1)
    before = helper.read_text()
    helper.write_text(before + EDIT)  # in another file than the kernel
    assert run(source, cache)[:2] == (6.0, 0)
    helper.write_text(before)  # the code of then is still there, under its own name
    assert run(source, cache)[:2] == (3.0, 1)


@pytest.mark.parametrize("base", ["file", pytest.param("file/below", marks=pytest.mark.long)])
def test_without_a_place_to_keep_them_kernels_are_compiled_per_process(source, tmp_path, base):
    (tmp_path / "file").touch()  # where a folder is needed: unwritable even for root
    assert run(source, tmp_path / base)[:2] == (3.0, 0)


# No file of the process grows beyond a KiB: a full disk, but for the errno.
SMALL_FILES = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (1024, 1024))"


@pytest.mark.long
@pytest.mark.push
def test_a_full_disk_costs_the_cache_and_nothing_else(tmp_path):
    done = program(f"{SMALL_FILES}\n{REPORT}", tmp_path)
    assert found(done)[:2] == (3.0, 0)
    assert "compiled code cannot be kept in" in done.stderr
    assert done.stderr.count("compiled code") == 1 and done.stderr.count("\n") == 2  # it compiles
    assert found(report(tmp_path))[:2] == (3.0, 0)  # nothing half-written was left
    assert found(report(tmp_path))[:2] == (3.0, 1)


@pytest.mark.long
@pytest.mark.parametrize("size", [300, 0])
def test_a_damaged_file_is_compiled_anew(tmp_path, size):
    report(tmp_path)
    (path,) = tmp_path.rglob("*.nbc")
    path.write_bytes(path.read_bytes()[:size])
    done = report(tmp_path)
    assert found(done)[:2] == (3.0, 0)
    assert "compiled code cannot be read in" in done.stderr
    assert done.stderr.count("compiled code") == 1 and done.stderr.count("\n") == 2  # it compiles
    assert found(report(tmp_path))[:2] == (3.0, 1)


def flip(path, bit):
    """Flip one bit of a file."""
    data = bytearray(path.read_bytes())
    data[bit // 8] ^= 1 << bit % 8
    path.write_bytes(data)


def twice(x):
    return x + x


def square(x):
    return x * x


class Kept:
    """A small kernel in a cache folder; each `load` is that of a new process."""

    def __init__(self, folder, function=twice):
        self._folder, self._function = folder, function
        self.compile()
        (self.path,) = folder.glob(f"{function.__name__}-*.nbc")

    def _kernel(self):
        kernel = numba.njit(self._function)
        kernel._cache = cache.KernelCache(self._folder, self._function.__name__)
        return kernel

    def compile(self):
        """Compile the kernel, and keep it."""
        assert self._kernel()(3.0) == self._function(3.0)

    def load(self):
        """What is loaded from the folder."""
        kernel = self._kernel()
        return kernel._cache.load_overload((numba.float64,), kernel.targetctx)


@pytest.fixture
def said(caplog, monkeypatch):
    """What is said of files from here on, as in a new process."""
    monkeypatch.setattr(cache, "_said", set())
    return lambda: "\n".join(record.getMessage() for record in caplog.records)


def test_of_200_flipped_bits_none_is_loaded_and_one_warning_says_so(tmp_path, said):
    kept = Kept(tmp_path)
    assert kept.load().entry_point(3.0) == 6.0
    for bit in random.Random(0).sample(range(8 * kept.path.stat().st_size), 200):
        flip(kept.path, bit)
        assert kept.load() is None, bit
        flip(kept.path, bit)
    assert said().startswith(f"compiled code cannot be read in {tmp_path} ({kept.path.name} is not")
    assert said().count("\n") == 0
    assert kept.load().entry_point(3.0) == 6.0


CODEGEN = type(cpu_target.target_context.codegen())
OTHERS = {
    "python": (sysconfig.get_config_vars(), "EXT_SUFFIX", ".cpython-314-x86_64-linux-gnu.so"),
    "free-threaded python": (sysconfig.get_config_vars(), "EXT_SUFFIX", ".cpython-311t-linux.so"),
    "numba": (numba, "__version__", "0.61.0"),
    "llvmlite": (llvmlite, "__version__", "0.44.0"),
    "processor": (CODEGEN, "magic_tuple", lambda self: ("x86_64-linux", "znver4", "+avx512f")),
    "optimisation": (numba.config, "OPT", 0),
    "check of bounds": (numba.config, "BOUNDSCHECK", 1),
}


@pytest.mark.parametrize("other", OTHERS)
def test_code_of_another_version_or_processor_is_not_loaded_whatever_its_name(
    tmp_path, monkeypatch, said, other
):
    kept = Kept(tmp_path)
    place, name, value = OTHERS[other]
    change = monkeypatch.setitem if isinstance(place, dict) else monkeypatch.setattr
    change(place, name, value)
    assert (kept.load(), said()) == (None, "")
    kept.compile()
    assert kept.load() is not None  # each has its own
    (theirs,) = set(tmp_path.iterdir()) - {kept.path}
    shutil.copy(kept.path, theirs)
    assert kept.load() is None
    assert said().startswith("compiled code cannot be read in ") and said().count("\n") == 0


def test_nor_is_that_of_another_kernel(tmp_path, said):
    kept = Kept(tmp_path)
    shutil.copy(Kept(tmp_path, square).path, kept.path)
    assert kept.load() is None
    assert "cannot be read" in said()


def test_code_with_addresses_of_its_process_is_not_kept(tmp_path, said):
    cosine = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(("cos", ctypes.CDLL(None)))
    kernel = numba.njit(lambda x: cosine(x))
    kernel._cache = cache.KernelCache(tmp_path, "cosine")
    assert kernel(0.0) == 1.0
    assert "cannot be kept" in said() and not list(tmp_path.iterdir())


@pytest.mark.long
def test_processes_that_write_at_once_do_not_disturb_each_other(tmp_path):
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda _: report(tmp_path), range(4)))
    assert {found(done)[0] for done in together} == {3.0}
    assert {done.stderr for done in together} == {""}
    assert found(report(tmp_path))[:2] == (3.0, 1)
    assert not list(tmp_path.rglob(".*.tmp"))


PLACES = """
import sys
import numpy as np
from rigid_envs.systems.free_body.dynamics import FREE_BODY
from rigid_envs.systems.heavy_top.dynamics import HEAVY_TOP
from rigid_envs.systems.roller.dynamics import ROLLER
from rigid_envs.engine.compiler import address_of, compiled_for

rows = (np.ones((1, 1)), np.ones(1), np.ones((1, 1)))
systems = {"body": FREE_BODY, "top": HEAVY_TOP, "roller": ROLLER}
kernels = [systems[name].measure_rows for name in sys.argv[1:]]
for kernel in kernels:
    compiled_for(kernel, *rows)
print(len({address_of(kernel, *rows) for kernel in kernels}))
"""


@pytest.mark.long
def test_kernels_that_different_processes_have_compiled_are_not_mixed_up(tmp_path):
    names = ("body", "top", "roller")
    for name in names:  # each is the first function that its process compiles
        assert int(program(PLACES, tmp_path, name).stdout) == 1
    assert int(program(PLACES, tmp_path, *names).stdout) == len(names)


RESET = "import gymnasium, rigid_envs; gymnasium.make('RigidEnvs/BallGrid-v0').reset(seed=0)"
LOGGED = f"import logging; logging.basicConfig(level='INFO'); {RESET}"


@pytest.mark.long
@pytest.mark.push
@pytest.mark.parametrize(
    ("code", "who"), [(RESET, "rigid-envs: "), (LOGGED, "INFO:rigid_envs.engine.compiler:")]
)
def test_it_is_said_what_is_compiled_before_it_is(code, who, tmp_path):
    said = "compiling systems.rolling_ball.tasks.ball_grid.reset, once: 1 to 6 s\n"
    assert program(code, tmp_path).stderr == who + said
    assert program(code, tmp_path).stderr == ""  # it is kept


def folder(base, monkeypatch):
    """The cache folder below a base, found afresh."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(base))
    return cache.cache_directory.__wrapped__()


def test_the_cache_folder_is_private_and_named_by_the_sources(tmp_path, monkeypatch):
    found = folder(tmp_path, monkeypatch)
    assert found == tmp_path / "rigid-envs" / cache.kernel_hash()
    assert stat.S_IMODE(found.stat().st_mode) == 0o700


@pytest.mark.parametrize("mode", [0o770, 0o707, 0o777, 0o720])
def test_a_cache_folder_that_others_may_write_to_is_not_used(tmp_path, monkeypatch, mode):
    found = folder(tmp_path, monkeypatch)
    found.chmod(mode)
    assert folder(tmp_path, monkeypatch) is None


@pytest.mark.parametrize(("mode", "used"), [(0o755, True), (0o777, False), (0o1777, True)])
def test_nor_is_one_below_a_folder_in_which_others_rename(tmp_path, monkeypatch, mode, used):
    above = tmp_path / "shared"
    above.mkdir()
    above.chmod(mode)
    assert (folder(above / "mine", monkeypatch) is not None) == used


def test_a_cache_folder_of_somebody_else_is_not_used(tmp_path, monkeypatch):
    assert folder(tmp_path, monkeypatch) is not None
    somebody = os.getuid() + 1
    monkeypatch.setattr(os, "getuid", lambda: somebody)
    assert folder(tmp_path, monkeypatch) is None


def test_the_cache_folder_falls_back_to_the_users_own(tmp_path, monkeypatch):
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert cache.cache_directory.__wrapped__().is_relative_to(tmp_path / "xdg")
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert cache.cache_directory.__wrapped__().is_relative_to(tmp_path / "home/.cache")


def test_other_users_of_numba_keep_their_own_cache_setting():
    assert "rigid-envs" not in (numba.config.CACHE_DIR or "")


LEFT = f"""
{RESET}
import gc, sys
from numba.core.registry import cpu_target
changed = {{"resolve_function_type", "load_additional_registries"}}
left = changed & (vars(cpu_target.typing_context).keys() | vars(cpu_target.target_context).keys())
print(left or "", gc.isenabled(), gc.get_freeze_count(), "scipy.linalg" in sys.modules)
"""


@pytest.mark.long
@pytest.mark.push
def test_numba_is_left_as_it_was_and_loads_little_for_a_kernel_from_its_file(tmp_path):
    assert program(LEFT, tmp_path).stdout.split() == ["True", "0", "True"]
    assert program(LEFT, tmp_path).stdout.split() == ["True", "0", "False"]


def test_what_the_user_has_frozen_is_not_collected_after_a_compilation():
    gc.freeze()
    try:
        with cache._no_collection():
            pass
        assert gc.get_freeze_count()
    finally:
        gc.unfreeze()


# A numba that the kernels were not tested with is named, with what to install instead.


PROJECT = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]
(WANTED,) = (each for each in PROJECT["dependencies"] if each.startswith("numba"))
INSTALL = f'pip install "{WANTED}"'


def test_the_range_is_that_of_the_package_and_has_the_numba_of_this_run():
    assert "numba>={}.{},<{}.{}".format(*numba_version.OLDEST, *numba_version.NEXT) == WANTED
    assert numba_version.OLDEST <= numba.version_info.short < numba_version.NEXT


def check(version, monkeypatch):
    """What an import of the kernels does with a version of numba."""
    monkeypatch.setattr(numba, "version_info", numba.version_info._replace(short=version))
    monkeypatch.setattr(numba, "__version__", "{}.{}.0".format(*version))
    numba_version.check()


@pytest.mark.parametrize("version", [(0, 61), (0, 68)])
def test_of_a_numba_in_the_range_nothing_is_said(version, monkeypatch, caplog):
    check(version, monkeypatch)
    assert not caplog.records


@pytest.mark.parametrize("version", [(0, 60), (0, 69), (1, 0), (None, None)])
def test_another_one_that_has_all_that_is_needed_is_used_with_a_warning(
    version, monkeypatch, caplog
):
    check(version, monkeypatch)
    (record,) = caplog.records
    assert record.levelno == logging.WARNING
    assert record.getMessage().startswith("numba = {}.{}.0; expected {}".format(*version, WANTED))
    assert INSTALL in record.getMessage()


@pytest.mark.parametrize("mistake", [AttributeError, ImportError, TypeError])
def test_of_one_in_which_anything_is_missing_or_changed_a_sentence_says_what_to_install(
    mistake, monkeypatch
):
    def fail(_name):
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


def test_so_it_does_of_a_part_that_is_taken_from_this_one():
    last = python("-c", WITHOUT_A_PART).stderr.splitlines()[-1]
    assert last.startswith(f"ImportError: numba = 0.70.0; expected {WANTED}: {INSTALL} (")
    assert "JITCodeLibrary" in last
