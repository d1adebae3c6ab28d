"""Episodes played in all rows of an environment, and counted."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.vector import VectorEnv

from rigid_envs.errors import ConfigError
from rigid_envs.registry import ErrorTerm
from rigid_envs.scores.episodes import ActionFunction, Episodes
from rigid_envs.scores.tally import Tally

__all__ = ["Told", "entries_of", "play"]

Bools = npt.NDArray[np.bool_]
Told = Callable[[Mapping[str, Any], Iterable[str], Bools], dict[str, npt.NDArray[Any]]]

_MOST = 100_000  # steps of an episode; those of this package have hundreds


def play(
    act: ActionFunction,
    venv: VectorEnv[Any, Any, Any],
    seeds: list[int],
    error: ErrorTerm | None = None,
    progress: Callable[[str], None] = lambda _: None,
    limit: int | None = None,
    told: Told | None = None,
) -> Episodes:
    """Play exactly one episode in each row.

    Rows that are done go on with another episode, which is not counted: so every start weighs the
    same.

    Args:
        act: Actions of all rows.
        venv: A vector environment whose rows start anew by themselves.
        seeds: One seed per row.
        error: Reward term whose error is recorded; None for none.
        progress: Called with a few words in every step.
        limit: Number of steps after which an episode is cut off here; None leaves that to the
            environment.
        told: Function from infos, names of entries and the rows that ended to the entries; None
            for those of the infos.

    Raises:
        ConfigError: No end after a hundred thousand steps.
    """
    first_seeds: Any = seeds  # native environments take one seed for each row
    obs, _ = venv.reset(seed=first_seeds)
    tally = Tally(seeds, error, limit or getattr(venv.spec, "max_episode_steps", None))
    rows: Any = venv.unwrapped
    step = 0
    try:
        while left := np.count_nonzero(tally.running):
            if step == _MOST:
                raise ConfigError(
                    f"env: {left} episodes of more than {_MOST} steps; expected a time limit: "
                    "wrap it in gymnasium.wrappers.TimeLimit"
                )
            step += 1
            progress(f"{len(seeds) - left} of {len(seeds)} episodes")
            rows.uncounted = ~tally.running  # nobody needs to plan for them
            obs, rewards, terminated, truncated, infos = venv.step(act(obs))
            truncated = truncated | (step == limit)
            ended = tally.running & (terminated | truncated)
            tally.add(
                rewards, terminated, truncated, (told or entries_of)(infos, tally.keys, ended)
            )
    finally:
        rows.uncounted = None
    return tally.episodes()


def entries_of(
    infos: Mapping[str, Any], keys: Iterable[str], ended: Bools
) -> dict[str, npt.NDArray[Any]]:
    """Info entries of the step itself, also in rows that started anew within it.

    Args:
        infos: Of all rows.
        keys: Names of the entries; one that is missing is 0.
        ended: Rows whose episode ended in the step, shape (N,).
    """
    values = {key: np.asarray(infos.get(key, np.zeros(len(ended)))) for key in keys}
    if ended.any() and "final_info" in infos:  # else rows start anew in the next step
        last = infos["final_info"]
        values = {key: np.where(ended, last.get(key, 0), now) for key, now in values.items()}
    return values
