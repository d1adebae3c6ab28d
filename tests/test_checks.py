"""Refusals have one grammar: `name = value; expected what it can be: how to mend it`."""

import importlib
import inspect
import math
import re
from pathlib import Path

import numpy as np
import pytest

import rigid_envs
from rigid_envs.base import checks
from rigid_envs.mechanics import bodies, rotations
from rigid_envs.systems.dynamic_ball import closed_forms as ball_on_plate
from rigid_envs.systems.dynamic_ball.system import DynamicBall
from rigid_envs.systems.free_body import closed_forms as free_body
from rigid_envs.systems.free_body.controllers import QuaternionPD
from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.systems.heavy_top import closed_forms as heavy_top
from rigid_envs.systems.heavy_top.system import HeavyTop
from rigid_envs.systems.roller import closed_forms as roller
from rigid_envs.systems.roller.system import Roller
from rigid_envs.systems.rolling_ball import closed_forms as rolling_ball
from rigid_envs.systems.rolling_ball.system import RollingBall
from rigid_envs.systems.rolling_disk import closed_forms as rolling_disk
from rigid_envs.systems.rolling_disk.system import RollingDisk
from rigid_envs.systems.upright_coin import closed_forms as upright_coin
from rigid_envs.systems.upright_coin.system import UprightCoin

SYSTEMS = (DynamicBall, FreeBody, HeavyTop, Roller, RollingBall, RollingDisk, UprightCoin)
NAME = r"[A-Za-z][\w.]*(\([\w.]+\))?(\[[^\]]*\])?"
GRAMMAR = re.compile(rf"([^;]+: )?{NAME} (= .+|has shape \([\d, ]*\)); expected [^;]+", re.DOTALL)
NO_NUMBERS = [True, np.True_, math.nan, math.inf, "1", None, 1j, [[1.0], [1.0, 2.0]]]
NO_SCALARS = [*NO_NUMBERS, [1.0], np.ones(2)]
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


def refusal(call, *args, **kwargs):
    with pytest.raises(ValueError) as refused:
        call(*args, **kwargs)
    text = str(refused.value)
    assert GRAMMAR.fullmatch(text), text
    return text


# The checks


@pytest.mark.parametrize("bad", [*NO_SCALARS, 10**400])
def test_no_number_passes_for_one(bad):
    for check in (checks.number, checks.positive, checks.non_negative):
        assert refusal(check, bad, "mass", "kg").startswith("mass = ")
        assert "[kg]" in refusal(check, bad, "mass", "kg")
    refusal(checks.integer, bad, "n", 1)


@pytest.mark.parametrize("good", [1, 1.5, np.float32(2.0), np.int64(3), np.array(4.0), 10**30])
def test_numbers_of_python_and_numpy_are_numbers(good):
    for check in (checks.number, checks.positive, checks.non_negative):
        assert check(good, "mass") == float(good)
        assert type(check(good, "mass")) is float


def test_bounds_are_those_of_the_name():
    assert checks.non_negative(0.0, "x") == 0.0
    assert checks.integer(2.0, "n", 2) == 2
    for bad in (0.0, -1.0):
        assert refusal(checks.positive, bad, "x") == f"x = {bad}; expected a positive finite number"
    refusal(checks.non_negative, -1e-300, "x")
    for bad in (1, 2.5):
        assert (
            refusal(checks.integer, bad, "n", 2) == f"n = {bad}; expected an integer of at least 2"
        )
    for bad in (0.0, 1.0, [0.5, 1.5]):
        refusal(checks.between, bad, "x", 0.0, 1.0)
    with pytest.raises(ValueError, match=r"^b = -1.0; expected"):
        checks.all_positive(a=1.0, b=-1.0)
    with pytest.raises(ValueError, match=r"^b = -1.0; expected"):
        checks.all_non_negative(a=0.0, b=-1.0)


@pytest.mark.parametrize("bad", [*NO_NUMBERS, [1.0, True], [1.0, np.True_], np.ones(3, bool)])
def test_arrays_are_of_finite_real_numbers(bad):
    for check in (checks.array, checks.exact_array, checks.positive_array):
        assert refusal(check, bad, "x").startswith("x")


def test_the_first_bad_entry_is_shown_by_its_index():
    y = np.ones((2, 3))
    y[1, 2] = math.nan
    assert refusal(checks.array, y, "y") == "y[1, 2] = nan; expected finite numbers"
    y[1, 2] = -1.0
    assert (
        refusal(checks.positive_array, y, "y") == "y[1, 2] = -1.0; expected positive finite numbers"
    )


def test_an_array_of_positive_numbers_holds_no_zero():
    for rows in ([1.0, 0.0], [1.0, -0.0], [5e-324, np.inf]):
        assert refusal(checks.positive_array, rows, "y").startswith("y[1] = ")
    assert checks.positive_array([5e-324, 1e308], "y").min() > 0.0


def test_shapes_are_refused_in_words_that_say_which():
    expected = "y has shape (2,); expected (..., 3): the last axis is (a, b, c)"
    assert refusal(checks.array, np.ones(2), "y", 3, entries="a, b, c") == expected
    assert refusal(checks.exact_array, np.ones(2), "y", 3) == "y has shape (2,); expected (3,)"
    assert refusal(checks.exact_array, np.ones((0, 3)), "y", "n", 3).endswith("expected (n, 3)")
    assert checks.array(np.ones((4, 2, 3)), "y", 2, 3).shape == (4, 2, 3)
    assert checks.exact_array(np.ones((4, 3)), "y", "n", 3).shape == (4, 3)


@pytest.mark.parametrize("error", [-2e-6, 2e-6, -1.0, 1e200])
def test_one_tolerance_for_unit_quaternions_everywhere(error):
    """Within 1e-6 all modules take a quaternion, and further away none but `rhs` does."""
    near, far = UPRIGHT * (1.0 + 4e-7), UPRIGHT * (1.0 + error)
    uses = (
        lambda q: checks.unit_quaternion(q, "q"),
        rotations.log,
        rotations.matrix_from_quaternion,
        lambda q: FreeBody().state(q=q),
        lambda q: FreeBody().invariants([*q, 0.0, 0.0, 1.0]),
        lambda q: RollingBall().checked_state([*q, 0.0, 0.0]),
        bodies.rod(1.0, 1.0).rotated,
        lambda q: free_body.attitude(0.0, (1.0, 2.0, 3.0), (0.1, 1.0, 0.0), q),
        lambda q: heavy_top.attitude(0.0, (0.1, 0.2, 3.0), q, i_perp=1.0, i3=0.5, mgl=1.0),
        lambda q: QuaternionPD(FreeBody(), 1.0)(FreeBody().state(), q),
    )
    for use in uses:
        use(near)
        assert "length 1 within 1e-06" in refusal(use, far)


def test_what_is_no_rotation_matrix_is_refused():
    for bad in (2.0 * np.eye(3), np.diag([1.0, 1.0, -1.0]), np.eye(2), np.full((3, 3), math.nan)):
        assert refusal(checks.rotation_matrix, bad, "R").startswith("R")


def test_rotation_matrices_are_taken_whatever_is_rounded():
    q = rotations.normalize(np.random.default_rng(0).normal(size=(1000, 4)))
    R = rotations.matrix_from_quaternion(q)
    for factor in (1.0, 1.0 - 4e-7, 1.0 + 4e-7):
        assert checks.rotation_matrix(factor * R, "R").shape == (1000, 3, 3)


@pytest.mark.parametrize(
    "bad", ["\x1b]0;title\x07", "a\nb", "\u202eright to left", "\ud800", "x" * 301]
)
def test_text_that_would_steer_a_terminal_is_refused_wherever_it_stands(bad):
    for value in (bad, [1, {"a": [bad]}], {"a": {bad: 1}}):
        refusal(checks.printable, value, "label")


def test_text_of_300_characters_is_shown_and_no_longer_one():
    assert checks.printable("x" * 300, "label")
    assert "at most 300 characters" in refusal(checks.printable, "x" * 301, "label")


def test_printable_text_stays_as_it_is():
    plain = {"name": "PPO, r\u00e9duit", "dt": 0.1, "pair": [1, None], "n": True}
    assert checks.printable(plain, "config") is plain


def test_control_characters_are_shown_and_not_obeyed():
    assert checks.shown("a\x1b[2J\rb\nc \u00e9") == "a\\x1b[2J\\rb\nc \u00e9"


def test_a_message_shows_no_more_of_a_value_than_fits():
    assert len(refusal(checks.number, list(range(10_000)), "x")) < 400


# Public functions and constructors

GOOD = {  # arguments of the closed forms, by name
    "t": 0.5, "u": 0.5, "sn": 0.6, "cn": 0.8, "dn": 0.9, "m1": 0.5, "nu": 0.5,
    "moments": (1.0, 2.0, 3.0), "omega0": (0.1, 1.0, 0.2), "q0": UPRIGHT, "spin": 1.0,
    "i_perp": 0.25, "i3": 0.5, "mgl": 1.0, "omega3": 1.0, "theta": 1.2, "precession": 0.5,
    "m": 1.0, "radius": 1.0, "g": 9.8, "beta": 0.4, "slope": 0.1, "height": 1.0, "mu": 0.3,
    "curvature": 0.3, "s0": 0.1, "v0": 0.2, "place": (0.1, 0.2), "tilt": 0.1,
    "turntable_rate": 0.3, "circle_radius": 2.0, "rate": 0.3, "phase": 0.1, "twist": 0.1,
    "displacement": (0.1, 0.2), "displacements": ((0.1, 0.2), (0.3, 0.1)), "speed": 1.0,
    "segments": ((1.0, 0.0, 0.1, 2.0),), "heading_acceleration": 0.1, "spin_per_rate": 0.1,
    "phi_rate": 0.1, "psi_rate": 0.2, "theta_rate": 0.1, "torques": (0.1, 0.2), "heading": 0.1,
    "steering_rate": 0.2, "contact_radius": 3.0, "amplitudes": (0.1, 0.2), "c1": 0.1, "c2": 0.2,
    "frequencies": (1.0, 2.0), "state": (0.0, 0.0, 0.0, 0.0), "depth": 2,
    "p_phi": 0.1, "p_psi": 0.2, "phi": 0.1, "psi": 0.2,
}  # fmt: skip
OTHERS = {  # where a name means something else
    ("dynamic_ball", "omega"): (0.1, 0.2, 0.3), ("dynamic_ball", "velocity"): (0.1, 0.2),
    ("roller", "velocity"): (1.0, 0.2), ("roller", "omega"): (0.1, 0.2, 0.3),
    ("symmetric_cones", "moments"): (1.0, 1.0, 2.0),
    ("symmetric_rates", "moments"): (1.0, 1.0, 2.0),
    ("roll_wheel", "omega"): 0.5, ("homoclinic_tilt", "omega3"): 0.2,
    ("rolling_threshold", "omega"): 0.5, ("dynamic_ball", "spin"): 0.1,
}  # fmt: skip
NOT_CHECKED = {"fields", "first", "second", "growth", "dimension"}  # functions and their results
MAY_BE_NAN = {("nutation_frequency", "precession")}
ROOMS = (ball_on_plate, free_body, heavy_top, roller, rolling_ball, rolling_disk, upright_coin)
CLOSED_FORMS = [
    (room, name)
    for room in ROOMS
    for name in room.__all__
    if inspect.isfunction(getattr(room, name))
    and not NOT_CHECKED & set(inspect.signature(getattr(room, name)).parameters)
]


def good_value(room, function, name):
    key = room.__name__.split(".")[2]  # the system
    return OTHERS.get((function, name), OTHERS.get((key, name), GOOD.get(name)))


@pytest.mark.parametrize(("room", "function"), CLOSED_FORMS)
def test_closed_forms_refuse_what_is_no_number(room, function):
    call = getattr(room, function)
    good = {name: good_value(room, function, name) for name in inspect.signature(call).parameters}
    call(**good)
    for name, value in good.items():
        if (function, name) in MAY_BE_NAN:
            continue
        bad_values = [*NO_NUMBERS] + ([np.ones((2, 5))] if np.ndim(value) else [])
        for bad in bad_values:
            text = refusal(call, **{**good, name: bad})
            assert re.match(rf"{name}\b", text), text


def test_all_closed_forms_are_tried():
    folder = Path(rigid_envs.__file__).parent / "systems"
    assert {room.__name__.split(".")[2] for room in ROOMS} == {
        file.parent.name for file in folder.glob("*/closed_forms.py")
    }
    assert len(CLOSED_FORMS) > 50


ATTITUDE = {
    "q": UPRIGHT, "p": UPRIGHT, "v": (1.0, 2.0, 3.0), "R": np.eye(3), "euler": (0.1, 0.2, 0.3),
    "rotation_vector": (0.1, 0.2, 0.3), "axis": (0.0, 0.0, 1.0), "angle": 0.1, "t": 0.5,
    "skew": np.zeros((3, 3)), "rot6d": (1.0, 0.0, 0.0, 0.0, 1.0, 0.0), "tensor": np.eye(3),
    "rates": (0.1, 0.2, 0.3), "omega_body": (0.1, 0.2, 0.3), "omega_world": (0.1, 0.2, 0.3),
    "v_body": (0.1, 0.2, 0.3), "v_world": (0.1, 0.2, 0.3), "rate_body": (0.1, 0.2, 0.3),
    "rate_world": (0.1, 0.2, 0.3),
}  # fmt: skip


@pytest.mark.parametrize("name", sorted({*rotations.__all__} - {"identity", "random_quaternion"}))
def test_rotations_refuse_what_is_no_number(name):
    call = getattr(rotations, name)
    good = {parameter: ATTITUDE[parameter] for parameter in inspect.signature(call).parameters}
    call(**good)
    for parameter, value in good.items():
        for bad in [*NO_NUMBERS] + ([np.ones((2, 5))] if np.ndim(value) else []):
            assert refusal(call, **{**good, parameter: bad}).startswith(parameter)


SOLIDS = [
    name
    for name in bodies.__all__
    if inspect.isfunction(call := getattr(bodies, name))
    and inspect.signature(call).parameters
    and all(p.annotation is float for p in inspect.signature(call).parameters.values())
]


@pytest.mark.parametrize("name", SOLIDS)
def test_bodies_refuse_what_is_no_number(name):
    call = getattr(bodies, name)
    good = {parameter: 1.0 for parameter in inspect.signature(call).parameters}
    call(**good)
    for parameter in good:
        for bad in [*NO_SCALARS, -1.0]:
            assert refusal(call, **{**good, parameter: bad}).startswith(f"{parameter} = ")


@pytest.mark.parametrize("system_type", SYSTEMS)
def test_systems_refuse_what_is_no_number(system_type):
    for parameter in system_type.parameter_names():
        for bad in NO_SCALARS:
            assert refusal(system_type, **{parameter: bad}).startswith(f"{parameter} = ")
    for bad in [*NO_NUMBERS, np.ones(99)]:
        assert refusal(system_type().rhs, bad)[0] in "yq"
        if bad is not None:
            assert refusal(system_type().rhs, system_type().state(), bad)[0] == "u"
        assert refusal(system_type().advance, system_type().state(), None, bad).startswith("dt")


BODY, TOP, BALL, PLATE = FreeBody(1.0, 2.0, 3.0), HeavyTop(), RollingBall(), DynamicBall()
LAWS = {
    "free_body.SpinRegulator": (BODY, {"rate": 1.0, "torque": 0.2, "dt": 0.1, "input_weight": 0.1}),
    "free_body.SingleTorque": (BODY, {"rate": 1.0, "torque": 0.2, "strength": 3.0}),
    "free_body.EnergyCasimir": (BODY, {"rate": 1.0, "torque": 0.2, "strength": 3.0}),
    "free_body.ForcedFlip": (BODY, {"rate": 1.0, "torque": 0.2, "gain": 4.0}),
    "free_body.TimedFlip": (BODY, {"rate": 1.0, "torque": 0.2, "margin": 0.03, "gain": 4.0}),
    "free_body.SeparatrixSteering": (BODY, {"rate": 1.0, "torque": 0.1, "dt": 0.1, "gain": 7.5}),
    "free_body.QuaternionPD": (BODY, {"torque": 0.5, "stiffness": 6.0}),
    "free_body.MomentumBrake": (BODY, {"impulse": 0.3}),
    "free_body.MomentumRegulator": (
        BODY,
        {"impulse": 0.3, "weight_momentum": 1.0, "weight_impulse": 1.0},
    ),
    "heavy_top.UprightBalance": (TOP, {"limit": 0.3, "dt": 0.05}),
    "heavy_top.PivotBalance": (TOP, {"limit": 3.0, "dt": 0.05}),
    "heavy_top.AsymmetricBalance": (TOP, {"torque": 0.3, "dt": 0.05, "fastest": 2.0}),
    "dynamic_ball.PlateRegulator": (
        PLATE,
        {"tilt_rate": 0.4, "dt": 0.05, "input_weight": 1.0, "farthest": 1.0},
    ),
    "dynamic_ball.PushAlong": (PLATE, {"force": 3.0, "dt": 0.1, "share": 0.98, "rate": 2.0}),
    "rolling_disk.CircleRegulator": (
        RollingDisk(),
        {"torque": 3.0, "dt": 0.05, "input_weight": 1e-5},
    ),
    "upright_coin.TwoRolls": (
        UprightCoin(),
        {"roll_per_step": 0.2, "steer_per_step": 0.2, "directions": 180},
    ),
    "rolling_ball.DampedFollower": (BALL, {"rate": 2.8, "gain": 0.6, "turn": 1.2}),
    "rolling_ball.FarSightedFollower": (BALL, {"rate": 2.8, "dt": 0.1, "input_weight": 0.03}),
    "rolling_ball.QuarterRolls": (BALL, {"reach": 2}),
    "roller.Pump": (Roller(curvature=0.3), {"beta_change": 0.3, "dt": 0.05}),
    "predictive.PathIntegral": (
        None,
        {"n_samples": 8, "horizon": 3, "spread": 0.5, "correlation": 0.0},
    ),
    "predictive.CrossEntropyChoices": (
        None,
        {"n_samples": 8, "horizon": 3, "n_choices": 4, "mixing": 0.1},
    ),
}


@pytest.mark.parametrize("law", LAWS)
def test_controllers_refuse_what_is_no_number(law):
    place, name = law.split(".")
    system, good = LAWS[law]
    module = f"control.{place}" if system is None else f"systems.{place}.controllers"
    make = getattr(importlib.import_module(f"rigid_envs.{module}"), name)
    first = () if system is None else (system,)
    make(*first, **good)
    for parameter in good:
        for bad in [*NO_SCALARS, -1.0]:
            assert refusal(make, *first, **{**good, parameter: bad}).startswith(f"{parameter} = ")


EMPTY = [[], (), np.array([]), np.ones(2)]
SCALARS = {
    "tilt", "turntable_rate", "spin", "slope", "v0", "speed", "theta"
}  # fmt: skip
ONE_NUMBER = [
    (room, function, name)
    for room, function in CLOSED_FORMS
    for name, parameter in inspect.signature(getattr(room, function)).parameters.items()
    if parameter.annotation in ("float", float) and name in SCALARS
]


@pytest.mark.parametrize(("room", "function", "name"), ONE_NUMBER)
def test_a_sequence_is_no_number(room, function, name):
    call = getattr(room, function)
    good = {key: good_value(room, function, key) for key in inspect.signature(call).parameters}
    for bad in EMPTY:
        assert refusal(call, **{**good, name: bad}).startswith(f"{name} = ")
