"""One episode to look at: as a table, in a window, as a film or a page."""

import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.error import DependencyNotInstalled

from rigid_envs.base.checks import ConfigError, Image, named_refusal
from rigid_envs.scores.policies import PolicyFactory, from_predict, uniform, untrained_policy
from rigid_envs.scores.starts import rollout, row_seeds
from rigid_envs.scores.trained import CompiledPolicy
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tasks.task import Task
from rigid_envs.tools.pages.tables import table
from rigid_envs.watch import films, pictures
from rigid_envs.watch.drawing import Look
from rigid_envs.watch.replays.page import write_html
from rigid_envs.watch.replays.replay import PastEpisode, Replay

from ..environments import make

# Who plays.

Player = tuple[PolicyFactory, dict[str, Any]]
"""Who acts, and in which settings of the task."""


def players_of(
    policy: CompiledPolicy, seed: int, random: bool = False, against: str | None = None
) -> list[Player]:
    """A policy, and a controller beside it.

    Args:
        policy: The policy.
        seed: Seed of the start.
        random: Whether to act at random instead.
        against: Name of the controller; None for none.

    Raises:
        ConfigError: There is no such controller.
    """
    config = policy.document["env_kwargs"]
    name = str(policy.document["algo"]).upper()
    players = [(uniform(seed) if random else from_predict(policy, name), config)]
    if against is not None:
        with named_refusal("--against"):
            other = untrained_policy(policy.env_id, against)
        # controllers act in the frame of the world
        players.append((other, {**config, "frame": "world"}))
    return players


# One episode, step by step, as a table to read.

_WIDE = 1000  # a step is one line
_LEFT_OUT = ("is_success", "action_clipped", "physics_error")  # said in words where they are true


def watch(act: PolicyFactory, document: Mapping[str, Any], seed: int, steps: bool) -> None:
    """Play one episode and print what came of it.

    Args:
        act: What acts.
        document: Of the policy: its environment and settings.
        seed: Seed of the start.
        steps: Whether every step is printed too; unweighted terms of the reward are `r:term`.
    """
    print(f"{document['env_id']}   seed {seed}")
    venv = make(document["env_id"], document["env_kwargs"], 1)
    dt = getattr(getattr(venv.unwrapped, "task", None), "dt", None)
    rows, total, header, success = [], 0.0, ["step"], False
    for step, each in enumerate(rollout(act(venv), venv, [seed]), start=1):
        info = {key: values[0] for key, values in each.infos.items()}
        names = [key for key in info if key not in _LEFT_OUT and np.isscalar(info[key])]
        told = {"t [s]": f"{step * dt:.2f}"} if dt is not None else {}
        told |= {f"a[{k}]": f"{a:.3f}" for k, a in enumerate(np.atleast_1d(each.actions[0]))}
        told["reward"] = f"{each.rewards[0]:.4f}"
        told |= {name.replace("reward/", "r:"): f"{float(info[name]):.4g}" for name in names}
        header = ["step", *told, "notes"]
        rows.append((str(step), *told.values(), " ".join(k for k in _LEFT_OUT if info.get(k))))
        total += float(each.rewards[0])
        success = bool(info.get("is_success", False))
    if steps:
        print(table(header, rows, ">" * (len(header) - 1), indent=0, width=_WIDE))
    print(f"return {total:.4f} in {len(rows)} steps: {'success' if success else 'no success'}")
    venv.close()


# One episode in a window, as a film or a page, beside that of a controller or not.


def refuse_early(
    video: str | None, html: str | None, alone: bool, against: str | None
) -> tuple[Path | None, Path | None]:
    """Paths of film and page, which are refused before anything is done for them.

    Args:
        video: Name of the film.
        html: Name of the page.
        alone: Whether there is to be neither, nor a window.
        against: Name of a controller.

    Raises:
        ConfigError: A name that cannot be, or something to show that is not to be shown.
        DependencyNotInstalled: A package that writes the film is not installed.
    """
    given = {"--video": video, "--html": html, "--against": against}
    if alone and any(given.values()):
        names = [name for name, value in given.items() if value]
        raise ConfigError(f"--table prints only; leave out {' '.join(names)}")
    page = None if html is None else Path(html)
    if page is not None and not (page.suffix == ".html" and page.parent.is_dir()):
        raise ConfigError(f"--html = {html}; expected NAME.html in a folder that exists")
    with named_refusal("--video"):
        return (None if video is None else films.checked_film(video)), page


def show(
    env_id: str,
    seed: int,
    players: Sequence[Player],
    video: Path | None,
    html: Path | None,
    otherwise: Path,
) -> None:
    """Show an episode of each: as is asked for, or else in a window, or else as a film.

    Without the packages that draw, what was not asked for is left out, and one line on standard
    error says how to install them.

    Args:
        env_id: The environment.
        seed: Seed of the start.
        players: From `players_of`.
        video: A film to be written.
        html: A page to be written.
        otherwise: A film to be written where neither is asked for and there is no display.

    Raises:
        ConfigError: A film or a page of an environment that has no pictures.
        DependencyNotInstalled: A package that draws what was asked for is not installed.
    """
    asked = bool(video or html)
    if env_id not in ENVIRONMENTS:
        if asked or len(players) > 1:
            raise ConfigError(f"env_id = {env_id!r}; expected one of ours for pictures")
        return
    played = [films.play_episode(act, env_id, seed, each, act.name) for act, each in players]
    task, shown = played[0].task, [each.captioned() for each in played]
    if len(shown) > 1:
        print("   ".join(episode.label for _, episode in shown))
    try:
        if html is not None:
            replay = Replay(env_id, task, tuple(episode for _, episode in shown))
            print(f"page: {write_html(html, [(replay, k) for k in range(len(shown))])}")
        if not asked and _window(task, shown, f"{env_id}   seed {seed}"):
            return
        if film := video or (None if asked else otherwise):
            pictures = films.episode_pictures(shown)
            print(f"film: {films.write_film(film, pictures, films.pictures_per_second(task))}")
    except DependencyNotInstalled as error:
        if asked:
            raise
        print(f"not shown: {error}", file=sys.stderr)


def _window(task: Task, shown: Sequence[tuple[Task, PastEpisode]], title: str) -> bool:
    """Show episodes in a window; False where there is no display."""
    return pictures.has_display() and pictures.show(
        lambda: films.episode_pictures(shown, hold=0.0), films.pictures_per_second(task), title
    )


# Short film of a trained policy, in bounded time.

NAME = "film.mp4"

BUDGET = 4.0
"""Time [s] after which no picture is drawn any more."""

_SIZE = 360  # pixels along each side
_LEAST = 15.0  # pictures per second


def try_film(policy: CompiledPolicy, folder: Path, seed: int) -> Path | None:
    """Film the episode of the first start of an evaluation, in real time.

    It takes `BUDGET` seconds at most, and a moment more: a slow machine leaves out the end. Nothing
    that goes wrong is raised; it is said in one line on standard error.

    Args:
        policy: The policy, with its document.
        folder: Where the film goes.
        seed: Seed that the starts are spawned from.

    Returns:
        The film; None if there is none, and then no older one either.
    """
    path, end = folder / NAME, time.perf_counter() + BUDGET
    if policy.env_id not in ENVIRONMENTS:
        return None
    try:
        path.unlink(missing_ok=True)
        films.checked_film(path)
        start = row_seeds(seed, 1, "test")[0]
        ((act, config),) = players_of(policy, start)
        played = films.play_episode(act, policy.env_id, start, config, act.name)
        best = films.pictures_per_second(played.task)
        fps = best / max(1, int(best / _LEAST))
        pictures = films.episode_pictures([played.captioned()], Look(_SIZE, _SIZE), fps=fps)
        films.write_film(path, _until(end, pictures), fps)
    except Exception as error:  # a film is not worth the results of a training
        print(f"no film of the policy: {type(error).__name__}: {error}", file=sys.stderr)
        return None
    return path


def _until(end: float, pictures: Iterator[Image]) -> Iterator[Image]:
    """Pictures until the time is over, at least one."""
    for picture in pictures:
        yield picture
        if time.perf_counter() > end:
            return
