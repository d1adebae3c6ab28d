"""Learning on from the published policy of BallPark, with a larger ball, and from nothing.

``python -m tests.benchmarks.fine_tuning``: five seeds, two minutes. See docs/sb3.md.
"""

import time

import torch
from stable_baselines3 import PPO

import rigid_envs
from rigid_envs.sb3 import load_model, make_vec_env
from rigid_envs.sb3.exporting import ACTIVATIONS
from rigid_envs.scores.evaluation import published_record
from rigid_envs.tools.pages.tables import table

ID, SETTINGS, STEPS = "BallPark", {"frame": "reduced", "radius": 3.0}, 200_000
_SAME = ("gamma", "n_steps", "batch_size", "n_epochs", "gae_lambda", "vf_coef", "max_grad_norm")


def from_nothing(env, seed):
    """An untrained model with the hyperparameters of the published one, and its first step size."""
    config = published_record(f"{ID}-v0").config
    told = {key: config[key] for key in ("net_arch", "log_std_init")}
    told["activation_fn"] = ACTIVATIONS[config["activation"]]
    own = {key: config[key] for key in _SAME} | {"learning_rate": config["learning_rate"][0]}
    return PPO("MlpPolicy", env, policy_kwargs=told, seed=seed, device="cpu", **own)


def measured(seed, starts=500, steps=STEPS):
    """Success [%] before and after, and processor time [s], of both.

    Args:
        seed: Of the environment and of the learner.
        starts: Number of test starts.
        steps: Of learning.
    """
    cells = [str(seed)]
    for published in (True, False):
        env = make_vec_env(ID, 128, seed=seed, **SETTINGS)
        model = load_model(ID, env, seed=seed) if published else from_nothing(env, seed)
        before = rigid_envs.evaluate(ID, model, n=starts, config=SETTINGS).success.mean
        begin = time.process_time()
        model.learn(steps)
        seconds = time.process_time() - begin
        after = rigid_envs.evaluate(ID, model, n=starts, config=SETTINGS).success.mean
        cells += [f"{100 * before:.1f}", f"{100 * after:.1f}", f"{seconds:.0f}"]
    return cells


if __name__ == "__main__":
    torch.set_num_threads(1)
    rows = [measured(seed) for seed in range(5)]
    header = ("seed", "published", "learnt on", "s", "untrained", "learnt", "s")
    print(f"{ID} {SETTINGS}: success [%] from 500 starts before and after {STEPS} steps\n")
    print(table(header, rows, ">" * 7))
