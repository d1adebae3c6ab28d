"""`rigid-envs replay`: what is in replays, and a page to watch them."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigid_envs.pages.tables import table

if TYPE_CHECKING:
    from rigid_envs.replays import Episode, Replay

__all__ = ["add_replay"]


def add_replay(verbs: Any) -> None:
    """Add the verb to the command.

    Args:
        verbs: of `argparse`, from `add_subparsers`.
    """
    replaying = verbs.add_parser(
        "replay",
        help="recorded episodes: what happened, and a page to watch them in a browser",
        description="Print the episodes of replays, and whether their actions give the same bits "
        "again. Several files are shown side by side.",
        allow_abbrev=False,
    )
    replaying.add_argument("files", nargs="+", metavar="FILE", type=Path)
    replaying.add_argument(
        "--episodes", nargs="+", type=int, metavar="K", help="only these episodes, counted from 0"
    )
    replaying.add_argument("--html", type=Path, metavar="OUT", help="write a page that shows them")
    replaying.set_defaults(act=_replay)


def _replay(options: argparse.Namespace, rest: list[str]) -> None:
    if rest:
        raise ValueError(f"argument = {rest[0]!r}; expected one of those that --help lists")
    if options.html and not options.html.parent.is_dir():
        raise ValueError(f"--html = {options.html}; expected a file in a folder that exists")
    replays = _read(options.files)
    for replay in replays:
        print(_as_text(replay))
    if options.html:
        from rigid_envs.replays.page import write_html  # imports the views: only here

        file = write_html(options.html, _chosen(replays, options.episodes))
        size = file.stat().st_size / 1e6
        print(f"written to {file} ({size:.2f} MB): open it in a browser")


def _read(files: Sequence[Path]) -> list[Replay]:
    """The replays of some files.

    Raises:
        ValueError: A file that does not exist or is no replay.
    """
    from rigid_envs.replays import load_replay  # imports what it plays again: only here

    for file in files:
        if not file.exists():
            raise ValueError(f"FILE = {file}; expected a replay: there is no such file")
    return [load_replay(file) for file in files]


def _as_text(replay: Replay) -> str:
    """The episodes of a replay as a table, and whether their actions give the same bits again."""
    versions = replay.provenance.get("versions")
    version = versions.get("rigid-envs", "?") if isinstance(versions, dict) else "?"
    head = f"{replay.env_id}   cost: {replay.task.cost_unit}   rigid-envs {version}"
    names = ("", "label", "steps", "time [s]", "return", "cost", "success", "end", "again")
    rows = [_row(replay, k, episode) for k, episode in enumerate(replay.episodes)]
    return f"{head}\n{table(names, rows, '><>>>>')}"


def _row(replay: Replay, k: int, episode: Episode) -> tuple[str, ...]:
    from rigid_envs.replays import play_again, same_bits

    again = play_again(replay.task, episode.start, episode.actions)
    return (
        str(k),
        episode.label,
        str(len(episode)),
        f"{episode.times[-1]:.2f}",
        f"{episode.rewards.sum():.5g}",
        f"{episode.costs.sum():.4g}",
        "yes" if len(episode) and episode.success[-1] else "no",
        "ended" if episode.terminated else "cut off" if episode.truncated else "left",
        "same bits" if same_bits(episode, again) else "other bits",
    )


def _chosen(replays: Sequence[Replay], episodes: Sequence[int] | None) -> list[tuple[Replay, int]]:
    """Which episodes are shown side by side: of each replay the given ones.

    Where none are given, the first ones of one replay, or the first of each of several.
    """
    from rigid_envs.replays.page import MOST_EPISODES

    if episodes is None:
        several = range(min(len(replays[0].episodes), MOST_EPISODES))
        episodes = several if len(replays) == 1 else (0,)
    return [(replay, k) for replay in replays for k in episodes]
