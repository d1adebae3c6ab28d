"""Ids that the contract tests run over, which must be known before the tests are imported."""

import json
import os
import subprocess
import sys
from collections.abc import Iterable

import pytest

from rigid_envs.envs.lookup import checked_id
from rigid_envs.tasks.registry import ENVIRONMENTS

OWN = tuple(env_id for env_id in ENVIRONMENTS if env_id.startswith("RigidEnvs/"))
"""Ids of this package."""

_chosen: list[str] = []


def choose(names: Iterable[str]) -> None:
    """Take these ids instead of those of this package.

    Args:
        names: Ids, or "module:id" where importing the module registers the id.

    Raises:
        UnknownIdError: an id that is not registered, or a module that cannot be imported.
    """
    _chosen[:] = dict.fromkeys(map(checked_id, names))


def chosen() -> tuple[str, ...]:
    """The ids."""
    return tuple(_chosen) or OWN


def are_named() -> bool:
    """Whether somebody chose them."""
    return bool(_chosen)


# Kernels are compiled before tests run in parallel.

_COMPILE = """
import json, logging, sys, gymnasium, rigid_envs
logging.getLogger("rigid_envs.engine.compiler").setLevel(logging.WARNING)
for env_id, settings in map(json.loads, sys.argv[1:]):
    env = gymnasium.make(env_id, **settings)
    env.reset(seed=0)
    env.step(env.action_space.sample())
"""
_DONE = pytest.StashKey[bool]()


def compile_first(config: pytest.Config) -> None:
    """With `-n`, compile each kernel once, a share of them in as many processes as there will be.

    Otherwise every worker would compile all that it meets at about the same time as the others.

    Args:
        config: Pytest's.
    """
    n = config.getoption("numprocesses", None) or 0
    is_worker, done = hasattr(config, "workerinput"), _DONE in config.stash
    if n < 2 or is_worker or done or config.option.collectonly:
        return
    config.stash[_DONE] = True
    from rigid_envs.testing.environments import KERNELS

    kernels, command = list(map(json.dumps, KERNELS)), [sys.executable, "-c", _COMPILE]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    shares = [subprocess.Popen([*command, *kernels[k::n]], env=environment) for k in range(n)]
    if any([share.wait() for share in shares]):  # a list: all are waited for
        raise pytest.UsageError("the kernels cannot be compiled; see above")
