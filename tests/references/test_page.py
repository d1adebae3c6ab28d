"""What docs/references.md shows runs as it stands there."""

from pathlib import Path

import pytest

from tests.page_code import run_page


def test_the_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names = run_page("references.md")
    assert names["info"]["is_success"]
    assert names["mean"] > 5.0  # 10 for parking, minus what the way costs
