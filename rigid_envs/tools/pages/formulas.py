r"""Formulas of docstrings as LaTeX, for pages.

A docstring is read in `help()` too, so it has a formula in plain text, between dollars:
`$phi' <= sqrt(g / ell) |theta_x|$`. Pages have LaTeX, which GitHub and Sphinx show as mathematics.
"""

import re
from itertools import cycle

_GREEK = (
    *("alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "kappa", "lambda"),
    *("mu", "nu", "xi", "pi", "rho", "sigma", "tau", "phi", "chi", "psi", "omega", "Omega"),
)
_FUNCTIONS = ("arcsin", "arctan", "cos", "cosh", "exp", "log", "max", "min", "sin", "sqrt", "tan")
_LATEX = {
    **{name: rf"\{name}" for name in (*_GREEK, *_FUNCTIONS, "ell", "tanh")},
    **{name: rf"\operatorname{{{name}}}" for name in ("atan2", "diag", "sign", "SO", "tr", "vec")},
    "cbrt": r"\sqrt[3]",
    "dt": r"\text{dt}",  # the control period, no differential
    "eps": r"\varepsilon",
}
_SYMBOL = re.compile(rf"({'|'.join(_GREEK)}|[A-Za-z])(?:_([^\W_]+)|(\d+|[XYZ]))")
_SIGNS = {"<=": r"\le", ">=": r"\ge", "->": r"\to", "+-": r"\pm ", "-+": r"\mp"}


def with_latex(text: str, form: str = "${}$") -> str:
    """A text with its formulas in LaTeX.

    Args:
        text: with formulas in plain text between dollars.
        form: what stands in place of a formula, `{}` for its LaTeX.
    """
    return re.sub(r"\$([^$]+)\$", lambda found: form.format(latex(found[1])), text)


def latex(formula: str) -> str:
    """The LaTeX of a formula in plain text, without signs that Markdown takes for marks."""
    text = _with_braces(" ".join(formula.split()))
    text = re.sub(r"(?<=[\w)']) x (?=[\w(])", r" \\times ", text)  # else x is a variable
    text = text.replace(" . ", r" \cdot ")
    text = re.sub("[<>]=|->|[+]-|-[+]", lambda sign: _SIGNS[sign[0]], text)
    text = re.sub(r"\b1e(-?\d+)", r"10^{\1}", text)
    text = re.sub(r"\b(\d)e(-?\d+)", r"\1 \\cdot 10^{\2}", text)
    text = re.sub(r"\^(-\d+)", r"^{\1}", text)
    text = re.sub(r"(?<![\\\w])([A-Za-z]\w*)(\*?)", lambda word: _word(*word.groups()), text)
    # in mathematics blanks vanish, but not in a word
    text = re.sub(r"(?<=[\w)}'|]) (\\text\w*\{)", r"\1 ", text)
    text = re.sub(r"(\\text\w*\{[^}]*)\} (?=[\w(|\\])", r"\1 }", text)
    bars = cycle((r"\lvert", r"\rvert"))
    text = re.sub(r"\|", lambda _: next(bars), text)
    return re.sub(r"(?<=[lr]vert)(?=[A-Za-z])", " ", text).replace("  ", " ")


def _with_braces(text: str) -> str:
    """Arguments of roots in braces, which LaTeX asks for."""
    found: list[str] = []
    roots: list[bool] = []  # whether each bracket that is open is that of a root
    for k, sign in enumerate(text):
        if sign == "(":
            roots.append(text[:k].endswith(("sqrt", "cbrt")))
            found.append("{" if roots[-1] else sign)
        elif sign == ")":
            found.append("}" if roots and roots.pop() else sign)
        else:
            found.append(sign)
    return "".join(found)


def _word(word: str, star: str = "") -> str:
    """A name, a letter, a symbol with its subscript, a differential, or a word."""
    if star:
        return rf"{{{_word(word)}^\ast}}"
    if word in _LATEX or len(word) == 1:
        return _LATEX.get(word, word)
    if symbol := _SYMBOL.fullmatch(word):
        below = symbol[2] or symbol[3]
        below = below if below.isdigit() else _word(below)
        return f"{_word(symbol[1])}_{below if len(below) == 1 else f'{{{below}}}'}"
    if word[0] == "d" and (word[1:] in _GREEK or re.fullmatch(r"[A-Za-z]\d?", word[1:])):
        return f"d{_word(word[1:])}"
    return rf"\texttt{{{word}}}" if "_" in word else rf"\text{{{word}}}"
