"""Words of the command line: arguments, progress."""

from __future__ import annotations

import argparse
import ast
import difflib
import importlib
import inspect
import logging
import os
import re
import signal
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

from gymnasium.error import DependencyNotInstalled

from rigid_envs import __version__
from rigid_envs.base.checks import UnknownKeywordError, one_named, require, shown
from rigid_envs.envs.lookup import checked_id

# Progress of a command on the terminal.


class _Pace:
    """Which lines are due where none can be written over.

    One after 10 s, then ever more seldom; after one of them also the last that is told.
    """

    _LEAST, _SHARE = 10.0, 0.1  # [s], and of the time since the beginning

    def __init__(self) -> None:
        self.begin()

    def begin(self) -> None:
        self._begin = self._last = time.monotonic()
        self._kept: str | None = None  # told since the last line; None where there was no line

    def due(self, what: str) -> str:
        """The line to print when this is told; empty for none."""
        now, kept = time.monotonic(), self._kept
        if not what:
            self._kept = None
            return kept or ""
        if now - self._last >= max(self._LEAST, self._SHARE * (now - self._begin)):
            self._last, self._kept = now, ""
            return what
        self._kept = None if kept is None else what
        return ""


_pace = _Pace()


class _Messages(logging.Handler):
    """Prints what is logged on the standard error of the moment, where progress stood."""

    def emit(self, record: logging.LogRecord) -> None:
        say(f"rigid-envs: {record.getMessage()}")


@contextmanager
def messages() -> Iterator[None]:
    """Print what the package logs, such as what it compiles; every command runs in it."""
    _pace.begin()
    logger, handler = logging.getLogger("rigid_envs"), _Messages()
    before = logger.level
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    try:
        yield
    finally:
        logger.removeHandler(handler)
        logger.setLevel(before)


def tell(what: str) -> None:
    """Show progress on standard error.

    On a terminal it is one line, in place of the line before. Elsewhere it is a line now and then,
    and in the end how far it has come.

    Args:
        what: a few words; an empty text ends it, and clears the line.
    """
    if sys.stderr.isatty():
        print(f"\r\x1b[K{what}", end="", file=sys.stderr, flush=True)
    elif line := _pace.due(what):
        print(line, file=sys.stderr, flush=True)


def say(line: str, file: TextIO | None = None) -> None:
    """Print a line that stays, in place of progress.

    Args:
        line: the line.
        file: where to; None is standard error.
    """
    if sys.stderr.isatty():
        tell("")
    print(line, file=file or sys.stderr, flush=True)


# Commands and their verbs: how they are added, called and answered for.

_FAILURES: tuple[type[Exception], ...] = (DependencyNotInstalled, ImportError, OSError)


def parser_of(prog: str, description: str, *verbs: Verb) -> argparse.ArgumentParser:
    """The parser of a command, whose default `verbs` has the parser of each verb by its name."""
    parser = argparse.ArgumentParser(prog=prog, description=description, allow_abbrev=False)
    parser.add_argument("--version", action="version", version=f"rigid-envs {__version__}")
    several = parser.add_subparsers(metavar="VERB", required=True)
    for each in verbs:
        each.add(several)
    parser.set_defaults(verbs=several.choices)
    return parser


def answer(
    parser: argparse.ArgumentParser,
    words: Sequence[str] | None,
    mistakes: tuple[type[Exception], ...] = (ValueError,),
    failures: tuple[type[Exception], ...] = (),
) -> int:
    """Do what the words of a command line say.

    Args:
        parser: Of the command, see `parser_of`.
        words: None takes those of the process.
        mistakes: Errors of the user, which are told in a line.
        failures: Other errors that are told in a line, beside those of files and missing packages.

    Returns:
        Exit status: that of the verb; 1 for a failure, 2 for a mistake, 130 after Ctrl-C.
    """
    words, verbs = sys.argv[1:] if words is None else words, parser.get_default("verbs")
    status = 0
    try:
        if words and not words[0].startswith("-"):
            one_named(words[0], verbs, "VERB")
        options, rest = parser.parse_known_args(words)
        options.rest = rest
        with messages():
            refuse([] if options.takes_rest else rest)
            for module in options.allow_import:
                importlib.import_module(module)
            status = options.act(options) or 0
        sys.stdout.flush()
    except BrokenPipeError:  # the reader, `head` perhaps, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except mistakes + failures + _FAILURES as error:
        text = shown(str(error))
        if isinstance(error, OSError) and error.filename is not None:
            text = shown(f"{error.filename}: {error.strerror}")
        if isinstance(error, UnknownKeywordError) and "did you mean" not in text:
            text += _nearest(options.rest, options.verb.format_help())
        say(f"{parser.prog.rpartition(' ')[2]}: {text}")
        return 2 if isinstance(error, mistakes) else 1
    except KeyboardInterrupt:
        tell("")
        return 128 + signal.SIGINT
    return status


def _nearest(rest: Sequence[str], told: str) -> str:
    """Which option, of those that a help tells, the words that none took may mean; or nothing."""
    known = re.findall(r"^ .*?(--[\w-]+)", told, re.MULTILINE)
    for word in rest:
        for near in difflib.get_close_matches(word.partition("=")[0], known, cutoff=0.7):
            return f": did you mean {near}?"
    return ""


Act = Callable[[argparse.Namespace], int | None]
"""What a verb does with its options; its value is the exit status, None for 0."""

Option = Callable[[argparse.ArgumentParser], object]
"""Adds an option, an argument or several to the parser of a verb."""


def option(*names: str, **settings: Any) -> Option:
    """An option or argument of a verb, as `argparse` takes it."""
    return lambda parser: parser.add_argument(*names, **settings)


_IMPORTS = option(
    "--allow-import",
    metavar="MODULE",
    action="append",
    default=[],
    help="import a module first, which may register environments of its own",
)
"""Of every verb: nothing is imported because a file says so."""


def imports_of(options: argparse.Namespace) -> str:
    """The options of a command that has to import what this one did, with a space before each."""
    return "".join(f" --allow-import {module}" for module in options.allow_import)


IDS = option("--ids", nargs="+", metavar="ID", help="these environments only")
"""Of a verb that is for all environments."""


def checked_ids(names: Iterable[str]) -> list[str]:
    """The ids in full that some names stand for, each once.

    Raises:
        ConfigError: one that is not registered.
    """
    return list(dict.fromkeys(map(checked_id, names)))


@dataclass(frozen=True)
class Verb:
    """A verb of a command.

    Attributes:
        act: Has the name of the verb. The first line of its docstring is the help, what follows the
            description.
        options: In the order of the help.
        usage: Of a verb that takes further words too, as `options.rest`; None is that of argparse.
    """

    act: Act
    options: tuple[Option, ...]
    usage: str | None

    def add(self, verbs: Any) -> None:
        """Add it to the verbs of a command."""
        summary, _, description = inspect.cleandoc(self.act.__doc__ or "").partition("\n\n")
        parser: argparse.ArgumentParser = verbs.add_parser(
            self.act.__name__.strip("_"),
            help=summary[:1].lower() + summary[1:].removesuffix("."),
            description=description or None,
            usage=self.usage,
            allow_abbrev=False,
        )
        parser.set_defaults(act=self.act, verb=parser, takes_rest=self.usage is not None)
        for each in (*self.options, _IMPORTS):
            each(parser)


def verb(*options: Option, usage: str | None = None) -> Callable[[Act], Verb]:
    """Decorator that makes a verb of what it does; see `Verb`."""
    return lambda act: Verb(act, options, usage)


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
        UnknownKeywordError: there is one.
    """
    if rest:
        expected = "one of those that --help lists"
        raise UnknownKeywordError(f"argument = {rest[0]!r}; expected {expected}")


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
        known = word.startswith("--") and key and (equals or rest)
        require(bool(known), word, "argument", "--KEY VALUE")
        config[key] = _value(value if equals else rest.pop(0))
    return config


def _value(text: str) -> Any:
    """Number, pair, truth value or word."""
    try:
        return ast.literal_eval({"true": "True", "false": "False"}.get(text, text))
    except (ValueError, SyntaxError):
        return text
