"""Importing the package registers its ids with Gymnasium."""

import importlib
import subprocess
import sys

import gymnasium as gym
import pytest

import rigid_envs
from rigid_envs.testing.environments import OWN as IDS


def test_import_registers_every_id_under_the_namespace():
    registered = {name for name in gym.registry if name.startswith("RigidEnvs/")}
    assert registered == set(IDS)


def test_registration_again_changes_nothing():
    before = {env_id: gym.registry[env_id] for env_id in IDS}
    importlib.reload(rigid_envs)
    assert {env_id: gym.registry[env_id] for env_id in IDS} == before
    assert all(gym.registry[env_id] is before[env_id] for env_id in IDS)


def test_make_with_the_module_in_the_id_imports_the_package():
    code = (
        "import gymnasium as gym\n"
        "env = gym.make('rigid_envs:RigidEnvs/BallPark-v0')\n"
        "envs = gym.make_vec('rigid_envs:RigidEnvs/BallPark-v0', num_envs=2)\n"
        "print(env.spec.id, type(envs).__name__)\n"
    )
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=False
    )
    assert done.stdout == "RigidEnvs/BallPark-v0 RigidVectorEnv\n", done.stderr


STEP = """
import gymnasium, rigid_envs
env = gymnasium.make("RigidEnvs/BallPark-v0")
env.reset(seed=0)
env.step(env.action_space.sample())
"""


@pytest.mark.parametrize(
    "code",
    [STEP, "import rigid_envs.tools.cli.command_line", "import agents.cli.command_line"],
    ids=["step", "rigid-envs", "agents"],
)
def test_a_step_and_a_command_import_only_what_they_take(code: str) -> None:
    slow = {"scipy.optimize", "scipy.integrate", "scipy.interpolate", "torch", "matplotlib", "PIL"}
    told = f"{code}\nimport sys\nprint(*{slow | {'panda3d'}} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", told], capture_output=True, text=True, check=True)
    assert done.stdout == "\n"
