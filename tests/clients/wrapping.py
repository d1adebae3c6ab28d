"""Every wrapper of Gymnasium, over single environments and over native rows."""

import tempfile

import gymnasium as gym
import numpy as np
from gymnasium import spaces, wrappers
from gymnasium.wrappers import vector

import rigid_envs  # noqa: F401, registers the ids

_JAX = "for environments that return arrays of JAX"
LEFT_OUT = {
    "vector": "a module, not a wrapper",
    "AtariPreprocessing": "for Atari games",
    "JaxToNumpy": _JAX,
    "JaxToTorch": _JAX,
}
"""Names of `gymnasium.wrappers` that are not for these environments, and why."""
LEFT_OUT_OF_ROWS = {
    **dict.fromkeys(("GrayscaleObservation", "ResizeObservation"), "rows observe no pictures"),
    **{name: LEFT_OUT[name] for name in ("JaxToNumpy", "JaxToTorch")},
}
"""The same of `gymnasium.wrappers.vector`."""

WITHOUT_ARGUMENTS = (
    *("FlattenObservation", "GrayscaleObservation", "NormalizeObservation", "AddRenderObservation"),
    *("ReshapeObservation", "TimeAwareObservation", "ClipAction", "NormalizeReward", "Autoreset"),
    *("PassiveEnvChecker", "OrderEnforcing", "RecordEpisodeStatistics", "RenderCollection"),
    *("HumanRendering", "ArrayConversion", "NumpyToTorch"),
)
SINGLE = {
    "DelayObservation": (1,),
    "DtypeObservation": (np.float64,),
    "DiscretizeObservation": (2, True),
    "FilterObservation": (["observation"],),
    "FrameStackObservation": (2,),
    "TransformObservation": (np.copy, None),
    "MaxAndSkipObservation": (2,),
    "ResizeObservation": ((8, 8),),
    "RescaleObservation": (-1.0, 1.0),
    "DiscretizeAction": (3,),
    "TransformAction": (np.copy, None),
    "RescaleAction": (-2.0, 2.0),
    "StickyAction": (0.25,),
    "RepeatAction": (2,),
    "ClipReward": (-1.0, 1.0),
    "TransformReward": (float,),
    "TimeLimit": (2,),
    "AddWhiteNoise": (0.5,),
    "ObstructView": (0.5, 8),
    "RecordVideo": (tempfile.gettempdir(),),
    **dict.fromkeys(WITHOUT_ARGUMENTS, ()),
}
"""Arguments of each wrapper after the environment."""
ROWS = {
    "VectorizeTransformObservation": (wrappers.FlattenObservation,),
    "VectorizeTransformAction": (wrappers.ClipAction,),
    "VectorizeTransformReward": (wrappers.TransformReward,),
    "DictInfoToList": (),
    "TransformObservation": (np.copy,),
    "TransformAction": (np.copy,),
    "TransformReward": (np.copy,),
    **{
        name: SINGLE[name]
        for name in (
            *("FilterObservation", "FlattenObservation", "ReshapeObservation"),
            *("RescaleObservation", "DtypeObservation", "NormalizeObservation", "ClipAction"),
            *("RescaleAction", "ClipReward", "NormalizeReward", "RecordEpisodeStatistics"),
            *("RecordVideo", "HumanRendering", "ArrayConversion", "NumpyToTorch"),
        )
    },
}
"""The same of native rows."""

_OF_GOALS = {"FilterObservation"}
_OF_NUMBERS = {"ClipAction", "DiscretizeAction", "RescaleAction", "VectorizeTransformAction"}
_PIXELS = {"GrayscaleObservation", "ResizeObservation"}
PICTURES = {
    *_PIXELS,
    *("AddRenderObservation", "AddWhiteNoise", "ObstructView", "RenderCollection", "RecordVideo"),
    "HumanRendering",
}
_OF_ONE_ARRAY = {
    *("DtypeObservation", "DiscretizeObservation", "TransformObservation", "MaxAndSkipObservation"),
    *("NormalizeObservation", "ReshapeObservation", "RescaleObservation"),
}


def fits(name, env_id):
    """Whether a wrapper is for the spaces of an id."""
    env = gym.make(env_id)
    goals = isinstance(env.observation_space, spaces.Dict)
    numbers = isinstance(env.action_space, spaces.Box)
    return (goals or name not in _OF_GOALS) and (numbers or name not in _OF_NUMBERS)


def wrapped(name, env_id):
    """A single environment in a wrapper."""
    env = gym.make(env_id, **_look(name))
    if name in _PIXELS:
        env = wrappers.AddRenderObservation(env)
    elif name in _OF_ONE_ARRAY and isinstance(env.observation_space, spaces.Dict):
        env = wrappers.FlattenObservation(env)
    return getattr(wrappers, name)(env, *SINGLE[name], **_settings(name, env.observation_space))


def wrapped_rows(name, env_id):
    """Three native rows in a wrapper."""
    native = "vector_entry_point"
    envs = gym.make_vec(env_id, num_envs=3, vectorization_mode=native, **_look(name))
    if name in _OF_ONE_ARRAY and isinstance(envs.single_observation_space, spaces.Dict):
        envs = vector.FlattenObservation(envs)
    space = envs.single_observation_space
    return getattr(vector, name)(envs, *ROWS[name], **_settings(name, space))


def play(env, n=3):
    """Reset and take n steps; what is observed must be of the space that the wrapper tells."""
    env.action_space.seed(0)
    seen, _ = env.reset(seed=0)
    over = False
    for _ in range(n):
        if over:
            seen, _ = env.reset()
        _check(seen, env)
        seen, reward, terminated, truncated, _ = env.step(env.action_space.sample())
        assert np.all(np.isfinite(np.asarray(reward)))
        over = terminated is True or truncated is True
    _check(seen, env)


def _check(seen, env):
    if type(seen).__module__.startswith("torch"):
        seen = seen.numpy()
    elif isinstance(seen, dict):
        seen = {key: np.asarray(value) for key, value in seen.items()}
    assert seen in env.observation_space, (seen, env.observation_space)


def _look(name):
    return {"render_mode": "rgb_array", "width": 32, "height": 32} if name in PICTURES else {}


def _settings(name, space):
    """Arguments by name, which are of the environment or import much."""
    if name == "ArrayConversion":
        import torch

        return {"env_xp": np, "target_xp": torch}
    if name == "ReshapeObservation":
        return {"shape": (1, *space.shape)}
    return {"func": abs} if name == "VectorizeTransformReward" else {}
