"""The pages of the free body and of the top are enough to rebuild their environments."""

import re

import gymnasium as gym
import numpy as np
import pytest

from rigid_envs.testing.environments import FULL
from tests.from_pages import bodies, tops
from tests.from_pages.attitudes import compose, of_rotation_vector
from tests.from_pages.model import pages_of
from tests.from_pages.side_by_side import Pair, environment, in_frames

# The pages of the free body are enough to rebuild their environments.


def spinning(page, omega):
    return np.array([0.6, 0.0, -0.8, 0.0, *omega])


def top(tilt, omega, *pivot):
    """A state that leans towards -y."""
    q = [np.cos(tilt / 2), np.sin(tilt / 2), 0.0, 0.0]
    return np.array([*q, *omega, *(pivot or (0.0, 0.0, 0.0, 0.0))])


@pytest.mark.parametrize(("kind", "frame"), in_frames(*bodies.KINDS))
def test_limits_and_edges_are_alike(kind, frame):
    rng, pair = np.random.default_rng(19), Pair(kind, frame=frame)
    for omega in (
        (25.0, 30.0, -22.0),
        (-25.0, -30.0, 22.0),
        (0.0, -30.0, 0.01),
        (20.5, 0.0, -21.0),
    ):
        pair.reset(rng, spinning(pair.page, omega))  # too fast to step with this accuracy
    for axis in np.vstack([np.zeros(3), np.eye(3), -np.eye(3)]):
        pair.reset(rng, spinning(pair.page, tuple(axis)))
        pair.shake(rng, 1)
        pair.reset(rng, spinning(pair.page, (1e-10 * rng.normal(size=3) + axis).tolist()))
        pair.shake(rng, 1)


@pytest.mark.long
@pytest.mark.parametrize("time", [-3.0, 0.0, 0.5, 60.0, 9000.0])
def test_any_time_that_is_left_is_alike(time):
    rng, times = np.random.default_rng(20), (12.0, max(20.0, time))
    pair = Pair(bodies.AxisFlip, frame="reduced", flip_time=times)
    for omega in ((0.1, 1.0, 0.05), (0.1, -1.0, 0.05), (0.0, 1.0, 0.0)):
        pair.reset(rng, spinning(pair.page, omega), aux=np.array([time, 1.0]))
        pair.step(np.zeros(3))


# -- ends


@pytest.mark.parametrize("kind", bodies.KINDS[:4], ids=lambda kind: kind.__name__)
@pytest.mark.parametrize("hold", [0.0, 0.05, 0.3, 0.7])
def test_successes_are_counted_alike(kind, hold):
    rng, pair = np.random.default_rng(7), Pair(kind, hold=hold, tolerance=0.03, torque=0.4)
    pair.reset(rng, spinning(pair.page, (0.005, 1.0, 0.005)))

    def policy(page, k):
        push = {9: 1.0, 10: 1.0, 12: -1.0, 13: -1.0}.get(k % 15, 0.0)
        return push * np.ones(page.n_action)

    successes = [outcome.info["is_success"] for outcome in pair.run(policy, 30)]
    assert any(successes) and (all(successes) == (hold == 0.0))  # see the page: 0 asks nothing


@pytest.mark.parametrize("actuators", ["e1 e2", "e1 e3", "e2"])
def test_an_axis_without_actuator_has_no_torque(actuators):
    rng, pair = np.random.default_rng(9), Pair(bodies.SpinCapture, actuators=actuators)
    pair.reset(rng)
    pair.shake(rng, 20)


@pytest.mark.parametrize("time", [1.0, 1.04, 1.1, 3.0])
@pytest.mark.parametrize(("kind", "frame"), in_frames(bodies.AxisFlip))
def test_a_flip_is_judged_from_the_commanded_time_on(time, kind, frame):
    rng = np.random.default_rng(10)
    pair = Pair(kind, torque=2.0, frame=frame)
    pair.reset(rng, aux=np.array([time, 1.0]))

    def policy(page, k):
        """`brute_force` of the page; later it lets go, and kicks the body away."""
        tau = -4 * page.moments * (page.omega + np.array([0, 1, 0]))
        kicked = np.ones(3) if k == 40 else tau / page.torque
        S = page.sign() if page.frame == "reduced" else 1.0
        return kicked * [S, 1.0, S]

    successes = [outcome.info["is_success"] for outcome in pair.run(policy, 50)]
    assert any(successes) == (time == 3.0)  # before, the spin is not yet reversed
    assert not successes[-1]


@pytest.mark.parametrize(("kind", "frame"), in_frames(bodies.Detumble))
def test_impulses_against_the_momentum_end_it(kind, frame):
    pair = Pair(kind, frame=frame)
    pair.reset(np.random.default_rng(11))

    def policy(page, k):
        L = page.moments * page.omega
        if page.frame == "reduced":
            return np.array([min(1.0, np.linalg.norm(L) / 0.5), 0.0, 0.0])
        return -L / max(0.5, float(np.linalg.norm(L)))

    outcomes = pair.run(policy)
    assert len(outcomes) == 50
    assert outcomes[-1].info["is_success"] and not outcomes[0].info["is_success"]


@pytest.mark.parametrize(("kind", "frame"), in_frames(bodies.Detumble))
def test_the_terms_and_entries_of_a_large_momentum_are_limited(kind, frame):
    rng, pair = np.random.default_rng(22), Pair(kind, start_momentum=0.01, frame=frame)
    pair.reset(rng, spinning(pair.page, (1.0, 0.5, -0.3)))
    outcome, _ = pair.step(np.zeros(3))
    assert outcome.info["reward/momentum"] == -100.0
    assert frame == "world" or outcome.observation[0] == 100.0


@pytest.mark.parametrize("size", [1.0 - 1e-7, 1.0 + 1e-7, 1.0 + 3e-7])
def test_a_direction_that_was_rounded_is_not_clipped(size):
    rng, pair = np.random.default_rng(12), Pair(bodies.Detumble)
    pair.reset(rng)
    for _ in range(40):
        direction = rng.normal(size=3)
        pair.step(size * direction / np.linalg.norm(direction))


@pytest.mark.parametrize(("kind", "frame"), in_frames(bodies.Reorient))
def test_a_turn_at_its_goal_is_alike(kind, frame):
    rng, pair = np.random.default_rng(13), Pair(kind, frame=frame)
    for angle in (0.0, 1e-9, 0.05):
        pair.reset(rng)
        state = pair.env.unwrapped.get_state()
        state["y"][:4] = compose(pair.page.aux, of_rotation_vector([0.0, angle, 0.0]))
        pair.env.unwrapped.set_state(state)
        pair.page.y[:4] = state["y"][:4]
        # at rest: there roundings decide on the signs of the frame
        outcomes = [pair.step(np.zeros(3))[0] for _ in range(2)]
        assert outcomes[1].info["is_success"]


def test_rewards_of_goals_are_computed_alike():
    rng, page = np.random.default_rng(14), bodies.Reorient(weight_angle=0.3, weight_rate=0.2)
    env = gym.make("RigidEnvs/Reorient-v0", weight_angle=0.3, weight_rate=0.2)
    starts = [page.draw(rng, {}) for _ in range(20)]
    for k, start in enumerate(starts):
        start["omega_body"] = rng.normal(size=3) * rng.choice([0.01, 1.0])
        start["q"] = start["aux"] if k % 2 else start["q"]
    # beside the tolerances, 0.1 rad and 0.05 rad/s, and within
    for angle, rate in ((0.0999, 0.0), (0.1001, 0.0), (0.0, 0.04999), (0.0, 0.05001)):
        turned = compose(starts[0]["aux"], of_rotation_vector([0.0, angle, 0.0]))
        starts.append({**starts[0], "q": turned, "omega_body": [0.0, rate, 0.0]})
    for start in starts:
        page.begin(**start)
        achieved, desired = page.poses()
        values = page.values(np.zeros(3))
        expected = values["reached"] + 0.3 * values["angle"] + 0.2 * values["rate"]
        # asin(c / sqrt(8)) loses half of the digits at c = sqrt(8)
        assert abs(env.unwrapped.compute_reward(achieved, desired, {}) - expected) < 1e-7


# -- too fast


@pytest.mark.parametrize(
    ("kind", "omega"),
    [
        (bodies.IntermediateAxis, (10.999, 0.0, 0.0)),
        (bodies.IntermediateAxisSingle, (0.0, 0.0, 9.98)),
        (bodies.SpinCapture, (0.0, 0.0, 14.98)),
        (bodies.AxisFlip, (19.97, 0.0, 0.0)),
        (bodies.Reorient, (9.98, 0.0, 0.0)),
        *((kind, (19.98, 0.0, 0.0)) for kind in tops.KINDS[1:4]),
    ],
)
def test_a_motion_that_becomes_too_fast_ends(kind, omega):
    is_top = kind in tops.KINDS
    within, steps = (1e-4, 100) if is_top else (1e-6, 20)
    pair = Pair(kind, within=within, n_substeps=kind.defaults()["n_substeps"])
    start = top(1.0, omega) if is_top else spinning(pair.page, omega)
    if omega[2]:  # |L| / I2 is the larger rate
        start[6] *= 2.0 / 3.0
    pair.reset(np.random.default_rng(15), start)
    outcomes = pair.run(lambda page, k: np.ones(page.n_action), steps)
    assert outcomes[-1].info["physics_error"] and outcomes[-1].terminated
    assert outcomes[-1].reward == 0.0


# The pages of the top are enough to rebuild their environments.


@pytest.mark.parametrize(("kind", "frame"), in_frames(*tops.KINDS))
def test_any_state_does_the_same(kind, frame):
    rng = np.random.default_rng(2)
    pair = Pair(kind, frame=frame, **({"fall": 3.1} if kind is tops.PivotTop else {}))
    for _ in range(4):
        y = rng.normal(size=11)
        y[:4] /= np.linalg.norm(y[:4])
        y[4:7] *= 3.0  # also spins below zero
        pair.reset(rng, y if kind is tops.PivotTop else [*y[:7], 0.0, 0.0, 0.0, 0.0])
        pair.shake(rng, 10)


@pytest.mark.parametrize(("kind", "frame"), in_frames(*tops.KINDS))
def test_limits_and_edges_of_tops_are_alike(kind, frame):
    rng, pair = np.random.default_rng(13), Pair(kind, frame=frame)
    fast = ((33.0, -35.0, 32.0), (-33.0, 35.0, -32.0), (1.0, 0.0, 34.0))
    for tilt in (0.0, 1e-7, 0.3, 1.6, np.pi):
        for omega in fast:  # too fast to step with this accuracy
            pair.reset(rng, top(tilt, omega, 12.0, -20.0, 25.0, -21.0))
            pair.reset(rng, top(tilt, omega, -12.0, 20.0, -25.0, 21.0))
    for omega in ((0.0, 0.0, 0.0), (0.0, 0.0, 4.0), (1e-10, 0.0, -2.0), (0.3, -0.2, 5.0)):
        pair.reset(rng, top(0.3, omega))
        pair.shake(rng, 1)


# -- ends


@pytest.mark.parametrize("kind", [k for k in tops.KINDS if k is not tops.TopPrecession])
@pytest.mark.parametrize("hold", [0.0, 0.32, 1.0])
def test_a_sleeping_top_is_a_success_after_the_hold_time(kind, hold):
    rng, pair = np.random.default_rng(7), Pair(kind, hold=hold)
    pair.reset(rng, top(0.03, (0.0, 0.0, 8.0)))

    def policy(page, k):
        """A kick; the top nutates and comes back, or not."""
        return np.ones(page.n_action) * (25 < k < 30)

    successes = [outcome.info["is_success"] for outcome in pair.run(policy, 50)]
    first = {0.0: 0, 0.32: 6, 1.0: 19}[hold]  # 1, 7 and 20 steps of 0.05 s
    assert successes.index(True) == first
    assert all(successes) == (hold == 0.0)


@pytest.mark.parametrize("branch", ["slow", "fast"])
@pytest.mark.parametrize("spin", [6.0, -6.0])
@pytest.mark.parametrize(("kind", "frame"), in_frames(tops.TopPrecession))
def test_steady_precession_is_a_success(branch, spin, kind, frame):
    rng = np.random.default_rng(8)
    pair = Pair(kind, branch=branch, hold=0.5, frame=frame, max_episode_steps=60)
    tilt = 0.5
    a, b, c = np.cos(tilt), 0.5 * spin, pair.page.m * pair.page.g * pair.page.ell
    root = np.sqrt(b * b - 4 * a * c) * np.sign(b)
    rate = 2 * c / (b + root) if branch == "slow" else (b + root) / (2 * a)
    # the vertical in body axes is (0, sin, cos)
    start = top(tilt, (0.0, rate * np.sin(tilt), spin))
    pair.reset(rng, start, np.array([0.0, tilt]))

    def policy(page, k):
        return np.array([1.0, 0.5]) * (k > 40)

    successes = [outcome.info["is_success"] for outcome in pair.run(policy)]
    assert successes.index(True) == 9 and not successes[-1]


def test_a_slow_spin_has_a_goal_too():
    rng, pair = np.random.default_rng(9), Pair(tops.TopPrecession, branch="fast")
    for spin in (2.0, -1.0):
        pair.reset(rng, top(0.4, (0.2, 0.1, spin)))
        pair.shake(rng, 10)


def test_a_top_has_fallen_at_the_tilt_of_the_page_and_not_below():
    rng, pair = np.random.default_rng(14), Pair(tops.PivotTop)
    for tilt in (0.499, 0.5001):  # within a step it grows by less than 1e-3
        pair.reset(rng, top(tilt, (0.0, 0.0, 0.0)))
        outcome, _ = pair.step(np.zeros(2))
        assert outcome.terminated == (tilt > 0.5)


@pytest.mark.parametrize(("kind", "frame"), in_frames(tops.PivotTop))
def test_an_episode_ends_when_the_pivot_leaves_the_arena(kind, frame):
    rng, pair = np.random.default_rng(10), Pair(kind, frame=frame, fall=3.0)
    pair.reset(rng, top(0.02, (0.0, 0.0, 3.0), 3.0, 3.0, 1.0, 2.0))
    outcomes = pair.shake(rng, 1000)
    assert outcomes[-1].terminated and pair.page.distance() > 5.0


# -- where a frame has no direction


@pytest.mark.parametrize(("kind", "frame"), in_frames(*tops.KINDS))
@pytest.mark.parametrize("spin", [0.0, 2.0, -2.0])
def test_an_upright_top_has_a_frame(kind, frame, spin):
    rng, pair = np.random.default_rng(12), Pair(kind, frame=frame)
    pair.reset(rng, top(0.0, (0.0, 0.0, spin)))
    # without spin, rounding of omega3 decides on the side of y after the first step
    pair.shake(rng, 5 if spin else 1)


# What the pages of the free body and of the top promise alike.


KINDS = bodies.KINDS + tops.KINDS
each = pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)


def cases():
    """Pages and arguments; delays and reduced frames, which are other kernels, of few."""
    for kind in KINDS:
        ranges = {"I1": (0.9, 1.1), "I2": (1.5, 1.7), "I3": (2.1, 2.3)}
        others = {"rotation": "matrix", "I1": 1.3, "I2": 1.8}
        if kind in tops.KINDS:
            ranges = {"I3": (0.45, 0.6), "g": (9.0, 10.0)}
            others = {"rotation": "none", "m": 1.1, "I3": 0.52}
        first = f"RigidEnvs/{kind.__name__}-v0" in FULL
        for arguments, is_long in (
            ({}, False),
            ({"rotation": "rot6d", "dt": 0.04}, False),
            ({"rotation": "quat"}, False),
            ({"rotation": "euler", "observe_params": True, **ranges}, False),
            (others, False),
            ({"frame": "reduced", "observe_params": True, **ranges}, not first),
            ({"rotation": "quat", "action_delay": 3}, not first),
            ({"frame": "reduced", "action_delay": 1, "rotation": "quat"}, True),
        ):
            yield pytest.param(kind, arguments, marks=[pytest.mark.long] * is_long)


@pytest.mark.parametrize(("kind", "arguments"), list(cases()))
def test_arguments_do_the_same(kind, arguments):
    rng, pair, clipped = np.random.default_rng(3), Pair(kind, **arguments), []
    for _ in range(2):
        pair.reset(rng)
        clipped += [outcome.info["action_clipped"] for outcome in pair.shake(rng, 15)]
    assert any(clipped) and not all(clipped)


@each
def test_weights_and_tolerances_do_the_same(kind):
    rng, names = np.random.default_rng(4), kind.defaults()
    terms = [name for name in names if name.startswith("weight_")]
    weights = {name: float(k) - 0.5 for k, name in enumerate(terms)}
    wide = {name: 3.0 if "angle" in name else 0.9 for name in names if "tolerance" in name}
    short = {"hold": 0.22 if kind in tops.KINDS else 0.7} if "hold" in names else {}
    time = {"flip_time": (1.0, 1.5)} if "flip_time" in names else {}
    pair, y, aux = Pair(kind, **weights, **wide, **short, **time), None, None
    if kind in tops.KINDS:
        y = top(0.1, (0.0, 0.0, 5.0))
        aux = np.array([0.0, 0.9]) if "goal_tilt" in names else None
    elif issubclass(kind, bodies.Spinning):
        y = spinning(pair.page, (0.1, -1.0 if kind is bodies.AxisFlip else 1.0, 0.1))
    pair.reset(rng, y, aux)
    successes = [outcome.info["is_success"] for outcome in pair.shake(rng, 30)]
    assert any(successes) or kind is tops.TopPrecession


@each
def test_default_substeps_do_nearly_the_same(kind):
    rng, page = np.random.default_rng(2), kind()
    rate = 6.0 if kind in tops.KINDS else 4.0
    # Fourth order: (rate times step)^4 per radian that it turns, at the largest rate [rad/s].
    step = rate * page.dt / page.n_substeps
    pair = Pair(kind, within=step**4 * rate * 30 * page.dt, n_substeps=page.n_substeps)
    pair.reset(rng)
    pair.shake(rng, 30)


@each
def test_episodes_end_when_the_page_says(kind):
    *_, n = re.findall(r"After (\d+) steps", "".join(pages_of(f"{kind.__name__}.md")))
    env = environment(kind.__name__)
    upright = {"state": {"q": [1, 0, 0, 0], "omega_body": [0, 0, 6]}}
    env.reset(seed=5, options=upright if kind in tops.KINDS else None)
    ends = [env.step(np.zeros(kind.n_action, np.float32))[2:4] for _ in range(int(n))]
    assert not any(any(end) for end in ends[:-1])
    assert ends[-1] == (False, True)


@pytest.mark.long
@each
@pytest.mark.parametrize("frame", ["world", "reduced"])
def test_longer_episodes_do_the_same(kind, frame):
    pair = Pair(kind, frame=frame)
    for seed in range(10):
        rng = np.random.default_rng(100 + seed)
        pair.reset(rng)
        pair.shake(rng, 100)
