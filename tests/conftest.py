"""Settings of all property tests, and kernels that are compiled before tests run in parallel."""

import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from rigid_envs import ENVIRONMENTS

# The first example compiles what it calls, and a machine may be busy: examples are not timed.
settings.register_profile("untimed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("untimed")

_COMPILE = """
import sys, gymnasium, rigid_envs
for env_id in sys.argv[1:]:
    env = gymnasium.make(env_id)
    env.reset(seed=0)
    env.step(env.action_space.sample())
"""


def pytest_configure(config: pytest.Config) -> None:
    """With `-n`, compile each kernel once, a share of them in as many processes as there will be.

    Otherwise every worker would compile all that it meets at about the same time as the others.
    """
    n = config.getoption("numprocesses", None) or 0
    if n > 1 and not hasattr(config, "workerinput") and not config.option.collectonly:
        ids = list(ENVIRONMENTS)
        command, root = [sys.executable, "-c", _COMPILE], Path(__file__).parents[1]
        shares = [subprocess.Popen([*command, *ids[k::n]], cwd=root) for k in range(n)]
        assert not any(share.wait() for share in shares), "the kernels cannot be compiled"
