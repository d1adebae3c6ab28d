"""Hashes of the published ids, as stored and as now.

``python -m tests.frozen`` adds new ids to tests/data/frozen.json; what stands there is kept.
"""

import json
from pathlib import Path

from rigid_envs.envs.lookup import task_of
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.testing import fingerprint

FILE = Path(__file__).parents[1] / "data" / "frozen.json"


def _frames(env_id):
    return ("world",) if task_of(env_id).reduction is None else ("world", "reduced")


CASES = [(env_id, frame) for env_id in ENVIRONMENTS for frame in _frames(env_id)]
"""Every id in every frame that it has."""


def computed(env_id, frame):
    """Hash of what an id does now; "world" is the default."""
    return fingerprint(env_id, **({} if frame == "world" else {"frame": frame}))


def stored():
    """Hashes by id and frame, as they were when each was published."""
    return json.loads(FILE.read_text(encoding="utf-8")) if FILE.is_file() else {}


if __name__ == "__main__":
    hashes = stored()
    for env_id, frame in CASES:
        frames = hashes.setdefault(env_id, {})
        if frame not in frames:
            frames[frame] = computed(env_id, frame)
            print(f"{env_id}, {frame}: {frames[frame]}")
    FILE.write_text(json.dumps(hashes, indent=2) + "\n", encoding="utf-8")
