"""A newcomer's package, made of nothing but docs/extending.md, gets all that the page promises."""

import importlib
import os
import re
import shlex
import sys
from functools import partial
from pathlib import Path

import pytest

from tests.fixtures import Patch
from tests.programs import printed, python

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs/extending.md").read_text(encoding="utf-8")
FILES = re.findall(r"^`(\S+\.py)`:\n\n```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
(SCRIPT,) = re.findall(r"^From now on:\n\n```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
(CHECKS,) = re.findall(r"^## Checks of any environment\n(.*?)^## ", PAGE, re.MULTILINE | re.DOTALL)
BASH = re.findall(r"^```bash\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
DESCRIBE, DOCS, CONTRACTS = (line for block in BASH for line in block.splitlines())
SWING_UP = "wheel_pendulum:WheelPendulum/SwingUp-v0"

# a few of the contracts that ask most of a task and of its system
SUBSET = "invariants or interface or rows_is or seed or substeps"
REPORT = f"""
import gymnasium
env = gymnasium.make("{SWING_UP}").unwrapped
env.reset(seed=0, options={{"state": {{"angle": 1.0}}}})
info = env.step(env.action_space.low)[-1]
kernels = (env.task.episode.step, env.task.episode.reset)
print(info["reward/height"], sum(sum(k.stats.cache_hits.values()) for k in kernels))
"""
PICTURE = """
import math, gymnasium, numpy as np
from rigid_envs import rotations
from rigid_envs.watch.views import view_of
env = gymnasium.make("wheel_pendulum:WheelPendulum/HeavySwingUp-v0", render_mode="rgb_array")
task, places = env.unwrapped.task, []
for angle in (0.0, 0.5 * math.pi):
    env.reset(seed=0, options={"state": {"angle": angle}})
    moment = env.unwrapped.moment()
    view = view_of(task, moment.parameters)
    frame = view.frame(moment)
    wheel = rotations.rotate(frame.poses["wheel"].q, [0.0, -1.0, 0.0])
    assert np.allclose(wheel, frame.points["path"])
    places.append((np.round(wheel, 6) + 0.0).tolist())
print(type(view).__name__, env.render().shape, *places)
"""


SYMBOLIC = """
import numpy as np
from wheel_pendulum.system import WheelPendulum
system = WheelPendulum()
model, y, u = system.symbolic(), [0.7, -1.0, 3.0], [0.2]
for found, exact in (
    (model.rhs(y, u), system.rhs(y, u)),
    (model.step(0.05)(y, u), system.advance(y, u, 0.05)),
    (model.invariants(y), list(system.invariants(y).values())),
):
    assert np.allclose(np.array(found)[:, 0], exact, rtol=1e-12, atol=1e-12)
print(model.states, model.inputs)
"""
SUBSTEPS = """
from wheel_pendulum.heavy import HeavySwingUp
from wheel_pendulum.task import SwingUp
print(HeavySwingUp().mgl, HeavySwingUp().n_substeps)
# 2010 rad/s in all, at which the least number is 201 and no rounding more
SwingUp(mgl=1e6, n_substeps=201).check_duration(200)
for refused in (
    lambda: HeavySwingUp(mgl=-1.0),
    lambda: SwingUp(mgl=1e6, n_substeps=200).check_duration(200),
):
    try:
        refused()
    except ValueError as error:
        print(error)
"""
BLOCKS = re.findall(r"^```python\n(.*?)^```$", CHECKS, re.MULTILINE | re.DOTALL)
PROGRAMS = {
    "script": f"{SCRIPT}env.reset(seed=0)\nprint(envs.reset(seed=0)[0].shape)\n",
    "checks": "\n".join(BLOCKS),
    "picture": PICTURE,
    "symbolic": SYMBOLIC,
    "substeps": SUBSTEPS,
}


class Package:
    """The package of the page in a folder of its own, and processes that run beside it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        path = os.pathsep.join([str(folder), str(ROOT)])
        own = {"cwd": folder, "PYTHONPATH": path, "NUMBA_CACHE_DIR": str(folder / "c")}
        self.run, self.output = partial(python, **own), partial(printed, **own)
        self.write(dict(FILES))

    def write(self, files: dict[str, str]) -> None:
        for name, text in files.items():
            (self.folder / name).parent.mkdir(exist_ok=True)
            (self.folder / name).write_text(text, encoding="utf-8")


def command(line: str) -> list[str]:
    """A command of the page as arguments of Python."""
    first, *rest = shlex.split(line)
    return ["-m", "rigid_envs.tools.cli", *rest] if first == "rigid-envs" else rest


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Package:
    return Package(tmp_path_factory.mktemp("newcomer"))


@pytest.fixture(scope="module")
def said(package: Package) -> dict[str, str]:
    """What the programs print, one after the other in one process."""
    text = package.output("-c", "\nprint('---')\n".join(PROGRAMS.values()))
    return dict(zip(PROGRAMS, text.split("---\n"), strict=True))


def test_the_page_is_a_whole_package() -> None:
    names = ("system", "task", "heavy", "view", "__init__")
    assert [name for name, _ in FILES] == [f"wheel_pendulum/{name}.py" for name in names]


def test_the_script_of_the_page_runs(said: dict[str, str]) -> None:
    assert said["script"] == "(256, 4)\n"


def test_the_checks_of_the_page_run(said: dict[str, str]) -> None:
    assert said["checks"] == "same_seed_again\n"


def test_it_is_seen_by_its_own_view(said: dict[str, str]) -> None:
    text = "SwingUpView (480, 480, 3) [0.0, 0.0, -1.0] [1.0, 0.0, 0.0]\n"
    assert said["picture"] == text


def test_its_system_is_a_symbolic_model_too(said: dict[str, str]) -> None:
    assert said["symbolic"] == "('angle', 'omega', 'spin') ('torque',)\n"


def test_the_second_process_compiles_nothing(package: Package) -> None:
    package.run("-c", REPORT)
    again = package.run("-c", REPORT)
    assert again.stderr == ""
    assert again.stdout.split()[1] == "2"


@pytest.mark.long
def test_an_edited_helper_in_another_file_is_noticed(package: Package) -> None:
    before = package.output("-c", REPORT).split()[0]
    system = dict(FILES)["wheel_pendulum/system.py"]
    package.write({"wheel_pendulum/system.py": system.replace("2.0 * sine * sine", "sine * sine")})
    after, hits = package.output("-c", REPORT).split()
    package.write(dict(FILES))
    assert (float(after) + 1.0, hits) == (0.5 * (float(before) + 1.0), "0")
    assert package.output("-c", REPORT).split() == [before, "2"]


def test_it_is_described_and_gets_pages(package: Package) -> None:
    text = package.output(*command(DESCRIBE))
    assert text.startswith("WheelPendulum/SwingUp-v0")
    assert "import wheel_pendulum" in text
    package.output(*command(DOCS))
    pages = {path.name for path in (package.folder / "pages").iterdir()}
    assert pages == {"README.md", "WheelPendulum-SwingUp.md", "WheelPendulum-HeavySwingUp.md"}
    assert "## Pendulum" in (package.folder / "pages/README.md").read_text()


def test_a_subclass_overrides_defaults_and_keeps_their_rules(said: dict[str, str]) -> None:
    own, refused, _ = said["substeps"].splitlines()
    assert own == "(6.0, 8.0) 2"
    assert refused.startswith("config.mgl: mgl = -1.0; expected")


def test_the_least_number_of_substeps_that_is_asked_for_is_enough(said: dict[str, str]) -> None:
    assert said["substeps"].endswith("take n_substeps >= 201\n")


@pytest.mark.parametrize(
    ("file", "old", "new", "message"),
    [
        ("system", "derive(inertia: float, mgl", "derive(mgl: float, inertia", "begins with"),
        ("system", "    mgl: float = 4.0\n", "", "expected the arguments of its derive"),
        ("task", "    weight_effort: ", "    wait_effort: ", "has no weight_effort"),
        ("task", "    omega_tolerance: float = s", "    slow: float = s", "has no omega"),
    ],
)
def test_names_that_do_not_fit_together_are_refused_at_import(
    tmp_path: Path, monkeypatch: Patch, file: str, old: str, new: str, message: str
) -> None:
    package, name = Package(tmp_path), f"wheel_pendulum/{file}.py"
    text = dict(FILES)[name]
    assert text.count(old) == 1
    package.write({name: text.replace(old, new), "wheel_pendulum/__init__.py": ""})
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "modules", {**sys.modules})
    with pytest.raises(TypeError, match=message):
        importlib.import_module("wheel_pendulum.task")


@pytest.mark.push
@pytest.mark.long
def test_it_passes_the_contracts_that_ask_most(package: Package) -> None:
    printed = package.output(*command(CONTRACTS), "-q", "-k", SUBSET)
    assert re.search(r"\d\d passed", printed), printed


def test_an_unknown_id_is_refused_in_one_line(package: Package) -> None:
    refused = package.run("-m", "rigid_envs.testing", "--env-id", "wheel_pendulum:Wheel/Swing-v0")
    assert "--env-id: env_id = 'wheel_pendulum:Wheel/Swing-v0'; expected" in refused.stderr
    assert "Traceback" not in refused.stderr


@pytest.mark.long
def test_it_passes_all_contracts(package: Package) -> None:
    other = "wheel_pendulum:WheelPendulum/HeavySwingUp-v0"
    printed = package.output(*command(CONTRACTS), "--env-id", other, "-q", "-n", "2")
    assert re.search(r"\d\d\d passed", printed), printed
