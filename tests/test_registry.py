"""The registry is what Gymnasium, tasks and scores have; another package gets all that ours get."""

import importlib
import os
import re
import shlex
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

import gymnasium
import numpy as np
import pytest

import rigid_envs
from rigid_envs.base.checks import ConfigError
from rigid_envs.envs.lookup import checked_id, families, full_id, new_task, task_of
from rigid_envs.mechanics import rotations
from rigid_envs.scores.best import TheoreticalLimit
from rigid_envs.scores.starts import METRICS
from rigid_envs.tasks.core import Core
from rigid_envs.tasks.registry import COSTS, ENVIRONMENTS, EnvironmentRecord, add, load
from tests.programs import printed, python
from tests.refusals import refuses

each_id = pytest.mark.parametrize("env_id", list(ENVIRONMENTS))
PARK = "RigidEnvs/BallPark-v0"

_NO_TASKS = ("other.Park", "other:Park:Goal", "")
_HOOP = '''
import rigid_envs
from rigid_envs.systems.rolling_ball.tasks import BallPark

class HoopRoll(BallPark):
    """Park a hoop.

    It is a ball under another name.

    Reference:
        None yet.
    """

rigid_envs.register("Hoops/Roll-v0", task="hoops:HoopRoll", max_episode_steps=70, family="Hoop")

class HoopToll(HoopRoll):
    __doc__ = HoopRoll.__doc__
    cost_unit = "toll of the road [penny]"

rigid_envs.register("Hoops/Toll-v0", task="hoops:HoopToll", max_episode_steps=70, family="Hoop",
                    metrics=("path", "success"))
'''
_USE = """
import gymnasium, numpy as np
from rigid_envs.envs.lookup import checked_id, task_of
from rigid_envs.tools.pages import describe, list_all, write_pages
from rigid_envs.scores import evaluate, metrics_of, uniform
from rigid_envs.watch.films import figure
from pathlib import Path
from typing import Any

env_id = checked_id("hoops:Hoops/Roll-v0")
assert gymnasium.make(env_id).spec.max_episode_steps == 70
assert gymnasium.make_vec(env_id, num_envs=3).reset(seed=0)[0].shape[0] == 3
assert "Park a hoop." in describe(env_id, {}) and env_id in list_all()
write_pages(Path("pages"), [env_id])
assert "Family: [Hoop](README.md#hoop)" in Path("pages/Hoops-Roll.md").read_text()
assert "## Hoop" in Path("pages/README.md").read_text()
assert [metric.name for metric in metrics_of(env_id)] == ["time", "success", "return"]
assert evaluate(env_id, uniform(), n=3).values["success"].shape == (3,)

toll = evaluate("Hoops/Toll-v0", uniform(), n=3)
assert toll.cost.title == "path [penny]" and "path [penny]" in str(toll)
assert figure("Hoops/Toll-v0", task_of("Hoops/Toll-v0"), 3.0) == "path 3 penny"
assert "toll of the road [penny], of this step" in describe("Hoops/Toll-v0", {})
"""


@each_id
def test_a_record_is_what_gymnasium_and_the_task_have(env_id):
    record, task, spec = ENVIRONMENTS[env_id], task_of(env_id), gymnasium.spec(env_id)
    assert record.id == env_id == spec.id
    assert record.max_episode_steps == spec.max_episode_steps
    assert record.goal == (task.n_goal > 0) == ("Goal" in str(spec.entry_point))
    assert set(record.metrics) <= set(METRICS) and {"success", "return"} <= set(record.metrics)
    assert (record.error is not None) == ("error" in record.metrics)
    assert record.error is None or record.error.term in task.terms
    assert record.metrics[0] in COSTS and set(record.limits) <= set(record.metrics)
    assert all(callable(load(name)) for name in record.controllers.values())
    assert all(isinstance(load(name), TheoreticalLimit) for name in record.limits.values())
    task_of(env_id, record.early_end)


def test_families_are_all_ids_in_the_order_of_registration():
    found = families()
    assert list(found) == ["Free body", "Top", "Ball", "Coin and wheel", "Satellite"]
    assert sorted(env_id for ids in found.values() for env_id in ids) == sorted(ENVIRONMENTS)
    assert families([PARK]) == {"Ball": [PARK]}


def test_wrong_records_are_refused_and_equal_ones_harmless():
    record = ENVIRONMENTS[PARK]
    add(record)
    with pytest.raises(ConfigError, match="expected an id that is not registered yet"):
        add(replace(record, max_episode_steps=99))
    other = EnvironmentRecord("Other/Park-v0", "other:Park", 10, "Ball")
    for change, complaint in (
        *(({"task": task}, f"task = '{task}'; expected 'module:Class'") for task in _NO_TASKS),
        *(({"max_episode_steps": no}, "expected an integer from 1") for no in (True, 0, -1, 2.0)),
        ({"metrics": ("time", "error")}, "expected an ErrorTerm"),
        ({"metrics": ("return", "time")}, "expected one of .* first"),
        ({"metrics": ()}, "expected one of .* first"),
    ):
        with pytest.raises(ConfigError, match=f"^Other/Park-v0: .*{complaint}"):
            add(replace(other, **change))
    with pytest.raises(ConfigError, match=r"'rigid_envs\.systems:Nothing'; expected 'module:name'"):
        rigid_envs.register("Other/Park-v0", "rigid_envs.systems:Nothing", 10)
    assert "Other/Park-v0" not in ENVIRONMENTS


def test_an_episode_may_have_one_step_alone(monkeypatch):
    known = {}
    for name in ("_RECORDS", "ENVIRONMENTS"):
        monkeypatch.setattr(f"rigid_envs.tasks.registry.{name}", known)
    add(other := EnvironmentRecord("Other/Park-v0", "other:Park", 1, "Ball"))
    assert known == {other.id: other}


def test_modules_that_are_used_most_are_names_of_the_package():
    homes = {"bodies": "mechanics", "rotations": "mechanics", "replays": "watch", "films": "watch"}
    for name, home in homes.items():
        assert getattr(rigid_envs, name) is sys.modules[f"rigid_envs.{home}.{name}"]


def test_an_id_may_be_short():
    for short in ("BallPark", "BallPark-v0", "RigidEnvs/BallPark", PARK):
        assert checked_id(short) == full_id(short) == PARK
    for other in ("Ball", "ballpark", "CartPole-v1", "", "-v0", "Other/BallPark"):
        assert full_id(other) == other
    assert len({full_id(env_id.rpartition("-")[0]) for env_id in ENVIRONMENTS}) == len(ENVIRONMENTS)


def test_a_short_id_means_the_newest_version_and_never_one_of_two_namespaces(monkeypatch):
    balls = (f"RigidEnvs/BallPark-v{k}" for k in (0, 10, 9))
    coins = ("RigidEnvs/Coin-v0", "Other/Coin-v0")
    known = dict.fromkeys((*balls, *coins, "Plain", "RigidEnvs/Top", "RigidEnvs/Top-v1"))
    monkeypatch.setattr("rigid_envs.envs.lookup.ENVIRONMENTS", known)
    assert full_id("BallPark") == "RigidEnvs/BallPark-v10"
    assert full_id("BallPark-v9") == "RigidEnvs/BallPark-v9"
    assert full_id("Coin") == "Coin"
    assert [full_id(env_id) for env_id in known] == [*known]  # a whole id is never a short one
    assert full_id("Top") == "RigidEnvs/Top-v1"  # without a version it is older than any


@pytest.mark.parametrize("no_text", [7, None, [], b"BallPark"])
def test_what_is_no_text_is_no_id(no_text):
    refuses(r"^env_id = .*; expected the id of an environment", task_of, no_text)


@pytest.mark.parametrize("no_dict", [3, 0, "", "dt", [("dt", 0.1)]])
def test_hyperparameters_that_are_no_dict_are_refused(no_dict):
    with pytest.raises(ConfigError, match=r"^config = .*; expected a dict of hyperparameters"):
        task_of(PARK, no_dict)


def test_an_id_may_name_the_module_that_registers_it():
    assert checked_id(f"rigid_envs:{PARK}") == PARK
    with pytest.raises(ConfigError, match="expected a module that can be imported: No module"):
        checked_id("no_such_package:Hoops/Roll-v0")


def test_another_package_gets_all_that_ours_get(tmp_path):
    (tmp_path / "hoops.py").write_text(_HOOP)
    path = [str(tmp_path), str(Path(__file__).parents[1])]
    code = f"import sys; sys.path[:0] = {path!r}\n{_USE}"
    printed("-c", code, cwd=tmp_path)


def tilt(core):
    """Angle of the third body axis from the vertical."""
    x, y, z = rotations.rotate(core.y[:, :4], np.array([0.0, 0.0, 1.0])).T
    return np.arctan2(np.hypot(x, y), z)


def off(core):
    """Distance from the commanded spin, in target rates."""
    task = core.task
    sense = -1.0 if type(task).__name__ == "AxisFlip" else 1.0
    goal = np.array([0.0, sense * task.spin_rate, 0.0])
    return np.linalg.norm(core.y[:, 4:7] - goal, axis=1) / task.spin_rate


ERRORS = {
    "spin": off,
    "axis": lambda core: np.arctan2(np.hypot(core.y[:, 4], core.y[:, 6]), core.y[:, 5]),
    "upright": tilt,
    "tilt": lambda core: np.abs(tilt(core) - core.auxiliary("goal_tilt")),
    "near": lambda core: np.linalg.norm(
        core.y[:, 4:6] - core.auxiliary("point_X", "point_Y"), axis=1
    ),
}
"""Errors by the name of their reward term, from the state, but "close" and "circle"."""
KNOWN = {
    env_id: record.error
    for env_id, record in ENVIRONMENTS.items()
    if record.error is not None and record.error.term in ERRORS
}


@pytest.mark.parametrize("env_id", KNOWN)
def test_the_error_that_is_read_from_a_reward_term_is_that_of_the_state(env_id):
    error, core = KNOWN[env_id], Core(task_of(env_id), 8)
    core.seed(np.arange(8), np.arange(8, dtype=np.uint64))
    core.reset(np.arange(8))
    core.actions[...] = np.random.default_rng(0).uniform(-1.0, 1.0, core.actions.shape)
    core.step()
    term = core.results[1 + core.task.terms.index(error.term)]
    np.testing.assert_allclose((1.0 / term - 1.0) / error.sharpness, ERRORS[error.term](core))


ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs/extending.md").read_text(encoding="utf-8")
FILES = re.findall(r"^`(\S+\.py)`:\n\n```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
(SCRIPT,) = re.findall(r"^From now on:\n\n```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
(CHECKS,) = re.findall(r"^## Checks of any environment\n(.*?)^## ", PAGE, re.MULTILINE | re.DOTALL)
BASH = re.findall(r"^```bash\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
DESCRIBE, DOCS, CONTRACTS = (line for block in BASH for line in block.splitlines())
SWING_UP = "wheel_pendulum:WheelPendulum/SwingUp-v0"

# a few of the contracts that ask most of a task and of its system
SUBSET = "envelope or invariants or interface or rows_is or seed or substeps"
REPORT = f"""
import gymnasium
env = gymnasium.make("{SWING_UP}").unwrapped
env.reset(seed=0, options={{"state": {{"angle": 1.0}}}})
info = env.step(env.action_space.low)[-1]
kernels = (env.task.compiled.step, env.task.compiled.reset)
print(info["reward/height"], sum(sum(k.stats.cache_hits.values()) for k in kernels))
"""
PICTURE = """
import math, gymnasium, numpy as np
from rigid_envs import rotations
from rigid_envs.watch.views import view_of
kind = {"frame": "reduced", "render_mode": "rgb_array"}
env = gymnasium.make("wheel_pendulum:WheelPendulum/MirrorSwingUp-v0", **kind)
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
HOLD = """
import gymnasium
from wheel_pendulum.hold import HoldAngle
env = gymnasium.make("wheel_pendulum:WheelPendulum/HoldAngle-v0").unwrapped
env.reset(seed=0, options={"state": {"angle": 0.5, "spin": 3.0}})
moment = env.moment()
print(moment.state, moment.y.tolist(), moment.input)
print(0.1 <= moment.aux["goal"] <= 0.2, env.step(env.action_space.low)[0][3] == moment.aux["goal"])
try:
    HoldAngle(least_goal=0.3)
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
    "hold": HOLD,
}


class Package:
    """The package of the page in a folder of its own, and processes that run beside it."""

    def __init__(self, folder):
        self.folder = folder
        path = os.pathsep.join([str(folder), str(ROOT)])
        own = {"cwd": folder, "PYTHONPATH": path, "NUMBA_CACHE_DIR": str(folder / "c")}
        self.run, self.output = partial(python, **own), partial(printed, **own)
        self.write(dict(FILES))

    def write(self, files):
        for name, text in files.items():
            (self.folder / name).parent.mkdir(exist_ok=True)
            (self.folder / name).write_text(text, encoding="utf-8")


def command(line):
    """A command of the page as arguments of Python."""
    first, *rest = shlex.split(line)
    return ["-m", "rigid_envs.tools.cli", *rest] if first == "rigid-envs" else rest


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    return Package(tmp_path_factory.mktemp("newcomer"))


@pytest.fixture(scope="module")
def said(package):
    """What the programs print, one after the other in one process."""
    text = package.output("-c", "\nprint('---')\n".join(PROGRAMS.values()))
    return dict(zip(PROGRAMS, text.split("---\n"), strict=True))


def test_the_page_is_a_whole_package():
    names = ("system", "task", "heavy", "hold", "mirror", "view", "__init__")
    assert [name for name, _ in FILES] == [f"wheel_pendulum/{name}.py" for name in names]


PRINTED = {
    "script": "(256, 4)\n",
    "checks": "same_seed_again\n",
    "picture": "SwingUpView (480, 480, 3) [0.0, 0.0, -1.0] [1.0, 0.0, 0.0]\n",  # by its own view
    "symbolic": "('angle', 'omega', 'spin') ('torque',)\n",
}


@pytest.mark.long
@pytest.mark.push
@pytest.mark.parametrize("name", PRINTED)
def test_the_script_of_the_page_runs(said, name):
    assert said[name] == PRINTED[name]


@pytest.mark.long
@pytest.mark.push
def test_it_has_an_auxiliary_state_names_and_settings_that_depend_on_one_another(said):
    state, goal, refused = said["hold"].splitlines()
    assert state == "State(angle=0.5, omega=0.0, spin=3.0) [0.5, 0.0, 3.0] Input(torque=0.0)"
    assert goal == "True True"
    expected = "config.least_goal: least_goal = 0.3; expected at most largest_goal = 0.2"
    assert refused == expected


@pytest.mark.long
@pytest.mark.push
def test_the_second_process_compiles_nothing(package):
    package.run("-c", REPORT)
    again = package.run("-c", REPORT)
    assert again.stderr == ""
    assert again.stdout.split()[1] == "2"


@pytest.mark.long
def test_an_edited_helper_in_another_file_is_noticed(package):
    before = package.output("-c", REPORT).split()[0]
    system = dict(FILES)["wheel_pendulum/system.py"]
    package.write({"wheel_pendulum/system.py": system.replace("2.0 * sine * sine", "sine * sine")})
    after, hits = package.output("-c", REPORT).split()
    package.write(dict(FILES))
    assert (float(after) + 1.0, hits) == (0.5 * (float(before) + 1.0), "0")
    assert package.output("-c", REPORT).split() == [before, "2"]


def test_it_is_described_and_gets_pages(package):
    text = package.output(*command(DESCRIBE))
    assert text.startswith("WheelPendulum/SwingUp-v0")
    assert "import wheel_pendulum" in text
    package.output(*command(DOCS))
    pages = {path.name for path in (package.folder / "pages").iterdir()}
    assert pages == {"README.md", "WheelPendulum-SwingUp.md", "WheelPendulum-HeavySwingUp.md"}
    assert "## Pendulum" in (package.folder / "pages/README.md").read_text()


@pytest.mark.long
@pytest.mark.push
def test_a_subclass_overrides_defaults_and_keeps_their_rules(said):
    own, refused, _ = said["substeps"].splitlines()
    assert own == "(6.0, 8.0) 2"
    assert refused.startswith("config.mgl: mgl = -1.0; expected")


@pytest.mark.long
@pytest.mark.push
def test_the_least_number_of_substeps_that_is_asked_for_is_enough(said):
    assert said["substeps"].endswith("take n_substeps >= 201\n")


@pytest.mark.parametrize(
    ("file", "old", "new", "message"),
    [
        ("system", "derive(inertia: float, mgl", "derive(mgl: float, inertia", "begins with"),
        ("system", "    mgl: float = 4.0\n", "", "expected the arguments of its derive"),
        ("task", "    weight_effort: ", "    wait_effort: ", "has no weight_effort"),
        ("task", "    omega_tolerance: float = s", "    slow: float = s", "has no omega"),
        ("system", "@scalar\ndef rhs(", "def rhs(", "a plain function; expected a compiled one"),
        ("task", "@scalar\ndef observe(", "def observe(", "observe = wheel_pendulum.task.o"),
    ],
)
def test_names_that_do_not_fit_together_are_refused_at_import(
    tmp_path, monkeypatch, file, old, new, message
):
    package, name = Package(tmp_path), f"wheel_pendulum/{file}.py"
    text = dict(FILES)[name]
    assert text.count(old) == 1
    package.write({name: text.replace(old, new), "wheel_pendulum/__init__.py": ""})
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "modules", {**sys.modules})
    with pytest.raises(TypeError, match=message):
        importlib.import_module("wheel_pendulum.task")
    with pytest.raises(ConfigError, match=rf"^config.task: .*{message}"):
        new_task("wheel_pendulum.task:SwingUp", {})


@pytest.mark.push
@pytest.mark.long
def test_it_passes_the_contracts_that_ask_most(package):
    printed = package.output(*command(CONTRACTS), "-q", "-n", "2", "-k", SUBSET)
    assert re.search(r"\d\d passed", printed), printed


STEP = "a_short_step"


@pytest.mark.push
@pytest.mark.long
@pytest.mark.parametrize(
    ("contract", "file", "old", "new", "told"),
    [
        (STEP, "system", ", u.torque / p.wheel)", ", -u.torque / p.wheel)", "tolerance rtol=1e-06"),
        (STEP, "system", "h * y.omega,", "h * (y.omega + h),", "to tolerance rtol=1e-11"),
        (STEP, "task", "min(max(y.omega, -FASTEST), FASTEST),", "", "gives 3 numbers; expected 4"),
        (STEP, "task", "0.0, 0.0), ()\n", "0.0, 0.0)\n", "task.start, which returns State; expec"),
        (
            "largest_rate",
            "task",
            "return fastest(",
            "return 0.1 * fastest(",
            "; expected at least ",
        ),
        ("early_end", "__init__", "early_end=_early_end,", "", "Error: early_end = {} of Wheel"),
    ],
)
def test_contracts_tell_what_import_does_not(tmp_path, contract, file, old, new, told):
    package, name = Package(tmp_path), f"wheel_pendulum/{file}.py"
    assert dict(FILES)[name].count(old) == 1
    package.write({name: dict(FILES)[name].replace(old, new)})
    assert told in str(package.run(*command(CONTRACTS), "-q", "-k", contract))


def test_an_unknown_id_is_refused_in_one_line(package):
    refused = package.run("-m", "rigid_envs.testing", "--env-id", "wheel_pendulum:Wheel/Swing-v0")
    assert "--env-id: env_id = 'wheel_pendulum:Wheel/Swing-v0'; expected" in refused.stderr
    assert "Traceback" not in refused.stderr


@pytest.mark.long
def test_it_passes_all_contracts(package):
    names = ("HeavySwingUp", "HoldAngle", "MirrorSwingUp")
    more = (word for k in names for word in ("--env-id", SWING_UP.replace("SwingUp", k)))
    printed = package.output(*command(CONTRACTS), *more, "-q", "-n", "2")
    assert re.search(r"\d\d\d passed", printed), printed
