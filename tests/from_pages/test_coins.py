"""Disks, a coin and a roller rebuilt from their pages do what the environments do."""

from typing import Any

import numpy as np
import pytest

from tests.from_pages.model import Model
from tests.from_pages.side_by_side import (
    actions,
    alike,
    begin,
    both,
    play,
    play_many,
    started,
)
from tests.from_pages.wheels import (
    CoinPark,
    DiskRoll,
    DiskRollRandom,
    RollPump,
    attitude_of,
    seen,
)

# Closed forms in float64 on both sides.
EXACT = 1e-12

# Ours integrates with errors of 1e-11 per control period, theirs to fourth order: it errs by less
# than the fourth power of what turns in a step, at 5 rad/s in 0.05 s. The relative error of a
# curvature of 0.1, by a tolerance of 0.05, magnifies that by 200.
FEW, MANY = 4, 32
DISK_ERROR = {n: 200.0 * (5.0 * 0.05 / n) ** 4 for n in (FEW, MANY)}  # 3e-3 and 8e-7


def on_rim(env: Any, model: DiskRoll, rng: np.random.Generator, seed: int, **more: Any) -> None:
    """Begin an episode with a start of ours and a goal of theirs."""
    observed = started(env, model, rng, seed, **more)
    alike(observed, model.observe(), EXACT)


long = pytest.mark.long  # a reduced frame with a delay is a kernel of its own
DISKS: list[Any] = [
    (DiskRoll, {}),
    (DiskRollRandom, {}),
    (DiskRoll, {"n_substeps": FEW}),
    (DiskRoll, {"rotation": "rot6d", "m": 2.0, "radius": 0.7, "I1": 0.4, "I3": 0.7}),
    (DiskRoll, {"rotation": "euler", "dt": 0.03, "torque": 5.0, "g": 6.0}),
    (DiskRoll, {"weight_circle": 2.0, "weight_effort": -0.5, "action_delay": 2}),
    (DiskRollRandom, {"observe_params": True, "rotation": "quat"}),
    pytest.param(DiskRoll, {"frame": "reduced", "action_delay": 1}, marks=long),
    (DiskRollRandom, {"frame": "reduced", "observe_params": True, "tolerance": 0.1}),
]


@pytest.mark.parametrize(("kind", "settings"), DISKS)
def test_a_disk_does_what_its_page_says(kind: type[DiskRoll], settings: dict[str, Any]) -> None:
    settings = {"n_substeps": MANY, **settings}
    tolerance = DISK_ERROR[settings["n_substeps"]]
    play_many(kind, 35, tolerance, n=3, at_start=EXACT, **settings)


@pytest.mark.parametrize("frame", ["world", "reduced"])
def test_a_wheels_backwards_or_spins_on_the_spot_does_what_its_page_says(frame: str) -> None:
    env, model = both(DiskRoll, n_substeps=MANY, frame=frame)
    rng = np.random.default_rng(2)
    for omega in ([0.1, 0.2, -1.5], [1.0, 2.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1e-6]):
        on_rim(env, model, rng, 0, omega_body=omega)
    on_rim(env, model, rng, 1, omega_body=[0.1, 0.2, -1.5])
    play(env, model, actions(rng, 20, 1), DISK_ERROR[MANY])


def test_a_disk_has_fallen_at_60_degrees() -> None:
    env, model = both(DiskRoll, n_substeps=MANY, hold=0.0)
    rng = np.random.default_rng(3)
    for seed in range(2):
        on_rim(env, model, rng, seed, omega_body=[0.0, 0.0, 0.0])
        # with `hold` = 0 every step is a success, but not that of the fall
        torque = np.full((200, 1), 0.6 * seed - 0.3, dtype=np.float32)
        assert not play(env, model, torque, DISK_ERROR[MANY])
        assert abs(seen(model.y).lean) > np.pi / 3


@pytest.mark.parametrize("hold", [0.0, 0.1, 0.12])
def test_a_disk_holds_its_circle_for_the_time_that_the_page_says(hold: float) -> None:
    env, model = both(DiskRoll, n_substeps=MANY, hold=hold, tolerance=0.9)
    rng, successes = np.random.default_rng(4), 0
    for seed in range(5):
        on_rim(env, model, rng, seed)
        successes += play(env, model, actions(rng, 12, 1), DISK_ERROR[MANY])
    assert successes >= 1


# Arcs are exact to a 1e-16th in integrator steps below 0.2 rad, as those of four in a period are;
# to 3e-12 rad in one of pi / 8, in each of 50 steps. Roots, rounded off, magnify by 30.
SPLIT = 4
ARCS = 50 * 30 * 3e-12

# The reduced features of the coin have roots and a quotient that are not rounded off: what is as
# small as 1e-4 is magnified by 50 and more, for errors of 1e-15 per step.
SHARP = 1e-10

COINS: list[Any] = [
    {},
    {"n_substeps": 1},
    *({"rotation": way} for way in ("rot6d", "none")),
    {"radius": 0.4, "dt": 0.05, "roll_per_step": 0.5, "steer_per_step": 0.3},
    {"radius": 0.015, "weight_mismatch": 0.7, "weight_side": -0.2},  # beyond 50 radii
    {"radius": (0.5, 1.5), "observe_params": True, "action_delay": 2},
    pytest.param({"frame": "reduced", "action_delay": 1}, marks=long),
    {"frame": "reduced", "radius": 0.02, "start_half_width": 3.0},
]


@pytest.mark.parametrize("settings", COINS)
def test_a_coin_does_what_its_page_says(settings: dict[str, Any]) -> None:
    settings = {"n_substeps": SPLIT, **settings}
    exact = EXACT if settings["n_substeps"] == SPLIT else ARCS
    play_many(CoinPark, 50, SHARP if "frame" in settings else exact, n=4, **settings)


@pytest.mark.parametrize("rates", [{}, {"steer_rate": 2.0, "roll_rate": -3.0}])
def test_a_coin_is_parked_within_its_tolerances_and_not_beside_them(
    rates: dict[str, float],
) -> None:
    env, model = both(CoinPark)
    rng, successes = np.random.default_rng(7), 0
    for _ in range(60):
        q = attitude_of(rng.uniform(-0.12, 0.12), rng.uniform(-0.18, 0.18))
        begin(env, model, {"q": q, "contact": rng.uniform(-0.1, 0.1, 2), **rates})
        successes += play(env, model, 0.05 * actions(rng, 9, 2), EXACT)
    assert 20 <= successes <= 58


def test_a_coin_at_the_edge_of_the_tolerance_is_parked() -> None:
    env, model = both(CoinPark, position_tolerance=0.5, heading_tolerance=0.3, phase_tolerance=0.3)
    for y, heading, phase, parked in (
        *((0.5, 0.1, -0.2, True), (-0.5, 0.1, -0.2, True)),
        *((np.nextafter(0.5, 1.0), 0.1, -0.2, False), (0.1, 0.3 - 1e-9, 0.0, True)),
        *((0.1, -0.3 - 1e-9, 0.0, False), (0.1, 0.0, 0.3 - 1e-9, True)),
        *((0.1, 0.0, 0.3 + 1e-9, False), (0.1, 0.0, -0.3 - 1e-9, False)),
    ):
        begin(env, model, {"q": attitude_of(heading, phase), "contact": [0.0, y]})
        assert play(env, model, [[0.0, 0.0]], EXACT) == parked


# As for disks; a roller swings at 1.7 rad/s, for up to 40 s, and its energy decides.
ROUGH, FINE = 1, 16
ROLLER_ERROR = {n: 40.0 * 1.7 * (1.7 * 0.1 / n) ** 4 for n in (ROUGH, FINE)}  # 6e-2 and 9e-7

ROLLERS: list[Any] = [
    {},
    {"n_substeps": ROUGH},
    {"action_delay": 3, "weight_shortfall": 0.5},
    {"beta": (0.3, 0.7), "curvature": (0.1, 0.4), "g": 3.0, "observe_params": True},
    {"beta_change": 2.0, "rim": 0.7, "start_part": 0.6, "dt": 0.07},
    pytest.param({"frame": "reduced", "action_delay": 1}, marks=long),
    {"frame": "reduced", "beta": (0.3, 0.7), "curvature": (0.1, 0.4)},
]


@pytest.mark.parametrize("settings", ROLLERS)
def test_a_roller_does_what_its_page_says(settings: dict[str, Any]) -> None:
    settings = {"n_substeps": FINE, **settings}
    tolerance = ROLLER_ERROR[settings["n_substeps"]]
    play_many(RollPump, 60, tolerance, n=3, at_start=EXACT, **settings)


@pytest.mark.parametrize("frame", ["world", "reduced"])
def test_a_roller_that_pumps_passes_the_rim(frame: str) -> None:
    env, model = both(RollPump, n_substeps=FINE, start_part=0.8, frame=frame)
    rng, successes = np.random.default_rng(10), 0
    for velocity in (0.0, 3.0, -5.0):
        begin(env, model, {**model.draw(rng), "velocity": velocity})
        # large during descent, small during ascent
        pump = ([-np.sign(model.y[0] * model.y[1])] for _ in range(400))
        successes += play(env, model, pump, ROLLER_ERROR[FINE])
    assert successes == 3


def test_a_disk_that_is_too_fast_for_the_integrator_ends_the_episode_without_reward() -> None:
    env, model = both(DiskRoll)
    rng, ended = np.random.default_rng(12), 0
    for k, spin in enumerate(np.linspace(26.0, 26.8, 12)):
        on_rim(env, model, rng, k, omega_body=[0.0, 0.0, spin])
        # 10 times as fast as the disks above, and 3 substeps
        ended += not play(env, model, [[1.0]], 1e4 * DISK_ERROR[FEW]) and model.rate > 30.0
    assert 0 < ended < 12


def test_a_roller_that_is_too_fast_for_the_integrator_ends_the_episode_without_reward() -> None:
    env, model = both(RollPump)
    ended = 0
    for speed in np.linspace(24.6, 24.99, 8):
        begin(env, model, {"arc_length": -3.0, "velocity": speed})
        play(env, model, [[-1.0]], 10.0 * ROLLER_ERROR[ROUGH])
        ended += model.rate > 5.0
    assert 0 < ended < 8


# As above; a disk that falls turns at up to 10 rad/s, not 5.
WIDE: list[tuple[type[Model], int, int, float]] = [
    (DiskRoll, MANY, 60, 16.0 * DISK_ERROR[MANY]),
    (DiskRollRandom, MANY, 60, 16.0 * DISK_ERROR[MANY]),
    (CoinPark, SPLIT, 100, SHARP),
    (RollPump, FINE, 400, ROLLER_ERROR[FINE]),
]


@pytest.mark.long
@pytest.mark.parametrize("frame", ["world", "reduced"])
@pytest.mark.parametrize(("kind", "n_substeps", "steps", "tolerance"), WIDE)
def test_many_episodes_are_what_the_page_says(
    kind: type[Model], n_substeps: int, steps: int, tolerance: float, frame: str
) -> None:
    # roots of the coin that are not rounded off, of 1e-8
    tolerance *= 1e4 if kind is CoinPark and frame == "reduced" else 1.0
    play_many(kind, steps, tolerance, n_substeps=n_substeps, frame=frame)
