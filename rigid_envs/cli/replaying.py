"""Replays in files: what `rigid-envs replay` prints and writes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rigid_envs.pages.tables import table
from rigid_envs.replays import Replay, load_replay, play_again, same_bits
from rigid_envs.replays.page import MOST_EPISODES, write_html

__all__ = ["as_text", "chosen", "read", "write_page"]

Shown = list[tuple[Replay, int]]


def read(files: Sequence[Path]) -> list[Replay]:
    """The replays of some files.

    Raises:
        ValueError: A file that does not exist or is no replay.
    """
    for file in files:
        if not file.exists():
            raise ValueError(f"FILE = {file}; expected a replay: there is no such file")
    return [load_replay(file) for file in files]


def as_text(replays: Sequence[Replay]) -> str:
    """The episodes of replays as a table, and whether their actions give the same bits again."""
    lines = []
    for replay in replays:
        rows = []
        for k, episode in enumerate(replay.episodes):
            again = play_again(replay.task, episode.start, episode.actions)
            end = "ended" if episode.terminated else "cut off" if episode.truncated else "left"
            rows.append(
                (
                    str(k),
                    episode.label,
                    str(len(episode)),
                    f"{episode.times[-1]:.2f}",
                    f"{episode.rewards.sum():.5g}",
                    f"{episode.costs.sum():.4g}",
                    "yes" if len(episode) and episode.success[-1] else "no",
                    end,
                    "same bits" if same_bits(episode, again) else "other bits",
                )
            )
        cost = f"cost: {replay.task.cost_unit}"
        lines.append(f"{replay.env_id}   {cost}   rigid-envs {_version(replay)}")
        heads = ("", "label", "steps", "time [s]", "return", "cost", "success", "end", "again")
        lines.append(table(heads, rows, "><>>>>"))
    return "\n".join(lines)


def chosen(replays: Sequence[Replay], episodes: Sequence[int] | None) -> Shown:
    """Which episodes are shown side by side.

    Args:
        replays: The replays.
        episodes: Indices of episodes, the same in each; None takes the first ones of one replay,
            or the first of each of several.
    """
    if episodes is None:
        several = range(min(len(replays[0].episodes), MOST_EPISODES))
        episodes = several if len(replays) == 1 else (0,)
    return [(replay, k) for replay in replays for k in episodes]


def write_page(shown: Shown, file: Path) -> None:
    """Write the page that shows episodes, and say so."""
    written = write_html(file, shown)
    size = written.stat().st_size / 1e6
    print(f"written to {written} ({size:.2f} MB): open it in a browser")


def _version(replay: Replay) -> str:
    versions = replay.provenance.get("versions")
    return str(versions.get("rigid-envs", "?")) if isinstance(versions, dict) else "?"
