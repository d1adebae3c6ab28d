"""RL Baselines3 Zoo: train with a file of this repository, then enjoy what was trained."""

import json
import re
import subprocess
import sys
from pathlib import Path

CONFIG = Path(__file__).parents[3] / "configs" / "zoo" / "ppo.yml"
ENV = "RigidEnvs/IntermediateAxisSingle-v0"
WHAT = ["--algo", "ppo", "--env", ENV, "--gym-packages", "rigid_envs"]
ALIKE = ["--num-threads", "1", "--device", "cpu", "--seed", "0"]


def zoo(program, *options):
    """Run a program of the zoo, and return what it printed."""
    command = [sys.executable, "-m", f"rl_zoo3.{program}", *WHAT, *ALIKE, *options]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


evaluation = ["--eval-env-kwargs", "frame:'reduced'", "--eval-freq", "40000"]
zoo("train", "--conf-file", str(CONFIG), "-n", "80000", *evaluation, "--log-folder", "logs")
told = zoo("enjoy", "--folder", "logs", "--no-render", "-n", "3000")
success, mean = (
    float(re.search(pattern, told)[1])
    for pattern in (r"Success rate: ([\d.]+)%", r"Mean reward: ([-\d.]+)")
)
assert success == 100.0
print(json.dumps({"steps": 80_000, "return after": mean, "success after": success / 100}))
