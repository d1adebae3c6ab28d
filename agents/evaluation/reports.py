"""Final evaluation, its report and its film."""

from __future__ import annotations

import hashlib
import itertools
import math
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gymnasium.error import DependencyNotInstalled

from rigid_envs.base.checks import Image
from rigid_envs.base.files import write_atomic, write_document
from rigid_envs.scores import evaluation
from rigid_envs.scores.policies import from_predict
from rigid_envs.scores.result import Evaluation
from rigid_envs.scores.starts import TEST_SEED, row_seeds
from rigid_envs.scores.trained import CompiledPolicy, load
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools.cli.words import tell
from rigid_envs.tools.pages import tables

from ..environments import make
from ..storage.runs import manifest

if TYPE_CHECKING:
    from rigid_envs.tasks.task import Task
    from rigid_envs.watch.drawing import Look
    from rigid_envs.watch.replays.episode import Episode


# Evaluation of a policy: one episode from each of many fixed starts, all at once.


def evaluate(
    policy: Any,
    env_id: str,
    n: int = 500,
    seed: int = TEST_SEED,
    env_kwargs: Mapping[str, Any] | None = None,
    name: str | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Evaluation:
    """Evaluate as `rigid_envs.evaluate` does, also in native environments of other packages.

    Args:
        policy: See `rigid_envs.evaluate`; None plays at random.
        env_id: The environment.
        n: Number of starts.
        seed: Seed that the starts are spawned from.
        env_kwargs: Hyperparameters of the task.
        name: Who acts; None for the name that the policy has.
        progress: Called with a few words in every step.
    """
    venv = make(env_id, env_kwargs or {}, n)
    chosen = "random" if policy is None else policy
    own = env_id.rpartition(":")[2]
    found = evaluation.evaluate(
        own if own in ENVIRONMENTS else env_id,
        chosen,
        n=n,
        seed=seed,
        env=venv,
        name=name,
        progress=progress,
    )
    venv.close()
    return found


# Report of an evaluation: the policy beside the random baseline, as table, JSON and CSV.


def report(path: Path, n: int, seed: int, quiet: bool = False) -> tuple[dict[str, Any], Evaluation]:
    """Evaluate a policy file and the random policy on the same starts.

    Args:
        path: The policy file.
        n: Number of starts.
        seed: Seed of the starts.
        quiet: Whether no progress is shown.

    Returns:
        A row of the leaderboard without its starts, and where it comes from, as JSON values; and
        the evaluation.
    """
    policy = load(path)
    document = policy.document
    row, found = _measured(
        policy, document["env_id"], document["env_kwargs"], n, seed, document["algo"], quiet
    )
    row |= {
        "training_seed": document["seed"],
        "training_timesteps": document["timesteps"],
        "policy_sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
    }
    return row, found


def report_controller(
    name: str, env_id: str, n: int, seed: int
) -> tuple[dict[str, Any], Evaluation]:
    """Evaluate what needs no training, and the random policy, on the same starts.

    Args:
        name: Name of the controller.
        env_id: The environment.
        n: Number of starts.
        seed: Seed of the starts.

    Returns:
        As `report`.
    """
    return _measured(name, env_id, {}, n, seed, None)


def _measured(
    policy: Any,
    env_id: str,
    env_kwargs: dict[str, Any],
    n: int,
    seed: int,
    name: str | None,
    quiet: bool = False,
) -> tuple[dict[str, Any], Evaluation]:
    progress = (lambda _: None) if quiet else tell
    found = evaluate(policy, env_id, n, seed, env_kwargs, name, progress)
    baseline = evaluate(None, env_id, n, seed, env_kwargs, progress=progress)
    progress("")
    row = {key: value for key, value in found.row().items() if key not in ("starts", "sha256")}
    command = " ".join([Path(sys.executable).name, "-m", "agents", *sys.argv[1:]])
    return row | {"random_policy": baseline.summary(), **manifest(), "command": command}, found


def write_report(folder: Path, row: dict[str, Any], found: Evaluation) -> None:
    """Write `results.json`, and `episodes.csv` with one row per start.

    Args:
        folder: Folder of the files.
        row: From `report`.
        found: From `report`.
    """
    bounds = [""] * found.n if found.bounds is None else found.bounds.tolist()
    columns = zip(
        found.seeds,
        found.successes.astype(int).tolist(),
        found.values["return"].tolist(),
        found.values["length"].astype(int).tolist(),
        found.costs.tolist(),
        bounds,
        strict=True,
    )
    lines = ["seed,is_success,return,length,cost,bound", *(",".join(map(str, c)) for c in columns)]
    write_atomic(folder / "episodes.csv", "\n".join(lines) + "\n")
    write_document(folder / "results.json", found.row() | row)


def table(row: dict[str, Any]) -> str:
    """Figures of `report` as an aligned table."""
    policy, baseline = row["policy"], row["random_policy"]
    cost, unit, _ = row["cost"] or ("cost", "", 0.0)
    header = ("", "success", "95 %", "efficiency", "95 %", f"{cost} [{unit}]" if unit else cost,
              "best", "bound", "return")  # fmt: skip
    rows = [_row(row["algo"], policy), _row("random policy", baseline)]
    title = f"{row['env_id']}: {policy['episodes']} unseen starts, one episode from each"
    figures = tables.table(header, rows, "<" + ">" * (len(header) - 1), indent=0)
    note = f"{cost}, best known and bound: means over the starts that succeeded"
    return f"{title}\n\n{figures}\n\n{note}"


def _row(name: str, figures: dict[str, Any]) -> tuple[str, ...]:
    low, high = figures["success_rate_95"]
    ends = figures["efficiency_95"]
    return (
        name,
        f"{100 * figures['success_rate']:.1f} %",
        f"{100 * low:.1f} .. {100 * high:.1f}",
        _number(figures["efficiency"]),
        "-" if ends is None else " .. ".join(map(_number, ends)),
        *(_number(figures[key]) for key in ("cost_mean", "best_mean", "bound_mean")),
        _number(figures["return_mean"]),
    )


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"


# Short film of a trained policy, in bounded time.

NAME = "film.mp4"

BUDGET = 4.0
"""Time [s] after which no picture is drawn any more."""

_SIZE = 360  # pixels along each side
_DRAWING = 0.7  # share of the time that drawing may plan with; encoding takes the rest
_SLOWEST = 15.0  # pictures per second, below which rather the end is left out
_TRIALS = 4


def try_film(policy: CompiledPolicy, folder: Path, seed: int) -> Path | None:
    """Film the episode of the first start of an evaluation, in real time.

    It takes `BUDGET` seconds at most, and a moment more: a slow machine draws fewer pictures per
    second and, if that is not enough, leaves out the end. Nothing that goes wrong is raised; it is
    said in one line on standard error.

    Args:
        policy: The policy, with its document.
        folder: Where the film goes.
        seed: Seed that the starts are spawned from.

    Returns:
        The film; None if there is none, and then no older one either.
    """
    path = folder / NAME
    if policy.document["env_id"].rpartition(":")[2] not in ENVIRONMENTS:
        return None
    try:
        path.unlink(missing_ok=True)
        _film(policy, path, row_seeds(seed, 1, "test")[0])
    except DependencyNotInstalled as error:
        print(f"no film of the policy: {error}", file=sys.stderr)
        return None
    except Exception as error:  # a film is not worth the results of a training
        print(f"no film of the policy: {type(error).__name__}: {error}", file=sys.stderr)
        return None
    return path


def _film(policy: CompiledPolicy, path: Path, seed: int) -> None:
    end = time.perf_counter() + BUDGET
    from rigid_envs.watch.drawing import Look
    from rigid_envs.watch.films import (
        checked_film,
        episode_pictures,
        pictures_per_second,
        play_episode,
        write_film,
    )

    checked_film(path)
    document = policy.document
    env_id, config = document["env_id"].rpartition(":")[2], document["env_kwargs"]
    label = str(document["algo"]).upper()
    played = play_episode(from_predict(policy), env_id, seed, config, label)
    task, shown = played.task, [played.captioned()]
    best = pictures_per_second(task)
    look = Look(_SIZE, _SIZE)
    fps = best / _stride(shown, look, best, end)
    pictures = episode_pictures(shown, look, fps=fps)
    write_film(path, _until(end, pictures), fps)


def _stride(shown: list[tuple[Task, Episode]], look: Look, best: float, end: float) -> int:
    """Number of pictures of which one is drawn, so that the time is enough for the episode."""
    from rigid_envs.watch.films import episode_pictures

    trial = episode_pictures(shown, look)
    next(trial)  # makes the scene
    begin = time.perf_counter()
    n = sum(1 for _ in itertools.islice(trial, _TRIALS))
    each = (time.perf_counter() - begin) / max(n, 1)
    affordable = max(_DRAWING * (end - time.perf_counter()) / each, 1.0)
    ((task, episode),) = shown
    stride = math.ceil((len(episode) * task.dt + 1.0) * best / affordable)
    return max(1, min(stride, int(best / _SLOWEST)))


def _until(end: float, pictures: Iterator[Image]) -> Iterator[Image]:
    """Pictures until the time is over, at least one."""
    for picture in pictures:
        yield picture
        if time.perf_counter() > end:
            return
