"""What an environment is made with: its registration, its time limit, its frame."""

import importlib
import pickle
import re
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

import rigid_envs
from rigid_envs.base.checks import ConfigError
from rigid_envs.envs.shells import RigidEnv, RigidVectorEnv
from rigid_envs.systems.rolling_ball.tasks.ball_park import BallPark
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.testing.environments import OWN as IDS
from rigid_envs.testing.environments import fresh
from rigid_envs.tools.pages.writing import with_tables
from tests.programs import printed

# Importing the package registers its ids with Gymnasium.


def test_import_registers_every_id_under_the_namespace_and_again_changes_nothing():
    assert {name for name in gym.registry if name.startswith("RigidEnvs/")} == set(IDS)
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
    assert printed("-W", "error", "-c", code) == "RigidEnvs/BallPark-v0 RigidVectorEnv\n"


STEP = """
import gymnasium, rigid_envs
env = gymnasium.make("RigidEnvs/BallPark-v0")
env.reset(seed=0)
env.step(env.action_space.sample())
"""


@pytest.mark.long
@pytest.mark.push
@pytest.mark.parametrize(
    "code",
    [STEP, "import rigid_envs.tools.cli.command_line", "import agents.cli.command_line"],
    ids=["step", "rigid-envs", "agents"],
)
def test_a_step_and_a_command_import_only_what_they_take(code):
    slow = {"scipy.optimize", "scipy.integrate", "scipy.interpolate", "torch", "matplotlib", "PIL"}
    told = f"{code}\nimport sys\nprint(*{slow | {'panda3d'}} & set(sys.modules))"
    assert printed("-c", told) == "\n"


# The time limit in force enters the stability check.


LONG = 1000  # steps; the registered limit of Reorient is 100
FULL = np.ones(3, dtype=np.float32)
REORIENT = "rigid_envs.systems.free_body.tasks:Reorient"


@pytest.mark.parametrize("env_id", ENVIRONMENTS)
def test_the_registered_limit_is_within_the_envelope_and_rates_grow_with_the_duration(env_id):
    task = gym.make(env_id).unwrapped.task
    limit = ENVIRONMENTS[env_id].max_episode_steps
    rates = [task.largest_rate(n * task.dt) for n in (0, limit // 2, limit, 10 * limit)]
    assert rates == sorted(rates)
    assert rates[2] * task.dt / task.n_substeps <= task.largest_turn
    assert task.stable_steps() >= limit


def test_a_vector_environment_refuses_a_limit_that_leaves_the_envelope():
    with pytest.raises(ConfigError, match=r"^config\.dt: .*1000 steps .*n_substeps >= \d+$"):
        gym.make_vec("RigidEnvs/Reorient-v0", num_envs=2, max_episode_steps=LONG)
    remedy = {"n_substeps": 20}
    gym.make_vec("RigidEnvs/Reorient-v0", num_envs=2, max_episode_steps=LONG, **remedy)


def test_a_single_environment_refuses_the_step_that_leaves_the_envelope():
    env = gym.make("RigidEnvs/Reorient-v0", max_episode_steps=LONG)
    task = env.unwrapped.task
    stable = task.stable_steps()
    assert 100 < stable < LONG
    env.reset(seed=0)
    for _ in range(stable):
        env.step(FULL)
    before = env.unwrapped.get_state()
    with pytest.raises(ConfigError, match=rf"elapsed = {stable} steps; expected a reset before"):
        env.step(FULL)
    for name, part in env.unwrapped.get_state().items():
        np.testing.assert_array_equal(part, before[name])
    env.reset()
    env.step(FULL)  # a new episode is as long as any


def test_a_clock_that_is_set_counts_in_rows_without_a_limit_too():
    for env in (RigidEnv(REORIENT), RigidVectorEnv(REORIENT, 2)):
        state, last = fresh(env).get_state(), env.task.stable_steps()
        action = np.ones(env.action_space.shape, dtype=np.float32)
        for first in (env.task.registered_steps(), last - 1):
            np.atleast_2d(state["clock"])[0, 3] = first  # of one row
            env.set_state(state)
            for _ in range(first, last):
                env.step(action)
            with pytest.raises(ConfigError, match="expected a reset before"):
                env.step(action)


def test_the_longest_limit_is_played_to_its_end_and_on():
    longest = RigidEnv(REORIENT).task.stable_steps()
    envs = fresh(RigidVectorEnv(REORIENT, 2, max_episode_steps=longest))
    still = np.zeros((2, 3), dtype=np.float32)
    ends = [envs.step(still)[3].all() for _ in range(longest + 2)]
    assert [k for k, end in enumerate(ends) if end] == [longest - 1]


def test_what_nothing_can_make_faster_goes_on_for_ever():
    env = RigidEnv("rigid_envs.systems.rolling_ball.tasks:BallPark")
    assert env.task.stable_steps() == 2**31
    env.reset(seed=0)
    for _ in range(250):
        env.step(np.zeros(2, dtype=np.float32))


@pytest.mark.parametrize("name", ["IntermediateAxis", "IntermediateAxisRandom", "SleepingTop"])
def test_beyond_the_envelope_of_the_system_the_energy_stays_bounded(name):
    # these tasks allow more than their system: rates of full torque until the end of the episode
    env_id = f"RigidEnvs/{name}-v0"
    envs = gym.make_vec(env_id, num_envs=64, max_episode_steps=2001, n_substeps=1, torque=1e-3)
    task = envs.unwrapped.task
    rate = task.largest_turn / task.dt
    rng = np.random.default_rng(0)
    axes, moments = rng.normal(size=(64, 3)), envs.unwrapped.task.system().moments
    turns = [np.linalg.norm(rates, axis=1) for rates in (axes, axes * moments / moments[1])]
    omega = 0.8 * rate * axes / np.max(turns, axis=0)[:, None]  # drawn moments differ
    envs.reset(seed=0, options={"state": {"omega_body": omega}})
    systems = envs.unwrapped.systems
    states = []
    for _ in range(2000):
        envs.step(np.zeros(envs.action_space.shape, dtype=np.float32))
        states.append(envs.unwrapped.y)
    y = np.array(states)
    energies = np.stack([s.invariants(y[:, k])["energy"] for k, s in enumerate(systems)], axis=1)
    first, last = energies[:200], energies[-200:]
    scale = np.abs(first).mean(axis=0)
    # bounded: what is seen in the first 200 steps is seen in the last 200, and no more
    assert np.max(np.abs(last - first.mean(axis=0)) / scale) < 2 * max(
        np.max(np.abs(first - first.mean(axis=0)) / scale), 1e-6
    )


# The frame of observations and actions, as a user asks for it.


PAGE = Path(__file__).parents[2] / "docs" / "symmetry.md"
PARK, GOAL = "RigidEnvs/BallPark-v0", "RigidEnvs/BallParkGoal-v0"


class NoReduction(BallPark):
    """Park the ball of a task that declares no symmetry."""

    reduction = None


def test_the_examples_of_the_page_run(capsys):
    blocks = re.findall(r"```python\n(.+?)```", PAGE.read_text(), flags=re.DOTALL)
    for block in blocks:
        exec(block, {})
    told = capsys.readouterr().out
    assert len(blocks) == 2
    assert told.startswith("False\nTrue\nturn about the vertical")


def test_the_table_of_groups_is_that_of_the_tasks():
    text = PAGE.read_text()
    assert text == with_tables(text), (
        "write it anew: python -m rigid_envs.tools.pages docs/symmetry.md"
    )


def test_rotation_has_no_effect_in_the_reduced_frame():
    spaces = {
        str(gym.make(PARK, frame="reduced", rotation=shown).observation_space)
        for shown in ("matrix", "quat", "none")
    }
    assert len(spaces) == 1


def test_delayed_actions_go_on_in_the_other_frame():
    # the history of actions is that of the task, whatever is shown
    shown = ({}, {"frame": "reduced"}, {"rotation": "quat"})
    worlds = [gym.make(PARK, action_delay=2, **settings).unwrapped for settings in shown]
    first = worlds[0]
    for env in worlds:
        env.reset(seed=1)
    for _ in range(3):
        first.step(np.array([0.5, -0.25], dtype=np.float32))
    state = first.get_state()
    rest = np.zeros(2, dtype=np.float32)
    first.step(rest)
    for env in worlds[1:]:
        env.set_state(state)
        env.step(rest)
        for name, part in first.get_state().items():
            np.testing.assert_array_equal(env.get_state()[name], part)


def test_a_task_without_symmetries_refuses_the_reduced_frame():
    task = NoReduction()
    assert task.frame == "world"
    with pytest.raises(ConfigError, match=r"config\.frame: .*NoReduction has no reduction"):
        NoReduction(frame="reduced")


def test_an_environment_in_the_reduced_frame_pickles():
    env = fresh(gym.make(PARK, frame="reduced").unwrapped)
    copy = pickle.loads(pickle.dumps(env))
    action = np.array([0.3, 0.4], dtype=np.float32)
    np.testing.assert_array_equal(env.step(action)[0], copy.step(action)[0])
