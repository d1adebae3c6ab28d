"""Operations are counted as they are by hand."""

import math
from typing import NamedTuple

import pytest

from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import fma, select, sqrt
from rigid_envs.systems.rolling_ball.dynamics import ROLLING_BALL
from tests.benchmarks.flops import KINDS, count, flops, of_period, of_substep


class Point(NamedTuple):
    x: float
    y: float


@scalar
def half(x: float) -> float:
    return 0.5 * x


@scalar
def everything(a: Point, b: tuple[float, float], h: float) -> tuple[float, ...]:
    length = sqrt(fma(a.x, a.x, a.y * a.y))  # fma, product, root
    again = math.sqrt(fma(a.x, a.x, a.y * a.y))  # computed before
    ratio = b[0] / length - 0.25 * h * b[1]  # quotient, product, sum: 0.25 * h is of all rows
    shifted = fma(b[0], 1.0, ratio) + abs(-b[1])  # sum, sum
    return again, half(select(ratio < 0.0, shifted, 1.0)), max(b[0], h)  # product, three choices


def test_every_kind_is_counted() -> None:
    counts = count(everything, Point(3.0, 4.0), (1.0, 2.0), 0.1)
    assert counts == {"sum": 3, "product": 3, "fma": 1, "quotient": 1, "root": 1, "choice": 3}
    assert flops(counts) == 3 + 3 + 2 + 1 + 1


def test_the_step_of_the_ball_is_that_of_its_source() -> None:
    # step: the rate of rolling takes 2 products, half the turn 3, its square 1, s times it 3, the
    # quaternion 4; fma are 2 in the square, 7 and 8 in the polynomials, 12 in the quaternion, 2 in
    # the position. restore: 1 + 4 products, 3 + 1 fma
    substep = of_substep(ROLLING_BALL)
    assert substep["product"] == 2 + 3 + 1 + 3 + 4 + 1 + 4
    assert substep["fma"] == 2 + 7 + 8 + 12 + 2 + 3 + 1
    assert flops(substep) == 18 + 2 * 35
    assert of_period("BallPark") == substep


@pytest.mark.parametrize("kind", KINDS)
def test_a_period_is_all_of_its_substeps(kind: str) -> None:
    assert of_period("Reorient")[kind] == 2 * of_period("IntermediateAxis")[kind]
