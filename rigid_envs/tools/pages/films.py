"""Films and pictures of pages."""

import hashlib
import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import rigid_envs
from rigid_envs.base import files
from rigid_envs.base.checks import ConfigError, Image
from rigid_envs.engine.provenance import heading, provenance
from rigid_envs.scores.policies import policy_of
from rigid_envs.scores.starts import evaluation_seeds
from rigid_envs.scores.trained import load
from rigid_envs.tools.pages.tables import summary_of, table
from rigid_envs.tools.pages.writing import between, film_of, marks
from rigid_envs.watch.drawing import Look
from rigid_envs.watch.films import (
    LETTERS,
    Played,
    episode_pictures,
    labels_height,
    play_episode,
    write_film,
)
from rigid_envs.watch.pictures import lines_height, pillow, tiled, wrapped, write
from rigid_envs.watch.replays.replay import PastEpisode, Replay

# Short film of every environment for its page: `rigid-envs films`.
#
# A film has a title, and below it one to three episodes side by side, each under a line that says
# who plays or what differs. The table says how each id is filmed.

DATA = "films.json"
SHEET = "contact_sheet.webp"
"""One picture of all films, each at half its time."""
MAX_BYTES = 250_000
WIDTH, HEIGHT = 396, 332  # pixels of every film; on a phone it is 360 wide
_TITLE = 24  # pixels of the line above what the task is
_FPS = 10.0
_LONGEST = 7.0  # [s] of film before its end, which stays for a second
_LIMIT = 2**20  # bytes of the data
_SOURCES = ("watch/[!f]*.py", "watch/films.py", "systems/*/view.py", "tools/pages/films.py")
_ENTRY = {"file": str, "sha256": str, "sources": str, "shows": list, "seeds": list}
_SPEEDS = (0.25, 0.5, 1.0, 2.0, 3.0, 4.0, 8.0, 16.0, 32.0, 192.0)  # times real time


class Shot(NamedTuple):
    """How an id is filmed: what is seen from left to right.

    Attributes:
        players: names of policies, "reference", or "trained" for the published one.
        starts: number of the start of each, of those of the evaluation.
        until: time of the episodes at which the film ends [s]; infinity for their end.
        camera: fields of `Camera` that differ from those of the scene.
    """

    players: tuple[str, ...] = ("reference",)
    starts: tuple[int, ...] = (0,)
    until: float = math.inf
    camera: Mapping[str, Any] | None = None


def _still(x: float, y: float, distance: float) -> Mapping[str, Any]:
    """A camera that follows nothing, above a place [m]."""
    return {"follow": None, "target": (x, y, 0.5), "distance": distance}


_FREE, _TRAINED, _THREE = ("zero", "reference"), ("trained", "reference"), ("reference",) * 3
_SHOTS = {
    "IntermediateAxis": Shot(("zero", "minimum_fuel"), (0, 0), 14.0),
    "IntermediateAxisRandom": Shot(_THREE, (0, 2, 8), 5.0, {"distance": 8.6}),
    "IntermediateAxisSingle": Shot(("zero", "energy_casimir"), (0, 0), 5.0),
    "SpinCapture": Shot(("zero", "separatrix"), (0, 0), 26.0),
    "AxisFlip": Shot(_FREE, (0, 0), 21.0),
    "Detumble": Shot(_FREE, (0, 0), 3.0),
    "Reorient": Shot(_TRAINED, (2, 2), 8.0),
    "SleepingTop": Shot(("lqr", "transfer"), (4, 4), 10.0),
    "SleepingTopRandom": Shot(("zero", *_THREE[:2]), (3, 3, 5), 5.0, {"distance": 8.6}),
    "TopRandom": Shot(_FREE, (2, 2), 5.0),
    "TopPrecession": Shot(_FREE, (0, 0), 7.0),
    "PivotTop": Shot(_FREE, (3, 3), 5.0, {"distance": 10.0}),
    "BallPark": Shot(_TRAINED, (0, 0)),
    "BallParkGoal": Shot(_TRAINED, (0, 0), 2.5),
    "BallParkRandom": Shot(_THREE, (0, 4, 7), camera={"distance": 19.0}),
    "BallReorient": Shot(_TRAINED, (0, 0), camera={"distance": 11.0}),
    "BallParkDynamic": Shot(_TRAINED, (0, 0)),
    "BallSteer": Shot(_FREE, (2, 2), 14.0, _still(-2.2, -1.9, 15.0)),
    "BallPlate": Shot(_FREE, (0, 0), 6.0),
    "BallGrid": Shot(_TRAINED, (0, 0), camera={"distance": 17.0}),
    "RollPump": Shot(camera={"distance": 13.0}),
    "CoinPark": Shot(_TRAINED, (0, 0), camera={"distance": 9.0}),
    "DiskRoll": Shot(_FREE, (2, 2), 14.0, _still(0.8, 3.2, 23.0)),
    "DiskRollRandom": Shot(_THREE[:2], (6, 7), 14.0, _still(4.6, 0.5, 22.0)),
    "RacketCatch": Shot(("zero", *_THREE[:2]), (3, 3, 1), camera={"distance": 3.7}),
    "TippeTop": Shot(_FREE, (0, 0), 21.0, _still(-0.5, 1.6, 11.0)),
    "WheelReorient": Shot(_THREE[:2], (0, 2), 43.0, {"distance": 8.8}),
    "TwoWheels": Shot(_THREE[:2], (1, 3), 55.0, {"distance": 8.8}),
    "DualSpin": Shot(_FREE, (0, 0), 56.0, {"distance": 8.8}),
    "WheelTrack": Shot(_FREE, (0, 0), 224.0, {"distance": 8.8}),
    "MagneticDetumble": Shot(_FREE, (6, 6), 1260.0, {"distance": 8.0}),
}
"""Films of our own ids, by name without version; others show the reference from the first start."""


def sources_hash(*patterns: str) -> str:
    """SHA-256 over files of the package, so that it is known when pictures are older than they.

    Args:
        *patterns: of files below `rigid_envs`, as for `Path.glob`.
    """
    digest = hashlib.sha256()
    package = Path(rigid_envs.__file__).resolve().parent
    for path in sorted(file for pattern in patterns for file in package.glob(pattern)):
        digest.update(path.relative_to(package).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def write_films(
    folder: Path, ids: Iterable[str], report: Callable[[str], Any] = lambda _: None
) -> None:
    """Write the film of each id, and what it shows to `films.json`.

    Args:
        folder: made if it is not there; films of other ids in it stay.
        ids: Gymnasium's ids.
        report: called with a line about each film.
    """
    folder.mkdir(parents=True, exist_ok=True)
    films = _read(folder)
    for env_id in ids:
        shot, seeds, played = _played(env_id)
        file = folder / film_of(env_id)
        write_film(file, _pictures(shot, played), _FPS, MAX_BYTES)
        films[env_id] = {
            "file": file.name,
            "sha256": files.file_digest(file),
            "sources": sources_hash(*_SOURCES),
            "shows": [each.captioned()[1].label for each in played],
            "seeds": seeds,
        }
        report(f"{file}: {file.stat().st_size / 1e3:.0f} kB, {films[env_id]['shows']}")
    ordered = {env_id: films[env_id] for env_id in sorted(films)}
    text = json.dumps({"provenance": provenance(), "films": ordered}, indent=1)
    files.write_atomic(folder / DATA, text + "\n")
    write_film(folder / SHEET, [_sheet(folder / films[env_id]["file"] for env_id in ordered)], 1.0)


def filmed(env_id: str) -> list[Replay]:
    """The episodes that a film shows, from left to right, each labelled as in the film.

    Args:
        env_id: Gymnasium's id.
    """
    _, _, played = _played(env_id)
    return [
        Replay(env_id, each.task, (episode,))
        for each, episode in zip(played, _labelled(played), strict=True)
    ]


def stale_films(folder: Path, ids: Iterable[str]) -> dict[str, str]:
    """Ids whose film is missing, changed, or older than what pictures are made from; and why."""
    films, found = _read(folder), {}
    for env_id in ids:
        file, entry = folder / film_of(env_id), films.get(env_id)
        if entry is None or not file.is_file():
            found[env_id] = "missing"
        elif files.file_digest(file) != entry["sha256"]:
            found[env_id] = "not what films.json says"
        elif entry["sources"] != sources_hash(*_SOURCES):
            found[env_id] = "older than what draws it"
    return found


def _played(env_id: str) -> tuple[Shot, list[int], list[Played]]:
    """How an id is filmed; of its players, the seeds of their starts and what they did."""
    shot = _SHOTS.get(Path(film_of(env_id)).stem, Shot())
    seeds = [evaluation_seeds(start + 1)[start] for start in shot.starts]
    played = []
    for player, seed in zip(shot.players, seeds, strict=True):
        source = load(env_id) if player == "trained" else player
        policy, config = policy_of(env_id, source), getattr(source, "env_kwargs", None)
        played.append(play_episode(policy, env_id, seed, config, policy.name))
    return shot, seeds, played


def _pictures(shot: Shot, played: Sequence[Played]) -> list[Image]:
    """Pictures of a film: as slow or fast as one can follow, and the end for a second."""
    task = played[0].task
    duration = min(shot.until, task.dt * max(len(each.episode) for each in played))
    speed = next((speed for speed in _SPEEDS if duration <= speed * _LONGEST), _SPEEDS[-1])
    what = wrapped(summary_of(type(task)).removesuffix(".").replace("`", ""), WIDTH, LETTERS)
    head = _TITLE + lines_height(len(what), LETTERS)
    episodes = [(task, episode) for episode in _labelled(played)]
    width = WIDTH // len(played)
    height = HEIGHT - head - labels_height([episode.label for _, episode in episodes], width)
    look = Look(width, height, shot.camera or {}, text=False)
    shown = episode_pictures(episodes, look, fps=_FPS, speed=speed, hold=0.0)
    times = "" if speed == 1.0 else f"{speed:g} x "
    pace = f"{'slow motion, ' if speed < 1.0 else ''}{times}real time"
    found = []
    for k, picture in enumerate(islice(shown, math.ceil(duration / speed * _FPS) + 1)):
        page = np.pad(picture, ((head, 0), (0, 0), (0, 0)), constant_values=255)
        write(page, [f"{type(task).__name__}: {k * speed / _FPS:.1f} s ({pace})"], 15)
        write(page[_TITLE:], what, LETTERS)
        found.append(page)
    return [*found, *found[-1:] * round(_FPS)]


def _labelled(played: Sequence[Played]) -> list[PastEpisode]:
    """The episodes, each with what stands above its picture."""
    parameters = [each.episode.parameters for each in played]
    differ = [name for name in parameters[0] if len({each[name] for each in parameters}) > 1][:3]
    return [replace(each.episode, label=_label(each, differ)) for each in played]


def _label(played: Played, differ: Iterable[str]) -> str:
    """What stands above a picture: parameters that differ, if any, else who plays and how well."""
    if played.episode.label == "zero":
        return "uncontrolled"
    parameters = played.episode.parameters
    text = ", ".join(f"{name} {parameters[name]:.2g}" for name in differ)
    return text or played.captioned()[1].label


def _sheet(films: Iterable[Path]) -> Image:
    pictures, _, _ = pillow()
    tiles = []
    for file in films:
        with pictures.open(file) as film:
            film.seek(film.n_frames // 2)
            tiles.append(np.asarray(film.convert("RGB").resize((WIDTH // 2, HEIGHT // 2))))
    return tiled(tiles)


def _read(folder: Path) -> dict[str, Any]:
    """What is known of each film, by id; nothing where none was written."""
    file = folder / DATA
    if not file.is_file():
        return {}
    with files.named_damage(file, "delete it and write all films anew: rigid-envs films"):
        films = files.checked_values(files.read_json(file, _LIMIT), {"films": dict})["films"]
        return {env_id: files.checked_values(entry, _ENTRY) for env_id, entry in films.items()}


# Times of pictures as tables: in the terminal, and in the page about pictures.

_HEADER = ("id", "picture", "without shadows", "first of a process")
_MARKS = marks("times", "rigid-envs frames --page docs/rendering.md")


def as_text(data: Mapping[str, Any]) -> str:
    """Table of times, with where they were measured.

    Args:
        data: `provenance`, `frames` (times of each id) and `bytes` (of each package).
    """
    parts = (heading(data["provenance"]), table(_HEADER, _rows(data), "<>>>"), _size(data))
    return "\n\n".join(parts)


def with_table(page: str, data: Mapping[str, Any]) -> str:
    """A page with the table between its two marks made anew.

    Raises:
        ConfigError: there are no such marks.
    """
    lines = files.markdown_table(_HEADER, _rows(data), "<>>>")
    content = f"{lines}\n\nOn one core of {data['provenance']['cpu']}. {_size(data)}"
    made = between(page, _MARKS, lambda: content)
    if made is None:
        raise ConfigError("page has no marks for the table; expected {} and {}".format(*_MARKS))
    return made


def _rows(data: Mapping[str, Any]) -> list[tuple[str, ...]]:
    return [
        (
            times["env_id"].removeprefix("RigidEnvs/"),
            f"{1e3 * times['frame']:.1f} ms",
            f"{1e3 * times['without_shadows']:.1f} ms",
            f"{times['first']:.2f} s",
        )
        for times in data["frames"]
    ]


def _size(data: Mapping[str, Any]) -> str:
    sizes = sorted(data["bytes"].items(), key=lambda item: -item[1])
    each = ", ".join(f"{name} {size / 1e6:.0f} MB" for name, size in sizes)
    total = sum(size for _, size in sizes) / 1e6
    return f"The extra `render` takes {total:.0f} MB: {each}."
