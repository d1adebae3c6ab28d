"""Speed of some environments against peers in the same run."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rigid_envs.bench.interleaved import Throughput
from rigid_envs.bench.mujoco_body import MujocoSetting
from rigid_envs.bench.workloads import FREE_BODY, ON_REQUEST

__all__ = ["Ratio", "ratios"]

_BALL, _TOP = "BallPark-v0", "SleepingTop-v0"
_SINGLE, _ROWS = "CartPole-v1", "CartPole-v1, NumPy"
_PEERS = (
    (FREE_BODY, "made", _SINGLE, "made"),
    (FREE_BODY, "bare", _SINGLE, "bare"),
    (FREE_BODY, "16", _ROWS, "16"),
    (FREE_BODY, "256", _ROWS, "256"),
    *((FREE_BODY, column, _ROWS, str(n)) for column, n in ON_REQUEST.items()),
    *((name, "4096", _ROWS, "4096") for name in (FREE_BODY, _BALL, _TOP)),
    *((name, "2 threads", name, "4096") for name in (FREE_BODY, _BALL, _TOP)),
)
_FORMS = {
    "made": "single, made",
    "bare": "single, bare",
    "16": "N = 16",
    "256": "N = 256",
    **{column: f"N = {column}" for column in ON_REQUEST},
    "4096": "N = 4096",
    "2 threads": "N = 4096, 2 threads",
}


@dataclass(frozen=True)
class Ratio:
    """Steps per second over those of a peer.

    Attributes:
        name: of the environment.
        form: of the environment, in words.
        peer: name of the peer; itself in one thread, where its form is 2 threads.
        median: over the rounds.
        quartiles: first and third, over the rounds.
    """

    name: str
    form: str
    peer: str
    median: float
    quartiles: tuple[float, float]


def ratios(speeds: Sequence[Throughput], mujoco: Sequence[MujocoSetting]) -> list[Ratio]:
    """Ratios to every peer that was measured.

    Of MuJoCo's settings the last RK4 counts: it holds our energy error for longest.
    """
    equal = [setting.name for setting in mujoco if setting.integrator == "RK4"][-1:]
    peers = [*_PEERS, *((FREE_BODY, "4096", peer, "4096") for peer in equal)]
    found = {(speed.name, speed.column): speed for speed in speeds}
    made = []
    for name, column, peer, peer_column in peers:
        ours, theirs = found.get((name, column)), found.get((peer, peer_column))
        if ours and theirs:
            low, median, high = np.percentile(ours.ratio(theirs), (25, 50, 75)).tolist()
            form = _FORMS[column] + (", equal energy error" if peer in equal else "")
            made.append(Ratio(name, form, peer, median, (low, high)))
    return made
