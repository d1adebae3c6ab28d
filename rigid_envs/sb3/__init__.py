"""Stable-Baselines3: environments as it takes them, and its models as policies without it.

::

    from stable_baselines3 import PPO
    from rigid_envs.sb3 import export, make_vec_env

    model = PPO("MlpPolicy", make_vec_env("BallPark", n_envs=256))
    model.learn(1_000_000)
    export(model, "policy.safetensors")  # for rigid_envs.load, without torch

Everything else of `rigid_envs` works without Stable-Baselines3.
"""

try:
    import stable_baselines3  # noqa: F401
except ImportError as error:
    raise ImportError(
        f'rigid_envs.sb3 needs Stable-Baselines3: pip install "rigid-envs[train]" ({error})'
    ) from error

from rigid_envs.sb3.adapter import GymnasiumVecEnv, NonFiniteError, make_vec_env
from rigid_envs.sb3.exporting import export
from rigid_envs.sb3.loading import load_model, to_onnx, to_torch

__all__ = ["GymnasiumVecEnv", "NonFiniteError", "export", "load_model", "make_vec_env"]
__all__ += ["to_onnx", "to_torch"]
