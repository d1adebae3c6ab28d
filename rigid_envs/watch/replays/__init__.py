"""Replays: what happened in episodes, in a small file; and a page to watch them in a browser."""

from rigid_envs.watch.replays.recording import RecordReplay, RecordRows, record_starts
from rigid_envs.watch.replays.replay import PastEpisode, Replay, load_replay, play_again, same_bits

__all__ = [
    "PastEpisode",
    "RecordReplay",
    "RecordRows",
    "Replay",
    "load_replay",
    "play_again",
    "record_starts",
    "same_bits",
]
