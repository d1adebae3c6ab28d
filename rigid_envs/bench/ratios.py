"""Speed of the free body against peers in the same run."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rigid_envs.bench.interleaved import Throughput
from rigid_envs.bench.mujoco_body import MujocoSetting

__all__ = ["FREE_BODY", "Ratio", "ratios"]

FREE_BODY = "IntermediateAxis-v0"
"""The environment that is compared: the free body, which MuJoCo can simulate too."""

_PEERS = (
    ("made", "single, made", "CartPole-v1"),
    ("bare", "single, bare", "CartPole-v1"),
    ("16", "N = 16", "CartPole-v1, NumPy"),
    ("256", "N = 256", "CartPole-v1, NumPy"),
    ("4096", "N = 4096", "CartPole-v1, NumPy"),
)


@dataclass(frozen=True)
class Ratio:
    """Steps per second over those of a peer.

    Attributes:
        column: form of the environment, see `workloads.COLUMNS`.
        text: the same form in words.
        peer: name of the peer.
        median: over the rounds.
        quartiles: first and third, over the rounds.
    """

    column: str
    text: str
    peer: str
    median: float
    quartiles: tuple[float, float]


def ratios(speeds: Sequence[Throughput], mujoco: Sequence[MujocoSetting]) -> list[Ratio]:
    """Ratios to every peer that was measured.

    Of MuJoCo's settings the last RK4 counts: it holds our energy error for longest.
    """
    peers = list(_PEERS)
    equal = [setting for setting in mujoco if setting.integrator == "RK4"]
    peers += [("4096", "N = 4096, equal energy error", setting.name) for setting in equal[-1:]]
    found = {(speed.name, speed.column): speed for speed in speeds}
    made = []
    for column, text, peer in peers:
        ours, theirs = found.get((FREE_BODY, column)), found.get((peer, column))
        if ours and theirs:
            low, median, high = np.percentile(ours.ratio(theirs), (25, 50, 75)).tolist()
            made.append(Ratio(column, text, peer, median, (low, high)))
    return made
