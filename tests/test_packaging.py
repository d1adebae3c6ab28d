"""What is installed: the wheel carries the library and its configs, and nothing else."""

import os
import re
import subprocess
import sys
import sysconfig
import tarfile
import zipfile
from email.parser import HeaderParser
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement

import rigid_envs
from rigid_envs.scores.trained import published
from tests.programs import printed

ROOT = Path(__file__).parents[1]


def build(target, source, out):
    """Builds the "wheel" or "sdist" of `source` with the build backend itself: no network."""
    printed("-m", "hatchling", "build", "--target", target, "--directory", out, cwd=source)
    (built,) = out.iterdir()
    return built


def files_of(wheel):
    with zipfile.ZipFile(wheel) as archive:
        return set(archive.namelist())


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    return build("wheel", ROOT, tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def metadata(wheel):
    (name,) = (f for f in files_of(wheel) if f.endswith(".dist-info/METADATA"))
    with zipfile.ZipFile(wheel) as archive:
        return HeaderParser().parsestr(archive.read(name).decode())


def test_wheel_holds_the_library_its_data_and_nothing_else(wheel):
    files = files_of(wheel)
    top_level = {name.split("/")[0] for name in files}
    assert top_level == {"rigid_envs", f"rigid_envs-{rigid_envs.__version__}.dist-info"}
    modules = {p.relative_to(ROOT).as_posix() for p in ROOT.glob("rigid_envs/**/*.py")}
    configs = {f"rigid_envs/{p.relative_to(ROOT)}" for p in ROOT.glob("configs/**/*.yaml")}
    stems = [f"rigid_envs/scores/published/{name}" for name in published()]
    policies = {stem + end for stem in stems for end in (".safetensors", ".json")}
    viewer = "rigid_envs/watch/replays/viewer"
    others = {"rigid_envs/py.typed", "rigid_envs/tools/pages/common.md", f"{viewer}/viewer.html"}
    assert configs and policies
    assert modules | configs | policies | others | {f"{viewer}/THREE-LICENSE.txt"} <= files
    assert not [name for name in files if "node_modules" in name or "/scores/plans" in name]
    assert wheel.stat().st_size <= 4_000_000


def test_metadata_states_version_python_four_packages_and_extras(metadata):
    assert metadata["Version"] == rigid_envs.__version__
    assert metadata["Requires-Python"] == ">=3.11"
    extras = {"control", "dataset", "docs", "train", "render", "sweep", "test", "dev"}
    assert set(metadata.get_all("Provides-Extra", [])) == extras
    requirements = [Requirement(line) for line in metadata.get_all("Requires-Dist", [])]
    base = {r.name: r.specifier for r in requirements if "extra" not in str(r.marker)}
    assert set(base) == {"gymnasium", "numpy", "scipy", "numba"}
    assert base["gymnasium"] == Requirement("gymnasium>=1.2,<2").specifier


def test_every_promised_python_is_tested_and_the_citation_is_of_this_version(metadata):
    kinds = metadata.get_all("Classifier", [])
    promised = {kind.rpartition(" ")[2] for kind in kinds if ":: Python :: 3." in kind}
    workflow = yaml.safe_load((ROOT / ".github/workflows/ci.yml").read_text())
    assert promised == set(workflow["jobs"]["tests"]["strategy"]["matrix"]["python"])
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert str(citation["version"]) == rigid_envs.__version__
    urls = [line.split(", ") for line in metadata.get_all("Project-URL", [])]
    assert dict(urls)["Repository"] == citation["repository-code"]


def test_links_of_the_readme_lead_somewhere_in_the_repository_and_on_pypi(metadata):
    readme, shown = (ROOT / "README.md").read_text(), str(metadata.get_payload())
    link = r'(?:\]\(|src=")([^)#"\s]+)'
    here = [each for each in re.findall(link, readme) if not each.startswith("http")]
    assert here and all((ROOT / each).exists() for each in here)
    there = re.findall(link, shown)
    assert len(there) == len(re.findall(link, readme))
    assert all(each.startswith("https://") for each in there)
    ends = [f"/main/{each}" for each in here]
    assert all(any(each.endswith(end) for each in there) for end in ends)


THEIRS = {"agents/__init__.py": "owner = 'openai-agents'\n", "agents/tool.py": "x = 1\n"}


@pytest.fixture(scope="module")
def site(wheel, tmp_path_factory):
    """Where the wheel was installed beside a package of others."""
    folder = tmp_path_factory.mktemp("site")
    (folder / "agents").mkdir()
    for name, text in THEIRS.items():
        (folder / name).write_text(text)
    options = ("--no-deps", "--no-index", "--no-compile", "--upgrade", "--quiet")
    # as pip does over what is there: `--upgrade` is what lets it replace a folder
    printed("-m", "pip", "install", *options, "--target", folder, wheel, cwd=folder)
    return folder


def test_installing_leaves_another_package_named_agents_untouched(site):
    found = {p.relative_to(site).as_posix(): p for p in site.glob("agents/*.py")}
    assert {name: path.read_text() for name, path in found.items()} == THEIRS


def test_installed_library_imports_alone_and_without_heavy_packages(site, tmp_path):
    heavy = (
        *("torch", "stable_baselines3", "matplotlib", "panda3d", "pygame", "agents", "casadi"),
        *("pytest", "hypothesis", "rigid_envs.testing"),
    )
    report = (
        "import sys, rigid_envs; print(rigid_envs.__file__); "
        f"print([name for name in {heavy} if name in sys.modules])"
    )
    # -P: the working directory is no place to import from; PYTHONPATH precedes any checkout.
    out = printed("-P", "-c", report, cwd=tmp_path, PYTHONPATH=str(site))
    assert out.splitlines() == [str(site / "rigid_envs" / "__init__.py"), "[]"]


@pytest.mark.long
def test_contract_tests_run_from_the_installed_library(site, tmp_path):
    command = ("-P", "-m", "rigid_envs.testing", "-q", "-k", "repr_names")
    ids = ("--env-id", "RigidEnvs/BallPark-v0", "--env-id", "RigidEnvs/BallGrid-v0")
    for workers in ((), ("-n", "2")):
        out = printed(*command, *ids, *workers, cwd=tmp_path, PYTHONPATH=str(site))
        assert "2 passed" in out, out


@pytest.mark.long
@pytest.mark.push
def test_wheel_built_from_the_sdist_is_the_wheel_built_from_the_checkout(wheel, tmp_path):
    sdist = build("sdist", ROOT, tmp_path / "sdist")
    with tarfile.open(sdist) as archive:
        safe = {"filter": "data"} if hasattr(tarfile, "data_filter") else {}  # not in 3.11.2
        archive.extractall(tmp_path, **safe)
    source = tmp_path / sdist.name.removesuffix(".tar.gz")
    assert (source / "tests").is_dir()
    assert files_of(build("wheel", source, tmp_path / "wheel")) == files_of(wheel)


SCRIPT = """
import importlib.util
import sys

import rigid_envs

assert sys.prefix in rigid_envs.__file__, rigid_envs.__file__
assert importlib.util.find_spec("agents") is None
loaded = {"torch", "stable_baselines3", "matplotlib", "minari", "h5py"} & set(sys.modules)
assert not loaded, loaded

published = rigid_envs.load("Detumble")
found = rigid_envs.evaluate("Detumble", published)
assert found.success.mean == 1.0
found.save("rows/published.json")
found = rigid_envs.evaluate("Detumble", rigid_envs.reference("Detumble"))
assert found.success.mean == 1.0
found.save("rows/reference.json")
assert "torch" not in sys.modules

from stable_baselines3 import PPO

from rigid_envs.sb3 import export, make_vec_env

venv = make_vec_env("Detumble", n_envs=16, seed=0)
model = PPO("MlpPolicy", venv, n_steps=50, batch_size=200, gamma=0.9, seed=0)
before = rigid_envs.evaluate("Detumble", model, n=50).values["return"].mean()
model.learn(16_000)
found = rigid_envs.evaluate("Detumble", model, n=50)
assert found.values["return"].mean() > before, (before, found)
found.save("rows/trained.json")
policy = rigid_envs.load(export(model, "policy.safetensors"))
again = rigid_envs.evaluate("Detumble", policy, n=50, name="exported")
assert abs(again.values["return"].mean() - found.values["return"].mean()) < 1e-3
"""


def away(*command, cwd):
    """What a command prints away from any checkout; fails with what it printed."""
    kept = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run(
        [str(word) for word in command],
        cwd=cwd,
        env=kept | {"MINARI_DATASETS_PATH": str(cwd / "sets")},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    return done.stdout


@pytest.fixture(scope="module")
def programs(wheel, tmp_path_factory):
    """The programs of an environment of its own that has the wheel.

    The packages that it needs are those of the environment of the tests, where nothing of a
    checkout is found.
    """
    folder = tmp_path_factory.mktemp("alone")
    python = folder / "venv" / "bin" / "python"
    away(sys.executable, "-m", "venv", folder / "venv", cwd=folder)
    away(python, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", wheel, cwd=folder)
    (site,) = (folder / "venv").glob("lib/python*/site-packages")
    # packages of that folder are found, but not what its own .pth files lead to: the checkout
    (site / "dependencies.pth").write_text(sysconfig.get_paths()["purelib"] + "\n")
    return python.parent


@pytest.mark.push
@pytest.mark.long
def test_it_trains_exports_evaluates_ranks_and_collects(programs, tmp_path):
    pytest.importorskip("stable_baselines3")
    pytest.importorskip("minari")
    (tmp_path / "rows").mkdir()
    away(programs / "python", "-P", "-c", SCRIPT, cwd=tmp_path)
    command = programs / "rigid-envs"
    own = ("--policy", "policy.safetensors")
    out = ("--name", "mine", "--out", "rows/mine.json")
    away(command, "evaluate", "Detumble", *own, *out, cwd=tmp_path)
    page = away(command, "leaderboard", "rows", cwd=tmp_path)
    for name in ("ppo reduced", "reference controller", "mine"):
        assert f"| {name} | 1 |" in page
    assert (tmp_path / "rows" / "leaderboard.png").read_bytes().startswith(b"\x89PNG")
    told = away(command, "dataset", "Detumble", *own, "--episodes", "3", cwd=tmp_path)
    name = told.split()[1]
    assert "3 episodes" in away(command, "dataset", "--check", name, cwd=tmp_path)
