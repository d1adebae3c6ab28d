"""Pictures need no system package: the same one is drawn where libX11 and OpenGL are hidden."""

import hashlib
import os
import shutil
import subprocess
import sys

import pytest
from gymnasium.error import DependencyNotInstalled

from rigid_envs.watch.panda import load_without_x11

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
