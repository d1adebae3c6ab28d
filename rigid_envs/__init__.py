"""rigid-envs: Gymnasium environments for rigid-body rotation.

Importing the package registers its ids, ``RigidEnvs/<Name>-v0``::

    import gymnasium as gym
    import rigid_envs
    env = gym.make("RigidEnvs/BallPark-v0")
    envs = gym.make_vec("RigidEnvs/BallPark-v0", num_envs=256)
"""

import importlib
from typing import Any

import gymnasium

__all__ = ["ENVIRONMENTS", "__version__", "score"]

__version__ = "0.1.0"

ENVIRONMENTS = {
    "RigidEnvs/IntermediateAxis-v0": ("rigid_envs.tasks:IntermediateAxis", 300),
    "RigidEnvs/IntermediateAxisRandom-v0": ("rigid_envs.tasks:IntermediateAxisRandom", 300),
    "RigidEnvs/IntermediateAxisSingle-v0": ("rigid_envs.tasks:IntermediateAxisSingle", 300),
    "RigidEnvs/SpinCapture-v0": ("rigid_envs.tasks:SpinCapture", 600),
    "RigidEnvs/AxisFlip-v0": ("rigid_envs.tasks:AxisFlip", 250),
    "RigidEnvs/Detumble-v0": ("rigid_envs.tasks:Detumble", 50),
    "RigidEnvs/Reorient-v0": ("rigid_envs.tasks:Reorient", 100),
    "RigidEnvs/SleepingTop-v0": ("rigid_envs.tasks:SleepingTop", 300),
    "RigidEnvs/BallPark-v0": ("rigid_envs.tasks:BallPark", 100),
    "RigidEnvs/BallParkGoal-v0": ("rigid_envs.tasks:BallParkGoal", 100),
    "RigidEnvs/BallParkRandom-v0": ("rigid_envs.tasks:BallParkRandom", 100),
    "RigidEnvs/BallReorient-v0": ("rigid_envs.tasks:BallReorient", 100),
    "RigidEnvs/BallParkDynamic-v0": ("rigid_envs.tasks:BallParkDynamic", 100),
    "RigidEnvs/BallSteer-v0": ("rigid_envs.tasks:BallSteer", 300),
    "RigidEnvs/BallPlate-v0": ("rigid_envs.tasks:BallPlate", 200),
    "RigidEnvs/BallGrid-v0": ("rigid_envs.tasks:BallGrid", 30),
    "RigidEnvs/RollPump-v0": ("rigid_envs.tasks:RollPump", 400),
    "RigidEnvs/PivotTop-v0": ("rigid_envs.tasks:PivotTop", 400),
    "RigidEnvs/TopPrecession-v0": ("rigid_envs.tasks:TopPrecession", 400),
    "RigidEnvs/TopRandom-v0": ("rigid_envs.tasks:TopRandom", 300),
    "RigidEnvs/SleepingTopRandom-v0": ("rigid_envs.tasks:SleepingTopRandom", 300),
    "RigidEnvs/CoinPark-v0": ("rigid_envs.tasks:CoinPark", 100),
    "RigidEnvs/DiskRoll-v0": ("rigid_envs.tasks:DiskRoll", 400),
    "RigidEnvs/DiskRollRandom-v0": ("rigid_envs.tasks:DiskRollRandom", 400),
}
"""Every id with its task and its time limit in steps."""

_GOALS = {"RigidEnvs/BallParkGoal-v0", "RigidEnvs/Reorient-v0"}
"""Ids that are goal environments."""


def score(env_id: str, metric: str | None = None) -> Any:
    """The scale that maps a figure of an environment to 0 (random policy) .. 1 (anchor).

    It is called with the figure, and says in ``kind`` and ``why`` what the anchor is: "exact", a
    "bound" or a "reference" controller; see `rigid_envs.scores.anchors.Scale`.

    Args:
        env_id: The id.
        metric: Name of the metric; None takes the one that ranks policies.

    Raises:
        ValueError: no anchors for the id, or none for the metric; names those that there are.
    """
    return importlib.import_module("rigid_envs.scores.anchors").score(env_id, metric)


def _register() -> None:
    """Register all ids; again is harmless."""
    for env_id, (task, max_episode_steps) in ENVIRONMENTS.items():
        if env_id not in gymnasium.registry:
            kind = "RigidGoal" if env_id in _GOALS else "Rigid"
            gymnasium.register(
                env_id,
                entry_point=f"rigid_envs.envs:{kind}Env",
                vector_entry_point=f"rigid_envs.envs:{kind}VectorEnv",
                max_episode_steps=max_episode_steps,
                kwargs={"task": task},
                # the environments refuse bad actions and a missing reset themselves
                disable_env_checker=True,
                order_enforce=False,
            )


_register()
