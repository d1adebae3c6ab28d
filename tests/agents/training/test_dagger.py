"""A policy learns a law: it is taught where it comes, and rests where the law does."""

import numpy as np
import pytest
import torch
from stable_baselines3.common.logger import Logger

from agents.config.entries import config_from
from agents.environments import make
from agents.training.algorithms import build_model
from agents.training.dagger import with_dead_band
from agents.training.recording import acting, as_saved, save_policy
from agents.training.rows import TrainingRows
from agents.training.trainer import train, wrapped
from rigid_envs import evaluate, load
from rigid_envs.sb3.loading import load_model, to_torch
from tests.agents.trainings import begun

SPIN, DETUMBLE = "RigidEnvs/SpinCapture-v0", "RigidEnvs/Detumble-v0"


def config_of(**entries):
    given = {"env_id": SPIN, "env_kwargs": {"frame": "reduced"}, "algo": "dagger", "n_envs": 8}
    own = {"n_steps": 20, "batch_size": 64, "gradient_steps": 5, "net_arch": [16]}
    return config_from({**given, **own, **entries})


def model_of(config):
    rows = TrainingRows(make(config.env_id, config.env_kwargs, config.n_envs))
    return build_model(config, wrapped(rows, config))


def test_a_linear_law_is_learnt_to_its_efficiency(tmp_path):
    config = config_of(env_id=DETUMBLE, n_envs=64, n_steps=50, gradient_steps=300, batch_size=512,
                       net_arch=[64, 64], total_timesteps=64 * 50 * 4, eval_episodes=50,
                       eval_every=1, log_dir=str(tmp_path))  # fmt: skip
    policy = load(train(config, quiet=True).folder / "best_model")
    found, law = (evaluate(DETUMBLE, each, n=100) for each in (policy, "riccati"))
    assert policy.name == "dagger reduced"
    assert found.success.mean == 1.0
    assert found.efficiencies.mean() > 0.97 * law.efficiencies.mean()


def test_the_teacher_acts_first_as_it_does_in_the_world_and_then_the_policy(tmp_path):
    config = config_of(total_timesteps=320, eval_episodes=1, log_dir=str(tmp_path))
    training = begun(config)
    rows = training._adapter.venv.unwrapped
    state = rows.get_state() | {}
    seen = []
    step = rows.step
    rows.step = lambda actions: seen.append(actions) or step(actions)
    training.iterate()
    world = make(SPIN, {}, 8)
    world.reset(seed=0)
    world.set_state(state)
    law = training.model.teacher
    for _ in range(20):
        world.step(np.asarray(law(world), np.float32))
    np.testing.assert_allclose(world.y, rows.y, rtol=0, atol=1e-6)
    lessons = training.model.replay_buffer
    np.testing.assert_array_equal(np.array(seen), lessons.actions[:20])
    training.iterate()
    training.close()
    assert lessons.size() == 40
    assert not np.allclose(np.array(seen)[20:], lessons.actions[20:40], atol=1e-3)


def test_a_full_store_of_lessons_forgets_the_oldest():
    model = model_of(config_of(buffer_size=8 * 30))
    lessons = model.replay_buffer
    for k in range(35):
        lessons.add(np.full((8, 11), k), np.full((8, 3), -k))
    assert lessons.size() == 30
    assert sorted(lessons.observations[:, 0, 0]) == list(range(5, 35))
    seen, right = lessons.draw(1000)
    assert torch.equal(seen[:, 0], -right[:, 0])
    assert set(seen[:, 0].tolist()) <= set(range(5, 35))


@pytest.mark.parametrize("band", [0.0, 0.1])
def test_within_the_band_actions_are_0_and_elsewhere_nearer_to_it(tmp_path, band):
    config = config_of(dead_band=band)
    model = model_of(config)
    before = {name: weight.clone() for name, weight in model.policy.state_dict().items()}
    seen = np.random.default_rng(0).normal(size=(500, 11)).astype(np.float32)
    rows = make(SPIN, {"frame": "reduced"}, 500)
    with torch.no_grad():
        net = model.policy
        z = net.action_net(net.mlp_extractor.policy_net(torch.from_numpy(seen))).numpy()
    with as_saved(model, config):
        banded = acting(model, rows)(seen)
        save_policy(model, config, tmp_path / "policy")
    expected = np.clip(np.sign(z) * np.maximum(np.abs(z) - np.float32(band), 0), -1, 1)
    np.testing.assert_allclose(banded, expected, rtol=0, atol=1e-6)
    policy = load(tmp_path / "policy")
    np.testing.assert_allclose(policy.predict(seen)[0], banded, rtol=0, atol=1e-6)
    again = load_model(tmp_path / "policy" / "policy.safetensors").predict(seen, deterministic=True)
    np.testing.assert_allclose(again[0], banded, rtol=0, atol=1e-6)
    exported = to_torch(policy)(torch.from_numpy(seen)).detach().numpy()
    np.testing.assert_allclose(exported, banded, rtol=0, atol=1e-6)
    within = np.abs(z) < band - 1e-6
    assert within.any() == (band > 0)
    for actions in (banded, policy.predict(seen)[0], again[0], exported):
        assert (actions[within] == 0.0).all()
    after = model.policy.state_dict()
    assert before.keys() == after.keys()
    assert all(torch.equal(weight, after[name]) for name, weight in before.items())


def test_what_is_learnt_is_beyond_the_band_where_the_teacher_acts():
    model = model_of(config_of(dead_band=0.3, gradient_steps=400, learning_rate=1e-2))
    seen = np.random.default_rng(0).normal(size=(8, 11)).astype(np.float32)
    right = np.zeros((8, 3), np.float32)
    right[:4] = [0.5, -0.2, 0.0]
    model.replay_buffer.add(seen, right)
    model.set_logger(Logger(None, []))
    model.train()
    with with_dead_band(model, 0.3):
        learnt = model.predict(seen, deterministic=True)[0]
    np.testing.assert_allclose(learnt[:4], right[:4], rtol=0, atol=0.05)
    assert (learnt[4:] == 0.0).all()
    assert (model.policy.log_std.exp() < 0.05).all()  # of its errors
