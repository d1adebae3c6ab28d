"""`rigid-envs compile`: its arguments, and what it says."""

import argparse
import os
import time
from typing import Any

from rigid_envs import ENVIRONMENTS
from rigid_envs.cli.progress import tell
from rigid_envs.cli.words import config_of

__all__ = ["add_compile"]


def add_compile(verbs: Any) -> None:
    """Add the verb to the parser of the command."""
    compiling = verbs.add_parser(
        "compile",
        help="compile environments now, rather than at their first use",
        usage="rigid-envs compile [ID ...] [--jobs N] [--KEY VALUE ...]",
        description="Compile reset and step of environments, of all if none is named, in the frame "
        "of the world and in the reduced one, or as hyperparameters say. What is compiled is kept "
        "for every later process.",
        allow_abbrev=False,
    )
    compiling.add_argument("ids", nargs="*", metavar="ID", help="these environments only")
    compiling.add_argument(
        "--jobs", type=int, default=os.cpu_count() or 1, metavar="N", help="processes (one a core)"
    )
    compiling.set_defaults(act=_compile)


def _compile(options: argparse.Namespace, rest: list[str]) -> None:
    from rigid_envs.kernels.cache import cache_directory
    from rigid_envs.precompiling import compile_all, kernels_of

    if options.jobs < 1:
        raise ValueError(f"--jobs = {options.jobs}; expected 1 or more")
    config, folder = config_of(rest), cache_directory()
    if folder is None:
        raise ValueError(
            "no private folder for compiled code can be made below ~/.cache; expected one: name it "
            "by NUMBA_CACHE_DIR"
        )
    ids = list(dict.fromkeys(options.ids or ENVIRONMENTS))
    kernels = [kernel for env_id in ids for kernel in kernels_of(env_id, config)]
    begin, found = time.perf_counter(), 0
    tell(f"0 of {len(kernels)} kernels")
    for count, (kernel, was_there) in enumerate(compile_all(kernels, options.jobs), start=1):
        found += was_there
        tell(f"{count} of {len(kernels)} kernels: {kernel}")
    tell("")
    print(
        f"{len(kernels) - found} kernels compiled in {time.perf_counter() - begin:.1f} s, "
        f"{found} were there; in {folder}"
    )
