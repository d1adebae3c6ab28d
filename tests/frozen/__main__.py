"""Add new ids to tests/data/frozen.json: ``python -m tests.frozen``; what stands there is kept."""

import json

from tests.frozen.hashes import CASES, FILE, computed, stored

if __name__ == "__main__":
    hashes = stored()
    for env_id, frame in CASES:
        frames = hashes.setdefault(env_id, {})
        if frame not in frames:
            frames[frame] = computed(env_id, frame)
            print(f"{env_id}, {frame}: {frames[frame]}")
    FILE.write_text(json.dumps(hashes, indent=2) + "\n", encoding="utf-8")
