"""Tasks of tops."""

from rigid_envs.systems.heavy_top.tasks.pivot_top import PivotTop
from rigid_envs.systems.heavy_top.tasks.sleeping_top import SleepingTop, SleepingTopRandom
from rigid_envs.systems.heavy_top.tasks.top_precession import TopPrecession
from rigid_envs.systems.heavy_top.tasks.top_random import TopRandom

__all__ = ["PivotTop", "SleepingTop", "SleepingTopRandom", "TopPrecession", "TopRandom"]
