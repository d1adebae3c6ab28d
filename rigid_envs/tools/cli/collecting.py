"""Verbs of data: dataset, compile, bench."""

import argparse
import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rigid_envs.base.checks import require
from rigid_envs.engine.compiler import cache_directory
from rigid_envs.engine.provenance import heading
from rigid_envs.envs import lookup
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools import datasets
from rigid_envs.tools.bench.accuracy import FreeRun
from rigid_envs.tools.bench.figures import Figures
from rigid_envs.tools.bench.measuring import COLUMNS, FORMS, Throughput
from rigid_envs.tools.cli.words import config_of, option, refuse, tell, verb
from rigid_envs.tools.pages.tables import paragraphs, table

# `rigid-envs dataset`: its arguments.


@verb(
    option("id", metavar="ID", nargs="?"),
    option(
        "--policy",
        metavar="NAME|FILE",
        help="`random`; `reference` for the best reference controller, or its name; a trained "
        "policy: a file (.safetensors), or `BallPark`, the published one of that id",
    ),
    option("--episodes", type=int, default=100, metavar="N", help="(100)"),
    option("--seed", type=int, default=0, metavar="S", help="of the starts (0)"),
    option("--name", metavar="DATASET", help="(rigid-envs/<environment>/<policy>-v0)"),
    option(
        "--out",
        type=Path,
        metavar="FOLDER",
        help="of all data sets (MINARI_DATASETS_PATH, or ~/.minari/datasets)",
    ),
    option("--overwrite", action="store_true", help="replace one of that name"),
    option("--check", metavar="DATASET", help="play its episodes again, and compare every bit"),
    usage=(
        "rigid-envs dataset ID --policy NAME|FILE [OPTION ...] [--KEY VALUE ...]\n"
        "       rigid-envs dataset --check DATASET [--out FOLDER]"
    ),
)
def dataset_(options: argparse.Namespace) -> int:
    """Episodes of a policy as a Minari data set; or one played again.

    Play episodes and write them as a data set of Minari, with what is needed to play them again to
    the bit. Any hyperparameter can be given as an option.
    """
    if options.check is not None:
        refuse([*options.rest, *([options.id] if options.id else [])])
        return _check(options)
    if options.id is None or options.policy is None:
        raise ValueError("expected ID and --policy NAME, or --check DATASET")
    name = datasets.write(
        options.id,
        options.policy,
        options.episodes,
        seed=options.seed,
        name=options.name,
        folder=options.out,
        overwrite=options.overwrite,
        config=config_of(options.rest),
        tell=tell,
    )
    tell("")
    place = f" --out {options.out}" if options.out else ""
    print(f"written: {name}\nto play it again: rigid-envs dataset --check {name}{place}")
    return 0


def _check(options: argparse.Namespace) -> int:
    found = datasets.check(options.check, options.out)
    for line in found.differences:
        print(f"FAILS: {line}")
    verdict = "FAILS" if found.differences else "holds"
    print(
        f"{options.check}: {found.episodes} episodes, {found.steps} steps, bit for bit: {verdict}"
    )
    return 1 if found.differences else 0


# `rigid-envs compile`: its arguments, and what it says.


@verb(
    option("ids", nargs="*", metavar="ID", help="these environments only"),
    option(
        "--jobs", type=int, default=os.cpu_count() or 1, metavar="N", help="processes (one a core)"
    ),
    usage="rigid-envs compile [ID ...] [--jobs N] [--KEY VALUE ...]",
)
def compile_(options: argparse.Namespace) -> None:
    """Compile environments now, rather than at their first use.

    Compile reset and step of environments, of all if none is named, in the frame of the world and
    in the reduced one, or as hyperparameters say. What is compiled is kept for every later
    process.
    """
    require(options.jobs >= 1, options.jobs, "--jobs", "1 or more")
    config, folder = config_of(options.rest), cache_directory()
    if folder is None:
        raise ValueError(
            "no private folder for compiled code can be made below ~/.cache; expected one: name it "
            "by NUMBA_CACHE_DIR"
        )
    ids = list(dict.fromkeys(options.ids or ENVIRONMENTS))
    kernels = [kernel for env_id in ids for kernel in lookup.kernels_of(env_id, config)]
    begin, found = time.perf_counter(), 0
    tell(f"0 of {len(kernels)} kernels")
    for count, (kernel, was_there) in enumerate(lookup.compile_all(kernels, options.jobs), start=1):
        found += was_there
        tell(f"{count} of {len(kernels)} kernels: {kernel}")
    tell("")
    print(
        f"{len(kernels) - found} kernels compiled in {time.perf_counter() - begin:.1f} s, "
        f"{found} were there; in {folder}"
    )


# `rigid-envs bench`: the figures as tables.


def as_text(where: dict[str, Any], figures: Figures) -> str:
    """Tables, 100 columns wide.

    Args:
        where: versions, machine and date, see `provenance`.
        figures: what was measured.
    """
    parts = (
        heading(where),
        _speeds(figures),
        _mujoco(figures),
        _costs(figures),
        _ratios(figures),
        _accuracy(figures.runs),
        _startups(figures),
    )
    return "\n\n".join(filter(None, parts))


def _speeds(figures: Figures) -> str:
    names = list(dict.fromkeys(speed.name for speed in figures.speeds))
    cells = {(speed.name, speed.column): _speed(speed) for speed in figures.speeds}
    rows = [(name, *(cells.get((name, column), "") for column in COLUMNS)) for name in names]
    title = (
        f"Environment steps per second, resets included: median and half the interquartile "
        f"range of {figures.rounds} interleaved rounds of {1e3 * figures.seconds:.0f} ms. Single "
        "as gymnasium.make gives it (made) and without its wrappers (bare); vectors of N rows in "
        "one thread; 4096 rows in 2 threads. By CPU time, but 2 threads by wall-clock time."
    )
    header = ("", *COLUMNS)
    return paragraphs(title, 0) + "\n\n" + table(header, rows, "<" + ">" * 7, indent=0)


def _mujoco(figures: Figures) -> str:
    rows = [
        (s.name, f"{s.errors.energy:.1e}", f"{s.errors.duration:g} s", s.why)
        for s in figures.mujoco
    ]
    header = ("substeps per control period", "energy error", "within", "chosen for")
    return table(header, rows, "<>>", indent=0) if rows else ""


def _costs(figures: Figures) -> str:
    cells = {
        (cost.name, cost.column): (as_time(cost.seconds), f"{cost.ratio:.2f}")
        for cost in figures.costs
    }
    names = dict.fromkeys(name for name, _ in cells)
    rows = [
        (name, *(cell for column in FORMS for cell in cells.get((name, column), ("", ""))))
        for name in names
    ]
    header = ["time of", *(word for text in FORMS.values() for word in (text, "x median"))]
    return table(header, rows, "<" + ">" * 2 * len(FORMS), indent=0) if rows else ""


def _ratios(figures: Figures) -> str:
    rows = [
        (r.name, r.form, r.peer, as_factor(r.median), " .. ".join(map(as_factor, r.quartiles)))
        for r in figures.ratios
    ]
    header = ("speed of", "form", "against", "median", "quartiles")
    return table(header, rows, "<<<>>", indent=0) if rows else ""


def _accuracy(runs: Sequence[FreeRun]) -> str:
    rows = [
        (
            f"{run.duration:g} s in steps of {run.dt:g} s",
            *(f"{error:.1e}" for error in (run.L_squared, run.energy, run.omega_end)),
        )
        for run in runs
    ]
    header = ("error of a free body", "|L|^2, relative", "energy, relative", "final omega [rad/s]")
    return table(header, rows, "<>>>", indent=0)


def _startups(figures: Figures) -> str:
    rows = [(s.env_id, f"{s.medians[1]:.2f} s", f"{s.medians[0]:.2f} s") for s in figures.startups]
    header = ("import to first step in a new process", "compiled before", "empty cache")
    return table(header, rows, "<>>", indent=0)


def _speed(speed: Throughput) -> str:
    """Median and half the interquartile range: ``1.23M 4%``."""
    low, high = speed.quartiles
    return f"{_steps(speed.median)} {50.0 * (high - low) / speed.median:2.0f}%"


def _steps(speed: float) -> str:
    unit, size = ("M", 1e6) if speed >= 999.5e3 else ("k", 1e3)
    return f"{speed / size:.3g}{unit}"


def as_time(time: float) -> str:
    """A time of a step [s]: ``1.23 us`` or ``45.6 ns``."""
    return f"{1e6 * time:.2f} us" if time >= 1e-6 else f"{1e9 * time:.1f} ns"


def as_factor(ratio: float) -> str:
    """A ratio: ``1.23 x``."""
    return f"{ratio:.3g} x" if ratio < 999.5 else f"{ratio:.0f} x"
