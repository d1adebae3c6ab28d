"""A document comes back as it was written; one that was changed, or is none, is refused by name."""

import json
from pathlib import Path
from typing import Any

import pytest

from rigid_envs.base.files import (
    DamagedFileError,
    checked_values,
    column,
    read_document,
    write_document,
)

FORMAT = "rigid-envs example 1"
VALUES = {"format": FORMAT, "n": 3, "costs": [0.1, None, 1e-17], "where": {"cpu": "a"}, "who": "me"}


def read(file: Path) -> dict[str, Any]:
    with read_document(file, FORMAT, 10_000, "write it anew") as document:
        return document


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "a.json"
    write_document(path, VALUES)
    return path


def test_a_document_is_read_as_it_was_written_and_written_as_it_was_read(file: Path) -> None:
    content, document = file.read_bytes(), read(file)
    assert {key: value for key, value in document.items() if key != "sha256"} == VALUES
    assert [line.partition(":")[0] for line in content.decode().splitlines()[1:-1]] == [
        f'"{key}"' for key in (*VALUES, "sha256")
    ]
    write_document(file, document)
    assert file.read_bytes() == content


@pytest.mark.parametrize("key", VALUES)
def test_no_entry_can_be_changed_taken_out_or_put_in(file: Path, key: str) -> None:
    document = json.loads(file.read_text())
    rest = {name: value for name, value in document.items() if name != key}
    for changed in (document | {key: "x"}, rest, document | {"more": 1}):
        file.write_text(json.dumps(changed))
        with pytest.raises(DamagedFileError, match=r"a\.json: (sha256|format) = .*anew$"):
            read(file)


HOSTILE = {
    "nothing": (b"", "Expecting value"),
    "no UTF-8": (b"\xff\xfe{}", "codec can't decode"),
    "no object": (b"[1]", r"content = \[1\]; expected a JSON object"),
    "NaN": (b'{"a": NaN}', "NaN: expected finite numbers"),
    "infinity": (b'{"a": -Infinity}', "-Infinity: expected finite"),
    "too large a number": (b'{"a": 1e999}', "1e999: expected finite"),
    "too long a number": (b'{"a": ' + b"9" * 9000 + b"}", "digits"),
    "a key twice": (b'{"a": 1, "b": 2, "a": 1}', "'a' is there twice"),
    "deep": (b"[" * 9000, "nested too deeply"),
    "deep, closed": (b'{"a":' * 900 + b"1" + b"}" * 900, "nested too deeply|format = None"),
    "without a format": (b"{}", "format = None; expected 'rigid-envs example 1'"),
    "of another format": (b'{"format": "other 1"}', "format = 'other 1'; expected"),
    "without a digest": (b'{"format": "rigid-envs example 1"}', "no sha256; expected one"),
    "large": (b" " * 10_001, "10001 bytes; expected at most 10000"),
}


@pytest.mark.parametrize("kind", HOSTILE)
def test_what_is_no_document_is_refused_by_name(file: Path, kind: str) -> None:
    content, message = HOSTILE[kind]
    file.write_bytes(content)
    with pytest.raises(DamagedFileError, match=rf"a\.json: .*({message})"):
        read(file)


def test_what_goes_wrong_while_a_document_is_taken_apart_names_the_file(file: Path) -> None:
    wrong: list[Any] = [lambda d: d["x"], lambda d: d["n"][0], lambda d: d["who"].x,
                        lambda d: 1 / 0, lambda d: d["costs"][9],
                        lambda d: float(d["who"])]  # fmt: skip
    for take in wrong:
        with (
            pytest.raises(DamagedFileError, match=r"a\.json: .*; write it anew$"),
            read_document(file, FORMAT, 10_000, "write it anew") as document,
        ):
            take(document)


def test_a_boolean_is_no_number_and_text_is_one_line_that_can_be_printed() -> None:
    wrong: list[Any] = [(True, int), (1, bool), (1.0, int), (None, str), ([], dict),
                        (1, str | None), ([], {"b": int})]  # fmt: skip
    for value, kind in wrong:
        with pytest.raises(ValueError, match=r"a = .*; expected a value of type"):
            checked_values({"a": value}, {"a": kind})
    assert checked_values({"a": None, "b": 1}, {"a": float | None}) == {"a": None}
    inside = {"a": {"b": 1, "c": 2}}
    assert checked_values(inside, {"a": {"b": int}}) == inside
    with pytest.raises(ValueError, match=r"b = 1; expected a value of type str"):
        checked_values(inside, {"a": {"b": str}})
    with pytest.raises(KeyError, match="d"):
        checked_values(inside, {"a": {"d": int}})
    with pytest.raises(ValueError, match="can be printed"):
        checked_values({"a": {"b": "\x1b[2J"}}, {"a": dict})


@pytest.mark.parametrize("values", [[], 3, "12", ["1"], [True], [[1.0]], [[1], [1, 2]], [10**400]])
def test_what_is_no_list_of_numbers_is_refused(values: Any) -> None:
    with pytest.raises(ValueError, match="costs"):
        column(values, "costs")
