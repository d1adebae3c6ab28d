"""What docs/sb3.md shows runs as it stands there."""

from pathlib import Path

import pytest

from rigid_envs.scores.trained import CompiledPolicy
from tests.page_code import run_page


def test_the_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names = run_page("sb3.md", _200_000="1", _2_000="1_100")
    assert isinstance(names["policy"], CompiledPolicy)
    assert names["venv"].action_space.contains(names["action"][0])
    assert names["mean"] > 0.0
    assert "mine" in (tmp_path / "leaderboard.md").read_text()
