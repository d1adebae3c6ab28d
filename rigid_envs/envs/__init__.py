"""Gymnasium environments on `rigid_envs.tasks.core`: spaces, seeding, autoreset; no physics."""

from rigid_envs.envs.goal import RigidGoalEnv, RigidGoalVectorEnv
from rigid_envs.envs.single import RigidEnv
from rigid_envs.envs.vector import RigidVectorEnv

__all__ = ["RigidEnv", "RigidGoalEnv", "RigidGoalVectorEnv", "RigidVectorEnv"]
