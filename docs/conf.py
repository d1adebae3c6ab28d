"""Sphinx: the site is made of the pages beside this file, the docstrings and the tutorials.

Pages stay readable where they are, in the repository; what only a site needs is added here.
"""

import re
import sys
import warnings
from pathlib import Path
from typing import Any, get_args, get_origin

import numpy as np
import numpy.typing as npt
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.config import Config
from sphinx.util.typing import stringify_annotation
from sphinx_autodoc_typehints import format_annotation

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

import site_pages  # noqa: E402

import rigid_envs  # noqa: E402
from rigid_envs.tools.pages.formulas import with_latex  # noqa: E402

project = "rigid-envs"
author = project_copyright = "rigid-envs contributors"
version = release = rigid_envs.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_autodoc_typehints",
    "sphinx_copybutton",
    "sphinx-mathjax-offline",
]
exclude_patterns = ["_build", "*.py"]
suppress_warnings = [
    "config.cache",  # a function among the settings
    "sphinx_autodoc_typehints.forward_reference",  # a field that a subclass in another module has
]

# Packages of others that use what Sphinx will remove; of all else its warnings are seen.
for module in ("myst_parser", r"sphinx\.ext\.napoleon", "sphinx_autodoc_typehints"):
    for category in (DeprecationWarning, PendingDeprecationWarning):
        warnings.filterwarnings("ignore", category=category, module=module)

# Pages
myst_enable_extensions = ["amsmath", "dollarmath", "html_image"]
myst_heading_anchors = 4  # links to headings, as on GitHub

# Tutorials: scripts with cells, executed again after a change of the script
nb_custom_formats = {".py": ["jupytext.reads", {"fmt": "py:percent"}]}
nb_execution_mode = "cache"
nb_execution_timeout = 600
nb_execution_raise_on_error = True
nb_execution_in_temp = True
nb_merge_streams = True

# Reference
autodoc_default_options = {"members": True}
napoleon_numpy_docstring = False
napoleon_use_ivar = True
napoleon_custom_sections = ["Physics", "Source"]
default_role = "py:obj"  # `name` in a docstring
highlight_language = "text"  # formulas in docstrings


def typehints_formatter(annotation: Any, config: Config) -> str | None:
    """Names of NumPy's types in place of the unions that they stand for."""
    members, union = get_args(annotation), get_args(npt.ArrayLike)
    if all(each in members for each in union):
        rest = [each for each in members if each not in union]
        return " | ".join(["``ArrayLike``", *(format_annotation(each, config) for each in rest)])
    if get_origin(annotation) is np.ndarray:
        (kind,) = get_args(get_args(annotation)[1]) or (Any,)
        return f"``NDArray[{getattr(kind, '__name__', kind)}]``"
    return None


_ARRAY_LIKE = stringify_annotation(npt.ArrayLike, "smart")  # the union, as in a signature


def with_short_signature(
    app: Sphinx, what: str, name: str, obj: object, options: object, signature: Any, returns: Any
) -> tuple[Any, Any]:
    """The name in signatures that have annotations: those of named tuples."""
    return signature and signature.replace(_ARRAY_LIKE, "ArrayLike"), returns


def with_short_alias(app: Sphinx, domain: str, kind: str, content: nodes.Element) -> None:
    """The name in what an alias stands for."""
    union = re.sub(r"~[\w.]*\.", "", _ARRAY_LIKE)  # as it is shown
    for paragraph in content.findall(nodes.paragraph):
        if union in (text := paragraph.astext()):
            kind_of = text.removeprefix("alias of ").replace(union, "ArrayLike")
            paragraph[:] = [nodes.Text("alias of "), nodes.literal("", kind_of)]


# Look
html_theme = "furo"
html_title = f"rigid-envs {version}"
html_static_path = ["_static"]
html_scaled_image_link = False  # a picture with a width leads where its page says
html_favicon = "_static/icon.svg"
html_css_files = ["site.css"]
html_js_files = [("site.js", {"defer": "defer"})]
html_theme_options = {
    "navigation_with_keys": True,
    "source_repository": "https://github.com/rigid-envs/rigid-envs/",
    "source_branch": "main",
    "source_directory": "docs/",
}


def as_plain_text(
    app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]
) -> None:
    """Formulas between dollars in LaTeX; those by themselves as they are; bars and ``*lead``."""
    lines[:] = with_latex("\n".join(lines), ":math:`{}`").splitlines()
    shown: list[str] = []
    margin, formula = 0, False  # indentation of the prose; whether the last line was no prose
    for line in lines:
        indent = len(line) - len(line.lstrip())
        if line and formula:
            formula = indent > margin
        elif line and indent > margin and shown and not shown[-1]:
            shown += [" " * margin + "::", ""]
            formula = True
        if line and not formula:
            margin, line = indent, _escaped(line)
            formula = line.endswith("::")
        shown.append(line)
    # Of an attribute, Napoleon takes what stands before a colon for its type, if it comes first.
    comment = ["..", ""] if what in ("attribute", "data", "property") else []
    lines[:] = comment + shown


def without_fields(
    app: Sphinx, what: str, name: str, obj: object, skip: bool, options: object
) -> bool | None:
    """Leave out fields of a named tuple, which its docstring describes."""
    return True if (getattr(obj, "__doc__", "") or "").startswith("Alias for field") else None


def _escaped(line: str) -> str:
    """Bars, and the star of ``(T, *lead)``, mean something else to RST."""
    parts = re.split(r"(``.*?``)", line)
    parts[::2] = [re.sub(r"\||\*(?=lead|shape)", r"\\\g<0>", part) for part in parts[::2]]
    return "".join(parts)


def for_the_site(app: Sphinx, name: str, text: list[str]) -> None:
    """Give anchors their MyST form, what moves its replay, and environments their cards."""
    text[0] = re.sub(r'^<a id="(\w+)"></a>$', r"(\1)=", text[0], flags=re.MULTILINE)
    if name == "environments/README":
        pages = site_pages.names(text[0])
        text[0] = site_pages.with_cards(text[0])
        text[0] += "\n".join(["\n```{toctree}", ":hidden:\n", *pages, "```\n"])
    text[0] = site_pages.with_replays(text[0], "../" * name.count("/") + "_static")


def sized(
    app: Sphinx, name: str, template: str, context: dict[str, Any], doctree: nodes.document | None
) -> None:
    """Give pictures their sizes."""
    if doctree:
        paths = {name: Path(app.srcdir, path) for path, name in app.builder.images.items()}
        context["body"] = site_pages.with_sizes(context["body"], paths)


def stills(app: Sphinx) -> None:
    """Write the pictures of the cards."""
    site_pages.write_stills(HERE / "environments/films", app.outdir / "_static/stills")


def setup(app: Sphinx) -> None:
    """Connect all of these, the first before Napoleon adds markup of its own."""
    app.connect("autodoc-process-docstring", as_plain_text, priority=400)
    app.connect("autodoc-skip-member", without_fields)
    app.connect("autodoc-process-signature", with_short_signature)
    app.connect("object-description-transform", with_short_alias)
    app.connect("builder-inited", stills)
    app.connect("source-read", for_the_site)
    app.connect("html-page-context", sized)
