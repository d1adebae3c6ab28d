"""Files that name code, given to every entry that reads files.

The code lies where Python would find it, a module `trap` in the current folder. Prints for every
entry and file what of it was touched, how the entry ended, and for `gym.make` the same of a user's
own call that names it, as JSON.
"""

import contextlib
import io
import json
import os
import sys
import tempfile
from pathlib import Path

import gymnasium as gym
import numpy as np

import rigid_envs
from agents.cli.command_line import main as agents
from agents.config.reading import dump_yaml
from agents.config.search import read_search
from rigid_envs.base.files import digest, read_arrays, sealed, write_arrays
from rigid_envs.scores.evaluation import evaluate, recheck, repeat
from rigid_envs.scores.records import read_evaluation, read_records
from rigid_envs.scores.trained import FOLDER, read_policy, write_policy
from rigid_envs.tools.cli import main as command
from rigid_envs.watch.replays.replay import load_replay
from tests.loading.readers import ID, READERS

CODE = "trap:Code"
NAMED = {
    "task": {"settings": {"task": CODE}},
    "module": {"env_id": f"trap:{ID}"},
    "wrappers": {"settings": {"wrappers": [CODE]}},
}
"""What the files say: a task, a module in front of the id, a wrapper."""


def write_files(folder, settings=None, env_id=ID):
    """A file of every kind that says which environment it is of."""
    settings = settings or {}
    document, arrays = read_policy(FOLDER / "Detumble-v0.safetensors")
    document |= {"env_id": env_id, "env_kwargs": {**document["env_kwargs"], **settings}}
    del document["format"]
    config = {"env_id": env_id, "env_kwargs": settings, "n_envs": 8, "batch_size": 512}
    (folder / "run/best_model").mkdir(parents=True)
    for file in ("policy.safetensors", "run/best_model/policy.safetensors"):
        write_policy(folder / file, document, arrays)
    for file in ("config.yaml", "run/config.yaml"):
        (folder / file).write_text(dump_yaml(config))
    ranges = {**config, "algo": "ppo", "gamma": {"low": 0.9, "high": 0.99}}
    (folder / "search.yaml").write_text(dump_yaml({"recipe": ranges}))
    row = json.loads((folder.parent / "row.json").read_text())
    row |= {"env_id": env_id, "config": settings}
    (folder / "row.json").write_text(json.dumps(sealed(row)))
    arrays = read_arrays(folder.parent / "replay.npz")
    header = json.loads(arrays.pop("header").tobytes())
    header |= {"env_id": env_id, "config": {**header["config"], **settings}}
    del header["sha256"]
    text = json.dumps({**header, "sha256": digest(header, arrays)})
    arrays["header"] = np.frombuffer(text.encode(), dtype=np.uint8)
    write_arrays(folder / "replay.npz", arrays)
    published = folder / "published"
    published.mkdir()
    write_policy(published / "Detumble-v0.safetensors", *read_policy(folder / "policy.safetensors"))
    record = json.loads((FOLDER / "Detumble-v0.json").read_text()) | {"env_id": env_id}
    record["evaluation"]["settings"] |= settings
    (published / "Detumble-v0.json").write_text(json.dumps(sealed(record)))


def _play(file):
    policy = rigid_envs.load(file)
    evaluate(policy.env_id, policy, n=2)


ENTRIES = {
    "train --config": lambda: agents(["train", "--config", "config.yaml", "--quiet"]),
    "train --resume": lambda: agents(["train", "--resume", "run", "--quiet"]),
    "evaluate POLICY": lambda: agents(["evaluate", "policy.safetensors", "--episodes", "2"]),
    "evaluate RUN": lambda: agents(["evaluate", "run", "--episodes", "2"]),
    "enjoy": lambda: agents(["enjoy", "policy.safetensors", "--table"]),
    "agents leaderboard": lambda: agents(["leaderboard", "."]),
    "read_records": lambda: [*read_records(Path())],
    "publish": lambda: agents(["publish", "run"]),
    "search": lambda: read_search(Path("search.yaml")),
    "load": lambda: _play("policy.safetensors"),
    "rigid-envs evaluate POLICY": lambda: command(
        ["evaluate", "Detumble", "--policy", "policy.safetensors", "--starts", "2"]
    ),
    "rigid-envs evaluate REPLAY": lambda: command(
        ["evaluate", "Detumble", "--policy", "replay.npz"]
    ),
    "rigid-envs replay": lambda: command(["replay", "replay.npz"]),
    "rigid-envs verify": lambda: command(["verify", "row.json"]),
    "rigid-envs leaderboard": lambda: command(["leaderboard", "."]),
    "load_replay": lambda: load_replay("replay.npz"),
    "read_evaluation": lambda: read_evaluation("row.json"),
    "repeat": lambda: repeat("row.json"),
    "recheck": lambda: recheck("Detumble", folder=Path("published")),
}


found = set()
"""What touched the module: a look for it, its file, its code."""


def hook(event, arguments):
    """Note an event."""
    shown = str(arguments[0].co_filename if event == "exec" else arguments[0]) if arguments else ""
    imported = event == "import" and shown.partition(".")[0] == "trap"
    read = event in ("open", "exec", "compile") and Path(shown).name.startswith("trap.")
    if imported or read or event.startswith(("os.system", "os.exec", "os.spawn", "socket.")):
        found.add(f"{event} {shown}")


def main():
    """Give the files to all entries."""
    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        (root / "trap.py").write_text("open('flag', 'w').close()\nclass Code: ...\n")
        sys.path.insert(0, name)
        READERS["replay"].write(root / "replay.npz")
        evaluate(ID, "zero", n=2).save(root / "row.json")
        sys.addaudithook(hook)
        told = {}
        for kind, says in NAMED.items():
            (root / kind).mkdir()
            write_files(root / kind, **says)
            os.chdir(root / kind)
            for entry, read in ENTRIES.items():
                told[f"{entry}: {kind}"] = _touched(read)
        told["gym.make"] = _touched(lambda: gym.make(ID, task=CODE))
        os.chdir("/")
    print(json.dumps(told))


def _touched(read):
    """What reading touched of the trap, and how it ended."""
    found.clear()
    sys.modules.pop("trap", None)
    Path("flag").unlink(missing_ok=True)
    with (
        contextlib.redirect_stdout(io.StringIO()),
        contextlib.redirect_stderr(io.StringIO()) as said,
    ):
        try:
            end = str(read())
        except Exception as error:  # the worse ends are what is looked for
            end = f"{type(error).__name__}: {error}"
    ran = Path("flag").exists()
    return {"found": sorted(found), "ran": ran, "end": f"{said.getvalue()[-300:]} {end}"}
