"""The page of best known costs is that of the data."""

from pathlib import Path

from rigid_envs.tools.pages.writing import with_tables

PAGE = Path(__file__).parents[2] / "docs" / "best_known.md"


def test_the_table_is_that_of_the_data():
    text = PAGE.read_text(encoding="utf-8")
    assert text == with_tables(text), (
        "write it anew: python -m rigid_envs.tools.pages docs/best_known.md"
    )
