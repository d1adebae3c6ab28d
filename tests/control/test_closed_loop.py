"""Closed loops as they are sampled, and the region from which they succeed."""

import numpy as np
import pytest

from rigid_envs.control.linear import (
    clip_to_ball,
    clip_to_box,
    region_of_attraction,
    simulate_closed_loop,
)


def saturated(x):
    """x+ = 2 x + clip(-2 x): brought to 0 at once from |x| <= 1/2, held for |x| < 1."""
    return 2.0 * x + clip_to_box(-2.0 * x)


def test_a_motion_is_the_step_repeated():
    x = simulate_closed_loop(saturated, np.array([[0.75], [0.25], [-1.5]]), 3)
    np.testing.assert_array_equal(
        x[:, :, 0], np.transpose([[0.75, 0.5, 0, 0], [0.25, 0, 0, 0], [-1.5, -2, -3, -5]])
    )


def test_the_region_of_a_scalar_loop_is_where_its_actuator_can_hold_it():
    def comes_back(x):
        return np.abs(simulate_closed_loop(saturated, x, 60)[-1, ..., 0]) < 1e-3

    sizes = np.arange(0.05, 2.0, 0.1)  # 0.95 and 1.05 among them
    np.testing.assert_allclose(
        region_of_attraction(comes_back, [[1.0], [-1.0], [2.0]], sizes), [0.95, 0.95, 0.45]
    )


def test_what_lies_beyond_a_failure_does_not_count():
    found = region_of_attraction(
        lambda x: np.abs(x[..., 0] - 2.0) > 0.5, [[1.0], [0.1], [10.0]], [0.2, 1.0, 2.0, 3.0]
    )
    np.testing.assert_array_equal(found, [1.0, 3.0, 0.0])


def test_sizes_out_of_order_are_refused():
    for sizes in ([0.0, 1.0], [1.0, 0.5], [[1.0]]):
        with pytest.raises(
            ValueError, match=r"^sizes .*; expected (positive .* ascending order|\(M,\))"
        ):
            region_of_attraction(lambda x: x[..., 0] > 0.0, [[1.0]], sizes)


def test_limits_keep_what_is_inside_and_the_direction_of_what_is_not():
    action = np.array([[0.3, -0.4, 0.5], [3.0, 0.0, -4.0]])
    np.testing.assert_array_equal(clip_to_box(action), [[0.3, -0.4, 0.5], [1.0, 0.0, -1.0]])
    np.testing.assert_allclose(
        clip_to_ball(action), [[0.3, -0.4, 0.5], [0.6, 0.0, -0.8]], rtol=1e-15
    )
