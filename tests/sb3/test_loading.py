"""Policy files as models that learn on, as modules of torch and as graphs of ONNX."""

import numpy as np
import pytest
import torch
from gymnasium import spaces
from stable_baselines3 import A2C, DQN, PPO, SAC
from stable_baselines3.common.vec_env import VecExtractDictObs, VecNormalize

import rigid_envs
from rigid_envs.base.files import DamagedFileError, load_tensors, save_tensors
from rigid_envs.envs.lookup import task_of
from rigid_envs.sb3 import export, load_model, make_vec_env, to_onnx, to_torch
from rigid_envs.sb3.exporting import AttitudeExtractor, attitudes
from rigid_envs.scores.evaluation import published_record
from rigid_envs.scores.trained import published
from rigid_envs.testing.environments import in_full

GOAL, GRID, BODY = "BallParkGoal", "BallGrid", "Detumble"
N_ROWS, N_STEPS = 32, 40
TOLERANCE = 1e-6  # sums of float32 in another order; 5e-7 is the most that all published ones have


def met(policy):
    """Observations that a policy meets in its environment, as it takes them."""
    venv = make_vec_env(policy.env_id, N_ROWS, seed=3, **policy.env_kwargs)
    found, obs = [], venv.reset()
    for _ in range(N_STEPS):
        found.append(obs)
        obs = venv.step(policy.predict(obs)[0])[0]
    return found


def flat(policy, observation):
    """The parts that a policy takes, side by side."""
    if not isinstance(observation, dict):
        return observation
    parts = policy.document["network"]["inputs"]
    return np.concatenate([observation[name] for name, _ in parts], axis=-1)


@in_full(f"RigidEnvs/{name}" for name in published())
def test_a_model_and_a_module_of_a_published_policy_act_as_it_does(env_id):
    policy = rigid_envs.load(env_id)
    model, module = load_model(env_id), to_torch(policy)
    assert model.observation_space.shape == (policy.n_obs,)
    for obs in met(policy):
        expected, seen = policy.predict(obs)[0], flat(policy, obs)
        actions = module(torch.tensor(seen)).numpy(force=True)
        for found in (model.predict(seen, deterministic=True)[0], actions):
            assert found.dtype == expected.dtype
            np.testing.assert_allclose(found, expected, rtol=0, atol=TOLERANCE)
    if policy.head == "gaussian":
        np.testing.assert_array_equal(model.policy.log_std.detach(), policy.arrays["log_std"])


def test_hyperparameters_are_those_of_the_training_and_may_be_changed():
    config = published_record("BallPark-v0").config
    model = load_model("BallPark")
    for key in ("gamma", "n_steps", "batch_size", "n_epochs", "gae_lambda", "vf_coef"):
        assert getattr(model, key) == config[key]
    assert (model.n_envs, model.seed, model.clip_range(1.0)) == (128, None, config["clip_range"])
    assert model.learning_rate == config["learning_rate"][1]
    env = make_vec_env("BallPark", 2, frame="reduced")
    other = load_model("BallPark", env, n_steps=512, gamma=0.9)
    assert (other.n_steps, other.gamma, other.n_envs) == (512, 0.9, 2)


@pytest.mark.long
@pytest.mark.push
def test_learning_goes_on_and_another_radius_is_learnt():
    larger = {"frame": "reduced", "radius": 3.0}
    env = make_vec_env("BallPark", 64, seed=0, **larger)
    model = load_model("BallPark", env, n_steps=64, n_epochs=5, seed=0, learning_rate=3e-4)
    before = rigid_envs.evaluate("BallPark", model, n=100, config=larger)
    model.learn(40_000)
    after = rigid_envs.evaluate("BallPark", model, n=100, config=larger)
    assert before.success.mean < 0.7 < 0.85 < after.success.mean


def trained(kind, env, **more):
    short = {} if kind is A2C else {"n_steps": 16, "batch_size": 16, "n_epochs": 1}
    policy = "MultiInputPolicy" if isinstance(env.observation_space, spaces.Dict) else "MlpPolicy"
    return kind(policy, env, seed=0, device="cpu", **short, **more).learn(40)


OTHER = {"net_arch": {"pi": [8], "vf": [4, 5]}, "activation_fn": torch.nn.ELU}
TURNING = {"features_extractor_class": AttitudeExtractor}
TURNING["features_extractor_kwargs"] = attitudes(task_of(GOAL))
CASES = {
    "box": lambda: trained(PPO, make_vec_env(BODY, 2)),
    "scaled": lambda: trained(PPO, VecNormalize(make_vec_env(BODY, 2), clip_obs=2.0, epsilon=0.1)),
    "other value network": lambda: trained(PPO, make_vec_env(BODY, 2), policy_kwargs=OTHER),
    "choices": lambda: trained(PPO, make_vec_env(GRID, 2)),
    "goals": lambda: trained(PPO, make_vec_env(GOAL, 2)),
    "scaled goals": lambda: trained(PPO, VecNormalize(make_vec_env(GOAL, 2))),
    "turned goals": lambda: trained(PPO, make_vec_env(GOAL, 2), policy_kwargs=TURNING),
    "part": lambda: trained(
        PPO, VecExtractDictObs(make_vec_env(GOAL, 2, frame="reduced"), "observation")
    ),
}


def acts_the_same(one, other, observation):
    actions = [each.predict(observation, deterministic=True)[0] for each in (one, other)]
    np.testing.assert_array_equal(*actions)


@pytest.mark.parametrize("case", CASES)
def test_from_an_exported_file_goes_on_the_whole_model(tmp_path, case):
    model = CASES[case]()
    file = export(model, tmp_path / "policy.safetensors")
    again = load_model(file, n_steps=16, batch_size=16, seed=0)
    assert again.n_envs == 1  # so that an update is of n_steps, as Stable-Baselines3 has it
    for name, weights in model.policy.state_dict().items():
        assert torch.equal(again.policy.state_dict()[name], weights), name
    scaled, other = model.get_vec_normalize_env(), again.get_vec_normalize_env()
    assert (scaled is None) == (other is None)
    obs = model.get_env().unwrapped.reset()
    policy = rigid_envs.load(file)
    module, seen = to_torch(policy), torch.tensor(flat(policy, obs))
    np.testing.assert_allclose(module(seen).detach(), policy(obs), rtol=0, atol=TOLERANCE)
    obs = obs["observation"] if case == "part" else obs
    if scaled is not None:
        ours, theirs = other.normalize_obs(obs), scaled.normalize_obs(obs)
        for part in ours if isinstance(ours, dict) else [...]:
            np.testing.assert_array_equal(ours[part], theirs[part])
        obs = theirs
    acts_the_same(again, model, obs)
    tensors = model.policy.obs_to_tensor(obs)[0]
    assert torch.equal(again.policy.predict_values(tensors), model.policy.predict_values(tensors))
    again.learn(40)


def test_an_environment_that_scales_gets_the_statistics_of_the_file(tmp_path):
    model = CASES["scaled"]()
    mine = VecNormalize(make_vec_env(BODY, 2), norm_reward=False)
    again = load_model(export(model, tmp_path / "policy.safetensors"), mine, n_steps=32)
    theirs = model.get_vec_normalize_env()
    assert again.get_env() is mine and not mine.norm_reward
    np.testing.assert_array_equal(mine.obs_rms.mean, theirs.obs_rms.mean)
    assert (mine.clip_obs, mine.epsilon) == (2.0, 0.1)


def test_of_a_file_of_before_the_value_network_is_fresh(tmp_path):
    model = trained(PPO, make_vec_env(BODY, 2))
    arrays, document = load_tensors(export(model, tmp_path / "policy.safetensors"), 2**20)
    assert document["format"] == "rigid-envs policy 2"
    old = {name: array for name, array in arrays.items() if not name.startswith("value.")}
    save_tensors(tmp_path / "old.safetensors", old, {**document, "format": "rigid-envs policy 1"})
    again = load_model(tmp_path / "old.safetensors", n_steps=64)
    acts_the_same(again, model, make_vec_env(BODY, 5, seed=1).reset())
    fresh, learnt = again.policy.value_net, model.policy.value_net
    assert not fresh.bias.any() and learnt.bias.any()  # biases begin at 0
    assert not torch.equal(fresh.weight, learnt.weight)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"value.0.weight": np.zeros((64, 7), np.float32)}, r"value: inputs, outputs = \(7, 1\)"),
        ({"value.2.weight": np.zeros((2, 64), np.float32), "value.2.bias": np.zeros(2, np.float32)},
         "expected "),
        ({"value.1.bias": np.zeros(3, np.float32)}, r"value\.1\.bias: expected 64 numbers"),
        ({"value.1.weight": np.full((64, 64), np.nan, np.float32)}, "value.1.weight is not finite"),
    ],
)  # fmt: skip
def test_a_value_network_that_does_not_fit_is_refused(tmp_path, change, message):
    file = export(trained(PPO, make_vec_env(BODY, 2)), tmp_path / "policy.safetensors")
    arrays, document = load_tensors(file, 2**20)
    save_tensors(file, arrays | change, document)
    with pytest.raises(DamagedFileError, match=message):
        rigid_envs.load(file)


def test_what_cannot_go_on_is_refused(tmp_path):
    sac = SAC("MlpPolicy", make_vec_env(BODY), device="cpu")
    with pytest.raises(ValueError, match=r"algo = 'sac'; expected one of .*'ppo', 'dagger'"):
        load_model(export(sac, tmp_path / "sac.safetensors"))
    with pytest.raises(ValueError, match=r"env: .* = \(3, 3, .* expected \(8, 3, 'ga.*: make"):
        load_model("Detumble", make_vec_env("Detumble"))
    with pytest.raises(ValueError, match=r"env: .* = \(11, 4, 'categorical'\); expected \(8, 3, "):
        load_model("Detumble", make_vec_env("BallGrid", frame="reduced"))
    with pytest.raises(ValueError, match="expected the path of a policy"):
        load_model("Nothing")


HEADS = {
    "squashed gaussian": lambda: SAC("MlpPolicy", make_vec_env(BODY, 2), device="cpu"),
    "greedy": lambda: DQN("MlpPolicy", make_vec_env(GRID, 2), device="cpu"),
    **{name: CASES[name] for name in ("scaled", "scaled goals", "turned goals", "choices")},
}


@pytest.mark.long
@pytest.mark.push
@pytest.mark.parametrize("name", [*HEADS, "BallPark", "BallGrid"])
def test_a_graph_of_onnx_and_a_module_act_as_the_policy_whatever_its_head(tmp_path, name):
    onnxruntime = pytest.importorskip("onnxruntime")
    pytest.importorskip("onnxscript")
    made = export(HEADS[name](), tmp_path / "policy.safetensors") if name in HEADS else name
    policy = rigid_envs.load(made)
    file = to_onnx(policy, tmp_path / "policy.onnx")
    graph, module = onnxruntime.InferenceSession(file), to_torch(policy)
    assert [each.name for each in tmp_path.iterdir() if "onnx" in each.name] == ["policy.onnx"]
    for obs in met(policy)[::8]:
        expected, seen = policy.predict(obs)[0], flat(policy, obs)
        for n in (N_ROWS, 1):
            (found,) = graph.run(["action"], {"observation": seen[:n]})
            np.testing.assert_allclose(found, expected[:n], rtol=0, atol=TOLERANCE)
        for rows in (slice(None), 0):
            action = module(torch.tensor(seen[rows])).detach()
            np.testing.assert_allclose(action, expected[rows], atol=TOLERANCE)
        assert found.dtype == expected.dtype


@pytest.mark.parametrize("agent", [rigid_envs.load(BODY), rigid_envs.reference(BODY)])
def test_agents_are_functions_of_observations(agent):
    obs = make_vec_env(BODY, 5, seed=0, **agent.env_kwargs).reset()
    np.testing.assert_array_equal(agent(obs), agent.predict(obs)[0])
    np.testing.assert_array_equal(agent(obs[0]), agent.predict(obs[0])[0])
    assert agent(obs[0]).shape == (3,)
