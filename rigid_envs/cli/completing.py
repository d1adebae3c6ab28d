"""Completion of the command in a shell: `rigid-envs completion SHELL`."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import Any

from gymnasium.error import DependencyNotInstalled

from rigid_envs import ENVIRONMENTS
from rigid_envs.cli.words import refuse

__all__ = ["add_completion"]

_SHELLS = ("bash", "zsh", "tcsh")
_FUNCTION = "_rigid_envs_ids"


def add_completion(verbs: Any, parser: argparse.ArgumentParser) -> None:
    """Add the verb `completion`.

    Args:
        verbs: Subparsers of the command.
        parser: Parser of the whole command.
    """
    completing = verbs.add_parser(
        "completion",
        help="a script that lets a shell complete verbs, options and ids",
        description="Print a completion script. For bash: "
        "rigid-envs completion bash > ~/.local/share/bash-completion/completions/rigid-envs",
        allow_abbrev=False,
    )
    completing.add_argument("shell", choices=_SHELLS)
    completing.set_defaults(act=lambda options, rest: _complete(options.shell, rest, parser))


def _complete(shell: str, rest: list[str], parser: argparse.ArgumentParser) -> None:
    refuse(rest)
    try:
        import shtab
    except ImportError:
        raise DependencyNotInstalled(
            'completion needs shtab: pip install "rigid-envs[completion]"'
        ) from None
    ids = " ".join(
        sorted({env_id.rpartition("/")[2].rpartition("-v")[0] for env_id in ENVIRONMENTS})
    )
    for action in _actions(parser):
        if action.metavar == "ID":
            ways: Any = action
            ways.complete = {"bash": _FUNCTION, "zsh": f"({ids})", "tcsh": f"p/*/({ids})/"}
    # its type is said to be that for one shell
    names: Any = {"bash": f'{_FUNCTION}() {{ compgen -W "{ids}" -- "$1"; }}'}
    print(shtab.complete(parser, shell, preamble=names))


def _actions(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """All arguments and options of a parser and its subparsers."""
    for action in parser._actions:
        yield action
        if isinstance(action, argparse._SubParsersAction):
            for part in action.choices.values():
                yield from _actions(part)
