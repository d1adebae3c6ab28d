"""Infos of a vector environment: one array over the rows for each key."""

from operator import itemgetter
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.core import Core
from rigid_envs.envs.task_spaces import info_flags, info_keys, info_numbers
from rigid_envs.kernels.layout import FLAGS

__all__ = ["Infos"]

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

# rows of an array: a third of the time that it takes to iterate over it
_flags_by_row = itemgetter(*range(len(FLAGS)))


class Infos:
    """Infos of the rows of a `Core`, each with a mask in which all rows are set."""

    def __init__(self, core: Core) -> None:
        """Prepare keys and masks."""
        self._core = core
        self._numbers, self._flags = info_numbers(core.task), info_flags(core.task)
        self._keys = info_keys(core.task)
        everywhere = np.ones(core.n_rows, dtype=np.bool_)
        everywhere.flags.writeable = False
        self._masks: dict[str, Any] = {f"_{key}": everywhere for key in self._keys}
        self._blank = dict.fromkeys(self._keys) | self._masks
        self._results_by_row = itemgetter(*range(len(self._numbers) + 1))

    def of_reset(self) -> dict[str, Any]:
        """Zeros, of the types that a step gives."""
        zeros: dict[str, Any] = {
            key: np.zeros(self._core.n_rows, dtype=np.float64 if key in self._numbers else np.bool_)
            for key in self._keys
        }
        return {**zeros, **self._masks}

    def of_step(self) -> tuple[Array, Bools, Bools, dict[str, Any]]:
        """Rewards, terminated, truncated and infos of the last step."""
        results, _, all_flags = self._core.outputs
        numbers = self._results_by_row(results)  # the last one is the reward
        terminated, truncated, *flags = _flags_by_row(all_flags)
        infos = self._blank.copy()
        for key, number in zip(self._numbers, numbers):  # noqa: B905 - ends with the keys
            infos[key] = number
        for key, flag in zip(self._flags, flags):  # noqa: B905 - ends with the keys
            infos[key] = flag
        return numbers[-1], terminated, truncated, infos

    def now(self) -> dict[str, Any]:
        """Infos of the last step; those of rows that have begun an episode since are zero."""
        self._core.renew_outputs()  # the old ones are with who has made the last step
        *_, infos = self.of_step()
        self._clear(infos, self._core.elapsed == 0.0)
        return infos

    def keep_final(self, infos: dict[str, Any], ended: Bools) -> None:
        """Move the infos of rows that ended to `final_info`, and add their last observations.

        Args:
            infos: changed: those of the rows are zero.
            ended: the rows, shape (N,).
        """
        infos["final_info"] = {
            **{key: np.where(ended, infos[key], 0).astype(infos[key].dtype) for key in self._keys},
            **{f"_{key}": ended for key in self._keys},
        }
        infos["final_obs"] = self._core.observations.copy()
        infos["_final_obs"] = infos["_final_info"] = ended
        self._clear(infos, ended)

    def _clear(self, infos: dict[str, Any], rows: Bools) -> None:
        for key in self._keys:
            infos[key][rows] = 0
