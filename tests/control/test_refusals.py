"""No controller takes what is no number, or acts beyond its limits, or mixes rows."""

import inspect
from dataclasses import is_dataclass, replace
from typing import get_type_hints

import numpy as np
import pytest

from rigid_envs import control, systems
from rigid_envs.control.predictive import CrossEntropyChoices, PathIntegral
from rigid_envs.mechanics import rotations
from rigid_envs.systems.dynamic_ball import controllers as dynamic_ball
from rigid_envs.systems.free_body import controllers as free_body
from rigid_envs.systems.gyrostat import controllers as gyrostat
from rigid_envs.systems.heavy_top import controllers as heavy_top
from rigid_envs.systems.roller import controllers as roller
from rigid_envs.systems.rolling_ball import controllers as rolling_ball
from rigid_envs.systems.rolling_disk import controllers as rolling_disk
from rigid_envs.systems.satellite import controllers as satellite
from rigid_envs.systems.spheroid import controllers as spheroid
from rigid_envs.systems.thrown_body import controllers as thrown_body
from rigid_envs.systems.upright_coin import controllers as upright_coin
from tests.refusals import NO_SCALARS, refusal
from tests.systems.claims import spinning

BODY, TOP, BALL, MOVED = (
    systems.FreeBody(1.0, 2.0, 3.0),
    systems.HeavyTop(),
    systems.RollingBall(),
    systems.DynamicBall(),
)
MAY_BE_ZERO = {
    *("Pump.dt", "QuarterRolls.reach", "PathIntegral.correlation"),
    *("DualSpinTurn.run_up", "TippeTopSpin.least_arm"),
}
SATELLITE = systems.Gyrostat(1.0, 2.0, 2.5, 0.1, 0.1, 0.1)
ORBITER = systems.Satellite(1.0, 2.0, 2.5, n=0.03, b=0.5)
CONTROLLERS = (
    thrown_body.CatchShot(BODY, 20.0, 0.05, 0.1),
    heavy_top.AsymmetricBalance(TOP, 0.3, 0.05, 3.0),
    heavy_top.BalancedTop(TOP, 3.0),
    rolling_disk.CircleRegulator(systems.RollingDisk(), 1.0, 0.05),
    CrossEntropyChoices(8, 5, 3),
    rolling_ball.DampedFollower(BALL, 1.0),
    gyrostat.DualSpinTurn(SATELLITE, 0.3, 1.0, 0.03),
    gyrostat.EigenaxisSlew(SATELLITE, 3.0, 5.0, 0.5),
    free_body.EnergyCasimir(BODY, 1.0, 0.2),
    rolling_ball.FarSightedFollower(BALL, 1.0, 0.1),
    satellite.FieldBrake(ORBITER, 0.1),
    free_body.ForcedFlip(BODY, 1.0, 0.5),
    dynamic_ball.HeldBall(MOVED, 0.4, 0.1, 0.1),
    free_body.HeldSpin(BODY, 1.0, 0.2),
    free_body.MinimumFuelSpin(BODY, 1.0, 0.2, 0.05, 0.1, 10.0),
    free_body.MomentumBrake(BODY, 0.2),
    free_body.MomentumRegulator(BODY, 0.2, 1.0, 1.0),
    PathIntegral(8, 5),
    heavy_top.PivotBalance(TOP, 3.0, 0.05),
    dynamic_ball.PlateRegulator(MOVED, 0.4, 0.1),
    heavy_top.PrecessionRegulator(TOP, 0.3, 0.05, (0.4, 0.8), (8.0, 9.0)),
    rolling_ball.QuarterRolls(BALL, 2),
    roller.LeastTime(roller.Pump(systems.Roller(curvature=0.3), 0.9, 0.05), 1.2),
    roller.Pump(systems.Roller(curvature=0.3), 0.9, 0.05),
    dynamic_ball.PushAlong(MOVED, 0.5, 0.1),
    free_body.QuaternionPD(BODY, 0.3),
    free_body.SeparatrixSteering(BODY, 1.0, 0.2, 0.05),
    free_body.SingleTorque(BODY, 1.0, 0.2),
    free_body.SpinRegulator(BODY, 1.0, 0.2, 0.05),
    free_body.TimedFlip(BODY, 1.0, 0.5),
    spheroid.TippeTopSpin(systems.Spheroid(), 0.3, 0.05, 4.0, 6.0, 0.2),
    gyrostat.ThreeTurns(SATELLITE, 3.0, 5.0, 0.5),
    dynamic_ball.TiltTransfer(dynamic_ball.PlateRegulator(MOVED, 0.4, 0.1), 0.1, 0.05, 20),
    upright_coin.TwoRolls(systems.UprightCoin(), 0.3, 0.5),
    heavy_top.UprightBalance(TOP, 0.3, 0.05),
)


def numbers_of(kind):
    """Names of its fields that are numbers."""
    return [name for name, hint in get_type_hints(kind).items() if hint in (float, int)]


NUMBERS = [(each, name) for each in CONTROLLERS for name in numbers_of(type(each))]


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
    rooms = [control, *systems.modules_of_all("controllers")]
    found = {
        name
        for room in rooms
        for name, kind in vars(room).items()
        if inspect.isclass(kind) and is_dataclass(kind) and "__post_init__" in dir(kind)
        if numbers_of(kind) and name not in systems.__all__
    }
    # the one that is left is made with CasADi alone
    tried = {kind.__name__ for each in CONTROLLERS for kind in type(each).__mro__}
    assert found - tried == {"PredictiveControl"}


RNG, LEAD = np.random.default_rng(0), (3, 5)
SPINS, ATTITUDES = spinning(RNG, LEAD), rotations.random_quaternion(RNG, LEAD)
SPINS[0, :, 4:7] *= 0.01
SPINS[1, :, 4:7] = [0.0, 1.0, 0.0] + 0.01 * SPINS[1, :, 4:7]
LEANS = 0.3 * RNG.normal(size=(*LEAD, 3))
LEANS[0] *= 0.01
TOPS = TOP.state(q=rotations.exp(LEANS), omega_body=LEANS + np.eye(3)[2])
MOTIONS = RNG.uniform([-1.0, -1.0, -1.0, 1.0], [1.0, 1.0, 1.0, 2.0], (*LEAD, 4))
DISKS = rolling_disk.rolling_state(rolling_disk.DiskMotion(*np.moveaxis(MOTIONS, -1, 0)))
PLACES, PACES = RNG.uniform(-3.0, 3.0, (*LEAD, 2)), RNG.uniform(-0.5, 0.5, (*LEAD, 2))
BALLS = BALL.state(q=ATTITUDES, position=PLACES)
PLATES = MOVED.state(q=ATTITUDES, position=PLACES, velocity=PACES, tilt=PACES[::-1])
SPINNING = systems.Spheroid().state(q=ATTITUDES, omega_body=10.0 * SPINS[..., 4:7])
CARRIERS = SATELLITE.state(q=ATTITUDES, omega_body=SPINS[..., 4:7])
ORBITERS = ORBITER.state(q=ATTITUDES, omega_body=SPINS[..., 4:7], latitude=PLACES[..., 0])
SHARES = RNG.uniform(0.1, 0.7, LEAD)
AHEAD = rolling_ball.FarSightedFollower(BALL, 1.0, 0.1).regulator(PACES).gain
IN_BOX = {
    "AsymmetricBalance": (TOPS,),
    "CatchShot": (SPINS, np.concatenate([SHARES[..., None], ATTITUDES], axis=-1)),
    "CircleRegulator": (DISKS, SHARES),
    "DualSpinTurn": (CARRIERS,),
    "EigenaxisSlew": (CARRIERS, ATTITUDES[::-1]),
    "EnergyCasimir": (SPINS,),
    "ForcedFlip": (SPINS,),
    "MinimumFuelSpin": (SPINS,),
    "PlateRegulator": (PLATES, PACES),
    "PrecessionRegulator": (TOPS + 12.0 * SHARES[..., None] * np.eye(11)[6], SHARES),
    "Pump": (PLACES, SHARES),
    "QuaternionPD": (SPINS, ATTITUDES),
    "SeparatrixSteering": (SPINS,),
    "SingleTorque": (SPINS,),
    "SpinRegulator": (SPINS,),
    "ThreeTurns": (CARRIERS, ATTITUDES[::-1]),
    "TimedFlip": (SPINS, 9.0 * SHARES),
    "TippeTopSpin": (SPINNING,),
}
IN_BALL = {
    "DampedFollower": (BALLS, BALLS[::-1], PACES),
    "FarSightedFollower": (BALLS, BALLS[::-1], PACES, AHEAD),
    "FieldBrake": (ORBITERS,),
    "MomentumBrake": (SPINS,),
    "MomentumRegulator": (SPINS,),
    "PivotBalance": (TOPS,),
    "PushAlong": (PLATES, PACES, PLACES, PACES),
    "UprightBalance": (TOPS,),
}


@pytest.mark.parametrize("name", [*IN_BOX, *IN_BALL])
def test_actions_stay_within_their_limits_and_rows_are_independent(name):
    controller = next(each for each in CONTROLLERS if type(each).__name__ == name)
    args = (IN_BOX | IN_BALL)[name]
    actions = controller(*args)
    size = np.linalg.norm(actions, axis=-1) if name in IN_BALL else np.abs(actions).max(axis=-1)
    assert actions.shape[:-1] == LEAD
    assert size.max() <= 1.0 + 4.0 * np.finfo(float).eps * (name in IN_BALL)
    assert (size > 1.0 - 1e-12).any() and ((np.abs(actions) < 0.99).any() or name == "Pump")
    for row in np.ndindex(LEAD):
        # sums may be taken in another order
        np.testing.assert_allclose(controller(*(a[row] for a in args)), actions[row], atol=1e-13)
