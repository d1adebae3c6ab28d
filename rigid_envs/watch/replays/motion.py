"""What a simulation shows without an environment: its figure, and its page to watch."""

import base64
import html
import math
import zlib
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from rigid_envs.base.checks import Array, require
from rigid_envs.base.files import write_atomic
from rigid_envs.engine.provenance import heading, provenance
from rigid_envs.envs.display import needed
from rigid_envs.mechanics.integration import Trajectory
from rigid_envs.mechanics.system import System
from rigid_envs.tasks.core import Moment
from rigid_envs.watch import figures
from rigid_envs.watch.replays import page
from rigid_envs.watch.views import view_class

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


class _Motion(NamedTuple):
    """One motion of a trajectory, forwards in time.

    Attributes:
        times: from 0 on [s], shape (n,).
        y: states, shape (n, n_state).
        u: inputs that act, shape (n, n_input).
    """

    times: Array
    y: Array
    u: Array


def _motions(trajectory: Trajectory, t: Array) -> list[_Motion]:
    """The motions of a trajectory at some times, of which there are as many as fit a page.

    Raises:
        ValueError: there is no time in which anything moves, or there are too many.
    """
    y, u = trajectory(t), trajectory.input_at(t)
    rows, inputs = y.reshape(len(t), -1, y.shape[-1]), u.reshape(len(t), -1, u.shape[-1])
    n = rows.shape[1]
    require(1 <= n <= page.MOST_EPISODES, n, "motions", f"1 to {page.MOST_EPISODES} side by side")
    return [_Motion(t - t[0], rows[:, k], inputs[:, k]) for k in range(n)]


def _span(trajectory: Trajectory) -> tuple[float, float]:
    n = len(trajectory)
    require(n > 1, n, "len(t)", "at least 2 times: between them it moves")
    first, last = np.sort(trajectory.t[[0, -1]]).tolist()
    return first, last


# The page of a replay.

_PERIOD = 0.04  # s between moments, at most
_TURN = 0.2  # rad between moments, at most


def write(trajectory: Trajectory, path: str | Path, title: str = "") -> Path:
    """Write the page; see `Trajectory.replay`."""
    file = Path(path)
    text = text_of(trajectory, title)
    file.parent.mkdir(parents=True, exist_ok=True)
    write_atomic(file, text)
    return file


def text_of(trajectory: Trajectory, title: str = "") -> str:
    """The page as text. Its moments are states of the motion: nothing is interpolated."""
    first, last = _span(trajectory)
    rate = trajectory.system.rate_bound(trajectory.y, trajectory.input_at(trajectory.t), 0.0)
    wanted = int(np.ceil((last - first) * max(1.0 / _PERIOD, rate / _TURN)))
    origin = heading(provenance())

    def payload(budget: int) -> dict[str, Any]:
        t = np.linspace(first, last, 1 + max(1, min(wanted, budget)))
        motions = _motions(trajectory, t)
        driven = any(np.any(motion.u != 0.0) for motion in motions)
        shown = [_shown(trajectory.system, motion, driven, origin) for motion in motions]
        return page.document(shown, driven, title or type(trajectory.system).__name__, "")

    return page.fitting(payload)


def _shown(system: System, motion: _Motion, driven: bool, origin: str) -> page.Shown:
    """A motion as a page shows it."""
    parameters = asdict(system)
    alone = SimpleNamespace(system=lambda _: system)  # in the place of a task, of which it has none
    view = view_class(type(system))(alone, parameters)
    path = [
        Moment(y, u, parameters, time=time, dynamics=system.dynamics)
        for time, y, u in zip(motion.times.tolist(), motion.y, motion.u, strict=True)
    ]
    return page.Shown(
        label="motion",
        result=f"{motion.times[-1]:.3g} s",
        success=False,
        times=motion.times,
        text=page.readings(view, path),
        view=view,
        path=path,
        curves=page.motion_curves(system, motion.y, motion.u, driven),
        facts=page.facts(parameters, origin),
    )


# The page in a frame: deflated, for a notebook keeps what it shows. It unpacks itself.

_UNPACKS = """<script>(async () => {{
const packed = Uint8Array.from(atob("{packed}"), (letter) => letter.charCodeAt(0));
const page = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
document.write(await new Response(page).text());
document.close();
}})();</script>"""
_FRAME = (
    '<iframe srcdoc="{text}" sandbox="allow-scripts" width="100%" height="{height}" '
    'style="border: 0"></iframe>'
)
_HEIGHT = 620  # pixels


def inline(trajectory: Trajectory) -> str | None:
    """The page in a frame that needs no file and no network; None where there is no page."""
    try:
        text = text_of(trajectory)
    except ValueError:  # one time, a crowd, or too long: it is shown as any other object
        return None
    packed = base64.b64encode(zlib.compress(text.encode(), 9)).decode("ascii")
    script = html.escape(_UNPACKS.format(packed=packed))
    return _FRAME.format(text=script, height=_HEIGHT)


# The figure.

_COLORS = (figures.BLUE, figures.RED, figures.GREEN, figures.PURPLE)
_STYLES = ("-", "--", ":", "-.")


def plot(trajectory: Trajectory) -> "Figure":
    """The curves of the page, at the times of the trajectory; see `Trajectory.plot`."""
    needed("matplotlib", "figures need matplotlib")
    from matplotlib import rc_context

    _span(trajectory)
    system, t = trajectory.system, trajectory.t
    motions = _motions(trajectory, t)
    driven = any(np.any(motion.u != 0.0) for motion in motions)
    found = [page.motion_curves(system, m.y, m.u, driven) for m in motions]
    kinds = {curve.key: curve for several in found for curve in several}
    with rc_context(cast(Any, figures.STYLE)):
        figure = figures.new_figure((7.2, 1.9 * ((len(kinds) + 1) // 2)))
        figure.set_layout_engine("constrained")
        panels = figure.subplots((len(kinds) + 1) // 2, 2, squeeze=False).ravel()
        for axes, key in zip(panels, kinds, strict=False):
            _draw(axes, t, [c for several in found for c in several if c.key == key])
        for axes in panels[len(kinds) :]:
            axes.remove()
    return figure


def _draw(axes: "Axes", t: Array, curves: Sequence[page.Curve]) -> None:
    """One kind of curve of all motions: colours tell quantities apart, styles motions."""
    first = curves[0]
    axes.set_title(f"{first.title} [{first.unit}]")
    for k, (curve, style) in enumerate(zip(curves, _STYLES, strict=False)):
        if curve.kind == "plan":
            axes.plot(*curve.values.T, color=_COLORS[k], ls=style)
        elif len(curve.names) == 1:
            axes.plot(t, curve.values, color=_COLORS[k], ls=style, label=f"motion {k + 1}")
        else:
            for values, name, color in zip(curve.values.T, curve.names, _COLORS, strict=False):
                axes.plot(t, values, color=color, ls=style, label=name if k == 0 else None)
    if first.kind == "plan":
        axes.set_aspect("equal", adjustable="datalim")
        return
    axes.set_xlabel("time [s]")
    n = len(axes.get_legend_handles_labels()[0])
    if n > 1:
        low, high = axes.get_ylim()
        axes.set_ylim(low, high + 0.3 * math.ceil(n / 3) * (high - low))  # the legend covers none
        axes.legend(loc="upper center", ncols=3)
