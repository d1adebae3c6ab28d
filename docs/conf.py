"""Sphinx: the site is made of the pages beside this file, the docstrings and the tutorials.

Pages stay readable where they are, in the repository; what only a site needs is added here.
"""

import re
import sys
from pathlib import Path

from sphinx.application import Sphinx

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))

import rigid_envs  # noqa: E402

project = "rigid-envs"
author = project_copyright = "rigid-envs contributors"
version = release = rigid_envs.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
]
exclude_patterns = ["_build", "conf.py"]

# Pages
myst_enable_extensions = ["amsmath", "dollarmath"]
myst_heading_anchors = 4  # links to headings, as on GitHub

# Tutorials: scripts with cells, executed again after a change of the script
nb_custom_formats = {".py": ["jupytext.reads", {"fmt": "py:percent"}]}
nb_execution_mode = "cache"
nb_execution_timeout = 600
nb_execution_raise_on_error = True
nb_execution_in_temp = True
nb_merge_streams = True

# Reference
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_default_options = {"members": True, "imported-members": True, "show-inheritance": True}
napoleon_numpy_docstring = False
napoleon_use_ivar = True
napoleon_custom_sections = ["Physics", "Source"]
default_role = "py:obj"  # `name` in a docstring

# Look
html_theme = "furo"
html_title = f"rigid-envs {version}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_theme_options = {
    "navigation_with_keys": True,
    "source_repository": "https://github.com/rigid-envs/rigid-envs/",
    "source_branch": "main",
    "source_directory": "docs/",
}


def as_plain_text(
    app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]
) -> None:
    """Keep bars and the star of ``(T, *lead)`` in docstrings, which mean something else to RST."""
    for k, line in enumerate(lines):
        parts = re.split(r"(``.*?``)", line)
        parts[::2] = [re.sub(r"\||(?<=, )\*|(?<=\()\*", r"\\\g<0>", part) for part in parts[::2]]
        lines[k] = "".join(parts)


def for_the_site(app: Sphinx, name: str, text: list[str]) -> None:
    """Give anchors their MyST form, and the index of the environments the list of its pages."""
    text[0] = re.sub(r'^<a id="(\w+)"></a>$', r"(\1)=", text[0], flags=re.MULTILINE)
    if name == "environments/README":
        names = re.findall(r"^\| \[`.*?\((\w+)\.md\)", text[0], re.MULTILINE)
        text[0] += "\n".join(["\n```{toctree}", ":hidden:\n", *names, "```\n"])


def setup(app: Sphinx) -> None:
    """Connect both, the first before Napoleon adds markup of its own."""
    app.connect("autodoc-process-docstring", as_plain_text, priority=400)
    app.connect("source-read", for_the_site)
