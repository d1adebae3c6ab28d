"""Which view shows which task or system."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rigid_envs import systems, tasks
from rigid_envs.render.view import View
from rigid_envs.render.views import (
    dynamic_ball,
    free_body,
    heavy_top,
    roller,
    rolling_ball,
    rolling_disk,
    upright_coin,
)
from rigid_envs.render.views.generic import GenericView
from rigid_envs.tasks.base import Task

__all__ = ["add_view", "view_class", "view_of"]

_VIEWS: dict[type, type[View]] = {
    systems.FreeBody: free_body.FreeBodyView,
    systems.HeavyTop: heavy_top.HeavyTopView,
    systems.RollingBall: rolling_ball.RollingBallView,
    systems.DynamicBall: dynamic_ball.DynamicBallView,
    systems.RollingDisk: rolling_disk.RollingDiskView,
    systems.UprightCoin: upright_coin.UprightCoinView,
    systems.Roller: roller.RollerView,
    tasks.IntermediateAxis: free_body.IntermediateAxisView,
    tasks.IntermediateAxisRandom: free_body.IntermediateAxisRandomView,
    tasks.IntermediateAxisSingle: free_body.IntermediateAxisSingleView,
    tasks.SpinCapture: free_body.SpinCaptureView,
    tasks.AxisFlip: free_body.AxisFlipView,
    tasks.Detumble: free_body.DetumbleView,
    tasks.Reorient: free_body.ReorientView,
    tasks.SleepingTop: heavy_top.UprightTopView,
    tasks.TopRandom: heavy_top.UprightTopView,
    tasks.PivotTop: heavy_top.PivotTopView,
    tasks.TopPrecession: heavy_top.TopPrecessionView,
    tasks.BallPark: rolling_ball.BallParkView,
    tasks.BallParkGoal: rolling_ball.BallParkGoalView,
    tasks.BallSteer: rolling_ball.BallSteerView,
    tasks.BallGrid: rolling_ball.BallGridView,
    tasks.BallParkDynamic: dynamic_ball.BallParkDynamicView,
    tasks.BallPlate: dynamic_ball.BallPlateView,
    tasks.DiskRoll: rolling_disk.DiskRollView,
    tasks.CoinPark: upright_coin.CoinParkView,
    tasks.RollPump: roller.RollPumpView,
}


def add_view(owner: type, view: type[View]) -> None:
    """Show a task, or every task of a system that has no view of its own, by a view.

    Args:
        owner: subclass of `Task` or of `System`; its subclasses are shown likewise.
        view: subclass of `View`. It replaces an earlier one.

    Raises:
        TypeError: other classes, or none.
    """
    if not issubclass(owner, Task | systems.System):
        raise TypeError(f"owner = {owner!r}; expected a subclass of Task or of System")
    if not issubclass(view, View):
        raise TypeError(f"view = {view!r}; expected a subclass of rigid_envs.render.view.View")
    _VIEWS[owner] = view


def view_class(task: Any) -> type[View]:
    """The class of the view: that of the task, else of its system, else a generic one."""
    for kind in (*type(task).__mro__, *task.system_type.__mro__):
        if kind in _VIEWS:
            return _VIEWS[kind]
    return GenericView


def view_of(task: Any, parameters: Mapping[str, float]) -> View:
    """The view of an episode.

    Args:
        task: the task.
        parameters: parameters of the system by name, of the episode.
    """
    return view_class(task)(task, dict(parameters))
