"""Refusals have one grammar: `name = value; expected what it can be: how to mend it`."""

import math

import numpy as np
import pytest

from rigid_envs.base import checks
from rigid_envs.mechanics import bodies, rotations
from rigid_envs.systems.free_body import closed_forms as free_body
from rigid_envs.systems.free_body.controllers import QuaternionPD
from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.systems.heavy_top import closed_forms as heavy_top
from rigid_envs.systems.rolling_ball.system import RollingBall
from tests.refusals import NO_NUMBERS, NO_SCALARS, refusal, refuses

UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


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
    assert refusal(checks.integer, 2**53, "n", 2).endswith("at least 2, and below 2^53")
    for bad in (0.0, 1.0, [0.5, 1.5]):
        refusal(checks.between, bad, "x", 0.0, 1.0)
    refuses(r"^b = -1.0; expected", checks.all_positive, a=1.0, b=-1.0)
    refuses(r"^b = -1.0; expected", checks.all_non_negative, a=0.0, b=-1.0)


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
    assert refusal(checks.array, np.ones(2), "y", 3) == "y has shape (2,); expected (..., 3)"
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
