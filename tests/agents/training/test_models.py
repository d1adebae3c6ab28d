"""Every entry of a config reaches its environment and its model, which acts as it was trained."""

import json
import math

import gymnasium as gym
import numpy as np
import pytest
from torch.nn import Linear, SiLU, Tanh

import tests.agents.drift  # noqa: F401, registers the environment
from agents.config.entries import config_from
from agents.environments import make
from agents.training.algorithms import build_model, parts_of
from agents.training.recording import acting, save_policy, stronger
from agents.training.rows import TrainingRows
from agents.training.trainer import train, wrapped
from rigid_envs import load
from rigid_envs.base.files import load_tensors
from rigid_envs.mechanics import rotations
from rigid_envs.sb3.adapter import NonFiniteError
from tests.sb3.script import Script, steps


def test_ended_episodes_are_listed_once():
    env = TrainingRows(Script())
    env.reset()
    steps(env, 3)
    n, one, *two = env.num_envs, *env.pop_episodes()
    assert (one["t"], one["r"]) == (2 * n, 3.0)
    told = [(each["t"], each["l"], each["is_success"]) for each in two]
    assert told == [(3 * n, 3, 0), (3 * n, 3, 1)]
    assert env.pop_episodes() == []


@pytest.mark.parametrize("env_id", ["Drift-v0", "RigidEnvs/BallParkGoal-v0"])
def test_continuation_from_a_state_is_bitwise(env_id):
    env, other = (TrainingRows(make(env_id, {}, 5)) for _ in range(2))
    env.seed(1)
    env.reset()
    other.reset()
    push = np.full((5, 2), 0.3, np.float32)
    for _ in range(70):
        env.step(push)
    other.set_state(env.get_state())
    for _ in range(70):
        ours, theirs = env.step(push), other.step(push)
        seen, again = (each[0] if isinstance(each[0], dict) else {"": each[0]}
                       for each in (ours, theirs))  # fmt: skip
        for name in seen:
            np.testing.assert_array_equal(seen[name], again[name])
        for mine, other_s in zip(ours[1:3], theirs[1:3], strict=True):
            np.testing.assert_array_equal(mine, other_s)
        assert str(ours[3]) == str(theirs[3])


TASKS = "rigid_envs.systems.free_body.tasks"
NO_SETTINGS = {
    "render_mode": "human",
    "wrappers": ["a:b"],
    "num_envs": 3,
    "autoreset_mode": "Disabled",
    "vectorization_mode": "sync",
    "vector_kwargs": {},
}


@pytest.fixture
def raw():
    """An environment of our class that is not registered by `rigid_envs.register`."""
    gym.register(
        "Raw-v0",
        vector_entry_point="rigid_envs.envs:RigidVectorEnv",
        kwargs={"task": f"{TASKS}:Detumble"},
    )
    yield
    del gym.registry["Raw-v0"]


@pytest.mark.usefixtures("raw")
@pytest.mark.parametrize(
    ("env_id", "kwargs", "message"),
    [
        ("Drift-v1", {}, r"^config\.env_id: .* did you mean 'Drift-v0'\?"),
        ("nowhere:Drift-v0", {}, r"^config\.env_id: .* --allow-import nowhere"),
        ("CartPole-v2", {}, r"^config\.env_id: .*did you mean 'CartPole-v1'"),
        ("Drift-v0", {"noise": 7}, r"^config\.env_kwargs\.noise: expected a number in \[0, 1\]"),
        ("Drift-v0", {"nose": 7}, r"^config\.env_kwargs: .*nose"),
        *(
            (env_id, {key: value}, rf"^config\.env_kwargs\.{key}: ")
            for env_id in ("Drift-v0", "RigidEnvs/Detumble-v0")
            for key, value in NO_SETTINGS.items()
        ),
        ("RigidEnvs/Detumble-v0", {"task": f"{TASKS}:Detumble"}, r"^config\.env_kwargs\.task"),
        ("Raw-v0", {"task": f"{TASKS}:Reorient"}, r"^config\.env_kwargs\.task"),
    ],
)
def test_an_environment_that_cannot_be_is_refused_by_key(env_id, kwargs, message):
    with pytest.raises(ValueError, match=message):
        make(env_id, kwargs, 2)


GRID, GOAL = "RigidEnvs/BallGrid-v0", "RigidEnvs/BallParkGoal-v0"
SPIN = "RigidEnvs/SpinCapture-v0"
COMMON = {"n_envs": 4, "gamma": 0.7, "learning_rate": 3e-5, "net_arch": [5, 3],
          "activation": "silu"}  # fmt: skip
MEMORY = {"buffer_size": 4000, "learning_starts": 77, "batch_size": 33, "tau": 0.11}
ENTRIES = {
    "ppo": {"n_steps": 24, "batch_size": 48, "n_epochs": 3, "gae_lambda": 0.81, "clip_range": 0.33,
            "ent_coef": 0.02, "vf_coef": 0.63, "max_grad_norm": 0.37, "target_kl": 0.05,
            "log_std_init": -1.25},
    "sac": {**MEMORY, "ent_coef": 0.07, "gradient_steps": 3, "train_freq": 2},
    "tqc": {**MEMORY, "ent_coef": 0.07, "n_quantiles": 13, "n_dropped": 4},
    "dqn": {**MEMORY, "env_id": GRID, "target_update_interval": 500, "exploration_fraction": 0.21,
            "exploration_initial_eps": 0.9, "exploration_final_eps": 0.13, "max_grad_norm": 3.0},
    "dagger": {"env_id": SPIN, "n_steps": 24, "batch_size": 33, "gradient_steps": 3,
               "buffer_size": 4000, "loss_width": 0.02},
}  # fmt: skip
OF_SB3 = {  # names that differ
    "buffer_size": ("replay_buffer.buffer_size", lambda value: value // 4),
    "n_dropped": ("top_quantiles_to_drop_per_net", lambda value: value),
    "n_quantiles": ("critic.n_quantiles", lambda value: value),
    "train_freq": ("train_freq.frequency", lambda value: value),
    "log_std_init": ("policy.log_std_init", lambda value: value),
}


def config_of(algo, **entries):
    return config_from({"env_id": "Drift-v0", **COMMON, **ENTRIES[algo], "algo": algo, **entries})


def model_of(config):
    rows = TrainingRows(make(config.env_id, config.env_kwargs, config.n_envs))
    return build_model(config, wrapped(rows, config))


def progress(config):
    """What a training logs, by columns."""
    with (train(config, quiet=True).folder / "progress.csv").open() as file:
        return np.genfromtxt(file, delimiter=",", names=True, deletechars="")


@pytest.mark.parametrize("algo", ENTRIES)
def test_every_entry_of_an_algorithm_is_told_to_its_model(algo):
    config = config_of(algo)
    model = model_of(config)
    own = {key: value for key, value in ENTRIES[algo].items() if key != "env_id"}
    for key, value in (own | {"gamma": 0.7}).items():
        name, convert = OF_SB3.get(key, (key, lambda value: value))
        found = model
        for part in name.split("."):
            found = getattr(found, part)
        assert (found(1.0) if callable(found) else found) == convert(value), key
    for optimizer in parts_of(model).optimizers.values():
        assert {group["lr"] for group in optimizer.param_groups} == {3e-5}
        # what SB3 has where nobody says otherwise
        assert {group["eps"] for group in optimizer.param_groups} == {
            1e-5 if algo == "ppo" else 1e-8
        }
    widths = [m.out_features for m in model.policy.modules() if isinstance(m, Linear)]
    assert widths[:2] == [5, 3]
    kinds = {type(m) for m in model.policy.modules() if isinstance(m, SiLU | Tanh)}
    assert kinds == {SiLU}


def test_goals_of_hindsight_are_as_many_as_said():
    for n in (0, 2, 7):
        model = model_of(config_of("sac", env_id=GOAL, n_sampled_goal=n, buffer_size=40_000))
        assert getattr(model.replay_buffer, "n_sampled_goal", 0) == n


@pytest.mark.parametrize("algo", ENTRIES)
def test_weights_are_those_of_the_seed(algo):
    def weights(seed):
        model = model_of(config_of(algo, seed=seed))
        return b"".join(p.detach().numpy().tobytes() for p in model.policy.parameters())

    assert weights(1) == weights(1)
    assert len({weights(seed) for seed in (0, 1, 2**32, 2**32 + 1)}) == 4


@pytest.mark.parametrize("algo", ENTRIES)
def test_the_learning_rate_falls_along_a_line_and_ends_at_its_end(tmp_path, algo):
    """The last update lies beyond the end: 4 of 40 steps where there are 150."""
    memory = {"log_every": 40, "learning_starts": 0, "train_freq": 1, "gradient_steps": 1}
    own = {
        "ppo": {"n_steps": 10, "batch_size": 10, "target_kl": None},
        "dagger": {"n_steps": 10},
    }.get(algo, memory)
    config = config_of(algo, **own, learning_rate=[1e-3, 0.0], total_timesteps=150,
                       eval_episodes=2, log_dir=str(tmp_path))  # fmt: skip
    table = progress(config)
    expected = 1e-3 * np.maximum(1 - np.array([40, 80, 120, 160]) / 150, 0.0)
    np.testing.assert_allclose(table["train/learning_rate"], expected, rtol=1e-12)


@pytest.mark.parametrize("algo", ["sac", "tqc", "dqn"])
def test_a_round_has_its_gradient_steps_once_learning_has_started(tmp_path, algo):
    own = {"log_every": 40, "learning_starts": 100, "train_freq": 2, "gradient_steps": 3}
    config = config_of(algo, **own, total_timesteps=200, eval_episodes=2, log_dir=str(tmp_path))
    table = progress(config)
    # a round is 8 steps, an update 5 rounds; the first one with gradient steps ends at 104 steps
    assert table["time/total_timesteps"].tolist() == [40, 80, 120, 160, 200]
    assert table["train/n_updates"][2:].tolist() == [9, 24, 39]
    assert np.isnan(table["train/n_updates"][:2]).all()


def test_a_spread_on_a_schedule_is_not_learnt_and_falls_by_equal_factors(tmp_path):
    assert model_of(config_of("ppo")).policy.log_std.requires_grad
    own = {"n_steps": 24, "total_timesteps": 288, "eval_episodes": 2, "log_dir": str(tmp_path)}
    config = config_of("ppo", action_std=[0.8, 0.1], **own)
    assert not model_of(config).policy.log_std.requires_grad
    policy = load(train(config, quiet=True).folder / "last_model")
    # the last of three updates began after two thirds of the run
    expected = math.log(0.8) + 2 / 3 * math.log(0.1 / 0.8)
    np.testing.assert_allclose(policy.arrays["log_std"], expected, rtol=1e-6)


PPO = {"n_steps": 16, "batch_size": 32, "n_epochs": 2}
OFF_POLICY = {"batch_size": 32, "learning_starts": 420, "train_freq": 8, "gradient_steps": 1}
SCALED = {"normalize_observation": True}


def quick(**entries):
    own = PPO if entries.get("algo", "ppo") == "ppo" else OFF_POLICY
    return config_from({"env_id": "Drift-v0", "n_envs": 4, **own, **entries})


def observations(space, n, rng):
    if isinstance(space, gym.spaces.Dict):
        return {name: observations(part, n, rng) for name, part in space.items()}
    return rng.normal(scale=2, size=(n, *(space.shape or ()))).astype(np.float32)


@pytest.mark.parametrize(
    "entries",
    [
        {},
        {"net_arch": [32, 16, 8], "activation": "elu", **SCALED},
        {"env_id": GOAL, "goal_turn": True},
        {"env_id": GOAL, "env_kwargs": {"frame": "reduced"}, **SCALED},
        {"algo": "sac", "env_id": GOAL, "goal_turn": True, **SCALED},
        {"algo": "tqc", "net_arch": []},
        {"env_id": GRID},
        {"algo": "dqn", "env_id": GRID, "net_arch": [16], "activation": "relu"},
    ],
    ids=str,
)
def test_a_model_and_its_file_act_alike(tmp_path, entries):
    config = quick(**entries)
    model = model_of(config)
    model.learn(512)
    save_policy(model, config, tmp_path / "policy")
    policy = load(tmp_path / "policy")
    for batch in (1, 500):
        venv = make(config.env_id, config.env_kwargs, batch)
        act = acting(model, venv)
        obs = observations(venv.single_observation_space, batch, np.random.default_rng(batch))
        np.testing.assert_allclose(act(obs), policy.predict(obs)[0], rtol=1e-5, atol=1e-5)
        assert act(obs).dtype == policy.predict(obs)[0].dtype
    if config.frame == "reduced":  # goals are in the frame of the world: they are not read
        assert policy.document["network"]["inputs"] == [["observation", 9]]
        alone = {"observation": obs["observation"]}
        np.testing.assert_array_equal(policy.predict(obs)[0], policy.predict(alone)[0])
        np.testing.assert_array_equal(act(obs), act(alone))
    beside = json.loads((tmp_path / "policy" / "policy.json").read_text())
    assert beside == load_tensors(tmp_path / "policy" / "policy.safetensors", 10**6)[1]
    assert (beside["env_id"], beside["seed"]) == (config.env_id, config.seed)


def test_an_observation_that_is_not_finite_ends_an_evaluation():
    model = model_of(quick())
    act = acting(model, make("Drift-v0", {}, 1))
    with pytest.raises(NonFiniteError, match="observation of the evaluation"):
        act(np.array([[0.0, np.nan]], dtype=np.float32))


@pytest.mark.parametrize("name", ["Reorient", "BallParkGoal"])
def test_a_network_with_goals_is_told_the_turn_in_body_and_world_axes(name):
    model = model_of(quick(env_id=f"RigidEnvs/{name}-v0", n_envs=50, goal_turn=True))
    obs = model.env.reset()
    told = model.policy.extract_features(model.policy.obs_to_tensor(obs)[0]).numpy()
    envs = model.env.venv.unwrapped
    here, there = envs.y[:, :4], envs.auxiliary(*envs.task.aux_names)[:, :4]
    back = rotations.conjugate(here)
    for turn, at in ((rotations.multiply(back, there), -18), (rotations.multiply(there, back), -9)):
        expected = rotations.matrix_from_quaternion(turn).reshape(50, 9)
        np.testing.assert_allclose(told[:, at:][:, :9], expected, atol=1e-6)  # of float32
    np.testing.assert_array_equal(told[:, :-18], np.hstack([obs[part] for part in sorted(obs)]))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"observation": None}, "dictionary of achieved_goal, desired_goal, observation"),
        ({"achieved_goal": np.zeros((2, 3))}, r"\['achieved_goal'\]: shape \(2, 3\), expected 11"),
        ({"achieved_goal": np.full((2, 11), np.nan)}, "every entry finite"),
        ({"achieved_goal": np.zeros((3, 11))}, "dimensions"),
    ],
)
def test_a_dictionary_that_does_not_fit_its_file_is_refused(tmp_path, change, message):
    config = quick(env_id=GOAL)
    save_policy(model_of(config), config, tmp_path / "policy")
    policy = load(tmp_path / "policy")
    sizes = dict(policy.document["network"]["inputs"])
    obs = {name: np.zeros((2, size)) for name, size in sizes.items()} | change
    with pytest.raises(ValueError, match=message):
        policy.predict({k: part for k, part in obs.items() if part is not None})
    with pytest.raises(ValueError, match="expected a dictionary"):
        policy.predict(np.zeros((2, sum(sizes.values()))))


@pytest.mark.parametrize("gain", [0.5, 1.0, 3.0])
def test_modes_and_spread_are_those_without_it_times_the_gain(tmp_path, gain):
    """What is trained does not change."""
    seen = np.random.default_rng(0).normal(size=(500, 2)).astype(np.float32)
    config = quick()
    model = model_of(config)
    model.learn(256)
    rows = make("Drift-v0", {}, 500)
    plain, before = acting(model, rows)(seen), str(model.policy.state_dict())
    spread = model.policy.log_std.exp().tolist()
    with stronger(model, gain):
        strong = acting(model, rows)(seen)
        save_policy(model, config, tmp_path / "policy")
    assert str(model.policy.state_dict()) == before
    np.testing.assert_array_equal(acting(model, rows)(seen), plain)
    inside = np.abs(plain) < 1.0
    np.testing.assert_allclose(strong[inside], np.clip(gain * plain, -1.0, 1.0)[inside], 1e-5, 1e-7)
    np.testing.assert_allclose(load(tmp_path / "policy").predict(seen)[0], strong, 1e-5, 1e-5)
    saved, _ = load_tensors(tmp_path / "policy" / "policy.safetensors", 10**6)
    np.testing.assert_allclose(np.exp(saved["log_std"]), gain * np.array(spread), rtol=1e-6)
