"""Measure speeds, and write them into docs/speed.json and docs/speed.md.

    python -m tests.benchmarks [--quick] [--out FOLDER] [--only PART]

On a machine with nothing else to do; with --quick in some minutes, for a first look. With --only
one part is measured, and printed as it would stand in docs/speed.json. All of them need gcc and
MuJoCo (`pip install mujoco`), and download PufferLib's source package once.
"""

import argparse
import shutil
import sys
from dataclasses import asdict
from pathlib import Path

from rigid_envs.base.files import lined_json, write_atomic
from rigid_envs.engine.provenance import provenance
from rigid_envs.envs.lookup import one_of_each
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools.bench import bench
from rigid_envs.tools.bench.accuracy import is_installed
from rigid_envs.tools.cli.words import tell
from tests.benchmarks.frames import by_frame
from tests.benchmarks.growth import by_option, by_size
from tests.benchmarks.kernel_vs_c import compare
from tests.benchmarks.limit import limit
from tests.benchmarks.page import markdown
from tests.benchmarks.ppo_phases import IDS, measure
from tests.benchmarks.pufferlib_drone import compare as compare_with_drones
from tests.benchmarks.stock_ppo import measure as measure_stock

DOCS = Path(__file__).resolve().parents[2] / "docs"
_QUICK_STEPS = 50_000


def _bench(quick):
    figures = bench(list(ENVIRONMENTS), one_of_each(), quick, tell).as_json()
    for speed in figures["steps_per_second"]:
        del speed["samples"]
    return figures


def _training(quick):
    steps = _QUICK_STEPS if quick else None
    return [measure(env_id, steps) for env_id in IDS]


def _stock(quick):
    return [asdict(kind) for kind in measure_stock(timesteps=_QUICK_STEPS if quick else None)]


def _loops(quick):
    compared = compare(20 if quick else 200)
    return {system: [asdict(loop) for loop in loops] for system, loops in compared.items()}


PARTS = {
    "bench": _bench,
    "drones": lambda quick: asdict(compare_with_drones(20 if quick else 200)),
    "sizes": lambda quick: [asdict(growth) for growth in by_size(5 if quick else 20)],
    "options": lambda quick: [asdict(growth) for growth in by_option(5 if quick else 50)],
    "frames": lambda quick: by_frame(2 if quick else 20),
    "loops": _loops,
    "limit": lambda quick: asdict(limit(20 if quick else 200)),
    "training": _training,
    "stock": _stock,
}
"""What is measured for a first look, or for the page."""


def main(argv=None):
    """Measure, and write data and page."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="a first look, some minutes")
    parser.add_argument("--out", type=Path, default=DOCS, metavar="FOLDER", help="(docs)")
    parser.add_argument("--only", choices=PARTS, help="print this part")
    options = parser.parse_args(argv)
    if options.only:
        print(lined_json({options.only: PARTS[options.only](options.quick)}))
        return 0
    if shutil.which("gcc") is None:
        parser.error("gcc is not installed, with which the kernels are compared")
    if not is_installed():
        parser.error("MuJoCo is not installed, which is one of the peers: pip install mujoco")
    data = {"provenance": provenance()}  # before, for it tells the load
    data |= {name: part(options.quick) for name, part in PARTS.items()}
    write_atomic(options.out / "speed.json", lined_json(data))
    write_atomic(options.out / "speed.md", markdown(data))
    return 0


if __name__ == "__main__":
    sys.exit(main())
