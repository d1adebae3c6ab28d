"""Options of the contract tests, and the ids that they run over."""

import pytest

from rigid_envs.base.checks import ConfigError
from rigid_envs.testing.ids import choose, chosen, compile_first


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add ``--env-id``."""
    parser.addoption(
        "--env-id",
        action="append",
        default=[],
        metavar="[MODULE:]ID",
        help="id for the contract tests of rigid-envs, and the module that registers it; "
        "may be given several times (default: all ids of rigid-envs)",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Choose the ids before any test is imported, and compile their kernels."""
    config.addinivalue_line("markers", "long: the long version of a claim, minutes to hours")
    config.addinivalue_line("markers", "push: one of the long tests that is run at every push")
    names = config.getoption("--env-id", None)
    try:
        if names:
            choose(names)
    except ConfigError as error:
        raise pytest.UsageError(f"--env-id: {error}") from None
    compile_first(config)


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Every chosen id in turn, where a test does not say which."""
    given = (mark.args[0] for mark in metafunc.definition.iter_markers("parametrize"))
    if "env_id" in metafunc.fixturenames and "env_id" not in given:
        metafunc.parametrize("env_id", chosen())
