"""The reference documents each object once, which the site needs to be built without a warning."""

import importlib
import re
from pathlib import Path

PAGES = Path(__file__).parents[2] / "docs" / "reference"


def documented(page: Path) -> list[object]:
    """The classes and functions on a page."""
    text, found = page.read_text(encoding="utf-8"), []
    for name, options in re.findall(r"automodule:: (\S+)\n((?:   .*\n)*)", text):
        left_out = re.findall(r":exclude-members: (.*)", options)
        names = {each.strip() for line in left_out for each in line.split(",")}
        module = importlib.import_module(name)
        own = [k for k, v in vars(module).items() if getattr(v, "__module__", "") == name]
        public = getattr(module, "__all__", [each for each in own if not each.startswith("_")])
        members = [getattr(module, each) for each in public if each not in names]
        found += [member for member in members if hasattr(member, "__qualname__")]
    return found


def test_no_object_is_documented_twice() -> None:
    pages: dict[int, str] = {}
    for page in sorted(PAGES.glob("*.md")):
        for member in documented(page):
            other = pages.setdefault(id(member), page.name)
            assert other == page.name, f"{member} is on {other} and {page.name}"
