"""`render` of environments: what it gives, costs, needs and leaves alone."""

import hashlib
import multiprocessing
import os
import pickle
import shutil
import subprocess
import sys

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.error import ClosedEnvironmentError, DependencyNotInstalled, ResetNeeded

from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.watch.drawing import Drawing
from rigid_envs.watch.panda import load_without_x11
from tests.programs import printed
from tests.refusals import refuses

IDS = tuple(ENVIRONMENTS)
PARK = "RigidEnvs/BallPark-v0"


def played(env_id, n=3, **kwargs):
    env = gym.make(env_id, render_mode="rgb_array", **kwargs)
    env.reset(seed=1)
    env.action_space.seed(2)
    for _ in range(n):
        env.step(env.action_space.sample())
    return env


@pytest.mark.parametrize("env_id", IDS)
def test_pictures_are_made_in_real_time(env_id):
    env = gym.make(env_id, render_mode="rgb_array")
    dt = env.unwrapped.task.dt
    assert env.metadata["render_fps"] == max(1, round(1.0 / dt))
    assert set(env.metadata["render_modes"]) == {"human", "rgb_array"}
    envs = gym.make_vec(env_id, num_envs=2, render_mode="rgb_array")
    assert envs.metadata["render_fps"] == env.metadata["render_fps"]


@pytest.mark.parametrize("env_id", IDS)
def test_rendering_changes_no_bit_of_the_motion(env_id):
    watched = gym.make(env_id, render_mode="rgb_array")
    alone = gym.make(env_id)
    for env in (watched, alone):
        env.reset(seed=3)
        env.action_space.seed(4)
    for _ in range(5):
        watched.render()
        first, second = (env.step(env.action_space.sample()) for env in (watched, alone))
        assert first[1:4] == second[1:4]
    for name, part in watched.unwrapped.get_state().items():
        assert part.tobytes() == alone.unwrapped.get_state()[name].tobytes()


def test_a_vector_environment_gives_a_picture_for_each_row_or_for_those_that_are_named():
    envs = gym.make_vec(PARK, num_envs=3, render_mode="rgb_array", width=96, height=64)
    envs.reset(seed=1)
    pictures = envs.render()
    assert isinstance(pictures, tuple)
    assert [picture.shape for picture in pictures] == [(64, 96, 3)] * 3
    single = gym.make(PARK, render_mode="rgb_array", width=96, height=64)
    single.reset(seed=2)
    assert np.array_equal(single.render(), pictures[1])
    assert np.array_equal(envs.call("render"), pictures)
    many = gym.make_vec(PARK, num_envs=4096, render_mode="rgb_array", render_rows=[0, 7, 4095])
    many.reset(seed=0)
    assert len(many.render()) == 3


@pytest.mark.parametrize("rows", [[0, 4], [-1, 0], [], "01", [0.5], [[0]]])
def test_wrong_render_rows_are_refused(rows):
    with pytest.raises(ValueError, match=r"^config\.render_rows: render_rows = .*; expected"):
        gym.make_vec(PARK, num_envs=4, render_rows=rows)


def test_pictures_are_squares_of_480_pixels_unless_told_otherwise():
    envs = gym.make_vec(PARK, num_envs=1, render_mode="rgb_array")
    envs.reset(seed=0)
    for picture in (played(PARK, 1).render(), *envs.render()):
        assert picture.shape == (480, 480, 3)
    assert played(PARK, 1, width=64, height=32).render().shape == (32, 64, 3)


def test_camera_is_an_argument():
    left, right = (
        played(PARK, camera={"azimuth": azimuth}).render().astype(int) for azimuth in (0.0, 90.0)
    )
    assert np.abs(left - right).mean() > 1.0


def test_render_needs_an_episode_and_an_open_environment():
    for env in (
        gym.make(PARK, render_mode="rgb_array").unwrapped,
        gym.make_vec(PARK, num_envs=2, render_mode="rgb_array").unwrapped,
    ):
        with pytest.raises(ResetNeeded, match="call reset first"):
            env.render()
        env.reset(seed=0)
        picture = env.render()
        env.close()
        with pytest.raises(ClosedEnvironmentError):
            env.render()
        env.reset(seed=0)
        assert np.array_equal(env.render(), picture)


@pytest.mark.parametrize("env_id", [PARK, "RigidEnvs/BallParkRandom-v0"])
def test_an_episode_is_drawn_anew_with_its_own_parameters(env_id, monkeypatch):
    closed = []
    monkeypatch.setattr(Drawing, "close", lambda drawing: closed.append(drawing))
    fresh, env = (gym.make(env_id, render_mode="rgb_array").unwrapped for _ in range(2))
    fresh.reset(seed=5)
    env.reset(seed=4)
    for _ in range(5):
        env.step(np.ones(2, dtype=np.float32))
        env.render()
    drawings = {env._drawn[0][0]}
    env.reset(seed=5)
    assert np.array_equal(env.render(), fresh.render())
    drawings.add(env._drawn[0][0])
    env.close()
    assert all(closed.count(drawing) == 1 for drawing in drawings)  # nothing of them is left


def test_rendering_again_gives_the_same_picture_and_no_point_of_a_path():
    env = gym.make("RigidEnvs/PivotTop-v0", render_mode="rgb_array")
    env.reset(seed=1)
    for _ in range(20):
        env.step(np.ones(2, dtype=np.float32))
        picture = env.render()
    again = [env.render() for _ in range(45)]  # a path of the tip has 40 points
    assert all(np.array_equal(picture, each) for each in again)
    bare = pickle.loads(pickle.dumps(env))  # takes no path along
    assert not np.array_equal(picture, bare.render())


def test_a_copy_of_a_rendered_environment_renders_by_itself():
    env = played(PARK)
    env.render()
    copy = pickle.loads(pickle.dumps(env))
    copy.reset(seed=9)
    env.reset(seed=9)
    assert np.array_equal(copy.render(), env.render())


def _picture(queue):
    queue.put(played(PARK).render())


@pytest.mark.long
@pytest.mark.push
@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_other_processes_render_the_same_picture(method):
    expected = played(PARK).render()  # before the fork: the child has a renderer already
    context = multiprocessing.get_context(method)
    queue = context.Queue()
    child = context.Process(target=_picture, args=(queue,))
    child.start()
    assert np.array_equal(queue.get(timeout=120), expected)
    child.join(timeout=60)


def _resident():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="needs Linux's /proc")
def test_two_hundred_environments_rendered_and_closed_leave_nothing():
    def one(seed):
        env = gym.make(PARK, render_mode="rgb_array", width=96, height=96)
        env.reset(seed=seed)
        env.render()
        env.close()

    for seed in range(50):
        one(seed)
    before = _resident()
    for seed in range(200):
        one(seed)
    # a scene graph takes 0.1 MiB or more, a picture 0.03
    assert _resident() - before < 2.0


def in_a_new_process(code):
    printed("-c", code, SDL_VIDEODRIVER="dummy", DISPLAY="")


RENDERERS = ("panda3d", "pygame", "PIL", "moviepy", "matplotlib")


@pytest.mark.long
@pytest.mark.push
def test_no_renderer_is_imported_before_the_first_picture():
    in_a_new_process(f"""
import sys, gymnasium as gym, rigid_envs
env = gym.make({PARK!r}, render_mode="rgb_array")
env.reset(seed=0)
found = [name for name in {RENDERERS} if name in sys.modules]
assert not found, found
env.render()
assert "panda3d" in sys.modules and "pygame" not in sys.modules
""")


@pytest.mark.long
@pytest.mark.push
def test_a_missing_package_is_named_with_the_command_that_installs_it():
    in_a_new_process(f"""
import sys
import gymnasium as gym, rigid_envs
from gymnasium.error import DependencyNotInstalled
for name in ("PIL", "panda3d"):
    sys.modules[name] = None
    env = gym.make({PARK!r}, render_mode="rgb_array")
    env.reset(seed=0)
    try:
        env.render()
    except DependencyNotInstalled as error:
        assert 'pip install "rigid-envs[render]"' in str(error), error
    else:
        raise SystemExit(f"no error without {{name}}")
    del sys.modules[name]
""")


@pytest.mark.parametrize("n", [0, 1])
def test_to_close_an_environment_closes_its_window_once(n, monkeypatch):
    calls = []

    class Window:
        def __init__(self, title):
            calls.append(title)

        def show(self, picture, fps):
            calls.append((picture.shape, fps))

        def close(self):
            calls.append("close")

    monkeypatch.setattr("rigid_envs.watch.pictures.Window", Window)
    options = {"render_mode": "human", "width": 64, "height": 32}
    env = gym.make_vec(PARK, num_envs=n, **options) if n else gym.make(PARK, **options)
    env.reset(seed=0)
    env.close()
    env.close()
    assert calls == [PARK, ((32, 64, 3), 10), "close"]


def test_human_mode_shows_every_step_in_a_window():
    in_a_new_process(f"""
import gymnasium as gym, pygame, rigid_envs
mode = dict(render_mode="human", width=64, height=64)
for env in (gym.make({PARK!r}, **mode), gym.make_vec({PARK!r}, num_envs=3, **mode)):
    env.reset(seed=0)
    assert pygame.display.get_surface() is not None
    before = pygame.surfarray.array3d(pygame.display.get_surface())
    for _ in range(2):
        env.step(env.action_space.sample())
    after = pygame.surfarray.array3d(pygame.display.get_surface())
    assert (before != after).any()
    assert env.render() is None
    env.close()
    assert not pygame.display.get_init()
""")


@pytest.mark.parametrize("n", [0, 2])
def test_a_step_that_nobody_would_see_is_refused(n, without_display):
    options = {"render_mode": "human", "width": 64, "height": 64}
    env = gym.make_vec(PARK, num_envs=n, **options) if n else gym.make(PARK, **options)
    env.reset(seed=0)  # Gymnasium's check of render modes does no more
    said = r"DISPLAY = None; expected a display for the window"
    refuses(said, env.step, env.action_space.sample())
    if n:  # some rows at a start, and some not
        refuses(said, env.reset, options={"reset_mask": np.arange(n) == 0})
    env.close()


DRAW = """
import hashlib, gymnasium as gym, rigid_envs
env = gym.make("RigidEnvs/BallPark-v0", render_mode="rgb_array")
env.reset(seed=0)
print(hashlib.sha256(env.render().tobytes()).hexdigest())
"""
HIDDEN = ("libX11", "libGL", "libEGL", "libOSMesa", "libxcb", "libfreetype", "libdrm", "libgbm")


def libraries():
    found = subprocess.run(["ldconfig", "-p"], capture_output=True, text=True).stdout.splitlines()
    paths = {os.path.realpath(line.split()[-1]) for line in found if " => " in line}
    return [path for path in paths if os.path.basename(path).startswith(HIDDEN)]


def can_hide():
    if shutil.which("unshare") is None:
        return False
    trial = ["unshare", "-m", "mount", "--bind", "/dev/null", "/dev/null"]
    done = subprocess.run(trial, capture_output=True)
    return done.returncode == 0 and os.geteuid() == 0


@pytest.mark.long
@pytest.mark.push
@pytest.mark.skipif(not can_hide(), reason="hiding libraries needs unshare, as root")
def test_pictures_are_drawn_without_system_libraries(capsys):
    hide = "".join(f"mount --bind /dev/null {path}\n" for path in libraries())
    bare = subprocess.run(
        ["unshare", "-m", "sh", "-ec", hide + 'exec "$@"', "sh", sys.executable, "-c", DRAW],
        capture_output=True,
        text=True,
        env={key: os.environ[key] for key in ("PATH", "HOME", "PYTHONPATH") if key in os.environ},
        timeout=300,
    )
    assert bare.returncode == 0, bare.stderr
    exec(DRAW, {})
    assert bare.stdout == capsys.readouterr().out
    assert len(bare.stdout.strip()) == len(hashlib.sha256().hexdigest())


@pytest.mark.skipif(sys.platform != "linux", reason="there libX11 is not asked for")
def test_what_is_missing_is_named_where_there_is_no_libx11_and_no_copy_can_be_loaded(
    tmp_path, monkeypatch
):
    monkeypatch.setattr("rigid_envs.watch.panda._X11", "libX11.so.none")
    broken = tmp_path / "libp3tinydisplay.so"
    broken.write_bytes(b"no library")
    with pytest.raises(DependencyNotInstalled, match=r"libX11\.so\.none, or /proc"):
        load_without_x11(broken)
