"""`rigid-envs replay`: what is in replays, and a page or a film to watch them."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigid_envs.checks import positive
from rigid_envs.cli.words import refuse, refuse_missing_folder
from rigid_envs.pages.tables import table

if TYPE_CHECKING:
    from rigid_envs.replays import Episode, Replay

__all__ = ["add_replay"]

_SAME = "same bits"


def add_replay(verbs: Any) -> None:
    """Add the verb to the command.

    Args:
        verbs: of `argparse`, from `add_subparsers`.
    """
    replaying = verbs.add_parser(
        "replay",
        help="recorded episodes: what happened, and a page or a film to watch them",
        description="Print the episodes of replays, and whether their actions give the same bits "
        "again. Several files are shown side by side. The exit status is 1 if other bits come.",
        allow_abbrev=False,
    )
    replaying.add_argument("files", nargs="+", metavar="FILE", type=Path)
    replaying.add_argument(
        "--episodes", nargs="+", type=int, metavar="K", help="only these episodes, counted from 0"
    )
    replaying.add_argument("--html", type=Path, metavar="OUT", help="write a page that shows them")
    replaying.add_argument(
        "--video", metavar="OUT", help="write a film of them: OUT.mp4, .gif or .webp"
    )
    replaying.add_argument(
        "--speed", type=float, default=1.0, metavar="X", help="of the film (1, real time)"
    )
    replaying.set_defaults(act=_replay)


def _replay(options: argparse.Namespace, rest: list[str]) -> int:
    refuse(rest)
    refuse_missing_folder("--html", options.html)
    if options.video:
        from rigid_envs.films import checked_film

        positive(options.speed, "--speed")
        checked_film(options.video)
    replays = _read(options.files)
    same = True
    for replay in replays:
        rows = [_row(replay, k, episode) for k, episode in enumerate(replay.episodes)]
        same &= all(row[-1] == _SAME for row in rows)
        print(_as_text(replay, rows))
    if options.html:
        from rigid_envs.replays.page import write_html  # imports the views: only here

        file = write_html(options.html, _chosen(replays, options.episodes))
        size = file.stat().st_size / 1e6
        print(f"written to {file} ({size:.2f} MB): open it in a browser")
    if options.video:
        _film(options.video, _chosen(replays, options.episodes), options.speed)
    return 0 if same else 1


def _film(file: str, chosen: Sequence[tuple[Replay, int]], speed: float) -> None:
    """Write a film of episodes side by side; pictures are smaller where there are many."""
    from rigid_envs.films import Look, episode_pictures, pictures_per_second, write_film

    size = 480 if len(chosen) <= 2 else 320
    shown = [(replay.task, replay.episodes[k]) for replay, k in chosen]
    fps = pictures_per_second(*(task for task, _ in shown))
    pictures = episode_pictures(shown, Look(size, size), speed=speed)
    print(f"written to {write_film(file, pictures, fps)}")


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


def _as_text(replay: Replay, rows: Sequence[Sequence[str]]) -> str:
    """The episodes of a replay as a table, and whether their actions give the same bits again."""
    versions = replay.provenance.get("versions")
    version = versions.get("rigid-envs", "?") if isinstance(versions, dict) else "?"
    head = f"{replay.env_id}   cost: {replay.task.cost_unit}   rigid-envs {version}"
    names = ("", "label", "steps", "time [s]", "return", "cost", "success", "end", "again")
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
        _SAME if same_bits(episode, again) else "other bits",
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
