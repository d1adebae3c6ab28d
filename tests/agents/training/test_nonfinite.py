"""A NaN ends the run before it reaches the weights, and says where it came up."""

import itertools
import re

import numpy as np
import pytest
import torch

import tests.agents.drift  # noqa: F401, registers the environment
from agents.config.entries import config_from
from agents.training import trainer
from agents.training.algorithms import refuse_bad_gradients
from agents.training.trainer import Trainer, train
from rigid_envs.base.files import load_tensors
from rigid_envs.sb3.adapter import GymnasiumVecEnv, NonFiniteError, all_finite, bad_row
from tests.agents.sessions import SMALL, small

MEMORY = {"env_id": "Drift-v0", "n_envs": 16, "learning_starts": 32, "log_every": 64}


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), -float("inf")])
def test_an_optimiser_does_not_step_along_a_bad_gradient(bad):
    weights = torch.nn.Parameter(torch.ones(3))
    optimizer = torch.optim.Adam([weights], lr=0.1)
    optimizer.register_step_pre_hook(refuse_bad_gradients)
    weights.sum().backward()
    optimizer.step()
    before = weights.detach().clone()
    weights.grad = torch.tensor([0.0, bad, 1.0])
    with pytest.raises(NonFiniteError, match="gradient"):
        optimizer.step()
    assert torch.equal(weights, before)


def assert_finite(paths):
    for path in paths:
        arrays, _ = load_tensors(path, 10**8)
        assert all(np.isfinite(array).all() for array in arrays.values())


def test_a_nan_reward_stops_the_run_and_leaves_good_checkpoints(tmp_path):
    config = small(tmp_path, env_kwargs={"bad_reward_at": 300}, seed=11)
    with pytest.raises(NonFiniteError, match=r"reward of row 8 .*step 300 .*action \[.*seed 11"):
        train(config, quiet=True)
    run = tmp_path / "ppo" / "r"
    paths = sorted((run / "checkpoints").glob("*.safetensors"))
    assert [int(path.stem) for path in paths] == [512 * 6, 512 * 9]  # 300 is in update 10
    assert_finite(paths)
    assert (run / "progress.csv").read_text().count("\n") == 1 + 9


def spoiled(venv, what, value, at):
    """The environment, which gives or is given one bad number, in a row of its step `at` or later.

    Drift has 16 rows; the others here do not begin with a row that ends.
    """
    taken, done = itertools.count(1), []

    def step(actions):
        obs, rewards, terminated, truncated, infos = original(actions)
        ends = np.flatnonzero(terminated | truncated)
        if not done and next(taken) >= at and (what != "last observation" or ends.size):
            done.append(True)
            if what == "reward":
                rewards = rewards.copy()
                rewards[5] = value
            elif what == "observation":
                obs = obs.copy()
                obs[5, 0] = value
            else:
                infos["final_obs"] = infos["final_obs"].copy()
                infos["final_obs"][ends[0], 0] = value
        return obs, rewards, terminated, truncated, infos

    original, venv.step = venv.step, step
    return venv


D7 = [
    pytest.param(
        *(algo, what, value),
        marks=[pytest.mark.long] if algo == "tqc" or value > 0.0 else [],  # as the others
    )
    for algo in ("ppo", "sac", "tqc", "dqn")
    for what in ("reward", "observation", "last observation", "action")
    for value in (float("nan"), float("inf"))
    if (algo, what) != ("dqn", "action")  # choices are integers
]


@pytest.mark.parametrize(("algo", "what", "value"), D7)
def test_one_bad_number_stops_any_algorithm_and_every_checkpoint_is_finite(
    tmp_path, monkeypatch, algo, what, value
):
    at = int(np.random.default_rng([len(algo), len(what), value > 0]).integers(70, 120))
    memory = {**MEMORY, "algo": algo, "log_every": 160, "buffer_size": 4000, "gradient_steps": 1}
    own = {**SMALL, "n_steps": 10, "batch_size": 160} if algo == "ppo" else memory
    env = {"env_id": "RigidEnvs/BallGrid-v0"} if algo == "dqn" else {}
    config = config_from(
        {**own, **env, "seed": 11, "net_arch": [8], "checkpoint_every": 1, "eval_episodes": 2,
         "eval_every": 10**6, "total_timesteps": 10**4, "log_dir": str(tmp_path), "run_name": "r"}
    )  # fmt: skip
    if what == "action":
        taken, original = itertools.count(1), GymnasiumVecEnv.step_async

        def step_async(self, actions):
            if next(taken) == at:
                actions = actions.copy()
                actions[5, 1] = value
            original(self, actions)

        monkeypatch.setattr(GymnasiumVecEnv, "step_async", step_async)
    else:
        make = trainer.make
        monkeypatch.setattr(trainer, "make", lambda *a: spoiled(make(*a), what, value, at))
    with pytest.raises(NonFiniteError) as stop:
        train(config, quiet=True)
    said = str(stop.value)
    assert re.match(rf"{what} of row \d+ is not finite at step \d+ of its episode, step \d+", said)
    assert int(re.findall(r"step (\d+) of the run", said)[0]) >= at
    assert re.search(r"action (\[.*\]|\d); seed 11\. .*checkpoints is of before, and good", said)
    paths = list((tmp_path / algo / "r" / "checkpoints").iterdir())
    assert paths
    assert_finite(paths)


@pytest.mark.parametrize(
    ("values", "factor"),
    [
        (SMALL, "ent_coef"),
        *((MEMORY | {"algo": algo}, "gamma") for algo in ("sac", "tqc")),
        (MEMORY | {"algo": "dqn", "env_id": "RigidEnvs/BallGrid-v0"}, "gamma"),
    ],
)
def test_a_nan_loss_stops_the_run_before_the_optimiser_steps(tmp_path, monkeypatch, values, factor):
    seen = {}

    def iterate(self):
        setattr(self.model, factor, float("nan"))
        seen["weights"] = [p.detach().clone() for p in self.model.policy.parameters()]
        seen["policy"] = self.model.policy
        original(self)

    original = Trainer.iterate
    monkeypatch.setattr(Trainer, "iterate", iterate)
    config = config_from({**values, "log_dir": str(tmp_path)})
    with pytest.raises(NonFiniteError, match=r"gradient of the loss .*seed 0"):
        train(config, quiet=True)
    for before, after in zip(seen["weights"], seen["policy"].parameters(), strict=True):
        assert torch.equal(before, after)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_one_bad_entry_is_found_wherever_it_is(value):
    rng = np.random.default_rng(0)
    for _ in range(50):
        array = rng.normal(size=(7, 5)).astype(np.float32)
        assert all_finite(array) and bad_row(array) is None
        row = int(rng.integers(7))
        array[row, rng.integers(5)] = value
        assert not all_finite(array) and bad_row(array) == row
    assert not all_finite({"a": np.zeros(3), "b": np.array([value, -value])})
