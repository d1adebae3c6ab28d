"""What anybody can do who has the wheel and no checkout.

The wheel is installed into an environment of its own. The packages that it needs are those of the
environment of the tests, where nothing of a checkout is found.
"""

import os
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

pytest.importorskip("stable_baselines3")
pytest.importorskip("minari")

ROOT = Path(__file__).parents[1]
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


def run(*command: str | Path, cwd: Path) -> str:
    """Runs a command away from any checkout; fails with what it printed."""
    away = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run(
        [str(word) for word in command],
        cwd=cwd,
        env=away | {"MINARI_DATASETS_PATH": str(cwd / "sets")},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    return done.stdout


@pytest.fixture(scope="module")
def programs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The programs of an environment that has the wheel."""
    folder = tmp_path_factory.mktemp("alone")
    python = folder / "venv" / "bin" / "python"
    build = ("-m", "hatchling", "build", "--target", "wheel", "--directory", folder / "dist")
    run(sys.executable, *build, cwd=ROOT)
    (wheel,) = (folder / "dist").iterdir()
    run(sys.executable, "-m", "venv", folder / "venv", cwd=folder)
    run(python, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", wheel, cwd=folder)
    (site,) = (folder / "venv").glob("lib/python*/site-packages")
    # packages of that folder are found, but not what its own .pth files lead to: the checkout
    (site / "dependencies.pth").write_text(sysconfig.get_paths()["purelib"] + "\n")
    return python.parent


@pytest.mark.long
def test_it_trains_exports_evaluates_ranks_and_collects(programs: Path, tmp_path: Path) -> None:
    (tmp_path / "rows").mkdir()
    run(programs / "python", "-P", "-c", SCRIPT, cwd=tmp_path)
    command = programs / "rigid-envs"
    own = ("--policy", "policy.safetensors")
    out = ("--name", "mine", "--out", "rows/mine.json")
    run(command, "evaluate", "Detumble", *own, *out, cwd=tmp_path)
    page = run(command, "leaderboard", "rows", cwd=tmp_path)
    for name in ("ppo reduced", "reference controller", "mine"):
        assert f"| {name} | 1 |" in page
    assert (tmp_path / "rows" / "leaderboard.png").read_bytes().startswith(b"\x89PNG")
    told = run(command, "dataset", "Detumble", *own, "--episodes", "3", cwd=tmp_path)
    name = told.split()[1]
    assert "3 episodes" in run(command, "dataset", "--check", name, cwd=tmp_path)
