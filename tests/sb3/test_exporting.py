"""Models of SB3: made on rows of an id, and exported into files that act as the model did."""

import random
from functools import partial

import gymnasium as gym
import numpy as np
import pytest
import torch
from sb3_contrib import TQC, RecurrentPPO
from stable_baselines3 import A2C, DQN, PPO, SAC, TD3
from stable_baselines3.common.env_util import make_vec_env as their_make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.vec_env import (
    DummyVecEnv,
    VecExtractDictObs,
    VecFrameStack,
    VecMonitor,
    VecNormalize,
)
from torch import linspace, nn

import rigid_envs
from rigid_envs import load
from rigid_envs.base.checks import ConfigError
from rigid_envs.envs.lookup import task_of
from rigid_envs.envs.shells import RigidEnv
from rigid_envs.sb3.adapter import GymnasiumVecEnv, make_vec_env
from rigid_envs.sb3.exporting import AttitudeExtractor, Tanh, attitudes, export, network_of
from rigid_envs.scores.trained import CompiledPolicy
from tests.page_code import run_page
from tests.programs import printed

GOAL, GRID, BODY = "BallParkGoal", "BallGrid", "Detumble"
SHORT = {
    PPO: {"n_steps": 16, "batch_size": 16, "n_epochs": 1},
    A2C: {},
    SAC: {"learning_starts": 8, "batch_size": 8},
    TQC: {"learning_starts": 8, "batch_size": 8},
    DQN: {"learning_starts": 8, "batch_size": 8},
    TD3: {"learning_starts": 8, "batch_size": 8},
    RecurrentPPO: {"n_steps": 16, "batch_size": 16, "n_epochs": 1},
}


def trained(kind, env, **more):
    """A model after some steps of learning."""
    several = isinstance(env.observation_space, gym.spaces.Dict)
    policy = more.pop("policy", "MultiInputPolicy" if several else "MlpPolicy")
    model = kind(policy, env, seed=0, device="cpu", **SHORT[kind], **more)
    return model.learn(40)


def layers(activation, *net_arch):
    return {"policy_kwargs": {"activation_fn": activation, "net_arch": list(net_arch)}}


CASES = [
    (PPO, BODY, {}, {}),
    (PPO, BODY, {}, layers(nn.ELU, 8)),
    (PPO, BODY, {}, layers(nn.SiLU)),
    (PPO, GRID, {"frame": "reduced"}, layers(nn.ReLU, 8, 8, 8)),
    (PPO, GOAL, {}, {}),
    (A2C, BODY, {"impulse": 0.4}, {}),
    (SAC, BODY, {}, {}),
    (SAC, GOAL, {}, layers(nn.Tanh, 16)),
    (TQC, BODY, {}, {}),
    (DQN, GRID, {}, layers(nn.ReLU, 16)),
]


@pytest.mark.parametrize(("kind", "name", "settings", "more"), CASES, ids=str)
@pytest.mark.parametrize("scaled", [False, True])
def test_the_file_acts_as_the_model(tmp_path, kind, name, settings, more, scaled):
    rows = make_vec_env(name, 2, seed=1, **settings)
    env = VecNormalize(VecMonitor(rows), clip_obs=2.0, epsilon=0.1) if scaled else rows
    model = trained(kind, env, **more)
    file = export(model, tmp_path / "of it" / "policy.safetensors")
    policy = rigid_envs.load(file)
    assert policy.env_id == f"RigidEnvs/{name}-v0"
    assert policy.document["env_kwargs"] == settings
    assert policy.name == kind.__name__.lower() + (" reduced" if "frame" in settings else "")
    assert policy.document["timesteps"] == model.num_timesteps
    venv = make_vec_env(name, 20, seed=2, **settings)
    obs = venv.reset()
    for _ in range(10):
        seen = env.normalize_obs(obs) if scaled else obs
        expected, _ = model.predict(seen, deterministic=True)
        actions, state = policy.predict(obs)
        # sums of float32 in another order
        np.testing.assert_allclose(actions, expected, rtol=1e-4, atol=1e-5)
        assert actions.dtype == expected.dtype and state is None
        draws = [venv.action_space.sample() for _ in range(20)]
        obs = venv.step(np.array(draws))[0]


def test_environments_in_their_rows_and_parts_of_goals_are_exported(tmp_path):
    rows = DummyVecEnv([lambda: gym.make(f"RigidEnvs/{GOAL}-v0", frame="reduced")])
    model = trained(PPO, VecExtractDictObs(rows, "achieved_goal"))
    policy = rigid_envs.load(export(model, tmp_path / "policy.safetensors"))
    assert policy.env_kwargs == {"frame": "reduced"}
    obs = rows.reset()
    expected, _ = model.predict(obs["achieved_goal"], deterministic=True)
    np.testing.assert_allclose(policy.predict(obs)[0], expected, rtol=1e-4, atol=1e-5)


class Own(ActorCriticPolicy):
    """A policy that might do anything."""


class Extractor(BaseFeaturesExtractor):
    """Features that a policy file does not hold."""

    def __init__(self, space):
        super().__init__(space, features_dim=3)

    def forward(self, observations):
        return observations**2


EXTRACTED = {"policy_kwargs": {"features_extractor_class": Extractor}}


def flat_goals():
    env = gym.make(f"RigidEnvs/{GOAL}-v0")
    return DummyVecEnv([lambda: gym.wrappers.FlattenObservation(env)])


def columns():
    env = gym.wrappers.ReshapeObservation(gym.make("Pendulum-v1"), (3, 1))
    return DummyVecEnv([lambda: env])


def switches():
    cart, space = gym.make("CartPole-v1"), gym.spaces.MultiBinary(1)
    env = gym.wrappers.TransformAction(cart, lambda bits: int(bits[0]), space)
    return DummyVecEnv([lambda: env])


def part_scaled():
    return VecNormalize(make_vec_env(GOAL), norm_obs_keys=["observation"])


@pytest.mark.parametrize(
    ("kind", "env", "more", "message"),
    [
        (TD3, BODY, {}, "model = TD3; expected one of PPO, A2C, SAC, TQC, DQN"),
        (RecurrentPPO, BODY, {"policy": "MlpLstmPolicy"}, "model = RecurrentPPO; expected one of"),
        (PPO, BODY, {"use_sde": True}, "use_sde = True; expected False"),
        (PPO, BODY, layers(nn.LeakyReLU, 8), r"activation_fn = LeakyReLU\(.*; expected ELU, ReLU"),
        (PPO, BODY, layers(partial(nn.ELU, alpha=2.0), 8), r"activation_fn = ELU\(alpha=2\.0\); "),
        (PPO, BODY, {"policy": Own}, "policy = Own; expected MlpPolicy"),
        (PPO, BODY, EXTRACTED, "features_extractor_class = Extractor; expected FlattenExtractor"),
        (PPO, lambda: VecFrameStack(make_vec_env(BODY), 2), {}, "env = VecFrameStack; expected no"),
        (PPO, part_scaled, {}, r"norm_obs_keys = \['observation'\]; expected all parts"),
        (PPO, columns, {}, r"^model: observation = Box(?s:.*); expected a Box of one axis"),
        (PPO, switches, {}, r"action_space = MultiBinary\(1\); expected Box or Discrete"),
        (PPO, flat_goals, {}, "observations are not those of RigidEnvs/BallParkGoal-v0; expected"),
    ],
    ids=lambda value: getattr(value, "__name__", None),  # no addresses: workers compare the ids
)
def test_what_a_file_does_not_hold_is_refused_by_name(tmp_path, kind, env, more, message):
    model = trained(kind, make_vec_env(env) if isinstance(env, str) else env(), **more)
    with pytest.raises(ConfigError, match=message):
        export(model, tmp_path / "policy.safetensors")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("kind", "name", "head", "more"),
    [
        (PPO, BODY, "gaussian", {"log_std", "action.low", "action.high"}),
        (PPO, GRID, "categorical", set()),
        (DQN, GRID, "greedy", set()),
        (
            SAC,
            BODY,
            "squashed gaussian",
            {"log_std.weight", "log_std.bias", "action.low", "action.high"},
        ),
    ],
)
def test_the_head_is_that_of_the_algorithm_and_the_actions(kind, name, head, more):
    network = network_of(kind("MlpPolicy", make_vec_env(name), device="cpu", **SHORT[kind]))
    assert network.head == head
    assert {key for key in network.arrays if not key.startswith(("layers.", "value."))} == more


def test_where_attitudes_are_is_told_of_the_extractor_that_turns_them_into_rotations():
    places = attitudes(task_of(GOAL))
    assert places == {"achieved": 2, "desired": 13}  # behind the positions
    turning = {"features_extractor_class": AttitudeExtractor, "features_extractor_kwargs": places}
    assert attitudes(None) == attitudes(task_of(BODY)) == {}
    for more, told in (({}, None), (turning, [2, 13])):
        model = PPO("MultiInputPolicy", make_vec_env(GOAL), device="cpu", policy_kwargs=more)
        assert network_of(model).attitudes == told


def test_the_rotations_from_one_attitude_to_another_stand_behind_all_that_is_observed():
    venv = make_vec_env(GOAL, 3)
    seen = venv.reset()
    extractor = AttitudeExtractor(venv.observation_space, **attitudes(task_of(GOAL)))
    found = extractor({name: torch.as_tensor(part) for name, part in seen.items()}).numpy()
    here, there = (seen[name][:, 2:].reshape(3, 3, 3) for name in ("achieved_goal", "desired_goal"))
    turns = [np.swapaxes(here, 1, 2) @ there, there @ np.swapaxes(here, 1, 2)]
    expected = np.concatenate(
        [*map(seen.get, sorted(seen)), *(turn.reshape(3, 9) for turn in turns)], axis=1
    )
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6)
    assert found.shape == (3, extractor.features_dim)


def test_a_network_that_was_built_by_hand_is_refused_where_a_file_does_not_hold_it():
    for place, module, message in (
        (3, nn.ReLU(), "activation_fn = relu, tanh; expected one for all hidden layers"),
        (1, nn.Hardtanh(), "activation_fn = Hardtanh"),
        (2, nn.Identity(), r"layer = Identity\(\); expected linear layers"),
    ):
        model = PPO("MlpPolicy", make_vec_env(BODY), device="cpu")
        model.policy.mlp_extractor.policy_net[place] = module
        with pytest.raises(ConfigError, match=message):
            network_of(model)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_weights_that_are_not_finite_are_refused_and_an_older_file_stays(tmp_path, bad):
    model = trained(PPO, make_vec_env(BODY))
    file = export(model, tmp_path / "policy.safetensors")
    before = file.read_bytes()
    model.policy.action_net.bias.data[0] = bad
    with pytest.raises(ValueError, match=r"^layers\.2\.bias is not finite"):
        export(model, file)
    assert file.read_bytes() == before


def test_more_layers_than_a_file_holds_are_refused(tmp_path):
    model = PPO("MlpPolicy", make_vec_env(BODY), device="cpu", **layers(nn.Tanh, *[2] * 64))
    with pytest.raises(ValueError, match=r"^expected 1 to 64 layers, found 65"):
        export(model, tmp_path / "of it" / "policy.safetensors")
    assert not list(tmp_path.iterdir())


def test_a_model_without_environment_and_another_kind_of_file_are_refused(tmp_path):
    model = trained(PPO, make_vec_env(BODY))
    with pytest.raises(ConfigError, match=r"expected a file NAME\.safetensors"):
        export(model, tmp_path / "policy.zip")
    model.save(tmp_path / "model.zip")
    with pytest.raises(ConfigError, match="env = None; expected the environment of its training"):
        export(PPO.load(tmp_path / "model.zip"), tmp_path / "policy.safetensors")


def test_a_model_of_an_environment_that_was_made_without_an_id_is_refused(tmp_path):
    env = DummyVecEnv([partial(RigidEnv, "rigid_envs.systems.free_body.tasks:Detumble")])
    model = PPO("MlpPolicy", env, device="cpu")
    with pytest.raises(ConfigError, match="env has no spec; expected an environment of"):
        export(model, tmp_path / "policy.safetensors")


def test_tanh_and_its_derivative_are_those_of_torch():
    ours, theirs = Tanh(), nn.Tanh()
    x = linspace(-20.0, 20.0, 40_001, requires_grad=True)
    y = x.detach().double().requires_grad_()
    found, expected = ours(x), theirs(y)
    found.sum().backward()
    expected.sum().backward()
    # two roundings near 1, and one of the factor 2
    assert (found - expected).abs().max() < 3e-7
    assert (x.grad - y.grad).abs().max() < 6e-7


@pytest.mark.parametrize("env_id", ["RigidEnvs/BallPark-v0", "RigidEnvs/SleepingTopRandom-v0"])
def test_a_seed_gives_the_episodes_that_their_function_gives(env_id):
    ours, theirs = make_vec_env(env_id, 3, seed=5), their_make_vec_env(env_id, 3, seed=5)
    np.testing.assert_array_equal(ours.reset(), theirs.reset())
    rng = np.random.default_rng(0)
    for _ in range(20):
        actions = rng.uniform(-1, 1, (3, *ours.action_space.shape)).astype(np.float32)
        for mine, other in zip(ours.step(actions)[:3], theirs.step(actions)[:3], strict=True):
            np.testing.assert_array_equal(mine, other)
    assert make_vec_env(env_id).num_envs == their_make_vec_env(env_id).num_envs
    assert make_vec_env(env_id, seed=3).action_space.sample() == pytest.approx(
        make_vec_env(env_id, seed=3).action_space.sample()
    )


@pytest.mark.parametrize("seed", [None, 0])
def test_the_random_numbers_of_the_process_are_left_alone(seed):
    def drawn_next():
        legacy = str(np.random.get_state())  # noqa: NPY002
        return random.getstate(), legacy, torch.get_rng_state().tolist()

    before = drawn_next()
    venv = make_vec_env("BallPark", 2, seed=seed)
    venv.reset()
    venv.step(np.stack([venv.action_space.sample()] * 2))
    assert drawn_next() == before


def test_short_ids_and_settings_are_taken():
    venv = make_vec_env("BallPark", n_envs=4, frame="reduced", radius=(0.8, 1.2))
    assert isinstance(venv, GymnasiumVecEnv) and venv.num_envs == 4
    (task,) = set(venv.get_attr("task"))
    assert task.frame == "reduced" and task.radius == (0.8, 1.2)


@pytest.mark.parametrize(
    ("name", "more", "message"),
    [
        ("BallPrak", {}, "did you mean 'RigidEnvs/BallPark-v0'"),
        ("BallPark", {"n_envs": 0}, "num_envs = 0; expected an integer from 1"),
        ("BallPark", {"radios": 1.0}, r"config\.radios: unknown key; did you mean 'radius'"),
    ],
)
def test_what_cannot_be_is_refused(name, more, message):
    with pytest.raises(ConfigError, match=message):
        make_vec_env(name, **more)


@pytest.mark.parametrize("name", ["Detumble", "BallGrid", "BallParkGoal", "BallPark"])
def test_their_evaluation_plays_published_policies(name):
    policy = load(name)
    env_id = f"RigidEnvs/{name}-v0"
    settings = dict(policy.env_kwargs)
    returns = [
        evaluate_policy(policy, env, n_eval_episodes=4, return_episode_rewards=True)[0]
        for env in (
            make_vec_env(name, 2, seed=0, **settings),
            their_make_vec_env(env_id, 2, seed=0, env_kwargs=settings),
        )
    ]
    assert returns[0] == pytest.approx(returns[1], abs=1e-5)  # Monitor rounds to six digits
    alone = gym.make(env_id, **settings)
    mean, _ = evaluate_policy(policy, alone, n_eval_episodes=1, warn=False)
    assert np.isfinite(mean)


def test_without_stable_baselines3_the_import_names_the_extra_and_the_rest_works():
    code = """
import sys
sys.modules["stable_baselines3"] = None
import rigid_envs
assert not {"torch", "matplotlib"} & set(sys.modules)
print(rigid_envs.load("Detumble").name)
try:
    import rigid_envs.sb3
except ImportError as error:
    print(error)
"""
    first, second = printed("-c", code).splitlines()
    assert first.startswith("ppo")
    assert 'pip install "rigid-envs[train]"' in second


@pytest.mark.long
@pytest.mark.push
def test_the_page_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = run_page("sb3.md", _200_000="1", _2_000="1_100")
    assert isinstance(names["policy"], CompiledPolicy)
    assert names["venv"].action_space.contains(names["action"][0])
    assert names["mean"] > 0.0
    assert "mine" in (tmp_path / "leaderboard.md").read_text()
