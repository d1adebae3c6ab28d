"""Gymnasium environments on `rigid_envs.tasks.core`: spaces, seeding, autoreset; no physics."""

from rigid_envs.envs.shells import RigidEnv, RigidGoalEnv, RigidGoalVectorEnv, RigidVectorEnv

__all__ = ["RigidEnv", "RigidGoalEnv", "RigidGoalVectorEnv", "RigidVectorEnv"]
