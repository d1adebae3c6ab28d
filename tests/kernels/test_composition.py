"""The coefficients that make a fourth-order step of a second-order one."""

import mpmath
import pytest

from rigid_envs.engine.algebra import EXACT, SUZUKI


def test_suzuki_coefficients_are_the_closed_form_rounded_once():
    outer = float(1 / (4 - mpmath.cbrt(mpmath.mpf(4))))
    assert SUZUKI == (outer, outer, 1.0 - 4.0 * outer, outer, outer)


def test_suzuki_coefficients_fulfil_the_order_conditions_of_a_symmetric_fourth_order_method():
    assert SUZUKI == SUZUKI[::-1]
    # Consistency, and no third-order term: Hairer, Lubich & Wanner, theorem II.4.1.
    assert sum(SUZUKI) == 1.0  # exactly: a million steps last a million steps
    assert sum(weight**3 for weight in SUZUKI) == pytest.approx(0.0, abs=2e-16)


def test_the_exact_flow_is_taken_in_one_piece():
    assert EXACT == (1.0,)
