"""What does the same thing in two or three ways, timed in turns in one run.

    python -m tests.benchmarks.beside rows [ID ...]   # the adapter, and Stable-Baselines3's rows
    python -m tests.benchmarks.beside actions [NAME]  # a compiled policy, and its network in torch
    python -m tests.benchmarks.beside updates         # PPO as it is, with either tanh, and without
                                                      # a fused Adam; collecting steps included

All on one thread of torch. Prints the median time of each, and its ratio to the first with its
quartiles.
"""

import argparse
import tempfile
from unittest.mock import patch

import numpy as np
import torch
from stable_baselines3.common.env_util import make_vec_env as their_make_vec_env

from agents.config.entries import config_from
from agents.config.reading import recipe_for
from rigid_envs import load
from rigid_envs.envs.lookup import checked_id
from rigid_envs.sb3.adapter import make_vec_env
from rigid_envs.sb3.exporting import ACTIVATIONS, Tanh
from rigid_envs.scores.trained import weights_of
from rigid_envs.tools.bench.measuring import Workload, time_interleaved
from rigid_envs.tools.pages.tables import table
from tests.agents.trainings import begun

IDS = ("BallPark", "IntermediateAxis", "DiskRollRandom", "BallParkGoal", "BallGrid")
ROWS = 256


def _workload(name, kind, call):
    """Calls it again and again; steps are its calls."""

    def run(times):
        for _ in range(times):
            call()
        return times

    return Workload(name, kind, run)


def rows(ids):
    """Steps of all rows by drawn actions, resets included."""
    for env_id in map(checked_id, ids or IDS):
        for kind, make in {"adapter": make_vec_env, "their rows": their_make_vec_env}.items():
            env = make(env_id, ROWS, seed=0)
            env.action_space.seed(0)
            drawn = np.array([env.action_space.sample() for _ in range(ROWS)])
            env.reset()
            yield _workload(env_id, kind, lambda env=env, drawn=drawn: env.step(drawn))


def actions(names):
    """Actions for one observation, and for 500 together."""
    policy = load(names[0] if names else "BallPark")
    for n in (1, 500):
        obs = np.random.default_rng(0).normal(size=(n, policy.n_obs)).astype(np.float32)
        for kind, act in {"compiled": policy.predict, "torch": _in_torch(policy)}.items():
            yield _workload(f"{n} observations", kind, lambda act=act, obs=obs: act(obs))


def _in_torch(policy):
    """The modes of a Gaussian policy, as torch computes them."""
    modules = []
    for k, weight in enumerate(weights_of(policy.arrays)):
        layer = torch.nn.Linear(weight.shape[1], len(weight))
        layer.weight.data = torch.tensor(weight)
        layer.bias.data = torch.tensor(policy.arrays[f"layers.{k}.bias"])
        modules += [layer, ACTIVATIONS[policy.activation]()]
    network = torch.nn.Sequential(*modules[:-1])
    low, high = policy.arrays["action.low"], policy.arrays["action.high"]

    def act(obs):
        with torch.no_grad():
            return np.clip(network(torch.as_tensor(obs)).numpy(), low, high)

    return act


def updates(_):
    """Updates of trainings on BallReorient by its recipe, whose network has tanh."""
    recipe = recipe_for("RigidEnvs/BallReorient-v0", "ppo", "reduced")
    never = {"eval_every": 10**9, "checkpoint_every": 10**9, "log_dir": tempfile.mkdtemp()}
    forms = {
        "as here": {},
        "torch.tanh": {"tanh": torch.nn.Tanh},
        "tanh by sigmoid": {"tanh": Tanh},
    }
    for kind, changed in {**forms, "default Adam": {}}.items():
        config = config_from({**recipe, **never, "run_name": kind.replace(" ", "_")})
        with patch.dict(ACTIVATIONS, changed):
            trainer = begun(config)
        if kind == "default Adam":
            for group in trainer.model.policy.optimizer.param_groups:
                group["fused"] = None
        yield _workload("update", kind, trainer.iterate)


def main():
    """Print the table."""
    kinds = {"rows": rows, "actions": actions, "updates": updates}
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=kinds)
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--rounds", type=int, default=40)
    options = parser.parse_args()
    torch.set_num_threads(1)
    results = time_interleaved([*kinds[options.what](options.names)], options.rounds, 0.02)
    cells = []
    for result in results:
        first = next(each for each in results if each.name == result.name)
        low, ratio, high = np.percentile(first.ratio(result), (25, 50, 75))
        time = f"{1e6 / result.median:,.1f} us"
        cells.append((result.name, result.column, time, f"{ratio:.3f}", f"{low:.3f} .. {high:.3f}"))
    print(table(("", "", "time", "ratio", "quartiles"), cells, "<<>>>", indent=0))


if __name__ == "__main__":
    main()
