"""Tasks on a Ray cluster, one for each training.

All nodes see the folders of this checkout, its virtual environment, runs and records under the same
paths, as on a cluster with a shared file system: there a training goes on that a dead node left.
"""

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import ray

from .sweep import FAILED, Ended, Training, work

_WAIT = 1.0  # [s]
_ROOT = Path(__file__).resolve().parents[2]


def connect(address: str, jobs: int | None = None) -> None:
    """Connect to a cluster.

    Args:
        address: As `ray.init` takes it: "host:6379", "auto", or "local" to start one here.
        jobs: Processors of one that is started here; None takes all.

    Raises:
        ConnectionError: There is no cluster.
    """
    own: dict[str, Any] = {"include_dashboard": False, "num_cpus": jobs}
    path = os.pathsep.join(filter(None, (str(_ROOT), os.environ.get("PYTHONPATH"))))
    environment = {"env_vars": {"PYTHONPATH": path}}
    here = own if address == "local" else {}
    ray.init(address, log_to_driver=False, runtime_env=environment, **here)


class RayTasks:
    """Workers of `train_all` on a Ray cluster; each takes one processor."""

    room = math.inf  # Ray keeps what waits: it may start nodes for it

    def __init__(self, address: str, imports: Sequence[str] = ()) -> None:
        """Connect to a cluster.

        Args:
            address: See `connect`.
            imports: Modules that register environments.

        Raises:
            ConnectionError: There is no cluster.
        """
        connect(address)
        # A task that dies begins again by `train_all`, which sees whether it gets on.
        self._task = ray.remote(num_cpus=1, max_retries=0, max_calls=1)(_task)
        self._imports = tuple(imports)
        self._running: dict[int, Any] = {}

    def start(self, number: int, training: Training) -> None:
        """Train in a process of its own.

        Args:
            number: Names the training.
            training: What to train.
        """
        self._running[number] = self._task.remote(os.getcwd(), training, self._imports)

    def wait(self) -> list[Ended]:
        """The trainings that ended; waits for one, a second at most."""
        ready, _ = ray.wait(list(self._running.values()), timeout=_WAIT)
        ended = [number for number, reference in self._running.items() if reference in ready]
        return [(number, *_result(self._running.pop(number))) for number in ended]

    def kill(self, number: int) -> None:
        """End one that hangs, without a word.

        Args:
            number: Names the training.
        """
        ray.cancel(self._running[number], force=True)

    def stop(self) -> None:
        """Ask all to save and end."""
        for reference in self._running.values():
            ray.cancel(reference)

    def close(self) -> None:
        """Leave the cluster, which ends what is left."""
        ray.shutdown()


def _task(folder: str, training: Training, imports: tuple[str, ...]) -> tuple[int, str]:
    os.chdir(folder)
    return work(training, imports)


def _result(reference: Any) -> tuple[int | None, str]:
    """Status and text of a task that ended; no status where its process or node died."""
    try:
        status, text = ray.get(reference)
    except ray.exceptions.RayTaskError as error:
        return FAILED, str(error)
    except ray.exceptions.RayError as error:
        return None, f"its task was lost ({type(error).__name__})"
    return status, text
