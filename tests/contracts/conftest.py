import pytest

from tests.contracts.environments import IDS


@pytest.fixture(params=IDS)
def env_id(request: pytest.FixtureRequest) -> str:
    """Every registered id in turn."""
    return str(request.param)
