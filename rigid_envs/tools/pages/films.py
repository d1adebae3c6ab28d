"""Films and pictures of pages."""

import hashlib
import itertools
import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

import rigid_envs
from rigid_envs.base import files
from rigid_envs.base.checks import ConfigError, Image
from rigid_envs.engine.provenance import heading, provenance
from rigid_envs.scores.policies import from_controller, reference_controllers
from rigid_envs.scores.starts import evaluation_seeds
from rigid_envs.tools.pages.tables import table
from rigid_envs.tools.pages.writing import between, film_of, marks
from rigid_envs.watch.drawing import Look
from rigid_envs.watch.films import Played, episode_pictures, play_episode, write_film
from rigid_envs.watch.pictures import pillow, tiled

# Short film of every environment for its page: `rigid-envs films`.
#
# A film shows a reference controller from the first start of the evaluation at which it succeeds.

DATA = "films.json"
SHEET = "contact_sheet.webp"
"""One picture of all films, each at a third of its time."""
MAX_BYTES = 250_000
_SIZE = 320  # pixels
_FPS = 12.0
_LONGEST = 8.0  # [s] of film
_FASTEST = 3.0  # times real time; what does not fit then is cut off
_TRIED = 20  # starts
_LIMIT = 2**20  # bytes of the data
_SOURCES = ("watch/[!f]*.py", "watch/films.py", "systems/*/view.py")  # not `watch/figures.py`
_ENTRY = {"file": str, "sha256": str, "sources": str, "shows": str, "seed": int}


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
        played, seed = _episode(env_id)
        file = folder / film_of(env_id)
        write_film(file, _pictures(played), _FPS, MAX_BYTES)
        films[env_id] = {
            "file": file.name,
            "sha256": files.file_digest(file),
            "sources": sources_hash(*_SOURCES),
            "shows": played.captioned()[1].label,
            "seed": seed,
        }
        report(f"{file}: {file.stat().st_size / 1e3:.0f} kB, {films[env_id]['shows']}")
    ordered = {env_id: films[env_id] for env_id in sorted(films)}
    text = json.dumps({"provenance": provenance(), "films": ordered}, indent=1)
    files.write_atomic(folder / DATA, text + "\n")
    write_film(folder / SHEET, [_sheet(folder / films[env_id]["file"] for env_id in ordered)], 1.0)


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


def _episode(env_id: str) -> tuple[Played, int]:
    """Episode of the best reference controller, and seed: the first that succeeds, or the last."""
    name, factory = next(iter(reference_controllers(env_id).items()))
    policy = from_controller(factory)
    for seed in evaluation_seeds(_TRIED):
        played = play_episode(policy, env_id, seed, label=name)
        if played.tally.success:
            break
    return played, seed


def _pictures(played: Played) -> Iterator[Image]:
    """Pictures in real time, or up to three times as fast where the episode is long.

    Moves on a grid, which have no time, take a quarter of a second.
    """
    duration = len(played.episode) * played.task.dt
    speed = min(max(duration / _LONGEST, 1.0), _FASTEST)
    if played.task.n_choices:
        speed = 4.0 * played.task.dt
    look = Look(width=_SIZE, height=_SIZE)
    pictures = episode_pictures([played.captioned()], look, fps=_FPS, speed=speed)
    yield from itertools.islice(pictures, int(_LONGEST * _FPS))


def _sheet(films: Iterable[Path]) -> Image:
    pictures, _, _ = pillow()
    tiles = []
    for file in films:
        with pictures.open(file) as film:
            film.seek(film.n_frames // 3)
            tiles.append(np.asarray(film.convert("RGB").resize((_SIZE // 2, _SIZE // 2))))
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
