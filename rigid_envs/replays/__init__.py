"""Replays: what happened in episodes, in a small file; and a page to watch them in a browser."""

from rigid_envs.replays.episode import Episode, play_again, same_bits
from rigid_envs.replays.recording import RecordReplay, RecordRows
from rigid_envs.replays.replay import Replay, load_replay
from rigid_envs.replays.starts import record_starts

__all__ = [
    "Episode",
    "RecordReplay",
    "RecordRows",
    "Replay",
    "load_replay",
    "play_again",
    "record_starts",
    "same_bits",
]
