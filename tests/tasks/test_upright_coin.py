"""CoinPark: two straight rolls park every coin, and the cost knows the order of each direction."""

import numpy as np
import pytest

from rigid_envs.envs.single import RigidEnv
from rigid_envs.envs.vector import RigidVectorEnv
from rigid_envs.systems.upright_coin.closed_forms import roll_coin
from rigid_envs.systems.upright_coin.references import two_rolls
from rigid_envs.systems.upright_coin.system import UprightCoin
from rigid_envs.systems.upright_coin.tasks.coin_park import CoinPark
from tests.tasks.runs import at_random, bound, run, still

COIN = UprightCoin()


def test_two_straight_rolls_park_the_coin_from_every_start():
    found = run("CoinPark", bound(two_rolls))
    assert found.success.all()
    assert found.steps.mean() < 17.0
    # hardly longer than the bound; what is saved at the end is within the tolerance
    shortest = CoinPark().lower_bound(found.y[0])
    assert (found.cost >= shortest - 0.15).all()
    assert found.cost.mean() < 1.15 * shortest.mean()


@pytest.mark.parametrize("policy", [still, at_random()], ids=["zero", "random"])
def test_neither_rest_nor_chance_parks_the_coin(policy):
    assert not run("CoinPark", policy).success.any()


def parked(env, x=0.0, heading=0.0, phase=0.0):
    """Whether a coin is parked that stands still at (x, 0)."""
    env.reset(options={"state": {"q": COIN.attitude(heading, phase), "contact": (x, 0.0)}})
    _, _, terminated, _, info = env.step(np.zeros(2, dtype=np.float32))
    assert terminated == info["is_success"]
    return terminated


@pytest.mark.parametrize("radius", [0.3, 1.0, 7.0])
def test_coin_is_parked_within_the_tolerances_and_not_outside(radius):
    env = RigidEnv("rigid_envs.tasks:CoinPark", radius=radius)
    for pose in ((0.099, 0.0, 0.0), (-0.099, 0.0, 0.0), (0.0, -0.099, 0.0), (0.0, 0.0, 0.149)):
        assert parked(env, *pose)
    assert parked(env, 0.0, 2.0 * np.pi - 0.09, 0.14 - 2.0 * np.pi)
    for pose in ((0.101, 0.0, 0.0), (0.0, 0.101, 0.0), (0.0, 0.0, -0.151), (0.0, np.pi, np.pi)):
        assert not parked(env, *pose)


def test_every_step_is_the_exact_arc():
    rng, n = np.random.default_rng(1), 50
    envs = RigidVectorEnv("rigid_envs.tasks:CoinPark", n, position_tolerance=1e-6)
    envs.reset(seed=0)
    for _ in range(5):
        before, actions = envs.y, rng.uniform(-1.0, 1.0, (n, 2)).astype(np.float32)
        envs.step(actions)
        roll, steer = (np.pi / 8 / 0.1 * actions.astype(np.float64)).T
        for k in range(n):
            arc = roll_coin(
                0.1,
                radius=1.0,
                psi_rate=roll[k],
                phi_rate=steer[k],
                phi=COIN.heading(before[k]),
                psi=COIN.phase(before[k]),
                place=before[k, 4:6],
            )
            # Stages turn by up to 0.13 rad of half angle: 0.009 z^5 of it at z = 0.13^2, each.
            np.testing.assert_allclose(envs.y[k, 4:6], arc.place, rtol=0, atol=1e-11)
            overlap = abs(envs.y[k, :4] @ arc.attitude)
            assert overlap == pytest.approx(1.0, abs=1e-14)


def directions(scale):
    """Where a fixed loop of steps leads, all of them scaled: heading, phase, side, mismatch."""
    loop = np.random.default_rng(2).uniform(-1.0, 1.0, (12, 2))
    y = COIN.state(q=COIN.attitude(0.0, 0.0))
    for roll, steer in scale * loop:
        y[6:] = steer, roll
        y = COIN.advance(y, None, 0.1)
    x, side = y[4:6]
    phase = COIN.phase(y)
    return np.abs([COIN.heading(y), phase, side, x + phase])


def test_directions_are_of_the_orders_1_1_2_and_3_by_which_the_cost_weighs_them():
    wide, narrow = directions(0.2), directions(0.1)
    # the next order is smaller by the square of the largest heading, some 0.05 rad
    np.testing.assert_allclose(np.log2(wide / narrow), [1.0, 1.0, 2.0, 3.0], atol=0.01)


def test_reward_terms_are_those_of_the_pose():
    env = RigidEnv("rigid_envs.tasks:CoinPark")
    y = {"q": COIN.attitude(0.7, -2.0), "contact": (1.5, -0.4)}
    env.reset(options={"state": y})
    *_, info = env.step(np.zeros(2, dtype=np.float32))
    # roots are rounded off at 1e-3
    assert info["reward/position"] == pytest.approx(-np.hypot(1.5, 0.4), rel=1e-12)
    assert info["reward/heading"] == pytest.approx(-0.7, rel=1e-12)
    assert info["reward/side"] == pytest.approx(-np.sqrt(0.4), rel=1e-5)
    assert info["reward/mismatch"] == pytest.approx(-np.cbrt(0.5), rel=1e-5)
    env.reset(options={"state": {**y, "contact": (1.5 + 2.0 * np.pi, -0.4)}})
    *_, info = env.step(np.zeros(2, dtype=np.float32))
    assert info["reward/mismatch"] == pytest.approx(-np.cbrt(0.5), rel=1e-5)
