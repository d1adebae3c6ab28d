"""Plans are as good as they can be, where that is known in closed form."""

import gymnasium as gym
import numpy as np

from rigid_envs.control.planning.descent import improve, shorten
from rigid_envs.control.planning.model import Model
from rigid_envs.envs.lookup import task_of
from rigid_envs.mechanics import rotations
from rigid_envs.scores.evaluation import evaluate
from rigid_envs.scores.finding import plan
from rigid_envs.scores.theory import least_time


def model_from(env_id, n_steps, timed=False, **start):
    """A model of one row that starts from a given state."""
    env = gym.make(env_id)
    env.reset(seed=0, options={"state": start})
    state = {key: np.atleast_2d(part) for key, part in env.unwrapped.get_state().items()}
    return Model(task_of(env_id), state, n_steps, timed=timed)


def crooked(n_steps, length, side=0.2):
    """Steps along a bow of about a length [largest steps], shape (n_steps, 1, 2)."""
    s = np.linspace(0.0, 1.0, n_steps)
    steps = np.stack([-np.ones(n_steps), side * np.cos(np.pi * s)], axis=-1) * length / n_steps
    return steps[:, None]


def test_a_ball_that_may_roll_straight_home_takes_the_shortest_path_to_the_tolerance():
    distance = 1.5
    q = rotations.exp([0.0, distance, 0.0])  # as rolling from home leaves it
    model = model_from("RigidEnvs/BallPark-v0", 20, q=q, position=(distance, 0.0))
    task = model.task
    plans = improve(model, crooked(20, distance / task.roll_per_step), 60)
    least = distance - min(task.position_tolerance, task.angle_tolerance)
    assert least <= plans.costs[0] * (1.0 + 1e-6) and plans.costs[0] < 1.002 * least


def test_a_coin_that_may_roll_straight_home_takes_the_shortest_path_to_the_tolerance():
    distance = 1.2
    upright, turned = (rotations.exp([0.5 * np.pi, 0, 0]), rotations.exp([0, 0, -distance]))
    q = rotations.multiply(upright, turned)
    model = model_from("RigidEnvs/CoinPark-v0", 20, q=q, contact=(distance, 0.0))
    roll = np.full(20, distance / 20 / model.task.roll_per_step)
    turn = 0.3 * np.sin(np.linspace(0.0, 2.0 * np.pi, 20))
    plans = improve(model, np.stack([roll, turn], axis=-1)[:, None], 60)
    task = model.task
    least = distance - min(task.position_tolerance, task.phase_tolerance)
    assert least <= plans.costs[0] * (1.0 + 1e-6) and plans.costs[0] < 1.002 * least


def test_a_ball_is_pushed_straight_home_in_the_least_time():
    distance = 1.5
    q = rotations.exp([0.0, distance, 0.0])
    model = model_from(
        "RigidEnvs/BallParkDynamic-v0", 30, timed=True, q=q, position=(distance, 0.0)
    )
    task = model.task
    largest = task.force / (task.m * (1.0 + task.beta))
    part = np.sqrt(distance / largest) / task.dt
    half = int(np.ceil(1.5 * part))
    strength = (part / half) ** 2
    slow = np.zeros((30, 1, 2))
    slow[:half, 0, 0], slow[half : 2 * half, 0, 0] = -strength, strength
    plans = shorten(model, slow, 8, 12)
    least = least_time(distance - task.position_tolerance, largest, task.speed_tolerance)
    assert least <= plans.costs[0] + 1e-9 and plans.costs[0] < least + 1.01 * task.dt


def test_a_plan_that_succeeds_is_kept_until_there_is_a_better_one():
    q = rotations.exp([0.0, 1.5, 0.0])
    model = model_from("RigidEnvs/BallPark-v0", 20, q=q, position=(1.5, 0.0))
    straight = crooked(20, 1.5 / model.task.roll_per_step, side=0.0)
    plans = improve(model, straight, 0)
    np.testing.assert_array_equal(plans.actions, straight.astype(np.float32))
    np.testing.assert_array_equal(plans.costs, model.roll(straight).costs)


def test_a_plan_is_a_success_in_the_environment_at_the_cost_that_it_says():
    env_id, n = "RigidEnvs/SleepingTop-v0", 4
    found = evaluate(env_id, plan(env_id, n).policy(n), n=n)
    lqr = evaluate(env_id, "lqr", n=n)
    assert found.successes.all()
    assert found.mean(found.costs) < 0.75 * lqr.mean(lqr.costs)


def test_planning_again_gives_the_same_bits_and_improves_what_is_stored():
    env_id, n = "RigidEnvs/CoinPark-v0", 3
    first, again = (plan(env_id, n) for _ in range(2))
    np.testing.assert_array_equal(first.actions, again.actions)
    np.testing.assert_array_equal(2.0**14 * first.actions % 1.0, 0.0)  # on a grid: small files
    both = (first, plan(env_id, n, first))
    costs = [evaluate(env_id, each.policy(n), n=n).costs for each in both]
    assert (costs[1] <= costs[0]).all()
