"""Importing the package registers its ids with Gymnasium."""

import importlib
import subprocess
import sys

import gymnasium as gym

import rigid_envs
from rigid_envs.testing.selection import OWN as IDS


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


def test_a_step_imports_only_what_it_takes() -> None:
    code = (
        "import sys, gymnasium, rigid_envs\n"
        "env = gymnasium.make('RigidEnvs/BallPark-v0')\n"
        "env.reset(seed=0)\n"
        "env.step(env.action_space.sample())\n"
        "slow = {'scipy.optimize', 'scipy.integrate', 'torch', 'matplotlib', 'PIL', 'panda3d'}\n"
        "assert not slow & set(sys.modules), slow & set(sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
