"""The pages of the top are enough to rebuild their environments."""

import numpy as np
import pytest

from tests.from_pages import tops
from tests.from_pages.model import Page
from tests.from_pages.side_by_side import Pair, in_frames
from tests.from_pages.tops import KINDS

each = pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)


def top(tilt: float, omega: tuple[float, float, float], *pivot: float) -> np.ndarray:
    """A state that leans towards -y."""
    q = [np.cos(tilt / 2), np.sin(tilt / 2), 0.0, 0.0]
    return np.array([*q, *omega, *(pivot or (0.0, 0.0, 0.0, 0.0))])


@pytest.mark.parametrize(("kind", "frame"), in_frames(*KINDS))
def test_any_state_does_the_same(kind: type[Page], frame: str) -> None:
    rng = np.random.default_rng(2)
    pair = Pair(kind, frame=frame, **({"fall": 3.1} if kind is tops.PivotTop else {}))
    for _ in range(4):
        y = rng.normal(size=11)
        y[:4] /= np.linalg.norm(y[:4])
        y[4:7] *= 3.0  # also spins below zero
        pair.reset(rng, y if kind is tops.PivotTop else [*y[:7], 0.0, 0.0, 0.0, 0.0])
        pair.shake(rng, 10)


@pytest.mark.parametrize(("kind", "frame"), in_frames(*KINDS))
def test_limits_and_edges_are_alike(kind: type[Page], frame: str) -> None:
    rng, pair = np.random.default_rng(13), Pair(kind, frame=frame)
    fast = ((33.0, -35.0, 32.0), (-33.0, 35.0, -32.0), (1.0, 0.0, 34.0))
    for tilt in (0.0, 1e-7, 0.3, 1.6, np.pi):
        for omega in fast:  # too fast to step with this accuracy
            pair.reset(rng, top(tilt, omega, 12.0, -20.0, 25.0, -21.0))
            pair.reset(rng, top(tilt, omega, -12.0, 20.0, -25.0, 21.0))
    for omega in ((0.0, 0.0, 0.0), (0.0, 0.0, 4.0), (1e-10, 0.0, -2.0), (0.3, -0.2, 5.0)):
        pair.reset(rng, top(0.3, omega))
        pair.shake(rng, 1)


@each
def test_weights_and_tolerances_do_the_same(kind: type[Page]) -> None:
    rng = np.random.default_rng(5)
    weights = {f"weight_{term}": float(k) - 0.5 for k, term in enumerate(kind.terms)}
    wide = {name: 0.9 for name in kind.defaults() if "tolerance" in name}
    pair = Pair(kind, hold=0.22, **weights, **wide)
    pair.reset(
        rng,
        top(0.1, (0.0, 0.0, 5.0)),
        np.array([0.0, 0.9]) if "goal_tilt" in kind.defaults() else None,
    )
    outcomes = pair.shake(rng, 30)
    successes = [outcome.info["is_success"] for outcome in outcomes]
    assert any(successes) or kind is tops.TopPrecession


# -- ends


@pytest.mark.parametrize("kind", [k for k in KINDS if k is not tops.TopPrecession])
@pytest.mark.parametrize("hold", [0.0, 0.32, 1.0])
def test_a_sleeping_top_is_a_success_after_the_hold_time(kind: type[Page], hold: float) -> None:
    rng, pair = np.random.default_rng(7), Pair(kind, hold=hold)
    pair.reset(rng, top(0.03, (0.0, 0.0, 8.0)))

    def policy(page: Page, k: int) -> np.ndarray:
        """A kick; the top nutates and comes back, or not."""
        return np.ones(page.controls) * (25 < k < 30)

    successes = [outcome.info["is_success"] for outcome in pair.run(policy, 50)]
    first = {0.0: 0, 0.32: 6, 1.0: 19}[hold]  # 1, 7 and 20 steps of 0.05 s
    assert successes.index(True) == first
    assert all(successes) == (hold == 0.0)


@pytest.mark.parametrize("branch", ["slow", "fast"])
@pytest.mark.parametrize("spin", [6.0, -6.0])
@pytest.mark.parametrize(("kind", "frame"), in_frames(tops.TopPrecession))
def test_steady_precession_is_a_success(
    branch: str, spin: float, kind: type[Page], frame: str
) -> None:
    rng = np.random.default_rng(8)
    pair = Pair(kind, branch=branch, hold=0.5, frame=frame, max_episode_steps=60)
    tilt = 0.5
    a, b, c = np.cos(tilt), 0.5 * spin, pair.page.m * pair.page.g * pair.page.ell
    root = np.sqrt(b * b - 4 * a * c) * np.sign(b)
    rate = 2 * c / (b + root) if branch == "slow" else (b + root) / (2 * a)
    # the vertical in body axes is (0, sin, cos)
    start = top(tilt, (0.0, rate * np.sin(tilt), spin))
    pair.reset(rng, start, np.array([0.0, tilt]))

    def policy(page: Page, k: int) -> np.ndarray:
        return np.array([1.0, 0.5]) * (k > 40)

    successes = [outcome.info["is_success"] for outcome in pair.run(policy)]
    assert successes.index(True) == 9 and not successes[-1]


def test_a_slow_spin_has_a_goal_too() -> None:
    rng, pair = np.random.default_rng(9), Pair(tops.TopPrecession, branch="fast")
    for spin in (2.0, -1.0):
        pair.reset(rng, top(0.4, (0.2, 0.1, spin)))
        pair.shake(rng, 10)


@pytest.mark.parametrize("seed", range(3))
def test_an_episode_ends_when_the_top_has_fallen(seed: int) -> None:
    rng, pair = np.random.default_rng(seed), Pair(tops.PivotTop)
    pair.reset(rng)
    outcomes = pair.run(lambda page, k: np.zeros(2))
    assert outcomes[-1].terminated and pair.page.tilt() > 0.5
    assert outcomes[-1].reward > 0.0  # as every other step


def test_a_top_has_fallen_at_the_tilt_of_the_page_and_not_below() -> None:
    rng, pair = np.random.default_rng(14), Pair(tops.PivotTop)
    for tilt in (0.499, 0.5001):  # within a step it grows by less than 1e-3
        pair.reset(rng, top(tilt, (0.0, 0.0, 0.0)))
        outcome, _ = pair.step(np.zeros(2))
        assert outcome.terminated == (tilt > 0.5)


@pytest.mark.parametrize(("kind", "frame"), in_frames(tops.PivotTop))
def test_an_episode_ends_when_the_pivot_leaves_the_arena(kind: type[Page], frame: str) -> None:
    rng, pair = np.random.default_rng(10), Pair(kind, frame=frame, fall=3.0)
    pair.reset(rng, top(0.02, (0.0, 0.0, 3.0), 3.0, 3.0, 1.0, 2.0))
    outcomes = pair.shake(rng, 1000)
    assert outcomes[-1].terminated and pair.page.distance() > 5.0


@pytest.mark.parametrize("kind", KINDS[1:4])
def test_a_motion_that_becomes_too_fast_ends(kind: type[Page]) -> None:
    pair = Pair(kind, within=1e-4, n_substeps=kind.defaults()["n_substeps"])
    pair.reset(np.random.default_rng(11), top(1.0, (19.98, 0.0, 0.0)))
    outcomes = pair.run(lambda page, k: np.ones(page.controls), 100)
    assert outcomes[-1].info["physics_error"] and outcomes[-1].terminated


# -- where a frame has no direction


@pytest.mark.parametrize(("kind", "frame"), in_frames(*KINDS))
@pytest.mark.parametrize("spin", [0.0, 2.0, -2.0])
def test_an_upright_top_has_a_frame(kind: type[Page], frame: str, spin: float) -> None:
    rng, pair = np.random.default_rng(12), Pair(kind, frame=frame)
    pair.reset(rng, top(0.0, (0.0, 0.0, spin)))
    # without spin, rounding of omega3 decides on the side of y after the first step
    pair.shake(rng, 5 if spin else 1)
