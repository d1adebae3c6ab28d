"""Infos of a vector environment: one array over the rows for each key."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.envs.task_spaces import info_keys, info_numbers
from rigid_envs.tasks import Task

__all__ = ["blank_infos", "keep_final"]


def blank_infos(task: Task, num_envs: int) -> dict[str, Any]:
    """Infos of a reset: zeros, of the types that a step gives."""
    numbers = info_numbers(task)
    return {
        key: np.zeros(num_envs, dtype=np.float64 if key in numbers else np.bool_)
        for key in info_keys(task)
    }


def keep_final(
    infos: dict[str, Any],
    keys: Sequence[str],
    ended: npt.NDArray[np.bool_],
    observations: npt.NDArray[np.float32],
) -> None:
    """Move the infos of rows that ended to `final_info`, and add their last observations.

    Args:
        infos: changed: those of the rows are zero.
        keys: of the infos.
        ended: the rows, shape (N,).
        observations: last observations, shape (N, n).
    """
    infos["final_info"] = {
        **{key: np.where(ended, infos[key], 0).astype(infos[key].dtype) for key in keys},
        **{f"_{key}": ended for key in keys},
    }
    infos["final_obs"] = observations
    infos["_final_obs"] = infos["_final_info"] = ended
    for key in keys:
        infos[key][ended] = 0
