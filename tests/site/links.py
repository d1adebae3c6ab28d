"""Links of the site, offline: `python -m tests.site.links FOLDER`."""

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

_MADE_BY_SPHINX = {"genindex.html", "py-modindex.html", "search.html"}


class _Page(HTMLParser):
    """Anchors of a page, and what it refers to."""

    def __init__(self, text):
        super().__init__()
        self.anchors = set()
        self.targets = set()
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        for name, value in attrs:
            if name == "id" and value:
                self.anchors.add(value)
            elif name in ("href", "src") and value and tag != "base":
                self.targets.add(value)


def broken_links(folder):
    """What is wrong, as "page: target": files and anchors that are not there, and bad addresses.

    Nothing is fetched: of an address elsewhere the form is checked.

    Args:
        folder: of the HTML pages.

    Raises:
        FileNotFoundError: no site is there.
    """
    if not (folder / "index.html").is_file():
        raise FileNotFoundError(f"folder = {folder}; expected a site: build it with .ci/docs")
    pages = {path.resolve(): _Page(path.read_text("utf-8")) for path in folder.rglob("*.html")}
    wrong = []
    for path, page in pages.items():
        for target in sorted(page.targets):
            if not _leads_somewhere(target, path, pages):
                wrong.append(f"{path.relative_to(folder.resolve())}: {target}")
    return sorted(wrong)


def _leads_somewhere(target, path, pages):
    parts = urlsplit(target)
    if parts.scheme or parts.netloc:
        address = parts.scheme == "https" and "." in parts.netloc and " " not in target
        return address or parts.scheme in ("data", "mailto")
    to = (path.parent / unquote(parts.path)).resolve() if parts.path else path
    if not to.is_file():
        return False
    listed = to not in pages or to.name in _MADE_BY_SPHINX
    return listed or not parts.fragment or unquote(parts.fragment) in pages[to].anchors


def main():
    """Print what is wrong; 1 if anything is."""
    wrong = broken_links(Path(sys.argv[1]))
    print("\n".join(wrong) or "all links lead somewhere")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
