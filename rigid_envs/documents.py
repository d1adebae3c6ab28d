"""JSON documents in files: one line for each key, the format first, a digest of all the rest last.

A document that was changed is refused, whichever key it was: who reads one has only to ask whether
its values make sense, inside `read_document`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, get_args

from rigid_envs.checks import Array, printable, real_numbers, require, safe_repr
from rigid_envs.files import digest, lined_json, named_damage, read_json, write_atomic

__all__ = ["checked_values", "column", "opened", "read_document", "sealed", "write_document"]

_SEAL = "sha256"


def sealed(values: Mapping[str, Any]) -> dict[str, Any]:
    """JSON values with the digest of all of them, in place of one that they had.

    Args:
        values: JSON values, "format" the first of them.
    """
    content = {key: value for key, value in values.items() if key != _SEAL}
    return {**content, _SEAL: digest(content)}


def opened(document: Any, known: str) -> dict[str, Any]:
    """A document, found to be what `sealed` made.

    Args:
        document: A value of JSON.
        known: The format that it must have.

    Raises:
        ValueError: No document, one of another format, without a digest, or changed since.
    """
    if not isinstance(document, dict):
        raise ValueError(f"content = {safe_repr(document)}; expected a JSON object")
    require(document.get("format") == known, document.get("format"), "format", repr(known))
    if _SEAL not in document:
        raise ValueError(f"no {_SEAL}; expected one, without which changes pass unseen")
    now = sealed(document)[_SEAL]
    require(document[_SEAL] == now, document[_SEAL], _SEAL, f"{now!r}: the content was changed")
    return document


def write_document(file: Path, values: Mapping[str, Any]) -> None:
    """Write a document, atomically; equal values give an equal file.

    Args:
        file: Its path.
        values: See `sealed`.
    """
    write_atomic(file, lined_json(sealed(values)))


@contextmanager
def read_document(file: Path, known: str, limit: int, mend: str) -> Iterator[dict[str, Any]]:
    """The document in a file, to be taken apart inside: what goes wrong there names the file too.

    Args:
        file: Its path.
        known: The format that it must have.
        limit: Largest size that makes sense [bytes].
        mend: How to get a good one.

    Raises:
        DamagedFileError: As `opened`; or a value that is not there, or not what it must be.
        FileNotFoundError: No file.
    """
    with named_damage(file, mend):
        yield opened(read_json(file, limit), known)


def checked_values(values: Mapping[str, Any], kinds: Mapping[str, Any]) -> dict[str, Any]:
    """The values of some keys, each of its kind, with text that can be printed.

    Args:
        values: JSON values.
        kinds: Types by key, ``str`` or ``int | None``; a boolean is no number. Or the types of
            entries of an entry, likewise.

    Raises:
        KeyError: A key that is not there.
        ValueError: A value of another kind, or text that cannot be printed.
    """
    for name, inside in kinds.items():
        kind, parts = (dict, inside) if isinstance(inside, Mapping) else (inside, {})
        ok = type(values[name]) in (get_args(kind) or (kind,))
        require(ok, values[name], name, f"a value of type {getattr(kind, '__name__', kind)}")
        checked_values(values[name], parts)
    return {name: printable(values[name], name) for name in kinds}


def column(values: Any, name: str) -> Array:
    """A list of at least one number as float64, shape (n,); None becomes NaN.

    Raises:
        ValueError: Something else.
    """
    require(isinstance(values, list) and len(values) > 0, values, name, "a list of numbers")
    found = real_numbers([math.nan if value is None else value for value in values], name)
    require(found.ndim == 1, values, name, "a list of numbers")
    return found
