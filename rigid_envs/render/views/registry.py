"""Which view shows which task or system, by name: what is not shown is not imported."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from typing import Any

from rigid_envs.registry import load
from rigid_envs.render.view import View

__all__ = ["add_view", "view_class", "view_of"]

_ROOM = "rigid_envs.render.views."
_GENERIC = "generic:GenericView"
_SYSTEMS = {
    "FreeBody": "free_body:FreeBodyView",
    "HeavyTop": "heavy_top:HeavyTopView",
    "RollingBall": "rolling_ball:RollingBallView",
    "DynamicBall": "dynamic_ball:DynamicBallView",
    "RollingDisk": "rolling_disk:RollingDiskView",
    "UprightCoin": "upright_coin:UprightCoinView",
    "Roller": "roller:RollerView",
}
_TASKS = {
    "IntermediateAxis": "free_body:IntermediateAxisView",
    "IntermediateAxisRandom": "free_body:IntermediateAxisRandomView",
    "IntermediateAxisSingle": "free_body:IntermediateAxisSingleView",
    "SpinCapture": "free_body:SpinCaptureView",
    "AxisFlip": "free_body:AxisFlipView",
    "Detumble": "free_body:DetumbleView",
    "Reorient": "free_body:ReorientView",
    "SleepingTop": "heavy_top:UprightTopView",
    "TopRandom": "heavy_top:UprightTopView",
    "PivotTop": "heavy_top:PivotTopView",
    "TopPrecession": "heavy_top:TopPrecessionView",
    "BallPark": "rolling_ball:BallParkView",
    "BallParkGoal": "rolling_ball:BallParkGoalView",
    "BallSteer": "rolling_ball:BallSteerView",
    "BallGrid": "rolling_ball:BallGridView",
    "BallParkDynamic": "dynamic_ball:BallParkDynamicView",
    "BallPlate": "dynamic_ball:BallPlateView",
    "DiskRoll": "rolling_disk:DiskRollView",
    "CoinPark": "upright_coin:CoinParkView",
    "RollPump": "roller:RollPumpView",
}
_VIEWS: dict[str, str | type[View]] = {
    **{f"rigid_envs.systems:{name}": _ROOM + view for name, view in _SYSTEMS.items()},
    **{f"rigid_envs.tasks:{name}": _ROOM + view for name, view in _TASKS.items()},
}


def add_view(owner: str | type, view: str | type[View]) -> None:
    """Show a task, or every task of a system that has no view of its own, by a view.

    Args:
        owner: subclass of `Task` or of `System`, or its name "module:Class", where the module may
            also be a package that holds it. Its subclasses are shown likewise.
        view: subclass of `View`, or its name "module:Class". It replaces an earlier one.

    Raises:
        TypeError: a view that is no subclass of `View`.
        ValueError: a name without a colon.
    """
    for name, value in (("owner", owner), ("view", view)):
        if isinstance(value, str) and value.count(":") != 1:
            raise ValueError(f"{name} = {value!r}; expected 'module:Class'")
    if not isinstance(view, str) and not issubclass(view, View):
        raise TypeError(f"view = {view!r}; expected a subclass of rigid_envs.render.view.View")
    _VIEWS[owner if isinstance(owner, str) else next(_names(owner))] = view


def view_class(task: Any) -> type[View]:
    """The class of the view: that of the task, else of its system, else a generic one.

    Raises:
        ConfigError: a view was added by a name that does not exist.
    """
    for kind in (*type(task).__mro__, *task.system_type.__mro__):
        for name in _names(kind):
            if name in _VIEWS:
                return _loaded(_VIEWS[name])
    return _loaded(_ROOM + _GENERIC)


def view_of(task: Any, parameters: Mapping[str, float]) -> View:
    """The view of an episode.

    Args:
        task: the task.
        parameters: parameters of the system by name, of the episode.
    """
    return view_class(task)(task, dict(parameters))


def _names(kind: type) -> Iterator[str]:
    """Names of a class, "module:Class", from its own module to the outermost package."""
    modules = [*itertools.accumulate(kind.__module__.split("."), "{}.{}".format)]
    return (f"{module}:{kind.__qualname__}" for module in reversed(modules))


def _loaded(view: str | type[View]) -> type[View]:
    found: type[View] = load(view) if isinstance(view, str) else view
    return found
