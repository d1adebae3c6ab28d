"""The same sweep on Ray, of whose two nodes one dies, and its workers, and the sweep itself."""

import multiprocessing
import os
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents.sweeps.sweep import PATIENCE, Training, train_all
from tests.agents.sweeps.kills import assert_as_undisturbed, kill_some, stop_once, trainings

pytestmark = pytest.mark.long

_context = multiprocessing.get_context("spawn")


@pytest.fixture
def cluster() -> Iterator[Any]:
    """Two nodes on this machine; the second can be killed."""
    os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
    from ray.cluster_utils import Cluster

    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    yield cluster
    cluster.shutdown()


def sweep(address: str, all_trainings: Sequence[Training], patience: float = PATIENCE) -> None:
    from agents.sweeps.cluster import RayTasks

    workers = RayTasks(address, ["tests.agents.drift"])
    raise SystemExit(train_all(all_trainings, workers, patience=patience))


@pytest.mark.parametrize(("n", "updates", "kills"), [(4, 300, 3), (8, 500, 20)])
def test_runs_are_those_of_an_undisturbed_sweep(
    tmp_path: Path, cluster: Any, n: int, updates: int, kills: int
) -> None:
    killed, alone = (trainings(tmp_path / name, n, updates) for name in ("killed", "alone"))
    second = [cluster.add_node(num_cpus=1)]

    def start() -> Any:
        process = _context.Process(target=sweep, args=(cluster.address, killed))
        process.start()
        return process

    def kill_node(rng: np.random.Generator) -> bool:
        if rng.random() < 0.7:
            return False
        cluster.remove_node(second.pop(), allow_graceful=False)
        second.append(cluster.add_node(num_cpus=1))
        return True

    done = kill_some(tmp_path / "killed", start, kills, seed=0, others=kill_node)
    print(f"kills: {done}")
    assert_as_undisturbed(killed, alone)


def test_a_training_that_hangs_is_killed_and_goes_on_to_the_bit(
    tmp_path: Path, cluster: Any
) -> None:
    hung, alone = (trainings(tmp_path / name, 2, 60) for name in ("hung", "alone"))
    stopper = threading.Thread(target=stop_once, args=(hung[0].folder,), daemon=True)
    stopper.start()
    process = _context.Process(target=sweep, args=(cluster.address, hung, 10.0))
    process.start()
    process.join(300)
    assert process.exitcode == 0 and not stopper.is_alive()
    assert_as_undisturbed(hung, alone)
