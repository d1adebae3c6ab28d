"""Formulas as pictures in the text, drawn by matplotlib: browsers show them without a script.

A page holds the outline of each sign once. What matplotlib does not know stops the build.
"""

import html
import re
from collections.abc import Iterable

from matplotlib.font_manager import FontProperties
from matplotlib.textpath import text_to_path

_EM = 100  # units of the outlines
_FONT = FontProperties(size=_EM, math_fontfamily="cm")
_FUNCTIONS = "(arc)?(sin|cos|tan)|exp|log|ln|max|min|operatorname"
_AS_KNOWN = {
    r"\\[lr]vert": "|",
    r"\\([lg])e\b": r"\\\1eq",
    r"\^\\ast": r"^{\\ast}",  # an operator in braces has no space around it
    r", (-|\\pm )": r", {\1}",
    rf"(?<=[\w}}]) (?=\\({_FUNCTIONS}))": r"\\,",
}
"""What LaTeX writes in a way that matplotlib does not know, or sets too narrow or too wide."""
_LETTERS = {1: "M", 2: "L", 3: "Q", 4: "C", 79: "Z"}  # of the codes of a path of matplotlib
_outlines: dict[str, str] = {}


def drawn(latex: str, block: bool) -> str:
    """A formula as HTML, its signs by reference to outlines.

    Args:
        latex: the formula.
        block: whether it stands by itself.

    Raises:
        ValueError: matplotlib does not know how to draw it.
    """
    text = " ".join(latex.split())
    for pattern, known in _AS_KNOWN.items():
        text = re.sub(pattern, known, text)
    text = re.sub(r"\\texttt\{(.*?)\}", _code, text)
    text = f"${text}$".replace(r"\frac", r"\dfrac" if block else r"\frac")
    width, height, depth = text_to_path.get_text_width_height_descent(text, _FONT, True)
    signs, outlines, bars = text_to_path.get_glyphs_mathtext(_FONT, text)
    _outlines.update({name: _path(*outline) for name, outline in outlines.items()})
    parts = [
        f'<use href="#{name}" transform="translate({x:.0f} {y:.0f}) scale({size:.3g})"/>'
        for name, x, y, size in signs
    ]
    parts += [f'<path d="{_path(*bar)}"/>' for bar in bars]
    picture = (
        f'<svg role="img" aria-label="{html.escape(latex)}" viewBox="0 {depth - height:.0f} '
        f'{width:.0f} {height:.0f}" style="width: {width / _EM:.2f}em; '
        f'height: {height / _EM:.2f}em; vertical-align: {-depth / _EM:.2f}em">'
        f'<g transform="scale(1 -1)">{"".join(parts)}</g></svg>'
    )
    return '<{0} class="math">{1}</{0}>'.format("div" if block else "span", picture)


def with_outlines(body: str) -> str:
    """A page with the outlines of the signs of its formulas."""
    names = sorted(set(re.findall('<use href="#([^"]+)"', body)))
    outlines = "".join(f'<path id="{name}" d="{_outlines[name]}"/>' for name in names)
    return f'<svg class="outlines"><defs>{outlines}</defs></svg>{body}' if names else body


def _code(name: re.Match[str]) -> str:
    escaped = re.sub("([ _])", r"\\\1", name[1])
    return rf"\mathtt{{{escaped}}}"


def _path(vertices: Iterable[tuple[float, float]], codes: Iterable[int]) -> str:
    """A path of matplotlib as one of SVG."""
    words, last = [], 0
    for (x, y), code in zip(vertices, codes, strict=True):
        if code != last or code == 1:
            words.append(_LETTERS[code])
        if _LETTERS[code] != "Z":
            words.append(f"{x:.1f} {y:.1f}")
        last = code
    return " ".join(words)
