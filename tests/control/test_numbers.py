"""No law takes what is no number for one of its own."""

import inspect
import math
from dataclasses import fields, is_dataclass, replace
from typing import Any

import pytest

from rigid_envs import control
from rigid_envs.control import __all__
from rigid_envs.control.predictive import CrossEntropyChoices, PathIntegral
from rigid_envs.systems.dynamic_ball.controllers import HeldBall, PlateRegulator, PushAlong
from rigid_envs.systems.dynamic_ball.system import DynamicBall
from rigid_envs.systems.free_body.controllers import (
    EnergyCasimir,
    ForcedFlip,
    HeldSpin,
    MomentumBrake,
    MomentumRegulator,
    QuaternionPD,
    SeparatrixSteering,
    SingleTorque,
    SpinRegulator,
    TimedFlip,
)
from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.systems.heavy_top.controllers import (
    AsymmetricBalance,
    BalancedTop,
    PivotBalance,
    PrecessionRegulator,
    UprightBalance,
)
from rigid_envs.systems.heavy_top.system import HeavyTop
from rigid_envs.systems.roller.controllers import Pump
from rigid_envs.systems.roller.system import Roller
from rigid_envs.systems.rolling_ball.controllers import DampedFollower, FarSightedFollower
from rigid_envs.systems.rolling_ball.system import RollingBall
from rigid_envs.systems.rolling_disk.controllers import CircleRegulator
from rigid_envs.systems.rolling_disk.system import RollingDisk
from rigid_envs.systems.upright_coin.controllers import TwoRolls
from rigid_envs.systems.upright_coin.system import UprightCoin

BODY, TOP, BALL, MOVED = FreeBody(1.0, 2.0, 3.0), HeavyTop(), RollingBall(), DynamicBall()
LAWS = (
    AsymmetricBalance(TOP, 0.3, 0.05, 3.0),
    BalancedTop(TOP, 3.0),
    CircleRegulator(RollingDisk(), 1.0, 0.05),
    CrossEntropyChoices(8, 5, 3),
    DampedFollower(BALL, 1.0),
    EnergyCasimir(BODY, 1.0, 0.2),
    FarSightedFollower(BALL, 1.0, 0.1),
    ForcedFlip(BODY, 1.0, 0.5),
    HeldBall(MOVED, 0.4, 0.1, 0.1),
    HeldSpin(BODY, 1.0, 0.2),
    MomentumBrake(BODY, 0.2),
    MomentumRegulator(BODY, 0.2, 1.0, 1.0),
    PathIntegral(8, 5),
    PivotBalance(TOP, 3.0, 0.05),
    PlateRegulator(MOVED, 0.4, 0.1),
    PrecessionRegulator(TOP, 0.3, 0.05, (0.4, 0.8), (8.0, 9.0)),
    Pump(Roller(curvature=0.3), 0.9, 0.05),
    PushAlong(MOVED, 0.5, 0.1),
    QuaternionPD(BODY, 0.3),
    SeparatrixSteering(BODY, 1.0, 0.2, 0.05),
    SingleTorque(BODY, 1.0, 0.2),
    SpinRegulator(BODY, 1.0, 0.2, 0.05),
    TimedFlip(BODY, 1.0, 0.5),
    TwoRolls(UprightCoin(), 0.3, 0.5),
    UprightBalance(TOP, 0.3, 0.05),
)


@pytest.mark.parametrize(
    ("law", "name"),
    [(law, field.name) for law in LAWS for field in fields(law) if field.type == "float"],
    ids=lambda each: each if isinstance(each, str) else type(each).__name__,
)
def test_a_law_refuses_what_is_no_number_by_its_name(law: Any, name: str) -> None:
    with pytest.raises(ValueError, match=f"^{name} = nan; expected"):
        replace(law, **{name: math.nan})


def test_every_law_with_numbers_is_tried() -> None:
    found = {
        name
        for name in __all__
        if inspect.isclass(law := getattr(control, name)) and is_dataclass(law)
        if "__post_init__" in dir(law) and any(field.type == "float" for field in fields(law))
    }
    # the one that is left is made with CasADi alone
    assert found - {type(law).__name__ for law in LAWS} == {"PredictiveControl"}
