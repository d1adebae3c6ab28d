"""Kernels are compiled before tests run in parallel."""

import os
import subprocess
import sys
from collections.abc import Iterable

import pytest

__all__ = ["compile_first"]

_COMPILE = """
import sys, gymnasium, rigid_envs
for env_id in sys.argv[1:]:
    env = gymnasium.make(env_id)
    env.reset(seed=0)
    env.step(env.action_space.sample())
"""
_DONE = pytest.StashKey[bool]()


def compile_first(config: pytest.Config, names: Iterable[str]) -> None:
    """With `-n`, compile each kernel once, a share of them in as many processes as there will be.

    Otherwise every worker would compile all that it meets at about the same time as the others.

    Args:
        config: Pytest's.
        names: Ids, or "module:id".
    """
    n = config.getoption("numprocesses", None) or 0
    if (
        n < 2
        or hasattr(config, "workerinput")
        or config.option.collectonly
        or _DONE in config.stash
    ):
        return
    config.stash[_DONE] = True
    ids, command = list(names), [sys.executable, "-c", _COMPILE]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    shares = [subprocess.Popen([*command, *ids[k::n]], env=environment) for k in range(n)]
    if any([share.wait() for share in shares]):  # a list: all are waited for
        raise pytest.UsageError("the kernels cannot be compiled; see above")
