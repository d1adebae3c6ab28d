"""TorchRL opens every id by its name, unmodified.

In a step of its own (see .ci/run), and imported no earlier: the import lets processes begin anew
instead of being forked, here and in every test after it, which takes seconds for each.
"""

import pytest

from rigid_envs.tasks.registry import ENVIRONMENTS

pytestmark = pytest.mark.long


@pytest.mark.parametrize("env_id", tuple(ENVIRONMENTS))
def test_torchrl_opens_an_id(env_id):
    from torchrl.envs import GymEnv

    env = GymEnv(env_id)
    env.set_seed(0)
    # TorchRL draws the actions from torch's generator; a walk of two steps can reach the goal
    assert env.rollout(3, break_when_any_done=False).batch_size == (3,)
    env.close()
