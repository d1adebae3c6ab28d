"""The page of speeds is that of its data; phases of a training are all of it."""

import json

import pytest

from tests.benchmarks.__main__ import DOCS
from tests.benchmarks.page import markdown
from tests.benchmarks.ppo_phases import measure


def test_the_page_of_the_repository_is_that_of_its_data() -> None:
    data = json.loads((DOCS / "speed.json").read_text())
    assert (DOCS / "speed.md").read_text() == markdown(data)


def test_the_phases_of_a_training_add_up_and_none_is_counted_twice() -> None:
    found = measure("IntermediateAxis", 40_000)
    assert found.timesteps > 0 and sum(found.shares) == pytest.approx(1.0)
    assert min(found.seconds) > 0.0
