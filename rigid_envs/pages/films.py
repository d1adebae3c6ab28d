"""Short film of every environment for its page: `rigid-envs films`.

A film shows a reference controller from the first start of the evaluation at which it succeeds.
"""

from __future__ import annotations

import hashlib
import itertools
import json
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import rigid_envs
from rigid_envs.documents import checked_values
from rigid_envs.files import named_damage, read_json, write_atomic
from rigid_envs.films import Look, episode_pictures, write_film
from rigid_envs.films.playing import Played, play_episode
from rigid_envs.pages.writing import film_of
from rigid_envs.provenance import provenance
from rigid_envs.render.lettering import pillow
from rigid_envs.render.picture import tiled
from rigid_envs.scores import evaluation_seeds, from_controller, reference_controllers

__all__ = ["DATA", "MAX_BYTES", "SHEET", "sources_hash", "stale_films", "write_films"]

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
_ENTRY = {"file": str, "sha256": str, "sources": str, "shows": str, "seed": int}

Image = npt.NDArray[np.uint8]


def sources_hash() -> str:
    """SHA-256 over what pictures are made from, the files of `rigid_envs.render`."""
    digest = hashlib.sha256()
    folder = Path(rigid_envs.__file__).resolve().parent / "render"
    for path in sorted(folder.rglob("*.py")):
        digest.update(path.relative_to(folder).as_posix().encode() + b"\0" + path.read_bytes())
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
            "sha256": hashlib.sha256(file.read_bytes()).hexdigest(),
            "sources": sources_hash(),
            "shows": played.captioned()[1].label,
            "seed": seed,
        }
        report(f"{file}: {file.stat().st_size / 1e3:.0f} kB, {films[env_id]['shows']}")
    ordered = {env_id: films[env_id] for env_id in sorted(films)}
    text = json.dumps({"provenance": provenance(), "films": ordered}, indent=1)
    write_atomic(folder / DATA, text + "\n")
    write_film(folder / SHEET, [_sheet(folder / films[env_id]["file"] for env_id in ordered)], 1.0)


def stale_films(folder: Path, ids: Iterable[str]) -> dict[str, str]:
    """Ids whose film is missing, changed, or older than what pictures are made from; and why."""
    films, found = _read(folder), {}
    for env_id in ids:
        file, entry = folder / film_of(env_id), films.get(env_id)
        if entry is None or not file.is_file():
            found[env_id] = "missing"
        elif hashlib.sha256(file.read_bytes()).hexdigest() != entry["sha256"]:
            found[env_id] = "not what films.json says"
        elif entry["sources"] != sources_hash():
            found[env_id] = "older than rigid_envs/render"
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


def _sheet(files: Iterable[Path]) -> Image:
    pictures, _, _ = pillow()
    tiles = []
    for file in files:
        with pictures.open(file) as film:
            film.seek(film.n_frames // 3)
            tiles.append(np.asarray(film.convert("RGB").resize((_SIZE // 2, _SIZE // 2))))
    return tiled(tiles)


def _read(folder: Path) -> dict[str, Any]:
    """What is known of each film, by id; nothing where none was written."""
    file = folder / DATA
    if not file.is_file():
        return {}
    with named_damage(file, "delete it and write all films anew: rigid-envs films"):
        films = checked_values(read_json(file, _LIMIT), {"films": dict})["films"]
        return {env_id: checked_values(entry, _ENTRY) for env_id, entry in films.items()}
