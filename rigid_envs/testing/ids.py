"""Ids that the contract tests run over, which must be known before the tests are imported."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterable

import pytest

from rigid_envs.envs.lookup import checked_id
from rigid_envs.tasks.registry import ENVIRONMENTS

OWN = tuple(env_id for env_id in ENVIRONMENTS if env_id.startswith("RigidEnvs/"))
"""Ids of this package."""

_chosen: dict[str, str] = {}  # each as it was given


def choose(names: Iterable[str]) -> None:
    """Take these ids instead of those of this package.

    Args:
        names: Ids, or "module:id" where importing the module registers the id.

    Raises:
        UnknownIdError: an id that is not registered, or a module that cannot be imported.
    """
    given = {checked_id(name): name for name in names}
    _chosen.clear()
    _chosen.update(given)


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
    Of ids that were given it is said what is compiled and, without `-n`, from the time of the first
    kernel, how long the others take.

    Args:
        config: Pytest's.
    """
    n = config.getoption("numprocesses", None) or 0
    is_worker, done = hasattr(config, "workerinput"), _DONE in config.stash
    if is_worker or done or config.option.collectonly or not (n > 1 or _chosen):
        return
    config.stash[_DONE] = True
    from rigid_envs.testing.environments import KERNELS

    kernels = [json.dumps((_chosen.get(i, i), settings)) for i, settings in KERNELS]
    if _chosen:
        names = "; ".join(f"{env_id} {settings or 'as it is'}" for env_id, settings in KERNELS)
        _say(f"kernels that are compiled, or loaded where they are kept: {names}")
    if n > 1:
        _compile([kernels[k::n] for k in range(n)])
        return
    start = time.perf_counter()
    _compile([kernels[:1]])
    seconds = time.perf_counter() - start
    _say(f"{seconds:.0f} s for the first; about {seconds * len(kernels[1:]):.0f} s for the others")


def _compile(shares: list[list[str]]) -> None:
    """Compile kernels, each share in a process of its own."""
    command = [sys.executable, "-c", _COMPILE]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    processes = [subprocess.Popen([*command, *share], env=environment) for share in shares]
    if any([process.wait() for process in processes]):  # a list: all are waited for
        raise pytest.UsageError("the kernels cannot be compiled; see above")


def _say(text: str) -> None:
    print(f"rigid-envs: {text}", file=sys.stderr, flush=True)
