"""No controller takes what is no number for one of its own."""

import importlib
import inspect
import pkgutil
from dataclasses import fields, is_dataclass, replace

import pytest

from rigid_envs import control, systems
from rigid_envs.control.predictive import CrossEntropyChoices, PathIntegral
from rigid_envs.systems.dynamic_ball import controllers as dynamic_ball
from rigid_envs.systems.free_body import controllers as free_body
from rigid_envs.systems.heavy_top import controllers as heavy_top
from rigid_envs.systems.roller import controllers as roller
from rigid_envs.systems.rolling_ball import controllers as rolling_ball
from rigid_envs.systems.rolling_disk import controllers as rolling_disk
from rigid_envs.systems.upright_coin import controllers as upright_coin
from tests.refusals import NO_SCALARS, refusal

BODY, TOP, BALL, MOVED = (
    systems.FreeBody(1.0, 2.0, 3.0),
    systems.HeavyTop(),
    systems.RollingBall(),
    systems.DynamicBall(),
)
MAY_BE_ZERO = {"Pump.dt", "QuarterRolls.reach", "PathIntegral.correlation"}
CONTROLLERS = (
    heavy_top.AsymmetricBalance(TOP, 0.3, 0.05, 3.0),
    heavy_top.BalancedTop(TOP, 3.0),
    rolling_disk.CircleRegulator(systems.RollingDisk(), 1.0, 0.05),
    CrossEntropyChoices(8, 5, 3),
    rolling_ball.DampedFollower(BALL, 1.0),
    free_body.EnergyCasimir(BODY, 1.0, 0.2),
    rolling_ball.FarSightedFollower(BALL, 1.0, 0.1),
    free_body.ForcedFlip(BODY, 1.0, 0.5),
    dynamic_ball.HeldBall(MOVED, 0.4, 0.1, 0.1),
    free_body.HeldSpin(BODY, 1.0, 0.2),
    free_body.MomentumBrake(BODY, 0.2),
    free_body.MomentumRegulator(BODY, 0.2, 1.0, 1.0),
    PathIntegral(8, 5),
    heavy_top.PivotBalance(TOP, 3.0, 0.05),
    dynamic_ball.PlateRegulator(MOVED, 0.4, 0.1),
    heavy_top.PrecessionRegulator(TOP, 0.3, 0.05, (0.4, 0.8), (8.0, 9.0)),
    rolling_ball.QuarterRolls(BALL, 2),
    roller.Pump(systems.Roller(curvature=0.3), 0.9, 0.05),
    dynamic_ball.PushAlong(MOVED, 0.5, 0.1),
    free_body.QuaternionPD(BODY, 0.3),
    free_body.SeparatrixSteering(BODY, 1.0, 0.2, 0.05),
    free_body.SingleTorque(BODY, 1.0, 0.2),
    free_body.SpinRegulator(BODY, 1.0, 0.2, 0.05),
    free_body.TimedFlip(BODY, 1.0, 0.5),
    upright_coin.TwoRolls(systems.UprightCoin(), 0.3, 0.5),
    heavy_top.UprightBalance(TOP, 0.3, 0.05),
)
NUMERIC = (float, int, "float", "int")  # a string where annotations are not evaluated
NUMBERS = [
    (controller, field.name)
    for controller in CONTROLLERS
    for field in fields(controller)
    if field.type in NUMERIC
]


@pytest.mark.parametrize(
    ("controller", "name"),
    NUMBERS,
    ids=lambda each: each if isinstance(each, str) else type(each).__name__,
)
def test_a_controller_refuses_what_is_no_number_by_its_name(controller, name):
    zero = [] if f"{type(controller).__name__}.{name}" in MAY_BE_ZERO else [0.0]
    for bad in [*NO_SCALARS, -1.0, *zero]:
        text = refusal(replace, controller, **{name: bad})
        assert text.startswith(f"{name} = "), text


def test_every_controller_with_numbers_is_tried():
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
        if any(field.type in NUMERIC for field in fields(kind)) and name not in systems.__all__
    }
    # the one that is left is made with CasADi alone
    tried = {kind.__name__ for each in CONTROLLERS for kind in type(each).__mro__}
    assert found - tried == {"PredictiveControl"}
