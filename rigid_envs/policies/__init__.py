"""Trained policies that run without torch, and those that come with the package.

::

    import rigid_envs
    policy = rigid_envs.load("BallPark")
    action, _ = policy.predict(observation)
    print(rigid_envs.evaluate("RigidEnvs/BallPark-v0", policy))
"""

from rigid_envs.policies.compiled import CompiledPolicy
from rigid_envs.policies.loading import FOLDER, load, published, read_policy, write_policy
from rigid_envs.policies.stored import StoredPolicy

__all__ = [
    "FOLDER",
    "CompiledPolicy",
    "StoredPolicy",
    "load",
    "published",
    "read_policy",
    "write_policy",
]
