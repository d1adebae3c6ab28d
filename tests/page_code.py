"""The code of a page of the documentation, run as a reader runs it: block after block."""

import re
import shlex
from pathlib import Path

from rigid_envs.tools.cli import main

DOCS = Path(__file__).parents[1] / "docs"


def run_page(name, **shorter):
    """Runs all blocks of docs/NAME in the current folder; the names that Python has then.

    Args:
        name: the page.
        **shorter: texts in the blocks, each of which stands there, and what is run in their place;
            a digit first is written with an underscore before it.
    """
    names = {}
    text = (DOCS / name).read_text(encoding="utf-8")
    for long, short in shorter.items():
        assert long.removeprefix("_") in text
        text = text.replace(long.removeprefix("_"), short)
    blocks = re.findall(r"^```(\w+)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    for language, code in blocks:
        if language == "python":
            exec(code, names)
        elif language == "bash":
            for line in code.splitlines():
                _run(shlex.split(line, comments=True))
    return names


def _run(words):
    if words[:2] != ["pip", "install"]:
        assert words[0] == "rigid-envs"
        assert main(words[1:]) == 0, words
