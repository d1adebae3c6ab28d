"""Reorient: the body gets to where it should by the short way, and no faster than is possible."""

import gymnasium as gym
import numpy as np

from rigid_envs.envs.single import RigidEnv
from rigid_envs.mechanics import rotations
from rigid_envs.systems.free_body.controllers import least_slew_time
from rigid_envs.systems.free_body.references import quaternion_pd
from rigid_envs.systems.free_body.tasks.reorient import Reorient
from tests.tasks.runs import bound, run

turn = quaternion_pd(Reorient())


def goals(envs):
    return envs.auxiliary(*envs.task.aux_names)


def rows(n, **config):
    return gym.make_vec(
        "RigidEnvs/Reorient-v0", n, vectorization_mode="vector_entry_point", **config
    ).unwrapped


def test_quaternion_feedback_reaches_every_goal():
    found = run("Reorient", bound(quaternion_pd))
    assert found.success.all()
    assert found.reward.mean() > -75.0  # steps until the goal is reached; 66 of 1000 starts


def test_no_goal_is_reached_before_the_least_time():
    envs, task = rows(200), Reorient()
    envs.reset(seed=0)
    angle = rotations.distance(envs.y[:, :4], goals(envs))
    least = least_slew_time(task.system(), task.torque, angle)
    reached = np.full(200, np.inf)
    for k in range(1, 101):
        success = envs.step(turn(envs).astype(np.float32))[4]["is_success"]
        reached = np.where(success & np.isinf(reached), k * task.dt, reached)
    # the tolerances let the end come earlier than rest at the very goal
    slack = least_slew_time(task.system(), task.torque, task.angle_tolerance)
    assert (reached > least - slack).all()
    assert 1.5 < np.mean(reached) / np.mean(least) < 2.5  # room for what is better


def test_a_turn_about_one_axis_at_full_torque_takes_the_time_of_the_bound_about_that_axis():
    """A half turn about e1 by one torque: 2 sqrt(I1 pi / torque)."""
    task = Reorient(dt=0.01)
    time = 2.0 * np.sqrt(np.pi / task.torque)
    envs = rows(1, dt=0.01, max_episode_steps=1000)
    envs.reset(seed=0, options={"state": {"q": [1.0, 0.0, 0.0, 0.0], "omega_body": [0.0] * 3}})
    half = round(0.5 * time / task.dt)
    for sign in [1.0] * half + [-1.0] * half:
        envs.step(np.array([[sign, 0.0, 0.0]], dtype=np.float32))
    np.testing.assert_allclose(envs.y[0, 4:], 0.0, atol=1e-12)
    # half the time is rounded by dt / 2 at most, at twice the largest rate
    off = task.dt * 0.5 * time * task.torque
    np.testing.assert_allclose(rotations.angle(envs.y[0, :4]), np.pi, atol=off)
    # a = torque sqrt(1 / 1 + 1 / 2 + 1 / 3) of the bound, torque about e1
    bound = least_slew_time(task.system(), task.torque, np.pi)
    np.testing.assert_allclose(time / bound, (11.0 / 6.0) ** 0.25)


def test_from_rest_the_body_turns_the_short_way():
    envs = rows(200)
    envs.reset(seed=0)
    angle = rotations.distance(envs.y[:, :4], goals(envs))
    turned = np.zeros(200)
    for _ in range(100):
        before = envs.y[:, :4]
        envs.step(turn(envs).astype(np.float32))
        turned += rotations.distance(before, envs.y[:, :4])
    # the long way is 2 pi - angle; detours come from the coupling of the axes, and there are some
    assert (turned < angle + 1.0).all()


def test_a_goal_is_reached_within_both_tolerances_only():
    env = RigidEnv("rigid_envs.tasks:Reorient")
    env.reset(seed=0)
    state = env.get_state()
    goal = state["aux"]
    for angle, rate, expected in (
        (0.099, 0.0, True),
        (0.101, 0.0, False),
        (0.0, 0.049, True),
        (0.0, 0.051, False),
        (3.1, 0.0, False),
    ):
        q = rotations.multiply(goal, rotations.exp([0.0, 0.0, angle]))
        env.set_state({**state, "y": np.concatenate([q, [0.0, 0.0, -rate * np.sign(0.5 - angle)]])})
        _, _, terminated, _, info = env.step(np.zeros(3, dtype=np.float32))
        assert info["is_success"] == (expected if angle else rate < 0.05)
        assert not terminated


def test_rewards_can_be_computed_anew_and_observations_hold_no_goal():
    envs = rows(100)
    observations, _ = envs.reset(seed=0)
    for _ in range(90):
        observations, rewards, _, _, infos = envs.step(turn(envs).astype(np.float32))
        pair = observations["achieved_goal"], observations["desired_goal"]
        np.testing.assert_array_equal(envs.compute_reward(*pair, {}), rewards)
        np.testing.assert_array_equal(rewards == 0.0, infos["is_success"])
        own = envs.compute_reward(pair[0], pair[0], {})
        assert (own == 0.0).all()  # what was achieved is a goal that was reached
    state = envs.get_state()
    state["aux"] = np.roll(state["aux"], 1, axis=0)
    envs.set_state(state)
    again = envs._core.observations[:, 2 * envs.task.n_goal :]
    np.testing.assert_array_equal(again, observations["observation"])


def test_dense_terms_are_angle_and_rate_off_the_goal():
    envs = rows(200, weight_angle=0.3, weight_rate=0.2)
    envs.reset(seed=0)
    for _ in range(90):
        _, rewards, _, _, infos = envs.step(turn(envs).astype(np.float32))
        angle = -rotations.distance(envs.y[:, :4], goals(envs))
        # the goals are rounded to float32, most of which is lost beside the sine of a half turn
        np.testing.assert_allclose(infos["reward/angle"], angle, atol=np.sqrt(2.0**-23))
        rate = -np.linalg.norm(envs.y[:, 4:], axis=1)
        np.testing.assert_allclose(infos["reward/rate"], rate, rtol=2.0**-22)
        both = 0.3 * infos["reward/angle"] + 0.2 * infos["reward/rate"]
        np.testing.assert_allclose(rewards, infos["reward/reached"] + both, rtol=1e-15)


def test_without_their_weights_dense_terms_change_no_bit():
    envs = rows(200)
    envs.reset(seed=0)
    for _ in range(90):
        _, rewards, _, _, infos = envs.step(turn(envs).astype(np.float32))
        assert rewards.tobytes() == np.where(infos["is_success"], 0.0, -1.0).tobytes()
