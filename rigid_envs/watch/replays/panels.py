"""What stands beside the scene in a page of replays: curves, insets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import rotations
from rigid_envs.mechanics.system import System
from rigid_envs.tasks.core import Moment
from rigid_envs.tasks.task import Task
from rigid_envs.watch.replays.episode import Episode
from rigid_envs.watch.scene import Arrow, Panel
from rigid_envs.watch.views import view_class

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


def curves(task: Task, episode: Episode, driven: bool) -> list[Curve]:
    """What is plotted of an episode.

    Args:
        task: Its task.
        episode: The episode.
        driven: Whether an input acts, in this episode or in one that it is compared with: what is
            conserved without it then has changes instead of errors.
    """
    system = task.system(episode.parameters)
    found = [*_motion(system, episode), *_attitude(task, system, episode)]
    found += [*_path(system, episode.y), *_errors(system, episode, "change" if driven else "error")]
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


def is_driven(episode: Episode) -> bool:
    """Whether any action or input acts in the episode: then energy and momentum may change."""
    return bool(np.any(episode.u != 0.0) or np.any(episode.applied != 0.0))


def conservation_errors(system: System, y: npt.ArrayLike) -> dict[str, Array]:
    """Deviations of what is conserved without input from its value at the start.

    Each is divided by the largest size of the quantity: ``(E - E[0]) / max |E|``.

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
    return {
        name: (value - value[0]) / max(float(np.max(np.abs(value))), 1e-300)
        for name, value in found.items()
    }


_CONSERVED = {
    "energy": "energy",
    "L_squared": "|L|",
    "L": "|L|",
    "L_vertical": "vertical L",
    "L_spin": "L about the axis",
    "q_squared": "|q|\N{SUPERSCRIPT TWO}",
}


def _errors(system: System, episode: Episode, word: str) -> list[Curve]:
    """Energy, and momenta: errors where nothing drives the system, else changes."""
    found = conservation_errors(system, episode.y)
    energy = found.pop("energy", None)
    result = []
    if energy is not None:
        result.append(
            Curve("energy", f"Energy {word}", "relative", ("energy",), np.asarray(energy)[:, None])
        )
    if found:
        names = tuple(_CONSERVED[name] for name in found)
        title = f"|L| {word}" if tuple(found) == ("L",) else f"Momentum {word}"
        if "q_squared" in found:  # it stays 1, whatever drives the ball
            title = "|q|\N{SUPERSCRIPT TWO} error"
        result.append(Curve("momentum", title, "relative", names, np.stack([*found.values()], -1)))
    return result


def _motion(system: System, episode: Episode) -> list[Curve]:
    """Angular velocity; of what has one degree of freedom, the velocity."""
    y, named = episode.y, system.accessors
    found = []
    axes = ("\u03c9\u2081", "\u03c9\u2082", "\u03c9\u2083")
    world = ("\u03c9x", "\u03c9y", "\u03c9z")
    if "omega_body" in named:
        found.append(
            Curve("omega", "Angular velocity", "rad/s, body axes", axes, named["omega_body"](y))
        )
    elif "omega_world" in named:
        values = named["omega_world"](y)
        found.append(Curve("omega", "Angular velocity", "rad/s, world axes", world, values))
    elif hasattr(system, "omega_world"):
        values = np.asarray(system.omega_world(episode.u))
        found.append(Curve("omega", "Angular velocity", "rad/s, world axes", world, values))
    elif "velocity" in named:
        speed = named["velocity"](y).reshape(len(y), -1)
        found.append(Curve("omega", "Velocity", "m/s", ("v",), speed))
    return found


def _path(system: System, y: Array) -> list[Curve]:
    """Path of a contact or of a pivot that moves."""
    named = system.accessors
    for name in ("contact", "position", "pivot"):
        if name in named and np.ptp(path := named[name](y)[..., :2], axis=0).any():
            title = {"pivot": "Path of the pivot"}.get(name, "Path on the plane")
            return [Curve("plan", f"{title}, from above", "m", ("x", "y"), path, "plan")]
    return []


def _attitude(task: Task, system: System, episode: Episode) -> list[Curve]:
    """The angle that says most about the attitude: from a goal, of the axis, or from upright."""
    if "q" not in system.components:
        return []
    y, named = episode.y, system.accessors
    q = rotations.normalize(y[:, :4])
    for name in ("goal", "reference"):
        if f"{name}_w" in task.aux_names:
            columns = [task.aux_names.index(f"{name}_{part}") for part in "wxyz"]
            angle = rotations.distance(q, rotations.normalize(episode.aux[:, columns]))
            return [_angle("Attitude", f"deg, from the {name}", ("angle",), angle)]
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
    return [_angle("Attitude", "deg, from upright", ("angle",), rotations.angle(q))]


def _angle(title: str, unit: str, names: tuple[str, ...], values: Array) -> Curve:
    return Curve("tilt", title, unit, names, np.degrees(values.reshape(len(values), -1)))


# Insets of a replay page: Poinsot's construction of a free body, the axis of a top on a sphere.

INSET_BLUE, INSET_RED, INSET_GREEN = (0.0, 0.447, 0.698), (0.835, 0.369, 0.0), (0.0, 0.62, 0.451)
INSET_INK = (0.42, 0.46, 0.52)
LIFT = 1.01  # of lines above the surface that they are drawn on


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


def body_axes() -> dict[str, Arrow]:
    """Principal axes of a body, with their names."""
    names = ("e\u2081", "e\u2082", "e\u2083")
    return {f"e{k + 1}": Arrow(INSET_INK, 0.02, name) for k, name in enumerate(names)}
