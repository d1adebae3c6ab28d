"""A vector of free bodies against PufferLib's drone: a rigid body in C, one Euler step in float32.

The drone is that of PufferLib's source package, unmodified and compiled with the flags of its
setup.py; it is downloaded once (61 MB). Needs gcc.
"""

import hashlib
import importlib
import importlib.util
import io
import json
import os
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
import urllib.request
from dataclasses import asdict
from itertools import cycle, islice
from pathlib import Path

import numpy as np

from rigid_envs.tools.bench.figures import Ratio
from rigid_envs.tools.bench.measuring import Workload, staggered, time_interleaved, vector_workload
from tests.clients.running import ROOT, cache, interpreter

_N = 256
_NAME = "IntermediateAxis-v0"
_REQUIREMENTS = Path(__file__).with_suffix(".txt")
_VERSION = "3.0.0"
DRONE = f"PufferLib {_VERSION}, drone"
_URL = (
    "https://files.pythonhosted.org/packages/7c/e1/"
    "5292f9b69c6263707b40ba04a87e6b9bcc177281d31092f77afd90c412f1/pufferlib-3.0.0.tar.gz"
)
_SHA256 = "7df3a3e3f5f894d78d2a1f5374097890aec01473183e748abefe4f3faa10eaa9"
_FLAGS = ("-DPLATFORM_DESKTOP", "-O2", "-flto", "-fwrapv", "-fPIC", "-shared")
_BINDING = "pufferlib.ocean.drone.binding"
_RAYLIB = "raylib-5.5_linux_amd64"  # comes with the package


def compare(rounds):
    """Speed of the free bodies over that of the drones, 256 of each.

    Measured in an environment of its own, which has what PufferLib imports.

    Args:
        rounds: of interleaved timing.
    """
    python, module = str(interpreter(_REQUIREMENTS)), "tests.benchmarks.pufferlib_drone"
    command = [python, "-m", module, str(rounds)]
    told = subprocess.run(command, check=True, cwd=ROOT, stdout=subprocess.PIPE, text=True).stdout
    return Ratio(**json.loads(told.splitlines()[-1]))


def _measure(rounds):
    with tempfile.TemporaryDirectory() as folder:
        drones = _drones(_source(), Path(folder))
        theirs = Workload("drone", "", _steps(drones))
        ours = Workload(_NAME, "", vector_workload(staggered(f"RigidEnvs/{_NAME}", _N, 1)))
        found, peer = time_interleaved([ours, theirs], rounds, 0.02)
    low, median, high = np.percentile(found.ratio(peer), (25, 50, 75)).tolist()
    return Ratio(_NAME, f"N = {_N}", DRONE, median, (low, high))


def _steps(drones):
    """Runs steps of all drones by random actions."""
    random = np.random.default_rng(0)
    actions = cycle(random.uniform(-1.0, 1.0, (16, _N, 4)).astype(np.float32))

    def run(steps):
        for action in islice(actions, steps):
            drones.step(action)
        return steps * _N

    return run


def _source():
    """The unpacked source package, in the user's cache."""
    folder = cache() / f"pufferlib-{_VERSION}"
    if not folder.is_dir():
        with urllib.request.urlopen(_URL) as answer:
            archive = answer.read()
        if hashlib.sha256(archive).hexdigest() != _SHA256:
            raise ValueError(f"{_URL}: expected a file of SHA-256 {_SHA256}")
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder.parent) as aside:
            with tarfile.open(fileobj=io.BytesIO(archive)) as packed:
                packed.extractall(aside, filter="data")
            os.rename(Path(aside) / folder.name, folder)
    return folder


def _drones(source, folder):
    """Its vector environment, whose extension is compiled into a folder."""
    library = folder / "binding.so"
    include = (sysconfig.get_path("include"), np.get_include(), source / _RAYLIB / "include")
    files = (source / "pufferlib/ocean/drone/binding.c", source / _RAYLIB / "lib/libraylib.a")
    command = ["gcc", "-w", *_FLAGS, *(f"-I{path}" for path in include), *map(str, files)]
    subprocess.run([*command, "-o", str(library)], check=True)
    spec = importlib.util.spec_from_file_location(_BINDING, library)
    sys.modules[_BINDING] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(sys.modules[_BINDING])
    sys.path.insert(0, str(source))
    os.chdir(folder)  # its import leaves a link in the present folder
    importlib.import_module("pufferlib.ocean.drone").binding = sys.modules[_BINDING]
    drones = importlib.import_module("pufferlib.ocean.drone.drone").Drone(_N, report_interval=1000)
    drones.reset(seed=0)
    return drones


if __name__ == "__main__":  # of `compare`
    print(json.dumps(asdict(_measure(int(sys.argv[1])))))
