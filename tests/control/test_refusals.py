"""No controller takes what is no number for one of its own."""

import importlib
import inspect
import pkgutil
from dataclasses import fields, is_dataclass, replace
from typing import Any

import pytest

from rigid_envs import control, systems
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
from rigid_envs.systems.rolling_ball.controllers import (
    DampedFollower,
    FarSightedFollower,
    QuarterRolls,
)
from rigid_envs.systems.rolling_ball.system import RollingBall
from rigid_envs.systems.rolling_disk.controllers import CircleRegulator
from rigid_envs.systems.rolling_disk.system import RollingDisk
from rigid_envs.systems.upright_coin.controllers import TwoRolls
from rigid_envs.systems.upright_coin.system import UprightCoin
from tests.refusals import NO_SCALARS, refusal

BODY, TOP, BALL, MOVED = FreeBody(1.0, 2.0, 3.0), HeavyTop(), RollingBall(), DynamicBall()
MAY_BE_ZERO = {"Pump.dt", "QuarterRolls.reach", "PathIntegral.correlation"}
CONTROLLERS = (
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
    QuarterRolls(BALL, 2),
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
NUMBERS = [
    (controller, field.name)
    for controller in CONTROLLERS
    for field in fields(controller)
    if field.type in ("float", "int")
]


@pytest.mark.parametrize(
    ("controller", "name"),
    NUMBERS,
    ids=lambda each: each if isinstance(each, str) else type(each).__name__,
)
def test_a_controller_refuses_what_is_no_number_by_its_name(controller: Any, name: str) -> None:
    zero = [] if f"{type(controller).__name__}.{name}" in MAY_BE_ZERO else [0.0]
    for bad in [*NO_SCALARS, -1.0, *zero]:
        text = refusal(replace, controller, **{name: bad})
        assert text.startswith(f"{name} = "), text


def test_every_controller_with_numbers_is_tried() -> None:
    rooms = [
        control,
        *(
            importlib.import_module(f"{systems.__name__}.{system.name}.controllers")
            for system in pkgutil.iter_modules(systems.__path__)
        ),
    ]
    found = {
        name
        for room in rooms
        for name, kind in vars(room).items()
        if inspect.isclass(kind) and is_dataclass(kind) and "__post_init__" in dir(kind)
        if any(field.type == "float" for field in fields(kind)) and name not in systems.__all__
    }
    # the one that is left is made with CasADi alone
    tried = {kind.__name__ for each in CONTROLLERS for kind in type(each).__mro__}
    assert found - tried == {"PredictiveControl"}
