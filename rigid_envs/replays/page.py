"""A page to watch replays in a browser: one file, without server or network."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from rigid_envs.files import write_atomic
from rigid_envs.moment import Moment
from rigid_envs.provenance import heading
from rigid_envs.render.view import View
from rigid_envs.replays.curves import Curve, curves, is_driven
from rigid_envs.replays.episode import Episode
from rigid_envs.replays.inbetween import moments
from rigid_envs.replays.insets import insets
from rigid_envs.replays.packing import Packer
from rigid_envs.replays.panels import Panel
from rigid_envs.replays.replay import Replay
from rigid_envs.tasks import Task

__all__ = ["MOST_BYTES", "MOST_EPISODES", "html", "write_html"]

MOST_BYTES = 1_500_000
MOST_EPISODES = 4
"""Episodes side by side in a page."""

_BUDGETS = (2400, 1200, 600, 1)  # moments of an episode; fewer where the file would be too large
_MARK = "/* replay */"

ViewOf = Callable[[Task, dict[str, float]], View]


def write_html(
    path: str | Path, episodes: Sequence[tuple[Replay, int]], view_of: ViewOf | None = None
) -> Path:
    """Write a page that shows episodes side by side.

    Args:
        path: The file, atomically replaced; missing folders are made.
        episodes: Replays, each with the index of one of its episodes.
        view_of: Makes the view of a task; None takes `rigid_envs.render.views.view_of`.

    Returns:
        The path that was written.

    Raises:
        ValueError: No episode, too many, an index that does not exist, or more than fits a page.
    """
    file = Path(path)
    text = html(episodes, view_of)
    file.parent.mkdir(parents=True, exist_ok=True)
    write_atomic(file, text)
    return file


def html(episodes: Sequence[tuple[Replay, int]], view_of: ViewOf | None = None) -> str:
    """The page of `write_html`, as text."""
    if not 1 <= len(episodes) <= MOST_EPISODES:
        raise ValueError(f"{len(episodes)} episodes; expected 1 to {MOST_EPISODES} in a page")
    for replay, k in episodes:
        if not 0 <= k < len(replay.episodes):
            raise ValueError(f"episode = {k}; expected 0 to {len(replay.episodes) - 1}")
    make = view_of or _registered_view()
    template = resources.files("rigid_envs.replays").joinpath("viewer/viewer.html").read_text()
    head, tail = template.split(_MARK)
    for budget in _BUDGETS:
        document = json.dumps(_payload(episodes, make, budget), allow_nan=False)
        page = head + document.replace("<", "\\u003c") + tail  # no text can end the element
        if len(page.encode()) < MOST_BYTES:
            return page
    raise ValueError(
        f"page = {len(page.encode())} bytes; expected less than {MOST_BYTES}: show fewer or "
        "shorter episodes"
    )


def _registered_view() -> ViewOf:
    from rigid_envs.render.views import view_of  # all views: only where one is needed

    return view_of


def _payload(
    episodes: Sequence[tuple[Replay, int]], view_of: ViewOf, budget: int
) -> dict[str, Any]:
    """All that the page shows, as JSON values."""
    packer = Packer()
    shown = [(replay, replay.episodes[k]) for replay, k in episodes]
    driven = any(is_driven(episode) for _, episode in shown)
    labels = _labels([episode for _, episode in shown])
    parts: list[dict[str, Any]] = []
    for label, (replay, episode) in zip(labels, shown, strict=True):
        view = view_of(replay.task, dict(episode.parameters))
        path = moments(replay.task, episode, budget)
        parts.append({"label": label, **_episode(packer, replay.task, episode, view, path, driven)})
    ids = list(dict.fromkeys(replay.env_id for replay, _ in shown))
    first = shown[0][0]
    summary = (type(first.task).__doc__ or "").strip().splitlines()
    return {
        "title": " and ".join(env_id.rpartition("/")[2] for env_id in ids),
        "subtitle": summary[0].replace("`", "") if summary and len(ids) == 1 else "",
        "facts": _facts(labels, shown),
        "plots": _plots(packer, [curves(r.task, e, driven) for r, e in shown], shown),
        "episodes": parts,
        "meshes": packer.meshes,
        "blob": packer.blob(),
    }


def _episode(
    packer: Packer,
    task: Task,
    episode: Episode,
    view: View,
    path: Sequence[Moment],
    driven: bool,
) -> dict[str, Any]:
    """An episode: its motion, and what is shown beside it."""
    steps = [episode.moment(k, task) for k in range(len(episode) + 1)]
    beside = insets(task.system(episode.parameters), path, driven)
    won = bool(len(episode) and episode.success[-1])
    result = f"{float(np.sum(episode.rewards)):.4g} return, {len(episode)} steps"
    return {
        "result": f"success, {result}" if won else result,
        "success": won,
        "times": packer.array(episode.times, "f8"),
        "text": [list(view.frame(moment).text) for moment in steps],
        "stage": packer.stage(_panel(view, path)),
        "insets": [{"title": panel.title, "stage": packer.stage(panel)} for panel in beside],
    }


def _panel(view: View, path: Sequence[Moment]) -> Panel:
    """The motion as the view shows it."""
    frames = [view.frame(moment) for moment in path]
    return Panel("Motion", view.scene, frames, np.array([moment.time for moment in path]))


def _plots(
    packer: Packer, found: Sequence[Sequence[Curve]], shown: Sequence[tuple[Replay, Episode]]
) -> list[dict[str, Any]]:
    """One plot for each kind of curve, with the lines of all episodes that have it."""
    kinds: dict[tuple[Any, ...], dict[int, Curve]] = {}
    for k, (several, (_, episode)) in enumerate(zip(found, shown, strict=True)):
        for curve in several:
            held = len(curve.values) == len(episode)
            kind = curve.key, curve.title, curve.unit, curve.kind, curve.names, held
            kinds.setdefault(kind, {})[k] = curve
    return [
        {
            **dict(zip(("key", "title", "unit", "kind", "names", "held"), kind, strict=True)),
            "episodes": [
                _lines(packer, here[k], episode) if k in here else None
                for k, (_, episode) in enumerate(shown)
            ],
        }
        for kind, here in kinds.items()
    ]


def _lines(packer: Packer, curve: Curve, episode: Episode) -> dict[str, Any]:
    """The lines of an episode: over the moments, or over the steps, which end at their times."""
    times = packer.array(episode.times[len(episode.times) - len(curve.values) :], "f8")
    x, *lines = [packer.array(column, "f8") for column in curve.values.T]
    end = float(episode.times[-1])
    if curve.kind == "plan":
        return {"end": end, "x": x, "times": times, "lines": lines}
    return {"end": end, "x": times, "lines": [x, *lines]}


def _labels(episodes: Sequence[Episode]) -> list[str]:
    """Who acts in each episode; those of one name are numbered."""
    names = [episode.label or "episode" for episode in episodes]
    return [
        f"{name} {names[: k + 1].count(name)}" if names.count(name) > 1 else name
        for k, name in enumerate(names)
    ]


def _facts(labels: Sequence[str], shown: Sequence[tuple[Replay, Episode]]) -> list[tuple[str, str]]:
    """What the page says about its episodes and their origin; what is equal, once."""
    facts: dict[tuple[str, str], list[str]] = {}
    for label, (replay, episode) in zip(labels, shown, strict=True):
        values = ", ".join(f"{name} = {value:.6g}" for name, value in episode.parameters.items())
        facts.setdefault(("parameters", f"{values} ({replay.env_id})"), []).append(label)
        facts.setdefault(("made with", _origin(replay)), []).append(label)
    result = []
    for (name, text), owners in facts.items():
        common = len(owners) == len(shown)
        result.append((name if common else f"{name}: {', '.join(owners)}", text))
    return result


def _origin(replay: Replay) -> str:
    """Where a replay comes from, as far as the file says it."""
    try:
        return heading(replay.provenance)
    except (LookupError, TypeError, AttributeError, ValueError):
        return "unknown"
