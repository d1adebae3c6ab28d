"""What the contracts tell the author of an environment in another package."""

from functools import partial
from pathlib import Path
from subprocess import CompletedProcess

import pytest

from tests.programs import python

ROOT = Path(__file__).parents[2]
# Its "v" is no rate, as names of ours would have it; two of its settings are nearly spelt alike;
# its episodes end early, which nothing says.
PUMP = '''
from dataclasses import dataclass
from typing import ClassVar

import rigid_envs
from rigid_envs.extending import Number, refusal, setting
from rigid_envs.systems import Roller
from rigid_envs.systems.roller.tasks import RollPump


class Valley(Roller):
    components: ClassVar = {"v": slice(0, 1), "speed": slice(1, 2)}


@dataclass(frozen=True)
class Pump(RollPump):
    """Pump a roller whose components have other names.

    It is a `RollPump`.
    """

    dt: float = 1.0
    n_substeps: int = 20
    start_part: float = 0.99
    beta_change: float = 3.0
    least_goal: float = setting(0.5, Number("least goal", "m", 0.0, 10.0))
    largest_goal: float = setting(1.0, Number("largest goal", "m", 0.0, 10.0))
    system_type: ClassVar = Valley

    def check_settings(self) -> None:
        super().check_settings()
        if self.least_goal > self.largest_goal:
            most = f"at most largest_goal = {self.largest_goal}"
            raise refusal("least_goal", self.least_goal, most)


rigid_envs.register("Pumps/Pump-v0", task="pumps:Pump", max_episode_steps=100)
'''
TOGETHER = """
import gymnasium
for least in (1.0, 1.5):
    gymnasium.make("pumps:Pumps/Pump-v0", least_goal=least)
"""

RECORDED = """
import gymnasium
from rigid_envs.watch.replays import RecordReplay
env = RecordReplay(gymnasium.make("pumps:Pumps/Pump-v0"), "pump.npz")
env.reset(seed=0)
env.step(env.action_space.low)
env.close()
"""


@pytest.fixture(scope="module")
def outside(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("outside")
    (folder / "pumps.py").write_text(PUMP, encoding="utf-8")
    return folder


def beside(folder: Path, *words: str) -> CompletedProcess[str]:
    return python(*words, cwd=folder, PYTHONPATH=f"{folder}:{ROOT}")


@pytest.mark.long
@pytest.mark.push
def test_another_package_is_told_what_to_declare_and_what_takes_long(outside: Path) -> None:
    words = ("-m", "rigid_envs.testing", "--env-id", "pumps:Pumps/Pump-v0", "-q")
    told = beside(outside, *words, "-rN", "-k", "envelope or can_end or misspelt")
    # starts outside the envelope are refused, misspellings found; of early ends two contracts tell
    assert "2 failed, 3 passed" in told.stdout, told.stdout
    ask = "Error: early_end = {} of Pumps/Pump-v0; expected settings under which random actions end"
    assert told.stdout.count(ask) == 2
    assert "did not. It is an argument of rigid_envs.register" in told.stdout
    first, second = (line for line in told.stderr.splitlines() if "rigid-envs: " in line)
    assert first.endswith(
        "where they are kept: Pumps/Pump-v0 as it is; Pumps/Pump-v0 {'observation_noise': 0.02, "
        "'action_delay': (0, 3)}; Pumps/Pump-v0 {'frame': 'reduced'}"
    )
    assert " s for the first; about " in second


def test_settings_that_depend_on_one_another_are_refused_by_key(outside: Path) -> None:
    told = beside(outside, "-c", TOGETHER)
    last = told.stderr.splitlines()[-1]
    assert last.endswith("config.least_goal: least_goal = 1.5; expected at most largest_goal = 1.0")


@pytest.mark.long
@pytest.mark.push
def test_a_replay_is_read_where_its_module_is_allowed_and_only_there(outside: Path) -> None:
    run = partial(beside, outside)
    assert run("-c", RECORDED).returncode == 0
    words = ("-m", "rigid_envs.tools.cli", "replay", "pump.npz")
    refused, allowed = run(*words), run(*words, "--allow-import", "pumps")
    assert refused.returncode == 2 and "with --allow-import MODULE those of" in refused.stderr
    assert allowed.returncode == 0 and "same bits" in allowed.stdout
    assert run(*words, "--allow-import", "pomps").stderr == "rigid-envs: No module named 'pomps'\n"
