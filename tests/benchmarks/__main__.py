"""Measure speeds, and write them into docs/speed.json and docs/speed.md.

    python -m tests.benchmarks [--quick] [--out FOLDER]

On a machine with nothing else to do; with --quick in some minutes, for a first look. Needs gcc and
MuJoCo (`pip install mujoco`), and downloads PufferLib's source package once.
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
from tests.benchmarks.ppo_phases import IDS, PHASES, measure
from tests.benchmarks.pufferlib_drone import compare as compare_with_drones
from tests.benchmarks.stock_ppo import measure as measure_stock

DOCS = Path(__file__).resolve().parents[2] / "docs"
_QUICK_STEPS = 50_000


def main(argv=None):
    """Measure, and write data and page."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="a first look, some minutes")
    parser.add_argument("--out", type=Path, default=DOCS, metavar="FOLDER", help="(docs)")
    options = parser.parse_args(argv)
    if shutil.which("gcc") is None:
        parser.error("gcc is not installed, with which the kernels are compared")
    if not is_installed():
        parser.error("MuJoCo is not installed, which is one of the peers: pip install mujoco")
    figures = bench(list(ENVIRONMENTS), one_of_each(), options.quick, tell).as_json()
    for speed in figures["steps_per_second"]:
        del speed["samples"]
    steps = _QUICK_STEPS if options.quick else None
    data = {
        "provenance": provenance(),
        "bench": figures,
        "drones": asdict(compare_with_drones(20 if options.quick else 200)),
        "sizes": [asdict(growth) for growth in by_size(5 if options.quick else 20)],
        "options": [asdict(growth) for growth in by_option(5 if options.quick else 50)],
        "frames": by_frame(2 if options.quick else 20),
        "loops": [asdict(loop) for loop in compare(20 if options.quick else 200)["free body"]],
        "limit": asdict(limit(20 if options.quick else 200)),
        "training": [_training(measure(env_id, steps)) for env_id in IDS],
        "stock": [asdict(kind) for kind in measure_stock(timesteps=steps)],
    }
    write_atomic(options.out / "speed.json", lined_json(data))
    write_atomic(options.out / "speed.md", markdown(data))
    return 0


def _training(found):
    return {
        "env_id": found.env_id,
        "timesteps": found.timesteps,
        "steps_per_second": found.steps_per_second,
        "shares": dict(zip(PHASES, found.shares, strict=True)),
    }


if __name__ == "__main__":
    sys.exit(main())
