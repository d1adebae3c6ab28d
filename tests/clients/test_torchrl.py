"""TorchRL opens every id by its name, unmodified.

In a step of its own (see .ci/run): once TorchRL is imported, processes forked later take seconds to
begin and to end, and Gymnasium's asynchronous vector environments are made of them.
"""

import pytest
from torchrl.envs import GymEnv

from rigid_envs import ENVIRONMENTS

pytestmark = pytest.mark.long


@pytest.mark.parametrize("env_id", tuple(ENVIRONMENTS))
def test_torchrl_opens_an_id(env_id: str) -> None:
    env = GymEnv(env_id)
    env.set_seed(0)
    # TorchRL draws the actions from torch's generator; a walk of two steps can reach the goal
    assert env.rollout(3, break_when_any_done=False).batch_size == (3,)
    env.close()
