"""CleanRL: `ppo_continuous_action.py` with the lines changed that Gymnasium 1.x asks for."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

FOLDER = Path(__file__).parents[1] / "cleanrl"
NAME = "ppo_continuous_action"
shutil.copy(FOLDER / f"{NAME}.py", ".")
subprocess.run(["git", "apply", "--unidiff-zero", str(FOLDER / f"{NAME}.patch")], check=True)
settings = ["--env-id", "rigid_envs:RigidEnvs/IntermediateAxis-v0", "--total-timesteps", "80000"]
rows = ["--num-envs", "16", "--num-steps", "256", "--num-minibatches", "8"]
command = [sys.executable, f"{NAME}.py", *settings, *rows, "--learning-rate", "1e-3", "--no-cuda"]
told = subprocess.run(command, check=True, capture_output=True, text=True).stdout
returns = [float(value) for value in re.findall(r"episodic_return=\[?([-\d.]+)", told)]
before, after = sum(returns[:32]) / 32, sum(returns[-32:]) / 32
assert after > before
print(json.dumps({"steps": 80_000, "return before": before, "return after": after}))
