"""Verbs of pictures: films, frames, gallery, play, replay."""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rigid_envs.base.checks import one_named, positive
from rigid_envs.base.files import write_atomic
from rigid_envs.engine.provenance import provenance
from rigid_envs.envs.lookup import checked_id
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools.bench import figures
from rigid_envs.tools.cli.words import (
    IDS,
    config_of,
    imports_of,
    option,
    refuse_missing_folder,
    tell,
    verb,
)
from rigid_envs.tools.pages.films import as_text, stale_films, with_table, write_films
from rigid_envs.tools.pages.tables import table
from rigid_envs.watch import films
from rigid_envs.watch.drawing import Look
from rigid_envs.watch.play.game import play
from rigid_envs.watch.play.steering import keys
from rigid_envs.watch.replays.page import MOST_EPISODES, write_html
from rigid_envs.watch.replays.replay import PastEpisode, Replay, load_replay, play_again, same_bits

# `rigid-envs films`: a short film of every environment, for its page.


@verb(
    option("folder", metavar="FOLDER", type=Path),
    IDS,
    option(
        "--check", action="store_true", help="say which films are missing or old; write nothing"
    ),
)
def films_(options: argparse.Namespace) -> int:
    """A short film of every environment, as animated WebP.

    Film the reference controller of each environment for its page. In the repository the films are
    in docs/environments/films.
    """
    own = (env_id for env_id in ENVIRONMENTS if env_id.startswith("RigidEnvs/"))
    ids = [checked_id(name) for name in options.ids or own]
    if options.check:
        stale = stale_films(options.folder, ids)
        for env_id, why in stale.items():
            print(f"{env_id}: {why}")
        return 1 if stale else 0
    write_films(options.folder, ids, tell)
    tell("")
    return 0


# `rigid-envs frames`: how long a picture takes.


@verb(
    IDS,
    option(
        "--page",
        type=Path,
        metavar="FILE.md",
        help="write the table into this page, and the data beside it as FILE.json; in the "
        "repository it is docs/rendering.md",
    ),
)
def frames_(options: argparse.Namespace) -> None:
    """Time of a picture of every environment.

    Measure pictures of 480 x 480 pixels on one thread, with and without shadows, and the first one
    of a new process. Takes a minute on an idle machine. With --ids the page keeps the other rows.
    """
    ids = [checked_id(name) for name in options.ids or ENVIRONMENTS]
    page = "" if options.page is None else options.page.read_text(encoding="utf-8")
    data = {
        "provenance": provenance(),
        "frames": [times._asdict() for times in figures.frame_times(ids, report=tell)],
        "bytes": figures.installed_size(),
    }
    tell("")
    if options.page is None:
        print(as_text(data))
        return
    file = options.page.with_suffix(".json")
    if options.ids and file.exists():
        data = _with_rows(json.loads(file.read_text(encoding="utf-8")), data)
    text = with_table(page, data)
    write_atomic(file, json.dumps(data, indent=1) + "\n")
    write_atomic(options.page, text)


def _with_rows(kept: dict[str, Any], new: dict[str, Any]) -> dict[str, Any]:
    """Data of a page in which some rows are measured anew; these say where they come from."""
    rows = {row["env_id"]: row for row in kept["frames"]}
    rows |= {row["env_id"]: row | {"provenance": new["provenance"]} for row in new["frames"]}
    return kept | {"frames": [rows[env_id] for env_id in ENVIRONMENTS if env_id in rows]}


# `rigid-envs gallery`: draw the figures.


@verb(
    option("names", nargs="*", metavar="NAME", help="these figures only"),
    option("--out", type=Path, metavar="DIR", help="folder of the files"),
    option("--list", action="store_true", help="name the figures, draw nothing"),
    option(
        "--docs",
        type=Path,
        metavar="DIR",
        help="draw all figures, small, into DIR instead, and write the page DIR.md about them; in "
        "the repository it is docs/gallery",
    ),
)
def gallery_(options: argparse.Namespace) -> int:
    """Figures of rotation and rolling, simulation against closed form.

    Draw figures as PNG and SVG, and write captions, numbers and provenance to figures.json. The
    exit status is 1 if a number is beyond its bound.
    """
    from rigid_envs.tools.gallery import FIGURES  # imports the systems: only here

    names = list(dict.fromkeys(one_named(name, FIGURES, "figure") for name in options.names))
    if options.list:
        rows = [(FIGURES[name].name, FIGURES[name].title) for name in names or FIGURES]
        print(table(("name", "figure"), rows, "<<"))
        return 0
    return _draw(names or list(FIGURES), options)


def _draw(names: Sequence[str], options: argparse.Namespace) -> int:
    from rigid_envs.tools.gallery import FIGURES, write_docs, write_figures

    if (options.out is None) == (options.docs is None):
        raise ValueError(f"--out = {options.out}; expected either --out DIR or --docs DIR")
    if options.docs and options.names:
        raise ValueError(f"names = {names}; expected none beside --docs: the page shows all")
    folder: Path = options.out or options.docs
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"folder = {folder}; expected a folder: this is a file")
    folder.mkdir(parents=True, exist_ok=True)
    if options.docs:
        drawn = write_docs(folder, tell)
    else:
        drawn = write_figures(folder, [FIGURES[name] for name in names], tell)
    tell("")
    rows = [(made.entry.name, str(made.numbers[0])) for made in drawn]
    print(table(("name", "number"), rows, "<<"))
    print(f"\nwritten to {folder}")
    broken = [made.entry.name for made in drawn if not all(n.holds for n in made.numbers)]
    if broken:
        print(f"beyond their bounds: {', '.join(broken)}")
    return 1 if broken else 0


# `rigid-envs play`: its arguments.


@verb(
    option("id", metavar="ID"),
    option("--seed", type=int, default=0, metavar="N", help="of the first start (0)"),
    option("--size", type=int, default=640, metavar="PIXELS", help="(640)"),
    option("--save", type=Path, metavar="FILE", help="a replay of all you play"),
    option("--help-keys", action="store_true", help="say which keys do what"),
    usage="rigid-envs play ID [OPTION ...] [--KEY VALUE ...]",
)
def play_(options: argparse.Namespace) -> None:
    """Steer an environment yourself, by keyboard, mouse or gamepad.

    Open a window in which you steer, in real time, and see your result beside what the reference
    controller makes of the same start. Any hyperparameter can be given as an option, as for
    `describe`.
    """
    config = config_of(options.rest)
    if options.help_keys:
        print(keys(options.id, config))
        return
    refuse_missing_folder("--save", options.save)
    saved = play(options.id, options.seed, config, options.size, options.save)
    if saved:
        print(f"written to {saved}; to see it: rigid-envs replay {saved}{imports_of(options)}")


# `rigid-envs replay`: what is in replays, and a page or a film to watch them.

_SAME = "same bits"


@verb(
    option("files", nargs="+", metavar="FILE", type=Path),
    option(
        "--episodes", nargs="+", type=int, metavar="K", help="only these episodes, counted from 0"
    ),
    option("--html", type=Path, metavar="OUT", help="write a page that shows them"),
    option("--video", metavar="OUT", help="write a film of them: OUT.mp4, .gif or .webp"),
    option("--speed", type=float, default=1.0, metavar="X", help="of the film (1, real time)"),
)
def replay_(options: argparse.Namespace) -> int:
    """Recorded episodes: what happened, and a page or a film to watch them.

    Print the episodes of replays, and whether their actions give the same bits again. Several
    files are shown side by side. The exit status is 1 if other bits come.
    """
    refuse_missing_folder("--html", options.html)
    if options.video:
        positive(options.speed, "--speed")
        films.checked_film(options.video)
    for file in options.files:
        if not file.exists():
            raise ValueError(f"FILE = {file}; expected a replay: there is no such file")
    replays, same = [load_replay(file) for file in options.files], True
    for replay in replays:
        rows = [_row(replay, k, episode) for k, episode in enumerate(replay.episodes)]
        same &= all(row[-1] == _SAME for row in rows)
        print(_as_text(replay, rows))
    if options.html:
        file = write_html(options.html, _chosen(replays, options.episodes))
        size = file.stat().st_size / 1e6
        print(f"written to {file} ({size:.2f} MB): open it in a browser")
    if options.video:
        chosen = _chosen(replays, options.episodes)
        shown = [(replay.task, replay.episodes[k]) for replay, k in chosen]
        side = 480 if len(shown) <= 2 else 320
        fps = films.pictures_per_second(*(task for task, _ in shown))
        pictures = films.episode_pictures(shown, Look(side, side), speed=options.speed)
        print(f"written to {films.write_film(options.video, pictures, fps)}")
    return 0 if same else 1


def _as_text(replay: Replay, rows: Sequence[Sequence[str]]) -> str:
    """The episodes of a replay as a table, and whether their actions give the same bits again."""
    versions = replay.provenance.get("versions")
    version = versions.get("rigid-envs", "?") if isinstance(versions, dict) else "?"
    head = f"{replay.env_id}   cost: {replay.task.cost_unit}   rigid-envs {version}"
    names = ("", "label", "steps", "time [s]", "return", "cost", "success", "end", "again")
    return f"{head}\n{table(names, rows, '><>>>>')}"


def _row(replay: Replay, k: int, episode: PastEpisode) -> tuple[str, ...]:
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
    if episodes is None:
        several = range(min(len(replays[0].episodes), MOST_EPISODES))
        episodes = several if len(replays) == 1 else (0,)
    return [(replay, k) for replay in replays for k in episodes]
