"""Pictures need no system package: the same one is drawn where libX11 and OpenGL are hidden."""

import hashlib
import os
import shutil
import subprocess
import sys

import pytest
from gymnasium.error import DependencyNotInstalled

from rigid_envs.watch import panda as without_x11
from rigid_envs.watch.panda import empty_library

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
def test_pictures_are_drawn_without_system_libraries():
    hide = "".join(f"mount --bind /dev/null {path}\n" for path in libraries())
    bare = subprocess.run(
        ["unshare", "-m", "sh", "-ec", hide + 'exec "$@"', "sh", sys.executable, "-c", DRAW],
        capture_output=True,
        text=True,
        env={key: os.environ[key] for key in ("PATH", "HOME", "PYTHONPATH") if key in os.environ},
        timeout=300,
    )
    assert bare.returncode == 0, bare.stderr
    usual = subprocess.run([sys.executable, "-c", DRAW], capture_output=True, text=True, check=True)
    assert bare.stdout == usual.stdout
    assert len(usual.stdout.strip()) == len(hashlib.sha256().hexdigest())


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="ELF")
@pytest.mark.parametrize("machine", ["x86_64", "aarch64"])
def test_the_empty_library_is_a_valid_one(machine, tmp_path):
    if shutil.which("readelf") is None:
        pytest.skip("readelf is not installed")
    file = tmp_path / "empty.so"
    file.write_bytes(empty_library("libsomething.so.1", machine))
    told = subprocess.run(["readelf", "-hldW", file], capture_output=True, text=True)
    assert not told.stderr
    assert "Library soname: [libsomething.so.1]" in told.stdout
    assert "DYN (Shared object file)" in told.stdout


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="there libX11 is not asked for")
def test_what_is_missing_is_named_where_neither_libx11_nor_proc_is_there(tmp_path, monkeypatch):
    def nothing(name, **_):
        raise OSError(f"{name}: cannot open shared object file")

    monkeypatch.setattr(without_x11.ctypes, "CDLL", nothing)
    with pytest.raises(DependencyNotInstalled, match=r"libX11\.so\.6, or /proc"):
        without_x11.provide_x11(tmp_path / "library.so")
