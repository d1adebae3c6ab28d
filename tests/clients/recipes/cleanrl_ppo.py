"""CleanRL: `ppo.py` as it is, on the environment with discrete actions."""

import json
import subprocess
import sys
from pathlib import Path

from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

SCRIPT = Path(__file__).parents[1] / "cleanrl" / "ppo.py"
settings = ["--env-id", "rigid_envs:RigidEnvs/BallGrid-v0", "--total-timesteps", "60000"]
faster = ["--num-envs", "16", "--learning-rate", "1e-3", "--no-cuda"]
subprocess.run([sys.executable, str(SCRIPT), *settings, *faster], check=True, capture_output=True)
(run,) = Path("runs").rglob("events.*")
events = EventAccumulator(str(run)).Reload()
entropy = [event.value for event in events.Scalars("losses/entropy")]
explained = [event.value for event in events.Scalars("losses/explained_variance")]
assert entropy[-1] < 0.8 * entropy[0]
figures = {"entropy before": entropy[0], "entropy after": entropy[-1]}
print(json.dumps({"steps": 60_000, **figures, "explained variance": explained[-1]}))
