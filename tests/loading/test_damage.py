"""Damage of a file is named or harmless: what is read is what was written, for every kind of file.

Also of what was changed on purpose, with a digest to match: wrong types and counts are refused.
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rigid_envs.base.checks import ConfigError
from rigid_envs.base.files import DamagedFileError, lined_json, sealed
from tests.loading.readers import READERS, Reader

KEPT = [kind for kind in READERS if kind != "config"]  # which people write by hand: no digest
DOCUMENTS = [kind for kind in KEPT if READERS[kind].name.endswith(".json")]
OTHERS: list[Any] = [None, 3, -1, 0.5, True, "x", "\x1b[2J", [], [1], [None], ["x"], [[1], [2]], {},
                     {"a": 1}, {"a": {}}, 10**400, [10**400]]  # fmt: skip


def content(value: Any) -> Any:
    """What was read, in a form that can be compared."""
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tobytes()
    if isinstance(value, dict):
        return {name: content(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [content(each) for each in value]
    if hasattr(value, "document"):  # a policy
        return content([value.document, value.arrays])
    return content(vars(value)) if hasattr(value, "__dict__") else repr(value)


def damaged(good: bytes, flips: int, cuts: int) -> Iterator[bytes]:
    """Versions of a file with one bit flipped, then such that are cut off."""
    rng = np.random.default_rng(0)
    for k in rng.integers(8 * len(good), size=flips).tolist():
        data = bytearray(good)
        data[k // 8] ^= 1 << k % 8
        yield bytes(data)
    for length in rng.integers(len(good), size=cuts).tolist():
        yield good[:length]


def n_refused(reader: Reader, path: Path, flips: int, cuts: int) -> int:
    """How many are refused, by name; all others are read as if nothing were changed."""
    reader.write(path)
    good, before, refused = path.read_bytes(), content(reader.read(path)), 0
    for data in damaged(good, flips, cuts):
        path.write_bytes(data)
        try:
            assert content(reader.read(path)) == before
        except (DamagedFileError, ConfigError) as error:
            assert str(path) in str(error)
            refused += 1
    return refused


@pytest.mark.parametrize("flips", [40, pytest.param(300, marks=pytest.mark.long)])
@pytest.mark.parametrize("kind", KEPT)
def test_damage_is_named_or_harmless(kind: str, tmp_path: Path, flips: int) -> None:
    assert n_refused(READERS[kind], tmp_path / READERS[kind].name, flips, flips // 2) >= flips


def changes(document: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """A document with an entry left out, or of another kind; also entries of its entries."""
    for key, value in document.items():
        yield {name: each for name, each in document.items() if name != key}
        for other in OTHERS:
            yield document | {key: other}
        for change in changes(value) if isinstance(value, dict) else ():
            yield document | {key: change}


def share_read(reader: Reader, path: Path, step: int) -> float:
    """Share of the changed documents that are read; all others are refused, by name."""
    reader.write(path)
    document = json.loads(path.read_text())
    chosen, read = [*changes(document)][::step], 0
    for changed in chosen:
        path.write_text(lined_json(sealed(changed)))
        try:
            str(reader.read(path))
            read += 1
        except (DamagedFileError, ConfigError) as error:
            assert str(path) in str(error)
    return read / len(chosen)


@pytest.mark.parametrize("step", [23, pytest.param(1, marks=pytest.mark.long)])
@pytest.mark.parametrize("kind", DOCUMENTS)
def test_entries_of_another_kind_are_refused_by_name_also_under_a_true_digest(
    kind: str, tmp_path: Path, step: int
) -> None:
    """Settings, versions and metrics can be anything, and are a part of what is changed here."""
    assert share_read(READERS[kind], tmp_path / READERS[kind].name, step) < 0.7
