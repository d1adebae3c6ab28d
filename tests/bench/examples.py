"""Figures that a benchmark run could have measured."""

from rigid_envs.tools.bench.accuracy import FreeRun, MujocoSetting
from rigid_envs.tools.bench.figures import Figures, Startup
from rigid_envs.tools.bench.measuring import Throughput

_RUNS = [
    FreeRun(0.05, 60.0, 9e-10, 1e-14, 5e-10, 3e-8),
    FreeRun(0.05, 6e3, 9e-10, 7e-14, 1e-6, 3e-6),
]
FIGURES = Figures(
    rounds=2,
    seconds=0.02,
    speeds=[
        Throughput("IntermediateAxis-v0", "made", [900e3, 1000e3]),
        Throughput("IntermediateAxis-v0", "4096", [30e6, 34e6]),
        Throughput("SleepingTop-v0", "4096", [20e6, 25e6]),
        Throughput("BallPark-v0", "4096", [5e6, 8e6]),
        Throughput("CartPole-v1", "made", [200e3, 200e3]),
        Throughput("CartPole-v1, NumPy", "4096", [24e6, 24e6]),
        Throughput("MuJoCo RK4 x 4", "4096", [40e3, 40e3]),
    ],
    mujoco=[MujocoSetting("RK4", 4, "our energy error over 6000 s", _RUNS[1])],
    runs=_RUNS,
    startups=[Startup("RigidEnvs/IntermediateAxis-v0", (6.0,), (0.7, 0.9, 0.8))],
)
