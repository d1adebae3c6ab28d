"""The figures of one benchmark run."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from rigid_envs.bench.accuracy import FreeRun
from rigid_envs.bench.costs import Cost, costs
from rigid_envs.bench.interleaved import Throughput
from rigid_envs.bench.mujoco_body import MujocoSetting
from rigid_envs.bench.ratios import Ratio, ratios
from rigid_envs.bench.startup import Startup

__all__ = ["Figures"]


@dataclass(frozen=True)
class Figures:
    """All measurements of a run, and what is computed from them.

    Attributes:
        rounds: rounds of the interleaved timing.
        seconds: aimed time of a workload per round [s].
        speeds: throughput of every workload.
        mujoco: settings of the MuJoCo body; empty if MuJoCo is not installed.
        runs: errors of torque-free runs.
        startups: times from import to first step.
    """

    rounds: int
    seconds: float
    speeds: Sequence[Throughput]
    mujoco: Sequence[MujocoSetting]
    runs: Sequence[FreeRun]
    startups: Sequence[Startup]

    @property
    def costs(self) -> list[Cost]:
        """Time per step of every environment, against the median of all."""
        return costs(self.speeds)

    @property
    def ratios(self) -> list[Ratio]:
        """Speed against the peers."""
        return ratios(self.speeds, self.mujoco)

    def as_json(self) -> dict[str, Any]:
        """JSON values, with every sample."""
        return {
            "rounds": self.rounds,
            "seconds_per_turn": self.seconds,
            "steps_per_second": [
                {**asdict(s), "median": s.median, "quartiles": s.quartiles} for s in self.speeds
            ],
            "mujoco": [{"name": setting.name, **asdict(setting)} for setting in self.mujoco],
            "costs": [asdict(cost) for cost in self.costs],
            "accuracy": [asdict(run) for run in self.runs],
            "import_to_first_step": [asdict(startup) for startup in self.startups],
            "ratios": [asdict(ratio) for ratio in self.ratios],
        }
