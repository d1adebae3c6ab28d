"""Episodes that are watched."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import numpy as np
from gymnasium.error import DependencyNotInstalled

from rigid_envs.base.checks import ConfigError
from rigid_envs.scores.policies import (
    PolicyFactory,
    RandomPolicy,
    from_predict,
    uniform,
    untrained_policy,
)
from rigid_envs.scores.starts import SupportsPredict
from rigid_envs.tasks.registry import ENVIRONMENTS

from ..environments import make

if TYPE_CHECKING:
    from rigid_envs.watch.films import Film, Played


# One episode, step by step, as a table to read.

_LEFT_OUT = ("is_success", "action_clipped", "physics_error")  # said in words where they are true


def watch(
    policy: SupportsPredict | None,
    env_id: str,
    env_kwargs: dict[str, Any],
    seed: int,
    out: TextIO | None = None,
) -> bool:
    """Play one episode and print every step of it.

    Args:
        policy: The policy; None plays at random.
        env_id: The environment.
        env_kwargs: Hyperparameters of the task.
        seed: Seed of the start.
        out: Where to print; None for standard output.

    Returns:
        Whether it ended in success.
    """
    out = sys.stdout if out is None else out
    venv = make(env_id, env_kwargs, 1)
    if policy is None:
        policy = RandomPolicy(venv.single_action_space, np.random.default_rng(seed))
    env: Any = venv.unwrapped
    dt = getattr(getattr(env, "task", None), "dt", None)
    total, success, names = 0.0, False, None
    for step, (action, reward, info) in enumerate(_episode(policy, venv, seed), start=1):
        total += reward
        success = bool(info.get("is_success", False))
        if names is None:
            names = [key for key in info if key not in _LEFT_OUT and np.isscalar(info[key])]
            _print_header(out, f"{env_id}   seed {seed}", names, np.size(action), dt)
        clock = f"{step:6d}" if dt is None else f"{step * dt:6.2f}"
        cells = [f"{float(a):7.3f}" for a in np.atleast_1d(action)] + [f"{reward:9.4f}"]
        cells += [f"{float(info[name]):>{_width(name)}.4g}" for name in names]
        notes = [key for key in _LEFT_OUT if info.get(key)]
        print(f"{step:5d}", clock, *cells, *notes, file=out)
    print(f"return {total:.4f} in {step} steps: {'success' if success else 'no success'}", file=out)
    venv.close()
    return success


def _episode(
    policy: SupportsPredict, venv: Any, seed: int
) -> Iterator[tuple[Any, float, dict[str, Any]]]:
    obs, _ = venv.reset(seed=[seed])
    done = False
    while not done:
        actions, _ = policy.predict(obs, deterministic=True)
        obs, rewards, terminated, truncated, infos = venv.step(actions)
        done = bool(terminated[0] or truncated[0])
        columns = infos["final_info"] if done else infos
        row = {
            key: np.asarray(column)[0]
            for key, column in columns.items()
            if not key.startswith("_") and not key.startswith("final_")
        }
        yield actions[0], float(rewards[0]), row


def _print_header(
    out: TextIO, title: str, names: list[str], n_action: int, dt: float | None
) -> None:
    actions = [f"   a[{k}]" for k in range(n_action)]
    clock = "  step" if dt is None else " t [s]"
    titles = [f"{_title(name):>{_width(name)}}" for name in names]
    header = [" step", clock, *actions, "   reward", *titles]
    print(title, " ".join(header), sep="\n", file=out)


def _title(name: str) -> str:
    """The name of an info entry; unweighted terms of the reward are `r:term`."""
    return name.replace("reward/", "r:")


def _width(name: str) -> int:
    return max(len(_title(name)), 9)


# One episode of a policy to look at: in a window, a film or a page, beside a controller or not.


def refuse_early(
    video: str | None, html: str | None, table: bool, against: str | None
) -> tuple[Path | None, Path | None]:
    """Paths of film and page, which are refused before anything is done for them.

    Args:
        video: Name of the film.
        html: Name of the page.
        table: Whether there is to be neither, nor a window.
        against: Name of a controller.

    Raises:
        ConfigError: A name that cannot be, or something to show that is not to be shown.
        DependencyNotInstalled: A package that writes the film is not installed.
    """
    given = {"--video": video, "--html": html, "--against": against}
    if table and any(given.values()):
        names = [name for name, value in given.items() if value]
        raise ConfigError(f"--table prints only; leave out {' '.join(names)}")
    page = None if html is None else Path(html)
    if page is not None and not (page.suffix == ".html" and page.parent.is_dir()):
        raise ConfigError(f"--html = {html}; expected NAME.html in a folder that exists")
    if video is None:
        return None, page
    from rigid_envs.watch.films import checked_film

    try:
        return checked_film(video), page
    except ValueError as error:
        raise ConfigError(f"--video: {error}") from None


class Show:
    """An episode of a policy, and that of a controller from the same start.

    Args:
        policy: The policy; None acts at random.
        document: Of the policy: its environment and algorithm.
        seed: Seed of the start.
        against: Name of a controller to be shown beside it; None for none.

    Raises:
        ConfigError: There is no such controller.
    """

    def __init__(
        self,
        policy: SupportsPredict | None,
        document: Mapping[str, Any],
        seed: int,
        against: str | None = None,
    ) -> None:
        """Nothing is played yet."""
        self._env_id = document["env_id"].rpartition(":")[2]
        self._seed = seed
        act = uniform(seed) if policy is None else from_predict(policy)
        name = "random" if policy is None else str(document["algo"]).upper()
        config = document["env_kwargs"]
        self._players: list[tuple[str, PolicyFactory, dict[str, Any]]] = [(name, act, config)]
        if against is not None:
            try:
                name, act = untrained_policy(self._env_id, against)
            except ValueError as error:
                raise ConfigError(f"--against: {error}") from None
            # controllers act in the frame of the world
            self._players.append((name, act, {**config, "frame": "world"}))

    def __call__(self, video: Path | None, html: Path | None, otherwise: Path) -> None:
        """Write what is asked for, or else open a window, or else write a film.

        Without the packages that draw, what was not asked for is left out, and one line on standard
        error says how to install them.

        Args:
            video: A film to be written.
            html: A page to be written.
            otherwise: A film to be written where neither is asked for and there is no display.

        Raises:
            ConfigError: A film or a page of an environment that has no pictures.
            DependencyNotInstalled: A package that draws what was asked for is not installed.
        """
        asked = bool(video or html)
        if self._env_id not in ENVIRONMENTS:
            if asked or len(self._players) > 1:
                raise ConfigError(f"env_id = {self._env_id!r}; expected one of ours for pictures")
            return
        played = self.play()
        if len(played) > 1:
            print("   ".join(each.captioned()[1].label for each in played))
        try:
            if video is not None:
                print(f"film: {self.film(played, video)}")
            if html is not None:
                print(f"page: {_page(played, html)}")
            if not asked and not self._window(played):
                print(f"film: {self.film(played, otherwise)}")
        except DependencyNotInstalled as error:
            if asked:
                raise
            print(f"not shown: {error}", file=sys.stderr)

    def play(self) -> list[Played]:
        """Play an episode of each."""
        from rigid_envs.watch.films import play_episode

        return [
            play_episode(act, self._env_id, self._seed, config, name)
            for name, act, config in self._players
        ]

    def film(self, played: list[Played], path: Path) -> Film:
        """Write a film of episodes side by side."""
        from rigid_envs.watch.films import episode_pictures, pictures_per_second, write_film

        task = played[0].task
        pictures = episode_pictures([each.captioned() for each in played])
        return write_film(path, pictures, pictures_per_second(task))

    def _window(self, played: list[Played]) -> bool:
        """Show episodes in a window; False where there is no display."""
        from rigid_envs.watch.animation import show
        from rigid_envs.watch.drawing import has_display
        from rigid_envs.watch.films import episode_pictures, pictures_per_second

        if not has_display():
            return False
        task, shown = played[0].task, [each.captioned() for each in played]
        return show(
            lambda: episode_pictures(shown, hold=0.0),
            pictures_per_second(task),
            f"{self._env_id}   seed {self._seed}",
        )


def _page(played: list[Played], path: Path) -> Path:
    """Write a page of episodes side by side."""
    from rigid_envs.watch.replays.page import write_html
    from rigid_envs.watch.replays.replay import Replay

    first = played[0]
    replay = Replay(first.env_id, first.task, tuple(each.captioned()[1] for each in played))
    return write_html(path, [(replay, k) for k in range(len(played))])
