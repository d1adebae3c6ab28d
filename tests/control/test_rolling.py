"""Straight rolls: where they lead, against the closed form, and derivatives."""

import numpy as np

from rigid_envs.mechanics import rotations
from rigid_envs.systems.rolling_ball import closed_forms as rolling_ball
from rigid_envs.systems.rolling_ball.controllers import difference, rolled


def polygons(n_rows, n_sides):
    return np.random.default_rng(0).uniform(-2.0, 2.0, (n_rows, n_sides, 2))


def test_rolls_turn_the_ball_as_the_closed_form_says():
    rolls = polygons(20, 7)
    turns, _ = rolled(rolls)
    closed = np.array([rolling_ball.roll_polygon(row, 1.0) for row in rolls])
    assert np.max(rotations.distance(turns, closed)) < 1e-14


def test_derivatives_are_those_of_the_turn():
    rolls, step = polygons(5, 6), 1e-5
    turn, change = rolled(rolls)
    for k, axis in np.ndindex(6, 2):
        moved = np.zeros_like(rolls)
        moved[:, k, axis] = step
        there, back = rolled(rolls + moved)[0], rolled(rolls - moved)[0]
        difference = rotations.log(rotations.multiply(there, rotations.conjugate(back)))
        # truncation step^2, rounding 1e-16 / step
        np.testing.assert_allclose(difference / (2.0 * step), change[:, k, :, axis], atol=1e-9)
    assert change.shape == (5, 6, 3, 2)
    assert turn.shape == (5, 4)


def test_the_difference_of_poses_is_what_leads_from_one_to_the_other():
    rng = np.random.default_rng(0)
    start, goal = (
        np.concatenate([rotations.random_quaternion(rng, (9,)), rng.normal(size=(9, 2))], axis=1)
        for _ in range(2)
    )
    radius = np.linspace(0.5, 2.0, 9)
    turn, way = difference(start, goal, radius)
    np.testing.assert_allclose(start[:, 4:] + radius[:, None] * way, goal[:, 4:], atol=1e-15)
    assert np.max(rotations.distance(rotations.multiply(turn, start[:, :4]), goal[:, :4])) < 1e-15
