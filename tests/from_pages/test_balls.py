"""Balls rebuilt from their pages do what the environments do."""

import math

import numpy as np
import pytest

from tests.from_pages import balls, side_by_side
from tests.from_pages.attitudes import compose, of_matrix, of_rotation_vector
from tests.from_pages.pushed_balls import BallParkDynamic, BallPlate
from tests.refusals import refuses

# Both sides are closed forms in float64: errors of some 1e-16 per step, which the roots, rounded
# off at 0.001, magnify to at most 30 times as much.
EXACT = 1e-12

# The reduced features have roots that are not rounded off: from errors of 1e-15 near 0 come 3e-8.
ROOTS = 1e-7

# The desired goal is known as it is observed, in float32, and its errors of 1e-7 are magnified by
# the roots of components that may be as small as 0.01.
ROUNDED_GOAL = 2e-6

# Where the motion is integrated, ours has errors of 1e-11 per control period. Theirs is of fourth
# order: it errs by less than the fourth power of what turns in a step, at 4 rad/s in 0.2 s, for its
# constants are below 1. Here with the default number of substeps and with many.
COARSE, FINE = 6, 96
INTEGRATED = {n: (4.0 * 0.2 / n) ** 4 for n in (COARSE, FINE)}  # 3e-4 and 5e-9

# On the table, as above, balls turn at up to 5 rad/s in 0.1 s.
ROUGH, SMOOTH = 2, 40
TABLE_ERROR = {n: (5.0 * 0.1 / n) ** 4 for n in (ROUGH, SMOOTH)}  # 4e-3 and 2e-8

# A reduced frame is a kernel of its own, and another with a delay: at a push, of few ids.
long = pytest.mark.long

POSES = (balls.BallPark, balls.BallParkRandom, balls.BallReorient)
PARKING = [
    *((kind, {}) for kind in POSES),
    *((balls.BallPark, {"rotation": way}) for way in ("rot6d", "quat", "euler", "none")),
    (balls.BallPark, {"weight_angle": 0.3, "weight_twist": -0.5, "weight_position": 0.2}),
    (balls.BallPark, {"dt": 0.04, "roll_per_step": 0.7, "radius": 0.3, "n_substeps": 3}),
    (balls.BallPark, {"radius": 0.02}),  # 50 radii and more from the goal
    (balls.BallPark, {"action_delay": 2}),
    (balls.BallParkRandom, {"observe_params": True, "radius": (0.1, 5.0)}),
]


@pytest.mark.parametrize(("kind", "settings"), PARKING)
def test_a_ball_that_parks_does_what_its_page_says(kind, settings):
    side_by_side.play_many(kind, 40, EXACT, n=3, **settings)


@pytest.mark.parametrize(
    ("kind", "delay"),
    [*((kind, 0) for kind in POSES), *(pytest.param(kind, 1, marks=long) for kind in POSES)],
)
def test_the_reduced_frame_of_parking_is_that_of_the_page(kind, delay):
    side_by_side.play_many(kind, 40, ROOTS, n=4, frame="reduced", action_delay=delay)


@pytest.mark.parametrize(
    ("q", "position"),
    [
        ((1.0, 0.0, 0.0, 0.0), (0.0, 0.0)),
        ((1.0, 0.0, 0.0, 0.0), (0.3, -0.4)),
        ((0.8, 0.0, 0.0, -0.6), (0.0, 0.0)),
        ((-0.8, 0.0, 0.6, 0.0), (0.0, 0.0)),
    ],
)
def test_the_reduced_frame_has_a_direction_where_there_is_no_offset(q, position):
    env, model = side_by_side.both(balls.BallPark, frame="reduced", position_tolerance=1e-6)
    side_by_side.begin(env, model, {"q": q, "position": position})
    side_by_side.play(env, model, [np.array([0.7, 0.2], dtype=np.float32)], ROOTS)


@pytest.mark.parametrize("kind", POSES)
def test_a_ball_is_parked_within_both_tolerances_and_not_beside_them(kind):
    env, model = side_by_side.both(kind, position_tolerance=0.2, angle_tolerance=0.3)
    rng, successes = np.random.default_rng(3), 0
    for _ in range(60):
        offset, theta = rng.uniform(-0.25, 0.25, 2), rng.uniform(-0.25, 0.25, 3)
        state = {"q": of_rotation_vector(theta), "position": offset}
        side_by_side.begin(env, model, state, model.draw_params(rng))
        successes += side_by_side.play(env, model, 0.1 * side_by_side.actions(rng, 20, 2), EXACT)
    assert 20 <= successes <= 58


@pytest.mark.parametrize("settings", [{}, {"weight_distance": 0.7, "radius": (0.5, 0.9)}])
def test_a_ball_with_a_goal_does_what_its_page_says(settings):
    side_by_side.play_many(balls.BallParkGoal, 100, EXACT, n=3, **settings)


@long
def test_a_ball_stays_at_its_goal_in_the_reduced_frame_and_earns_nothing_less():
    env, model = side_by_side.both(
        balls.BallParkGoal, frame="reduced", position_tolerance=0.5, angle_tolerance=0.5
    )
    rng, successes = np.random.default_rng(5), 0
    for seed in range(8):
        seen, _ = env.reset(seed=seed)
        goal = np.asarray(seen["desired_goal"], dtype=float)
        q = compose(
            of_rotation_vector(rng.uniform(-0.4, 0.4, 3)), of_matrix(goal[2:].reshape(3, 3))
        )
        state = {"q": q, "position": goal[:2] + rng.uniform(-0.4, 0.4, 2)}
        side_by_side.begin(env, model, state, seed=seed, goal=goal)
        successes += side_by_side.play(env, model, side_by_side.actions(rng, 30, 2), ROUNDED_GOAL)
    assert successes >= 2


def test_rewards_of_goals_are_computed_anew_as_the_page_says():
    settings = {"weight_distance": 0.5, "angle_tolerance": 1.5, "position_tolerance": 2.0}
    env, model = side_by_side.both(balls.BallParkGoal, **settings)
    rng = np.random.default_rng(6)
    pairs = [(model.draw(rng, {})["goal"], model.draw(rng, {})["goal"]) for _ in range(300)]
    expected = []
    for achieved, desired in pairs:
        terms = model.judge(achieved, desired)
        expected.append(terms["reached"] + 0.5 * terms["distance"])
    assert 0 < sum(reward == 0.0 for reward in expected) < 300
    sides = (np.array(side, dtype=np.float32) for side in zip(*pairs, strict=True))
    rewards = env.unwrapped.compute_reward(*sides, {})
    np.testing.assert_allclose(rewards, expected, rtol=0.0, atol=EXACT)


@pytest.mark.parametrize(("X", "parked"), [(0.5, True), (math.nextafter(0.5, 1.0), False)])
def test_a_ball_at_the_edge_of_the_tolerance_is_parked(X, parked):
    env, model = side_by_side.both(balls.BallPark, position_tolerance=0.5)
    side_by_side.begin(env, model, {"q": [1.0, 0.0, 0.0, 0.0], "position": [X, 0.0]})
    assert side_by_side.play(env, model, [[0.0, 0.0]], EXACT) == parked


@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"radius": 0.3, "start_cells": 1, "weight_moves": 0.2, "action_delay": 2},
        {"frame": "reduced", "start_cells": 1},
        {"frame": "reduced", "start_cells": 6},
        {"rotation": "rot6d", "start_cells": 0},  # w may be 0, where the sign of q is not defined
    ],
)
def test_a_ball_on_a_grid_does_what_its_page_says(settings):
    env, model = side_by_side.both(balls.BallGrid, **settings)
    rng, successes = np.random.default_rng(8), 0
    for _ in range(20):
        seen = side_by_side.begin(env, model, model.draw(rng, {}))
        side_by_side.alike(seen, model.observe(), EXACT)
        # the next choice is often the opposite of the last: so home is reached, from home at once
        choices = np.cumsum(rng.choice([0, 1, 2, 2], 30)) % 4
        successes += side_by_side.play(env, model, choices, EXACT)
    assert successes or settings.get("start_cells", 4) > 1


@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"path": "eight", "weight_close": 0.3, "dt": 0.07},
        {"path": "elastica", "radius": 0.4, "wavenumber": 0.9, "reference_speed": 0.8},
        {"radius": (0.5, 1.5), "observe_params": True, "rotation": "euler"},
        pytest.param({"action_delay": 1}, marks=long),
        pytest.param({"frame": "reduced", "roll_per_step": 0.2, "n_substeps": 4}, marks=long),
        pytest.param({"frame": "reduced", "action_delay": 2}, marks=long),
    ],
)
def test_a_ball_that_follows_does_what_its_page_says(settings):
    side_by_side.play_many(balls.BallSteer, 100, EXACT, n=3, **settings)


def test_a_ball_succeeds_while_its_mean_error_is_within_the_bound():
    env, model = side_by_side.both(balls.BallSteer, start_offset=0.1, start_angle=0.2, bound=0.3)
    outcomes = []
    for seed in range(6):
        seen, _ = env.reset(seed=seed)
        y, aux = env.unwrapped.y, side_by_side.hidden(env)
        model.begin(q=y[:4], position=y[4:], aux=aux)
        side_by_side.alike(seen, model.observe(), EXACT)
        copied = (model.leading() + 0.02 * (seed - 2) for _ in range(300))
        outcomes.append(side_by_side.play(env, model, copied, 1e-11))  # roundings of 300 steps
    assert len(set(outcomes)) == 2


@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"n_substeps": COARSE},
        {"turntable_rate": 0.8, "rotation": "rot6d", "action_delay": 1},
        {"m": 2.0, "radius": 0.5, "beta": 2 / 3, "force": 5.0, "dt": 0.1},
        {"m": (0.8, 1.5), "beta": (0.2, 0.5), "observe_params": True, "weight_angle": 0.1},
    ],
)
def test_a_ball_with_inertia_does_what_its_page_says(settings):
    settings = {"n_substeps": FINE, **settings}
    tolerance = INTEGRATED[settings["n_substeps"]]
    side_by_side.play_many(BallParkDynamic, 40, tolerance, n=2, at_start=EXACT, **settings)


@pytest.mark.parametrize(
    ("turntable_rate", "delay"), [(0.0, 0), (-0.6, 0), pytest.param(-0.6, 1, marks=long)]
)
def test_the_reduced_frame_of_a_ball_with_inertia_is_that_of_the_page(turntable_rate, delay):
    settings = {"frame": "reduced", "turntable_rate": turntable_rate, "action_delay": delay}
    settings |= {"n_substeps": FINE, "m": (0.5, 2.0), "beta": (0.3, 0.6)}
    env, model = side_by_side.both(BallParkDynamic, **settings)
    rng = np.random.default_rng(13)
    for _ in range(3):
        start = {**model.draw(rng, {}), "velocity": rng.uniform(-1.0, 1.0, 2)}
        seen = side_by_side.begin(env, model, start, model.draw_params(rng))
        side_by_side.alike(seen, model.observe(), ROOTS)
        # the roots of components that may be as small as 1e-4 magnify by 50
        side_by_side.play(env, model, side_by_side.actions(rng, 30, 2), 50.0 * INTEGRATED[FINE])


def test_a_ball_with_inertia_is_parked_at_rest_and_not_beside_its_tolerances():
    settings = {"position_tolerance": 0.2, "angle_tolerance": 0.3, "speed_tolerance": 0.2}
    env, model = side_by_side.both(BallParkDynamic, **settings)
    rng, successes = np.random.default_rng(14), 0
    for _ in range(30):
        theta, offset = rng.uniform(-0.2, 0.2, 3), rng.uniform(-0.2, 0.2, 2)
        velocity = rng.uniform(-0.3, 0.3, 2)
        state = {"q": of_rotation_vector(theta), "position": offset, "velocity": velocity}
        side_by_side.begin(env, model, state)
        successes += side_by_side.play(
            env, model, 0.1 * side_by_side.actions(rng, 5, 2), INTEGRATED[COARSE]
        )
    assert 5 <= successes <= 28


def test_a_ball_with_inertia_falls_off_the_plate_at_its_edge():
    env, model = side_by_side.both(BallParkDynamic, start_half_width=1.0, margin=0.5)
    rng = np.random.default_rng(15)
    for _ in range(5):
        side_by_side.begin(env, model, model.draw(rng, {}))
        heading = rng.uniform(0.0, 2.0 * math.pi)
        action = np.array([math.cos(heading), math.sin(heading)])
        assert not side_by_side.play(env, model, [action] * 100, INTEGRATED[COARSE])
        assert math.hypot(*model.position) > math.sqrt(2.0) + 0.5
    for offset in (-1e-3, 1e-3):
        at_rest = {"position": [math.sqrt(2.0) + 0.5 + offset, 0.0], "velocity": [0.0, 0.0]}
        side_by_side.begin(env, model, {"q": [1.0, 0.0, 0.0, 0.0], **at_rest})
        side_by_side.play(env, model, [[0.0, 0.0]], INTEGRATED[COARSE])


TABLES = [
    {},
    {"n_substeps": ROUGH},
    {"turntable_rate": 1.5, "rotation": "matrix", "radius": 0.7},
    {"tilt_limit": 0.4, "tilt_rate": 2.0, "margin": 8.0, "g": 5.0, "rotation": "quat"},
    pytest.param({"frame": "reduced", "action_delay": 1}, marks=long),
    pytest.param(
        {"frame": "reduced", "turntable_rate": -1.0, "beta": (0.3, 0.6), "radius": (0.6, 1.1)},
        marks=long,
    ),
    {"weight_effort": 2.0, "weight_near": 0.3, "m": (1.0, 2.0), "observe_params": True},
]


@pytest.mark.parametrize("settings", TABLES)
def test_a_ball_on_a_table_does_what_its_page_says(settings):
    settings = {"n_substeps": SMOOTH, **settings}
    tolerance = TABLE_ERROR[settings["n_substeps"]]
    side_by_side.play_many(BallPlate, 40, tolerance, n=2, at_start=EXACT, **settings)


def test_a_table_that_starts_tilted_and_turning_stops_within_its_limit():
    env, model = side_by_side.both(BallPlate, n_substeps=SMOOTH)
    rng = np.random.default_rng(18)
    for seed in range(4):
        tilted = {"tilt": rng.uniform(-0.15, 0.15, 2), "tilt_rate": rng.uniform(-0.5, 0.5, 2)}
        side_by_side.started(env, model, rng, seed, **tilted, spin=rng.uniform(-2.0, 2.0))
        side_by_side.play(env, model, np.ones((30, 2), dtype=np.float32), TABLE_ERROR[SMOOTH])


@pytest.mark.parametrize("hold", [0.0, 0.3, 0.35, 2.0])
def test_a_ball_is_held_for_the_time_that_the_page_says(hold):
    env, model = side_by_side.both(BallPlate, hold=hold, tolerance=0.1, n_substeps=SMOOTH)
    rng, successes = np.random.default_rng(19), 0
    for seed in range(6):
        env.reset(seed=seed)
        near = {"position": side_by_side.hidden(env)[:2] + np.array([0.05, 0.0])}
        near["velocity"] = rng.uniform(-0.05, 0.05, 2)
        side_by_side.started(env, model, rng, seed, **near)
        successes += side_by_side.play(
            env, model, np.zeros((30, 2), dtype=np.float32), TABLE_ERROR[SMOOTH]
        )
    assert successes > 0


@pytest.mark.parametrize(("X", "near"), [(0.0625, False), (math.nextafter(0.0625, 0.0), True)])
def test_a_ball_at_the_edge_of_the_tolerance_is_not_near_its_point(X, near):
    env, model = side_by_side.both(BallPlate, start_radius=0.0, tolerance=0.0625, hold=0.1)
    at_rest = {"position": [X, 0.0], "velocity": [0.0, 0.0]}
    side_by_side.started(env, model, np.random.default_rng(25), 0, **at_rest)
    assert side_by_side.play(env, model, [[0.0, 0.0]], EXACT) == near


def test_a_ball_falls_off_the_table_at_its_edge():
    env, model = side_by_side.both(
        BallPlate, start_radius=1.0, margin=0.3, tilt_limit=0.3, n_substeps=SMOOTH
    )
    rng = np.random.default_rng(20)
    for seed in range(3):
        side_by_side.started(env, model, rng, seed)
        assert not side_by_side.play(
            env, model, np.tile([1.0, -0.5], (200, 1)), 100.0 * TABLE_ERROR[SMOOTH]
        )  # 7 s
        assert math.hypot(*model.y[4:6]) > 1.3


def test_a_ball_that_is_too_fast_for_the_integrator_ends_the_episode_without_reward():
    env, model = side_by_side.environment("BallParkDynamic"), BallParkDynamic(n_substeps=COARSE)
    rng, ended = np.random.default_rng(22), 0
    for speed in np.linspace(14.0, 14.95, 12):
        side_by_side.begin(env, model, {**model.draw(rng, {}), "velocity": [speed, 0.0]})
        side_by_side.play(env, model, [[1.0, 0.0]], 50.0 * INTEGRATED[COARSE])  # 15 rad/s, not 4
        if model.rate > 15.0:
            ended += 1
            assert env.unwrapped.y.tolist() == [1.0] + 12 * [0.0]
    assert 0 < ended < 12
    refuses("rates of at most 15", env.reset, options={"state": {"velocity": [15.1, 0.0]}})


def test_a_number_above_1e9_ends_the_episode_without_reward():
    env = side_by_side.environment("BallPark", radius=100.0)
    env.reset(seed=0, options={"state": {"position": [1e9 - 10.0, 0.0]}})
    _, reward, terminated, _, info = env.step(np.array([1.0, 0.0], dtype=np.float32))
    assert terminated and info["physics_error"] and reward == 0.0 and info["cost"] == 0.0


# As above. Roots of components of 1e-6, which are not rounded off, magnify by 500; roundings add up
# over 300 steps; on the table, errors of a velocity add up to those of a position for 20 s.
WIDE = [
    *((kind, 1, 100, EXACT) for kind in (*POSES, balls.BallParkGoal)),
    (balls.BallSteer, 1, 300, 10.0 * EXACT),
    (BallParkDynamic, FINE, 100, INTEGRATED[FINE]),
    (BallPlate, SMOOTH, 200, 100.0 * TABLE_ERROR[SMOOTH]),
]


@long
@pytest.mark.parametrize("frame", ["world", "reduced"])
@pytest.mark.parametrize(("kind", "n_substeps", "steps", "tolerance"), WIDE)
def test_many_episodes_of_a_ball_are_what_its_page_says(kind, n_substeps, steps, tolerance, frame):
    if frame == "reduced":
        tolerance = 500.0 * max(tolerance, ROUNDED_GOAL if kind is balls.BallParkGoal else ROOTS)
    side_by_side.play_many(kind, steps, tolerance, n_substeps=n_substeps, frame=frame)
