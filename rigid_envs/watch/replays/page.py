"""A page to watch replays in a browser: scenes, curves and insets, as JSON and one block."""

import base64
import json
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, require
from rigid_envs.base.files import write_atomic
from rigid_envs.engine.provenance import heading
from rigid_envs.mechanics import rotations
from rigid_envs.mechanics.system import System
from rigid_envs.tasks.core import Moment
from rigid_envs.tasks.task import Task
from rigid_envs.watch.meshes import Mesh
from rigid_envs.watch.replays.replay import PastEpisode, Replay, moments
from rigid_envs.watch.views import Panel, Pose, Scene, SceneFrame, View, view_class

# Curves that are plotted beside the motion: rates, tilt, errors of what is conserved, reward.


@dataclass(frozen=True, eq=False)
class Curve:
    """Quantities of an episode over time, or a path in the plane.

    Attributes:
        key: What it is, for programs.
        title: What it is.
        unit: Unit, and frame where there are two.
        names: Name of each quantity.
        values: Shape (n, k): at the T + 1 moments, or of the T steps.
        kind: "time"; "plan" for a path, whose columns are x and y.
    """

    key: str
    title: str
    unit: str
    names: tuple[str, ...]
    values: Array
    kind: str = "time"


def curves(task: Task, episode: PastEpisode, driven: bool) -> list[Curve]:
    """What is plotted of an episode.

    Args:
        task: Its task.
        episode: The episode.
        driven: Whether an input acts, in this episode or in one that it is compared with: what is
            conserved without it then has changes instead of errors.
    """
    found = motion_curves(task.system(episode.parameters), episode.y, episode.u, driven)
    if goal := _from_goal(task, episode):
        found = [goal if curve.key == goal.key else curve for curve in found]
    quantity, _, unit = task.cost_unit.rpartition("[")
    spent = np.cumsum(episode.costs)[:, None]
    entries = tuple(entry.symbol for entry in task.actions())
    action = "choice" if task.n_choices else "of the largest"
    found += [
        Curve("reward", "Reward", "per step", ("reward",), episode.rewards[:, None]),
        Curve("cost", f"Cost: {quantity.strip()}", unit.rstrip("]"), ("sum",), spent),
        Curve("action", "Action", action, entries, episode.applied),
    ]
    return found


def motion_curves(system: System, y: Array, u: Array, driven: bool) -> list[Curve]:
    """What is plotted of a motion.

    Args:
        system: The system.
        y: States, shape (n, n_state), the start first.
        u: Inputs, shape (n, n_input), or (n - 1, n_input), of the steps between.
        driven: As of `curves`.
    """
    found = [*_motion(system, y, u), *_attitude(system, y), *_path(system, y), *_wheels(system, y)]
    found += _parts_of_momentum(system, y)
    word = "error" if system.conserves and not driven else "change"
    return [*found, *_errors(system, y, word)]


def is_driven(episode: PastEpisode) -> bool:
    """Whether any action or input acts in the episode: then energy and momentum may change."""
    return bool(np.any(episode.u != 0.0) or np.any(episode.applied != 0.0))


def conservation_errors(system: System, y: npt.ArrayLike) -> dict[str, Array]:
    """Deviations of what is conserved without input from its value at the start.

    Each is divided by the largest size of the quantity: ``(E - E[0]) / max |E|``. That of L counts
    what each wheel has, for together they may have none.

    Args:
        system: The system.
        y: States, shape (n, n_state), the start first.

    Returns:
        "energy" and what else there is, each of shape (n,).
    """
    invariants = system.invariants(y)
    symmetric = getattr(system, "I1", None) == getattr(system, "I2", None)
    found = {name: value for name, value in invariants.items() if name in _CONSERVED}
    if "L_squared" in found:
        found = {"L" if k == "L_squared" else k: v for k, v in found.items()}
        found["L"] = np.sqrt(found["L"])
    if not symmetric:
        found.pop("L_spin", None)
    sizes = {name: float(np.max(np.abs(value))) for name, value in found.items()}
    if "L" in found and "spin_momenta" in system.accessors:
        spins = system.accessors["spin_momenta"](y)
        sizes["L"] = max(sizes["L"], float(np.max(np.abs(spins))))
    return {name: (x - x[0]) / max(sizes[name], 1e-300) for name, x in found.items()}


_CONSERVED = {
    "energy": "energy",
    "L_squared": "|L|",
    "L": "|L|",
    "L_vertical": "vertical L",
    "L_spin": "L about the axis",
    "q_squared": "|q|\N{SUPERSCRIPT TWO}",
}


def _errors(system: System, y: Array, word: str) -> list[Curve]:
    """Energy, and momenta: errors where nothing drives or slows the system, else changes."""
    found = conservation_errors(system, y)
    result = []
    if (energy := found.pop("energy", None)) is not None:
        title = f"Energy {word}"
        result.append(Curve("energy", title, "relative", ("energy",), energy[:, None]))
    if found:
        names = tuple(_CONSERVED[name] for name in found)
        title = f"|L| {word}" if tuple(found) == ("L",) else f"Momentum {word}"
        if "q_squared" in found:  # it stays 1, whatever drives the ball
            title = "|q|\N{SUPERSCRIPT TWO} error"
        result.append(Curve("momentum", title, "relative", names, np.stack([*found.values()], -1)))
    return result


def _motion(system: System, y: Array, u: Array) -> list[Curve]:
    """Angular velocity; of what has one degree of freedom, the velocity; else the state."""
    named = system.accessors
    unit, names = "rad/s, world axes", ("\u03c9x", "\u03c9y", "\u03c9z")
    if "omega_body" in named:
        unit, names = "rad/s, body axes", ("\u03c9\u2081", "\u03c9\u2082", "\u03c9\u2083")
        values = named["omega_body"](y)
    elif "omega_world" in named:
        values = named["omega_world"](y)
    elif hasattr(system, "omega_world"):
        values = np.asarray(system.omega_world(u))
    elif "velocity" in named:
        return [Curve("omega", "Velocity", "m/s", ("v",), named["velocity"](y).reshape(len(y), -1))]
    else:
        return [Curve("state", "State", "SI units", system.state_entries, y)]
    return [Curve("omega", "Angular velocity", unit, names, values)]


def _path(system: System, y: Array) -> list[Curve]:
    """Path of a contact or of a pivot that moves; the height of what flies."""
    named = system.accessors
    if "position" in named and (place := named["position"](y)).shape[-1] == 3:
        return [Curve("height", "Height", "m", ("Z",), place[:, 2:])]
    for name in ("contact", "position", "pivot"):
        if name in named and np.ptp(path := named[name](y)[..., :2], axis=0).any():
            title = {"pivot": "Path of the pivot"}.get(name, "Path on the plane")
            return [Curve("plan", f"{title}, from above", "m", ("x", "y"), path, "plan")]
    return []


def _wheels(system: System, y: Array) -> list[Curve]:
    """Spin momenta of wheels, where there are some."""
    named = system.accessors
    if "spin_momenta" not in named:
        return []
    names = ("l\u2081", "l\u2082", "l\u2083")
    return [Curve("wheels", "Spin of the wheels", "N m s", names, named["spin_momenta"](y))]


def _parts_of_momentum(system: System, y: Array) -> list[Curve]:
    """Angular momentum along a magnetic field and across it, where there is one."""
    named = system.accessors
    if "field_body" not in named or not (B := named["field_body"](y)).any():
        return []
    L, n = named["L_body"](y), B / np.linalg.norm(B, axis=-1, keepdims=True)
    values = np.stack([np.sum(L * n, axis=-1), np.linalg.norm(np.cross(L, n), axis=-1)], axis=-1)
    return [Curve("field", "Angular momentum", "N m s", ("along B", "across B"), values)]


def _from_goal(task: Task, episode: PastEpisode) -> Curve | None:
    """The angle of the attitude from that of a goal; None where no attitude is one."""
    for name in ("goal", "reference"):
        if f"{name}_w" in task.aux_names:
            columns = [task.aux_names.index(f"{name}_{part}") for part in "wxyz"]
            q, goal = (rotations.normalize(x) for x in (episode.y[:, :4], episode.aux[:, columns]))
            angle = rotations.distance(q, goal)
            return _angle("Attitude", f"deg, from the {name}", ("angle",), angle)
    return None


def _attitude(system: System, y: Array) -> list[Curve]:
    """The angle that says most about the attitude: of the axis, or from upright."""
    if "q" not in system.components:
        return []
    named = system.accessors
    if "heading" in named:
        both = np.stack([named["heading"](y), named["phase"](y)], axis=-1)
        return [_angle("Heading and roll phase", "deg", ("heading", "phase"), both)]
    if "L_body" in named and "tilt" not in named:
        L = named["L_body"](y)
        angle = np.arctan2(np.linalg.norm(L[:, :2], axis=-1), L[:, 2])
        return [_angle("Tilt", "deg, of e\u2083 from L", ("tilt",), angle)]
    tilt = named["tilt"](y) if "tilt" in named else None
    if tilt is not None and tilt.ndim == 1:
        return [_angle("Tilt", "deg, from the vertical", ("tilt",), tilt)]
    return [
        _angle(
            "Attitude",
            "deg, from upright",
            ("angle",),
            rotations.angle(rotations.normalize(y[:, :4])),
        )
    ]


def _angle(title: str, unit: str, names: tuple[str, ...], values: Array) -> Curve:
    return Curve("tilt", title, unit, names, np.degrees(values.reshape(len(values), -1)))


# Insets of a replay page: Poinsot's construction of a free body, the axis of a top on a sphere.


def insets(system: System, moments: Sequence[Moment], driven: bool) -> list[Panel]:
    """What is shown beside the motion of a system.

    Args:
        system: The system.
        moments: Moments of the episode.
        driven: Whether inputs act: without them, the inertia ellipsoid rolls on a plane.
    """
    times = np.array([moment.time for moment in moments])
    y = np.array([moment.y for moment in moments])
    return view_class(type(system)).insets(system, y, times, driven)


# Scenes, frames and curves as JSON and one block of binary numbers, for the replay page.

_KINDS = {"f4": np.float32, "f8": np.float64, "u1": np.uint8, "u4": np.uint32}
_ALIGNED = 8  # bytes
_SYMBOLS = {"omega": "\u03c9", "tau": "\u03c4"}


class Packer:
    """Collects arrays in one block; equal arrays and meshes are kept once.

    Attributes:
        meshes: References to the arrays of every mesh.
    """

    def __init__(self) -> None:
        """Begin with an empty block."""
        self.meshes: list[dict[str, Any]] = []
        self._block = bytearray()
        self._places: dict[tuple[str, bytes], list[Any]] = {}
        self._numbers: dict[Mesh, int] = {}

    def array(self, values: npt.ArrayLike, kind: str = "f4") -> list[Any]:
        """Reference to an array, [kind, offset in bytes, number of entries]; rows follow rows."""
        data = np.ascontiguousarray(values, dtype=_KINDS[kind])
        raw = data.tobytes()
        if (kind, raw) not in self._places:
            self._places[kind, raw] = [kind, len(self._block), data.size]
            self._block += raw + bytes(-len(raw) % _ALIGNED)
        return self._places[kind, raw]

    def blob(self) -> str:
        """The block, deflated, in base64."""
        return base64.b64encode(zlib.compress(bytes(self._block), 9)).decode("ascii")

    def stage(self, panel: Panel) -> dict[str, Any]:
        """A panel: its scene, and its frames as arrays over time."""
        scene, frames = panel.scene, panel.frames
        return {
            "times": self.array(panel.times, "f8"),
            "camera": {**asdict(scene.camera), "fov": scene.camera.field_of_view},
            "floor": None if scene.floor is None else asdict(scene.floor),
            "parts": [self._part(name, scene, frames) for name in scene.parts],
            "arrows": [self._arrow(name, scene, frames) for name in scene.arrows],
            "traces": [self._trace(name, panel) for name in scene.traces],
        }

    def _part(self, name: str, scene: Scene, frames: Sequence[SceneFrame]) -> dict[str, Any]:
        part, gone = scene.parts[name], Pose((np.nan,) * 3, (np.nan,) * 4, (np.nan,) * 3)
        columns = zip(*(frame.poses.get(name, gone) for frame in frames), strict=True)
        rows = {key: self._rows(column) for key, column in zip(Pose._fields, columns, strict=True)}
        return {"name": name, **part._asdict(), "mesh": self._mesh(part.mesh), **rows}

    def _arrow(self, name: str, scene: Scene, frames: Sequence[SceneFrame]) -> dict[str, Any]:
        arrow = scene.arrows[name]
        nothing = ((np.nan,) * 3,) * 2
        ends = [frame.arrows.get(name, nothing) for frame in frames]
        return {
            **asdict(arrow),
            "label": _SYMBOLS.get(arrow.label, arrow.label),
            "start": self._rows([start for start, _ in ends]),
            "vector": self._rows([vector for _, vector in ends]),
        }

    def _trace(self, name: str, panel: Panel) -> dict[str, Any]:
        trace, whole = panel.scene.traces[name], panel.whole.get(name)
        points = [frame.points.get(name, (np.nan,) * 3) for frame in panel.frames]
        return {
            **asdict(trace),
            "whole": whole is not None,
            "points": self.array(np.asarray(points if whole is None else whole, dtype=np.float64)),
        }

    def _rows(self, values: Sequence[npt.ArrayLike]) -> list[Any]:
        """Rows over time; one row where they are all the same."""
        rows = np.array([np.asarray(value, dtype=np.float64) for value in values], dtype=np.float32)
        constant = np.array_equal(rows[1:], rows[:-1], equal_nan=True)
        return self.array(rows[:1] if constant else rows)

    def _mesh(self, mesh: Mesh) -> int:
        """Number of a mesh."""
        if mesh not in self._numbers:
            self._numbers[mesh] = len(self.meshes)
            self.meshes.append(
                {
                    "vertices": self.array(mesh.vertices),
                    "normals": self.array(mesh.normals),
                    "colors": self.array(mesh.colors, "u1"),
                    "triangles": self.array(mesh.triangles, "u4"),
                }
            )
        return self._numbers[mesh]


# A page to watch replays in a browser: one file, without server or network.

MOST_BYTES = 1_500_000
MOST_EPISODES = 4
"""Episodes side by side in a page."""

_BUDGETS = (2400, 1200, 600, 1)  # moments of an episode; fewer where the file would be too large
_MARK = "/* replay */"


def write_html(path: str | Path, episodes: Sequence[tuple[Replay, int]], title: str = "") -> Path:
    """Write a page that shows episodes side by side.

    Args:
        path: The file, atomically replaced; missing folders are made.
        episodes: Replays, each with the index of one of its episodes.
        title: Of a page about motions of systems, which says nothing of tasks, rewards and costs.
            Empty for a page about tasks.

    Returns:
        The path that was written.

    Raises:
        ValueError: No episode, too many, an index that does not exist, or more than fits a page.
    """
    file = Path(path)
    text = html(episodes, title)
    file.parent.mkdir(parents=True, exist_ok=True)
    write_atomic(file, text)
    return file


def html(episodes: Sequence[tuple[Replay, int]], title: str = "") -> str:
    """The page of `write_html`, as text."""
    if not 1 <= len(episodes) <= MOST_EPISODES:
        raise ValueError(f"{len(episodes)} episodes; expected 1 to {MOST_EPISODES} in a page")
    for replay, k in episodes:
        n = len(replay.episodes)
        require(0 <= k < n, k, "episode", f"0 to {n - 1}")
    return fitting(lambda budget: _payload(episodes, budget, title))


def fitting(payload: Callable[[int], dict[str, Any]]) -> str:
    """The most detailed page that is small enough.

    Args:
        payload: All that the page shows, as JSON values, for a number of moments of each episode.

    Raises:
        ValueError: None is.
    """
    template = resources.files("rigid_envs.watch.replays").joinpath("viewer/viewer.html")
    head, tail = template.read_text().split(_MARK)
    for budget in _BUDGETS:
        document = json.dumps(payload(budget), allow_nan=False)
        page = head + document.replace("<", "\\u003c") + tail  # no text can end the element
        if len(page.encode()) < MOST_BYTES:
            return page
    raise ValueError(
        f"page = {len(page.encode())} bytes; expected less than {MOST_BYTES}: show fewer or "
        "shorter episodes"
    )


class Shown(NamedTuple):
    """An episode, or the motion of a system alone, as a page shows it.

    Attributes:
        label: Who acts.
        result: What it came to, in words.
        success: Whether it was one.
        times: Of the text and of the curves [s], shape (n,).
        text: What is said at each time.
        view: What it looks like.
        path: Moments that are drawn.
        curves: What is plotted.
        facts: What is said of it, with the name of each fact.
    """

    label: str
    result: str
    success: bool
    times: Array
    text: list[tuple[str, ...]]
    view: View
    path: Sequence[Moment]
    curves: list[Curve]
    facts: tuple[tuple[str, str], ...]


def document(shown: Sequence[Shown], driven: bool, title: str, subtitle: str) -> dict[str, Any]:
    """All that a page shows, as JSON values."""
    packer = Packer()
    labels = _labels([each.label for each in shown])
    parts = [
        {
            "label": label,
            "result": each.result,
            "success": each.success,
            "text": each.text,
            **_stages(packer, each, driven),
        }
        for label, each in zip(labels, shown, strict=True)
    ]
    return {
        "title": title,
        "subtitle": subtitle,
        "facts": _facts(labels, shown),
        "plots": _plots(packer, shown),
        "episodes": parts,
        "meshes": packer.meshes,
        "blob": packer.blob(),
    }


def _payload(episodes: Sequence[tuple[Replay, int]], budget: int, title: str) -> dict[str, Any]:
    """All that a page of episodes shows, as JSON values."""
    played = [(replay, replay.episodes[k]) for replay, k in episodes]
    driven = any(is_driven(episode) for _, episode in played)
    shown = [_shown(replay, episode, budget, driven, title) for replay, episode in played]
    ids = list(dict.fromkeys(replay.env_id for replay, _ in played))
    summary = (type(played[0][0].task).__doc__ or "").strip().splitlines()
    alone = summary and len(ids) == 1 and not title
    return document(
        shown,
        driven,
        title or " and ".join(env_id.rpartition("/")[2] for env_id in ids),
        summary[0].replace("`", "") if alone else "",
    )


def _shown(replay: Replay, episode: PastEpisode, budget: int, driven: bool, title: str) -> Shown:
    """An episode; of a task only without title."""
    task = replay.task
    view = view_class(task.system_type if title else type(task))(task, episode.parameters)
    steps = [episode.moment(k, task) for k in range(len(episode) + 1)]
    won = bool(len(episode) and episode.success[-1]) and not title
    result = f"{float(np.sum(episode.rewards)):.4g} return, {len(episode)} steps"
    text = [view.frame(moment).text for moment in steps]
    if title:
        result, text = f"{episode.times[-1]:.3g} s", readings(view, steps)
    whose = "" if title else f" ({replay.env_id})"
    return Shown(
        episode.label,
        f"success, {result}" if won else result,
        won,
        episode.times,
        text,
        view,
        moments(task, episode, budget),
        _curves(replay, episode, driven, title),
        facts(episode.parameters, _origin(replay), whose),
    )


def readings(view: View, path: Sequence[Moment]) -> list[tuple[str, ...]]:
    """What is said of the motion of a system alone, at each moment."""
    return [(f"time {moment.time:.1f} s", *view.readings(moment)) for moment in path]


def facts(
    parameters: Mapping[str, float], origin: str, whose: str = ""
) -> tuple[tuple[str, str], ...]:
    """Parameters of a system, and where its motion comes from."""
    values = ", ".join(f"{name} = {value:.6g}" for name, value in parameters.items())
    return ("parameters", values + whose), ("made with", origin)


def _stages(packer: Packer, shown: Shown, driven: bool) -> dict[str, Any]:
    """The motion of an episode, and what is shown beside it."""
    view, path = shown.view, shown.path
    times = np.array([moment.time for moment in path])
    frames = [SceneFrame(view.poses(m), view.arrows(m), view.points(m)) for m in path]
    motion = Panel("Motion", view.scene, frames, times)
    beside = insets(view.system, path, driven)
    return {
        "times": packer.array(shown.times, "f8"),
        "stage": packer.stage(motion),
        "insets": [{"title": panel.title, "stage": packer.stage(panel)} for panel in beside],
    }


def _curves(replay: Replay, episode: PastEpisode, driven: bool, title: str) -> list[Curve]:
    """The curves of an episode, under a title without those of the task."""
    hidden = ("reward", "cost", "" if driven else "action") if title else ()
    return [each for each in curves(replay.task, episode, driven) if each.key not in hidden]


def _plots(packer: Packer, shown: Sequence[Shown]) -> list[dict[str, Any]]:
    """One plot for each kind of curve, with the lines of all episodes that have it."""
    kinds: dict[tuple[Any, ...], dict[int, Curve]] = {}
    for k, each in enumerate(shown):
        for curve in each.curves:
            held = len(curve.values) < len(each.times)
            kind = curve.key, curve.title, curve.unit, curve.kind, curve.names, held
            kinds.setdefault(kind, {})[k] = curve
    return [
        {
            **dict(zip(("key", "title", "unit", "kind", "names", "held"), kind, strict=True)),
            "episodes": [
                _lines(packer, here[k], each.times) if k in here else None
                for k, each in enumerate(shown)
            ],
        }
        for kind, here in kinds.items()
    ]


def _lines(packer: Packer, curve: Curve, times: Array) -> dict[str, Any]:
    """The lines of an episode: over the moments, or over the steps, which end at their times."""
    ends = packer.array(times[len(times) - len(curve.values) :], "f8")
    x, *lines = [packer.array(column, "f8") for column in curve.values.T]
    end = float(times[-1])
    if curve.kind == "plan":
        return {"end": end, "x": x, "times": ends, "lines": lines}
    return {"end": end, "x": ends, "lines": [x, *lines]}


def _labels(given: Sequence[str]) -> list[str]:
    """Who acts in each episode; those of one name are numbered."""
    names = [label or "episode" for label in given]
    return [
        f"{name} {names[: k + 1].count(name)}" if names.count(name) > 1 else name
        for k, name in enumerate(names)
    ]


def _facts(labels: Sequence[str], shown: Sequence[Shown]) -> list[tuple[str, str]]:
    """What the page says about its episodes and their origin; what is equal, once."""
    owners: dict[tuple[str, str], list[str]] = {}
    for label, each in zip(labels, shown, strict=True):
        for fact in each.facts:
            owners.setdefault(fact, []).append(label)
    return [
        (name if len(whose) == len(shown) else f"{name}: {', '.join(whose)}", text)
        for (name, text), whose in owners.items()
    ]


def _origin(replay: Replay) -> str:
    """Where a replay comes from, as far as the file says it."""
    try:
        return heading(replay.provenance)
    except (LookupError, TypeError, AttributeError, ValueError):
        return "unknown"
