"""Tools of others show every id, unmodified: films, windows, keys."""

import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.wrappers import RecordVideo
from gymnasium.wrappers.vector import RecordVideo as VectorRecordVideo
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import VecVideoRecorder

from rigid_envs import sb3
from rigid_envs.tasks.registry import ENVIRONMENTS
from tests.films.test_film import read_video

pygame = pytest.importorskip("pygame")
pytest.importorskip("panda3d")
pytest.importorskip("moviepy")

PARK = "RigidEnvs/BallPark-v0"
# of the environments one at every push
EACH = [pytest.param(name, marks=pytest.mark.push if name == PARK else ()) for name in ENVIRONMENTS]

# it says so of every folder that is there already
pytestmark = [
    pytest.mark.long,
    pytest.mark.filterwarnings("ignore:.*Overwriting existing videos:UserWarning"),
]
SMALL = {"render_mode": "rgb_array", "width": 64, "height": 64}


@pytest.fixture(autouse=True)
def no_display(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    yield
    pygame.quit()


def steps(env, n, seed=0):
    env.reset(seed=seed)
    env.action_space.seed(seed)
    for _ in range(n):
        env.step(env.action_space.sample())


@pytest.mark.parametrize("env_id", EACH)
def test_record_video_films_an_id_in_real_time(env_id, tmp_path):
    env = RecordVideo(gym.make(env_id, **SMALL), str(tmp_path), disable_logger=True)
    steps(env, 6)
    env.close()
    (film,) = tmp_path.glob("*.mp4")
    meta, pictures = read_video(film)
    assert meta["codec"] == "h264" and meta["size"] == (64, 64)
    assert meta["fps"] == pytest.approx(env.metadata["render_fps"], abs=0.01)
    assert len(pictures) == 7


@pytest.mark.push
def test_the_vector_wrapper_films_our_native_rows(tmp_path):
    envs = gym.make_vec(PARK, num_envs=3, vectorization_mode="vector_entry_point", **SMALL)
    filmed = VectorRecordVideo(envs, str(tmp_path), video_length=4, disable_logger=True)
    steps(filmed, 6)
    filmed.close()
    (film,) = tmp_path.glob("*.mp4")
    assert read_video(film)[0]["size"][0] >= 2 * 64  # rows are side by side


@pytest.mark.parametrize("mode", ["sync", "async"])
def test_gymnasiums_vectors_of_single_environments_render(mode):
    envs = gym.make_vec(PARK, num_envs=2, vectorization_mode=mode, **SMALL)
    envs.reset(seed=0)
    pictures = envs.render()
    assert len(pictures) == 2 and pictures[0].shape == (64, 64, 3)
    assert not np.array_equal(*pictures)
    envs.close()


def keys_to_action(env):
    """The mapping that a user would write: one key for each side of each entry."""
    space = env.action_space
    if isinstance(space, gym.spaces.Discrete):
        return dict(zip("dwas", range(int(space.n)), strict=False))
    letters = iter("adwsqe")
    n, mapping = space.shape[0], {}
    for k in range(n):
        for side in (-1.0, 1.0):
            action = np.zeros(n, np.float32)
            action[k] = side
            mapping[next(letters)] = action
    return mapping


@pytest.mark.parametrize("env_id", EACH)
def test_gymnasiums_play_steers_an_id(env_id, monkeypatch):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it asks for a backend of matplotlib as it is imported
        from gymnasium.utils import play as utils

    env = gym.make(env_id, **SMALL)
    mapping = keys_to_action(env)
    noop = 0 if env.unwrapped.task.n_choices else np.zeros(env.action_space.shape, np.float32)
    taken = []

    def post(kind, key):
        pygame.event.post(pygame.event.Event(kind, key=ord(key)))

    def callback(_before, _after, action, *_rest):
        taken.append(action)
        if len(taken) == 1:
            post(pygame.KEYDOWN, "d")
        if len(taken) == 3:
            pygame.event.post(pygame.event.Event(pygame.QUIT))

    utils.play(env, keys_to_action=mapping, noop=noop, seed=0, fps=1000, callback=callback)
    assert np.array_equal(taken[0], noop)
    if "d" in mapping:
        assert np.array_equal(taken[1], mapping["d"])
    assert len(taken) == 3


@pytest.mark.parametrize("env_id", EACH)
def test_stable_baselines3_films_its_rows_and_our_adapter(env_id, tmp_path):
    theirs = make_vec_env(env_id, n_envs=2, seed=0, env_kwargs={"width": 64, "height": 64})
    assert theirs.render_mode == "rgb_array"
    for name, venv in (("theirs", theirs), ("ours", sb3.make_vec_env(env_id, 2, **SMALL))):
        recorder = VecVideoRecorder(
            venv, str(tmp_path / name), record_video_trigger=lambda step: step == 0, video_length=4
        )
        recorder.reset()
        for _ in range(5):
            recorder.step(np.stack([venv.action_space.sample() for _ in range(2)]))
        recorder.close()
        (film,) = (tmp_path / name).glob("*.mp4")
        size = read_video(film)[0]["size"]
        assert size[0] * size[1] >= 2 * 64 * 64
