"""Replays of policies from the starts of the evaluation set."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rigid_envs.replays.recording import RecordRows
from rigid_envs.replays.replay import Replay
from rigid_envs.scores.evaluation import make_rows
from rigid_envs.scores.playing import play
from rigid_envs.scores.policies import PolicyFactory
from rigid_envs.scores.starts import TEST_SEED, row_seeds

__all__ = ["record_starts"]


def record_starts(
    policy: PolicyFactory,
    env_id: str,
    n: int = 1,
    label: str = "policy",
    seed: int = TEST_SEED,
    config: Mapping[str, Any] | None = None,
) -> Replay:
    """Play and record one episode from each of the first n starts.

    Args:
        policy: From `rigid_envs.scores.from_controller`, `from_predict` or `uniform`, for example.
        env_id: Gymnasium's id.
        n: Number of starts.
        label: Who acts.
        seed: Seed that the starts are drawn from; that of the evaluation set by default.
        config: Hyperparameters of the task.
    """
    rows = make_rows(env_id, n, config)
    envs = RecordRows(rows, rows=range(n), label=label, first=1)
    try:
        play(policy(rows), envs, row_seeds(seed, n, "test"))
        return envs.replay()
    finally:
        envs.close()
