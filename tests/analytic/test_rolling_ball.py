import math
from operator import itemgetter

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rigid_envs.systems.rolling_ball import closed_forms as rolling_ball
from tests.reference import cases

EPS = np.finfo(np.float64).eps


def arrangement(case):
    return rolling_ball.ARRANGEMENTS[case["in"].get("variant", "fixed_plane")]


def matrices(turn):
    return Rotation.from_quat(turn, scalar_first=True).as_matrix()


def kinematic(command):
    return [c for c in cases("ball_kinematic") if c["in"]["command"] == command]


def check_ball(case, place, turn):
    given, out = case["in"], case["out"]
    expected = np.stack([out["x"], out["y"]], axis=-1)
    np.testing.assert_allclose(place, expected, rtol=0, atol=8 * EPS * np.max(np.abs(expected)))
    rotation = matrices(turn) @ matrices(given["q0"])
    expected = np.array(out["R"]).reshape(-1, 3, 3)
    # cond eps from the input, and a few roundings for each of up to six rolls.
    np.testing.assert_allclose(rotation, expected, rtol=0, atol=8 * EPS * case["cond"]["R"])


@pytest.mark.parametrize("case", kinematic("segments"), ids=itemgetter("id"))
def test_rolling_along_segments_agrees_with_the_reference(case):
    given = case["in"]
    centre, roll = arrangement(case)
    segments = np.array(given["segments"]) * np.array([roll, roll, 1.0, 1.0])
    way, turn = rolling_ball.roll_segments(case["t"], segments, given["a"])
    check_ball(case, centre / roll * way + given["pos0"], turn)


@pytest.mark.parametrize("case", kinematic("circle"), ids=itemgetter("id"))
def test_rolling_round_a_circle_with_spin_agrees_with_the_reference(case):
    given = case["in"]
    centre, roll = arrangement(case)
    place, turn = rolling_ball.roll_circle(
        case["t"],
        radius=given["a"],
        circle_radius=abs(roll) * given["r"],
        rate=given["rate"],
        phase=given.get("phase0", 0.0) + (np.pi if roll < 0.0 else 0.0),
        spin=given["spin"],
    )
    check_ball(case, centre / roll * place, turn)


@pytest.mark.parametrize(
    "case", [c for c in kinematic("circle") if "one_turn_R" in c["scalars"]], ids=itemgetter("id")
)
def test_one_round_with_spin_agrees_with_the_reference(case):
    given, scalars = case["in"], case["scalars"]
    vector = rolling_ball.circle_rotation_vector(
        given["r"], given["a"], phase=given["phase0"], spin_per_rate=given["spin"] / given["rate"]
    )
    angle = scalars["one_turn_rotation_angle_unreduced"]
    np.testing.assert_allclose(np.linalg.norm(vector), angle, rtol=8 * EPS)
    turn = Rotation.from_rotvec(vector).as_matrix()
    np.testing.assert_allclose(turn, scalars["one_turn_R"], rtol=0, atol=4 * EPS * angle)


@pytest.mark.parametrize("case", kinematic("clothoid"), ids=itemgetter("id"))
def test_the_path_along_a_clothoid_agrees_with_the_reference(case):
    given, out = case["in"], case["out"]
    place = rolling_ball.clothoid_path(
        case["t"], speed=given["speed"], heading_acceleration=given["k"]
    )
    expected = np.stack([out["x"], out["y"]], axis=-1)
    tolerance = 8 * EPS * max(case["cond"]["x"], case["cond"]["y"])
    np.testing.assert_allclose(place, expected, rtol=0, atol=tolerance)


@pytest.mark.parametrize("case", cases("ball_clothoid_complete"), ids=itemgetter("id"))
def test_the_complete_clothoid_tips_the_ball_as_in_the_reference(case):
    given = case["in"]
    angle = rolling_ball.complete_clothoid_angle(
        speed=given["speed"], heading_acceleration=given["k"], radius=given["a"]
    )
    np.testing.assert_allclose(math.cos(angle), case["out"]["final_R33"], rtol=8 * EPS)


@pytest.mark.parametrize("case", cases("ball_reach"), ids=itemgetter("id"))
def test_three_straight_rolls_reach_the_pose_of_the_reference(case):
    given, out = case["in"], case["out"]
    plan = np.array(out["plan_displacements"])
    length = np.sum(np.linalg.norm(plan, axis=-1))
    assert plan.shape == (3, 2)
    np.testing.assert_allclose(length, out["path_length"], rtol=8 * EPS)
    np.testing.assert_allclose(
        np.sum(plan, axis=0), given["target_xy"], rtol=0, atol=4 * EPS * length
    )
    # The plan is rounded where it is printed: length / radius is how much that turns the ball.
    turn = matrices(rolling_ball.roll_polygon(plan, given["a"]))
    tolerance = 4 * EPS * length / given["a"]
    np.testing.assert_allclose(turn, matrices(given["target_q"]), rtol=0, atol=tolerance)


@pytest.mark.parametrize("case", cases("ball_holonomy_circle"), ids=itemgetter("id"))
def test_a_circle_rolled_once_agrees_with_the_reference(case):
    turn = rolling_ball.circle_holonomy(case["in"]["r"], case["in"]["a"])
    # The angle, up to 42 radians, is rounded before it is reduced.
    tolerance = 4 * EPS * case["out"]["angle_unreduced"]
    expected = np.array(case["out"]["R_loop"]).reshape(3, 3)
    np.testing.assert_allclose(matrices(turn), expected, rtol=0, atol=tolerance)
    vector = rolling_ball.circle_rotation_vector(case["in"]["r"], case["in"]["a"])
    unreduced = case["out"]["rotation_vector_unreduced"]
    np.testing.assert_allclose(vector, unreduced, rtol=4 * EPS, atol=0)
    np.testing.assert_allclose(np.linalg.norm(vector), case["out"]["angle_unreduced"], rtol=4 * EPS)
    area = math.pi * (case["in"]["r"] / case["in"]["a"]) ** 2
    np.testing.assert_allclose(area, case["out"]["small_loop_area_over_a2"], rtol=4 * EPS)


@pytest.mark.parametrize("case", cases("ball_holonomy_rectangle"), ids=itemgetter("id"))
def test_a_rectangle_of_straight_rolls_agrees_with_the_reference(case):
    x, y = case["in"]["lx"], case["in"]["ly"]
    turn = rolling_ball.roll_polygon([(x, 0.0), (0.0, y), (-x, 0.0), (0.0, -y)], case["in"]["a"])
    expected = np.array(case["out"]["R_loop"]).reshape(3, 3)
    np.testing.assert_allclose(matrices(turn), expected, rtol=0, atol=8 * EPS)
    vector = Rotation.from_quat(turn, scalar_first=True).as_rotvec()
    # Half a turn has two vectors, and which of them is a matter of rounding.
    if np.linalg.norm(case["out"]["rotation_vector"]) > 3.14:
        vector = math.copysign(1.0, vector @ case["out"]["rotation_vector"]) * vector
    np.testing.assert_allclose(vector, case["out"]["rotation_vector"], rtol=0, atol=8 * EPS)


@pytest.mark.parametrize("circle_radius", [1e-12, 1e-6, 1e-3])
def test_a_small_loop_turns_the_ball_by_minus_its_area_about_the_vertical(circle_radius):
    w, x, y, z = rolling_ball.circle_holonomy(circle_radius, 0.5)
    rho = circle_radius / 0.5
    # The next order is rho^2 / 4 relative, and the axis leans by rho.
    assert 2.0 * math.atan2(z, w) == pytest.approx(-math.pi * rho**2, rel=rho**2 + 8 * EPS)
    assert math.hypot(x, y) == pytest.approx(rho * abs(z), rel=8 * EPS)


def test_a_small_square_turns_the_ball_by_minus_its_area_about_the_vertical():
    side = 1e-3
    square = [(side, 0.0), (0.0, side), (-side, 0.0), (0.0, -side)]
    w, _, _, z = rolling_ball.roll_polygon(square, 1.0)
    assert 2.0 * math.atan2(z, w) == pytest.approx(-(side**2), rel=side)


def test_a_circle_of_sqrt_3_radii_turns_the_ball_not_at_all():
    turn = rolling_ball.circle_holonomy(math.sqrt(3.0), 1.0)
    np.testing.assert_allclose(matrices(turn), np.eye(3), rtol=0, atol=8 * EPS)


@pytest.mark.parametrize("rate", [0.7, -0.7])
@pytest.mark.parametrize("phase", [0.0, 2.2])
def test_one_round_of_rolling_is_the_holonomy_and_clockwise_its_inverse(rate, phase):
    place, turn = rolling_ball.roll_circle(
        [0.0, 2.0 * np.pi / abs(rate)], radius=0.4, circle_radius=0.9, rate=rate, phase=phase
    )
    loop = matrices(rolling_ball.circle_holonomy(0.9, 0.4, phase=phase))
    expected = loop if rate > 0.0 else loop.T
    np.testing.assert_allclose(place[1], place[0], rtol=0, atol=8 * EPS)
    np.testing.assert_allclose(matrices(turn[0]), np.eye(3), rtol=0, atol=8 * EPS)
    np.testing.assert_allclose(matrices(turn[1]), expected, rtol=0, atol=1e-14)


def test_polygons_approach_the_circle_with_the_square_of_their_sides():
    errors = []
    for n in (50, 100):
        angle = np.linspace(0.0, 2.0 * np.pi, n + 1)
        corners = 0.8 * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        polygon = matrices(rolling_ball.roll_polygon(np.diff(corners, axis=0), 0.3))
        circle = matrices(rolling_ball.circle_holonomy(0.8, 0.3))
        errors.append(np.max(np.abs(polygon - circle)))
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.02)


def test_ever_longer_clothoids_tip_the_ball_ever_closer_to_the_closed_form():
    speed, k, radius = 0.9, 0.7, 0.8
    angle = rolling_ball.complete_clothoid_angle(speed=speed, heading_acceleration=k, radius=radius)
    for end in (10.0, 40.0):
        t = np.linspace(-end, end, 200 * round(end) ** 2 // 10)
        way = rolling_ball.clothoid_path(t, speed=speed, heading_acceleration=k)
        _, x, y, z = turn = rolling_ball.roll_polygon(np.diff(way, axis=0), radius)
        # Beyond `end` the heading spins so fast that speed / (radius k end) is left at either side;
        # the polygon itself is 1e-3 off.
        rest = 2.0 * speed / (radius * k * end)
        assert matrices(turn)[2, 2] == pytest.approx(math.cos(angle), abs=rest)
        assert abs(z) < rest * math.hypot(x, y)


def test_a_clothoid_of_the_other_sense_is_its_mirror_image_and_a_faint_one_turns_the_ball_little():
    t = np.linspace(-3.0, 3.0, 7)
    left = rolling_ball.clothoid_path(t, speed=0.8, heading_acceleration=0.6)
    right = rolling_ball.clothoid_path(t, speed=0.8, heading_acceleration=-0.6)
    np.testing.assert_array_equal(right, left * np.array([1.0, -1.0]))
    np.testing.assert_allclose(left, -left[::-1], rtol=4 * EPS)
    faint = rolling_ball.complete_clothoid_angle(speed=1e-9, heading_acceleration=2.0, radius=1.0)
    # The length of the integral of omega, sqrt(2 pi / k) speed / radius.
    assert faint == pytest.approx(math.sqrt(math.pi) * 1e-9, rel=8 * EPS)


def test_the_contact_point_never_slips():
    arguments = {"radius": 0.4, "circle_radius": 0.7, "rate": 1.3, "phase": 0.4, "spin": -0.6}
    t, h = np.linspace(0.0, 5.0, 11), 1e-3
    weights = np.array([1.0, -8.0, 8.0, -1.0]) / (12.0 * h)
    times = t[:, None] + h * np.array([-2.0, -1.0, 1.0, 2.0])
    place, turn = rolling_ball.roll_circle(times, **arguments)
    now = matrices(rolling_ball.roll_circle(t, **arguments)[1])
    velocity = np.einsum("k,nki->ni", weights, place)
    rates = np.einsum("k,nkij->nij", weights, matrices(turn.reshape(-1, 4)).reshape(11, 4, 3, 3))
    spin = np.einsum("nij,nkj->nik", rates, now)  # R' R^T, antisymmetric
    omega = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=-1)
    # v = omega x radius e_z; the difference leaves h^4 and eps / h.
    np.testing.assert_allclose(velocity[:, 0], 0.4 * omega[:, 1], rtol=0, atol=1e-11)
    np.testing.assert_allclose(velocity[:, 1], -0.4 * omega[:, 0], rtol=0, atol=1e-11)
    np.testing.assert_allclose(omega[:, 2], -0.6, rtol=0, atol=1e-11)


def test_straight_rolls_of_any_shape_are_taken():
    assert rolling_ball.roll_straight(np.zeros((5, 3, 2)), 1.0, twist=np.ones(3)).shape == (5, 3, 4)
    quarter = rolling_ball.roll_straight((0.5 * np.pi, 0.0), 1.0)  # along x: about +y
    np.testing.assert_allclose(matrices(quarter) @ (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), atol=2 * EPS)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: rolling_ball.roll_straight((1.0, 0.0), 0.0), "^radius = 0.0; expected"),
        (lambda: rolling_ball.roll_straight((1.0, 0.0, 0.0), 1.0), r"shape \(3,\)"),
        (lambda: rolling_ball.roll_polygon((1.0, 0.0), 1.0), r"expected \(n, 2\)"),
        (lambda: rolling_ball.roll_segments(3.0, [(1.0, 0.0, 0.0, 2.0)], 1.0), "within"),
        (lambda: rolling_ball.roll_segments(0.0, [(1.0, 0.0, 0.0, -2.0)], 1.0), "duration"),
        (lambda: rolling_ball.circle_holonomy(math.nan, 1.0), "^circle_radius = nan; expected"),
        (lambda: rolling_ball.circle_rotation_vector(1.0, -1.0), "^radius = -1.0; expected"),
        (
            lambda: rolling_ball.clothoid_path(0.0, speed=1.0, heading_acceleration=0.0),
            "use roll_straight",
        ),
        (
            lambda: rolling_ball.complete_clothoid_angle(
                speed=1.0, heading_acceleration=-1.0, radius=1.0
            ),
            "^heading_acceleration = -1.0; expected",
        ),
    ],
)
def test_bad_input_is_refused_by_name(call, message):
    with pytest.raises(ValueError, match=message):
        call()
