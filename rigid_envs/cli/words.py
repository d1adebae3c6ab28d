"""Words of the command line: hyperparameters, and what is refused."""

import ast
from pathlib import Path
from typing import Any

__all__ = ["config_of", "refuse", "refuse_missing_folder"]


def refuse_missing_folder(option: str, file: Path | None) -> None:
    """Refuse a file that could not be written.

    Raises:
        ValueError: its folder does not exist.
    """
    if file and not file.parent.is_dir():
        raise ValueError(f"{option} = {file}; expected a file in a folder that exists")


def refuse(rest: list[str]) -> None:
    """Refuse words that no option took.

    Raises:
        ValueError: there is one.
    """
    if rest:
        raise ValueError(f"argument = {rest[0]!r}; expected one of those that --help lists")


def config_of(words: list[str]) -> dict[str, Any]:
    """Hyperparameters from ``--key value`` or ``--key=value``.

    Raises:
        ValueError: a word that is neither.
    """
    config: dict[str, Any] = {}
    rest = list(words)
    while rest:
        word = rest.pop(0)
        key, equals, value = word.removeprefix("--").partition("=")
        if not word.startswith("--") or not key or not (equals or rest):
            raise ValueError(f"argument = {word!r}; expected --KEY VALUE")
        config[key] = _value(value if equals else rest.pop(0))
    return config


def _value(text: str) -> Any:
    """Number, pair, truth value or word."""
    try:
        return ast.literal_eval({"true": "True", "false": "False"}.get(text, text))
    except (ValueError, SyntaxError):
        return text
