"""What a rolling body needs of its ground is in info, and ends an episode where that is asked."""

import numpy as np
import pytest

from rigid_envs.tasks.task import Rolling
from rigid_envs.testing.environments import (
    ROLLING,
    actions,
    assert_same_bits,
    single,
    task_of,
    vector,
)


def coefficient(env_id):
    """A coefficient of friction with which some steps slip and others do not: the median need."""
    envs = vector(env_id, 50)
    envs.reset(seed=0)
    needs = [envs.step(batch)[-1]["needed_friction"] for batch in actions(env_id, 10, 50)]
    return float(np.median(needs))


@pytest.mark.parametrize("env_id", ROLLING)
def test_info_says_what_the_system_says_of_state_and_input(env_id):
    env = single(env_id)
    env.reset(seed=3)
    for action in actions(env_id, 20, 1)[:, 0]:
        *_, terminated, _, info = env.step(action)
        moment, system = env.unwrapped.moment(), env.unwrapped.system
        if info["physics_error"]:
            assert not info["normal_force"]
            assert not info["needed_friction"]
        else:
            # the same kernel, but as another loop: its compiler may fuse other roundings
            for key in ("normal_force", "needed_friction"):
                said = getattr(system, key)(moment.y, moment.u)
                assert info[key] == pytest.approx(said, rel=1e-12, abs=1e-12)
            assert info["slips"] == (info["needed_friction"] > system.mu)
        if terminated:
            env.reset()


ENDING = [env_id for env_id in ROLLING if isinstance(task_of(env_id), Rolling)]


@pytest.mark.parametrize("env_id", ENDING)
def test_slip_ends_an_episode_only_where_that_is_asked(env_id):
    mu, penalty = coefficient(env_id), 7.5
    free = vector(env_id, 50, mu=mu, autoreset_mode="Disabled")
    held = vector(
        env_id,
        50,
        mu=mu,
        end_on_slip=True,
        slip_penalty=penalty,
        autoreset_mode="Disabled",
    )
    assert_same_bits(free.reset(seed=0)[0], held.reset(seed=0)[0])
    n_slips = n_kept = 0
    for batch in actions(env_id, 10, 50):
        observations, rewards, terminated, _, infos = free.step(batch)
        found, paid, ended, _, same = held.step(batch)
        assert_same_bits(observations, found)
        slips = infos["slips"]
        np.testing.assert_array_equal(slips, same["slips"])
        np.testing.assert_array_equal(ended, terminated | slips)
        np.testing.assert_array_equal(same["is_success"], infos["is_success"] & ~slips)
        broken = infos["physics_error"]
        np.testing.assert_array_equal(paid, np.where(slips & ~broken, rewards - penalty, rewards))
        n_slips, n_kept = n_slips + slips.sum(), n_kept + (~slips).sum()
        if ended.any():
            for envs in (free, held):
                envs.reset(options={"reset_mask": ended})
    assert n_slips
    assert n_kept
