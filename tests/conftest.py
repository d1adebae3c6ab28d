"""Settings of all property tests, and kernels that are compiled before tests run in parallel."""

import gc
import logging
import os

os.environ.setdefault("OMP_NUM_THREADS", "1")  # of torch and BLAS: tests run beside each other

import pytest
from hypothesis import HealthCheck, settings

from rigid_envs.testing.ids import compile_first

# The first example compiles what it calls, and a machine may be busy: examples are not timed. They
# are others in every run: forty of them are as many as a push needs.
settings.register_profile(
    "untimed", deadline=None, max_examples=40, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("untimed")

# Commands print what they compile, which depends on the tests before: here they keep to warnings.
logging.getLogger("rigid_envs.engine.compiler").setLevel(logging.WARNING)


@pytest.fixture
def without_display(monkeypatch):
    """As on a server, where no window can be opened."""
    for name in ("SDL_VIDEODRIVER", "DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("sys.platform", "linux")


@pytest.hookimpl(trylast=True)  # ids may be chosen
def pytest_configure(config):
    """With `-n`, compile all kernels before the workers start."""
    compile_first(config)


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Collect tests without searching for garbage, which takes a third of the time."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()


def pytest_collection_modifyitems(items):
    """Put the file that takes longest first: begun last, it would be waited for alone."""
    items.sort(key=lambda item: item.path.name != "test_machine_code.py")
