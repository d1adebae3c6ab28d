"""The checker of links finds what is broken, and nothing else."""

from pathlib import Path

import pytest

from tests.site.links import broken_links

PAGE = """
<a href="other.html#there">a</a> <a href="#here">b</a> <h2 id="here">c</h2> <img src="a%20b.png">
<a href="https://doi.org/10.1007/BF00375605">d</a> <a href="sub/">e</a>
"""
BROKEN = ["#gone", "gone.html", "http://plain.org/x", "https://nowhere", "other.html#gone", "sub/"]


def test_what_leads_nowhere_is_named_with_its_page(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "a b.png").write_bytes(b"")
    (tmp_path / "other.html").write_text('<p id="there">')
    links = "".join(f'<a href="{target}">x</a>' for target in BROKEN)
    (tmp_path / "index.html").write_text(PAGE + links)
    assert broken_links(tmp_path) == [f"index.html: {target}" for target in BROKEN]


def test_an_empty_folder_is_no_site(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="expected a site"):
        broken_links(tmp_path)
