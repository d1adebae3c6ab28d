"""What a report says it comes from."""

from typing import Any

import pytest

from rigid_envs.engine.provenance import heading

WHERE: dict[str, Any] = {
    "versions": {"rigid-envs": "1.2", "numpy": "2.0"},
    "cpu": "Some CPU",
    "cores": 2,
    "load": None,
    "git_commit": None,
    "git_dirty": None,
    "kernel_hash": "abc",
    "date": "2026-01-01",
}


@pytest.mark.parametrize(
    ("known", "said"),
    [
        ({}, ""),
        ({"load": 0.04}, "; load before 0.0"),
        ({"git_commit": "0123456789", "git_dirty": False}, "; commit 012345678"),
        ({"git_commit": "0123456789", "git_dirty": True}, "; commit 012345678 and changes"),
    ],
    ids=str,
)
def test_a_heading_says_load_and_commit_where_they_are_known(
    known: dict[str, Any], said: str
) -> None:
    first, second = heading(WHERE | known).splitlines()
    assert first == "rigid-envs 1.2, numpy 2.0"
    assert second == f"Some CPU, 2 cores{said}; kernels abc; 2026-01-01"
