"""Environments for Stable-Baselines3."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from numpy.typing import NDArray
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import base_vec_env as base

from rigid_envs.base.checks import as_array, require, safe_repr
from rigid_envs.envs.lookup import checked_id
from rigid_envs.envs.spaces import seeds_of
from rigid_envs.scores.evaluation import make_rows

# Infos of some rows, from Gymnasium's one dictionary of arrays.


def split(columns: Mapping[str, Any], rows: NDArray[np.intp]) -> list[dict[str, Any]]:
    """One dictionary for each of some rows.

    Args:
        columns: Info entries over all rows, each with its mask `_key` where not every row has it.
        rows: Indices of the rows, shape (k,).

    Returns:
        k dictionaries of Python scalars and copied arrays.
    """
    keys = [key for key in columns if not (key.startswith("_") and key[1:] in columns)]
    if not keys:
        return [{} for _ in rows]
    values = zip(*[rows_of(columns[key], rows) for key in keys], strict=True)
    infos = [dict(zip(keys, row, strict=True)) for row in values]
    for key in keys:
        mask = columns.get(f"_{key}")
        if mask is not None and not mask[rows].all():
            for info, there in zip(infos, mask[rows].tolist(), strict=True):
                if not there:
                    del info[key]
    return infos


def rows_of(column: Any, rows: NDArray[np.intp]) -> list[Any]:
    """Some rows of one info entry.

    Args:
        column: Array over the rows, shape (N, ...), or a dictionary of such.
        rows: Indices of the rows, shape (k,).

    Returns:
        k Python scalars, copied arrays, or dictionaries of them.
    """
    if isinstance(column, dict):
        return split(column, rows)
    picked = np.asarray(column)[rows]
    return picked.tolist() if picked.ndim == 1 else list(picked)


# Checks of arrays for NaN and infinity, which stop a run before they reach the weights.


class NonFiniteError(FloatingPointError):
    """A reward, an observation or a gradient is NaN or infinite."""


def all_finite(arrays: NDArray[Any] | Mapping[str, NDArray[Any]] | tuple[Any, ...]) -> bool:
    """Whether there is no NaN and no infinity.

    One sum is not finite when any of its terms is not, and costs less than looking at each.

    Args:
        arrays: An array or a number, or a collection of them.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        return all(math.isfinite(np.asarray(array).sum()) for array in _each(arrays))


def bad_row(arrays: NDArray[Any] | Mapping[str, NDArray[Any]] | tuple[Any, ...]) -> int | None:
    """The first row with a NaN or an infinity.

    Args:
        arrays: An array of shape (N, ...) or a collection of such.

    Returns:
        Its index, or None if all is finite.
    """
    for array in _each(arrays):
        bad = ~np.isfinite(array.reshape(len(array), -1)).all(axis=1)
        if bad.any():
            return int(bad.argmax())
    return None


def _each(arrays: Any) -> tuple[Any, ...]:
    if isinstance(arrays, dict):
        return tuple(arrays.values())
    return arrays if isinstance(arrays, tuple) else (arrays,)


# Gymnasium vector environments as Stable-Baselines3 sees them.
#
# SB3 accepts only its own `VecEnv`. The two protocols mean the same thing when the Gymnasium
# environment resets a finished row within the step (`AutoresetMode.SAME_STEP`); what differs is the
# packing: Gymnasium gives one dictionary of arrays over the rows, SB3 wants one dictionary per row.


class GymnasiumVecEnv(base.VecEnv):
    """An SB3 `VecEnv` over a Gymnasium `VectorEnv` that resets in the same step.

    A row whose episode ended reports its whole `final_info`, and what SB3 looks for:
    `terminal_observation`, `TimeLimit.truncated` (the limit struck and nothing else) and
    `episode` = {r: sum of rewards, l: length}, so that no `Monitor` or `VecMonitor` is needed.
    A running row reports an empty dictionary of its own, because filling one for every row at
    every step would cost more than the physics; `vector_infos` has them all as arrays.

    Attributes:
        venv: Gymnasium environment inside.
        vector_infos: The infos of the last reset or step, as Gymnasium gives them.
    """

    def __init__(self, venv: VectorEnv[Any, Any, Any]) -> None:
        """Wrap a vector environment.

        Args:
            venv: Environment with `metadata["autoreset_mode"]` equal to `SAME_STEP`.

        Raises:
            ValueError: No vector environment, or one that resets in another way.
        """
        require(isinstance(venv, VectorEnv), venv, "venv", "a gymnasium.vector.VectorEnv")
        mode = venv.metadata.get("autoreset_mode")
        if mode is not AutoresetMode.SAME_STEP:
            expected = 'AutoresetMode.SAME_STEP: make it with autoreset_mode="SameStep"'
            raise ValueError(f"{venv} has autoreset mode {mode}; expected {expected}")
        self.venv = venv
        self.vector_infos: dict[str, Any] = {}
        super().__init__(venv.num_envs, venv.single_observation_space, venv.single_action_space)
        self._actions: NDArray[Any] | None = None
        self._returns = np.zeros(self.num_envs)
        self._lengths = np.zeros(self.num_envs, dtype=np.int64)
        self._steps = 0

    def seed(self, seed: int | Sequence[int] | None = None) -> Sequence[int | None]:
        """Choose the seeds of the next reset.

        Args:
            seed: An integer s gives row i the seed s + i, as in SB3 and Gymnasium; a sequence
                gives each row its own; None draws an integer from NumPy's global generator.

        Returns:
            The seed of each row.

        Raises:
            gymnasium.error.Error: No integer of at least 0, and no sequence of such.
            ValueError: A sequence with other than one seed per row.
        """
        if seed is None:
            return super().seed()
        self._seeds = seeds_of(seed, self.num_envs, type(self).__name__)
        return self._seeds

    def set_options(self, options: Any = None) -> None:
        """Choose the options of the next reset.

        Args:
            options: A dictionary for all rows, or one for each.

        Raises:
            ValueError: Something else.
        """
        each = options if isinstance(options, list) and len(options) == self.num_envs else [options]
        known = options is None or all(isinstance(one, dict) for one in each)
        require(known, options, "options", f"a dictionary, or a list of {self.num_envs}")
        super().set_options(options)

    def reset(self) -> base.VecEnvObs:
        """Start an episode in every row.

        Returns:
            Observations, shape (N, ...), or a dictionary of such arrays.
        """
        seed: Any = self._next_seed()  # one integer or one for each row
        obs, infos = self.venv.reset(seed=seed, options=self._next_options())
        self._reset_seeds()
        self._reset_options()
        self.vector_infos = infos
        self.reset_infos = split(infos, np.arange(self.num_envs))
        self._returns[:] = 0.0
        self._lengths[:] = 0
        return obs  # type: ignore[no-any-return]

    def step_async(self, actions: Any) -> None:
        """Keep the actions for `step_wait`.

        Args:
            actions: One action per row, shape (N, ...).

        Raises:
            ValueError: No array of numbers.
            NonFiniteError: An action is NaN or infinite.
        """
        numbers = isinstance(actions, np.ndarray) and actions.ndim and actions.dtype.kind in "biuf"
        require(bool(numbers), actions, "actions", "an array of numbers, a row for each action")
        self._actions = np.asarray(actions)  # of a masked array the numbers, masked or not
        if not all_finite(self._actions):
            raise self._not_finite("action", bad_row(self._actions), "", 1)

    def step_wait(self) -> base.VecEnvStepReturn:
        """Advance every row by one step.

        Returns:
            Observations (of the new episode where one ended), rewards (N,) float32, dones (N,)
            bool, and one dictionary per row.

        Raises:
            NonFiniteError: A reward or an observation, also the last one of an episode, is NaN or
                infinite.
        """
        obs, rewards, terminated, truncated, infos = self.venv.step(self._actions)
        self.vector_infos = infos
        self._steps += 1
        dones = terminated | truncated
        rewards = self._paid(rewards, dones)
        self._returns += rewards
        self._lengths += 1
        if not (all_finite(self._returns) and all_finite(obs)):
            raise self._what_is_not_finite(obs, rewards)
        row_infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        rows = np.flatnonzero(dones)
        if rows.size:
            self._end_episodes(rows, truncated & ~terminated, infos, row_infos)
        # A new array: SB3 adds the value of truncated states to it in place.
        return obs, np.array(rewards, dtype=np.float32), dones, row_infos

    def close(self) -> None:
        """Close the environment."""
        self.venv.close()

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        """One picture per row."""
        pictures: Any = self.venv.render()
        return [None] * self.num_envs if pictures is None else list(pictures)

    def get_attr(self, attr_name: str, indices: base.VecEnvIndices = None) -> list[Any]:
        """An attribute of the environment, once for each row asked for.

        Rows of a native vector environment share one object, hence one value.
        """
        rows = self._get_indices(indices)
        if hasattr(self.venv, "envs"):
            return [self.venv.envs[row].get_wrapper_attr(attr_name) for row in rows]
        return [self._find(attr_name)] * len(rows)

    def set_attr(self, attr_name: str, value: Any, indices: base.VecEnvIndices = None) -> None:
        """Set an attribute of the environment.

        Raises:
            ValueError: Only some rows are asked for, and rows share one object.
        """
        rows = self._get_indices(indices)
        if hasattr(self.venv, "envs"):
            for row in rows:
                self.venv.envs[row].set_wrapper_attr(attr_name, value)
        elif len(rows) == self.num_envs:
            setattr(self.venv.unwrapped, attr_name, value)
        else:
            expected = "all rows, which share one object"
            raise ValueError(f"set_attr: indices = {rows}; expected {expected}")

    def env_method(
        self,
        method_name: str,
        *method_args: Any,
        indices: base.VecEnvIndices = None,
        **method_kwargs: Any,
    ) -> list[Any]:
        """Call a method, once per row asked for; once only where rows share one object."""
        rows = self._get_indices(indices)
        if hasattr(self.venv, "envs"):
            methods = self.get_attr(method_name, rows)
            return [method(*method_args, **method_kwargs) for method in methods]
        method = self._find(method_name)
        require(callable(method), method_name, "method_name", "a method, not an attribute")
        return [method(*method_args, **method_kwargs)] * len(rows)

    def env_is_wrapped(
        self,
        wrapper_class: type[gym.Wrapper[Any, Any, Any, Any]],
        indices: base.VecEnvIndices = None,
    ) -> list[bool]:
        """Whether rows are in a wrapper; true of `Monitor`, whose work the adapter does."""
        require(isinstance(wrapper_class, type), wrapper_class, "wrapper_class", "a class")
        wrapped = issubclass(wrapper_class, Monitor)
        return [wrapped for _ in self._get_indices(indices)]

    def _paid(self, rewards: NDArray[Any], dones: NDArray[np.bool_]) -> NDArray[Any]:
        """Rewards of the last step, shape (N,); a subclass may change them."""
        return rewards

    def _end_episodes(
        self,
        rows: NDArray[np.intp],
        truncated: NDArray[np.bool_],
        infos: dict[str, Any],
        row_infos: list[dict[str, Any]],
    ) -> None:
        details = split(infos.get("final_info", {}), rows)
        last_obs = rows_of(infos["final_obs"], rows)
        for row, last in zip(rows.tolist(), last_obs, strict=True):
            if not all_finite(last):
                raise self._not_finite("last observation", row)
        returns, lengths = self._returns[rows], self._lengths[rows]
        columns = zip(
            rows.tolist(), details, last_obs, truncated[rows].tolist(), returns.tolist(),
            lengths.tolist(), strict=True,
        )  # fmt: skip
        for row, info, last, cut, total, length in columns:
            info["terminal_observation"] = last
            info["TimeLimit.truncated"] = cut
            info["episode"] = {"r": total, "l": length}
            row_infos[row] = info
        self._returns[rows] = 0.0
        self._lengths[rows] = 0

    def _what_is_not_finite(self, obs: base.VecEnvObs, rewards: NDArray[Any]) -> NonFiniteError:
        what, row = "reward", bad_row(rewards)
        if row is None:
            what, row = "observation", bad_row(obs)
        if row is None:
            return NonFiniteError(
                f"the sum of rewards of an episode overflowed at step {self._steps} of the run"
            )
        return self._not_finite(what, row, f"reward {rewards[row]}, ")

    def _not_finite(
        self, what: str, row: int | None, also: str = "", ahead: int = 0
    ) -> NonFiniteError:
        assert row is not None and self._actions is not None
        return NonFiniteError(
            f"{what} of row {row} is not finite at step {self._lengths[row] + ahead} of its "
            f"episode, step {self._steps + ahead} of the run; "
            f"{also}action {np.asarray(self._actions[row]).tolist()}"
        )

    def _get_indices(self, indices: Any) -> list[int]:
        """Indices of the rows that are asked for.

        Raises:
            ValueError: No integer from 0 to N - 1, and no sequence of such.
        """
        rows = as_array(range(self.num_envs) if indices is None else indices)
        inside = rows.dtype.kind in "iu" and bool(np.all((rows >= 0) & (rows < self.num_envs)))
        known = f"integers from 0 to {self.num_envs - 1}"
        require((inside or not rows.size) and rows.ndim < 2, indices, "indices", known)
        return [int(row) for row in rows.ravel()]

    def _find(self, name: Any) -> Any:
        if not isinstance(name, str):
            raise AttributeError(f"{safe_repr(name)} is no name of an attribute or a method")
        for owner in (self.venv, self.venv.unwrapped):
            if hasattr(owner, name):
                return getattr(owner, name)
        raise AttributeError(f"{self.venv.unwrapped} has no attribute or method {name!r}")

    def _next_seed(self) -> int | list[int] | None:
        seeds = [s for s in self._seeds if s is not None]
        if len(seeds) != self.num_envs:
            return None
        first = seeds[0]
        # Native environments of others take an integer only: s means s + i there too.
        return first if seeds == list(range(first, first + len(seeds))) else seeds

    def _next_options(self) -> dict[str, Any] | None:
        options = self._options[0]
        alike = all(other == options for other in self._options)
        require(alike, self._options, "set_options: options", "the same for all rows")
        return dict(options) or None


# Vector environments of registered ids.


def make_vec_env(
    env_id: str, n_envs: int = 1, seed: int | None = None, **env_kwargs: Any
) -> GymnasiumVecEnv:
    """An environment of n rows, compiled into one loop, as Stable-Baselines3 takes it.

    It stands for `stable_baselines3.common.env_util.make_vec_env`: same episodes from the same
    seed, episode statistics included.

    Args:
        env_id: A registered id, also in short: "BallPark".
        n_envs: Number of rows.
        seed: Row i is given seed + i in the first reset; None draws the seeds.
        **env_kwargs: Hyperparameters of the task, and ``num_threads``.

    Raises:
        ConfigError: An unknown id or hyperparameter, or a bad value; names it.
    """
    venv = GymnasiumVecEnv(make_rows(checked_id(env_id), n_envs, env_kwargs))
    venv.action_space.seed(seed)
    if seed is not None:
        venv.seed(seed)
    return venv
