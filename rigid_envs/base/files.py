"""Files: atomic writes, bounded reads, JSON, documents under a digest, arrays by name."""

import errno
import hashlib
import io
import json
import math
import os
import re
import stat
import zipfile
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any, get_args

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from rigid_envs.base.checks import Array, printable, real_numbers, require, safe_repr

# Atomic writes, reads of bounded size, and JSON with one meaning.

_SUFFIX = ".tmp"
# Of folders: Windows, or a folder that may be written and not read, does not open them (EACCES);
# some network file systems do not sync them.
_CANNOT_SYNC = (errno.EACCES, errno.EBADF, errno.EINVAL, errno.ENOTSUP)
_MISFITS = (LookupError, TypeError, AttributeError, ValueError, ArithmeticError, RecursionError)
_LONGEST = 300  # characters of what a message says is wrong


class DamagedFileError(ValueError):
    """A file is not what it should be: cut, changed, of another kind, or too large."""


def write_atomic(path: Path, data: bytes | str) -> None:
    """Replace a file at once: a reader, or a restart after a crash, sees the old or the new one.

    Written beside it, synced to the disk, renamed over it, and the folder synced, in this order.

    Args:
        path: The file; its folder exists.
        data: Its new content; text is written as UTF-8.

    Raises:
        OSError: Nothing was replaced; the message says how many bytes were needed. Or the file was
            replaced, and `sync_folder` failed.
    """
    data = data.encode() if isinstance(data, str) else data
    # a name that no other thread, process or machine has
    temporary = path.with_name(f".{path.name}.{os.urandom(8).hex()}{_SUFFIX}")
    try:
        with open(temporary, "xb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except OSError as error:
        with suppress(OSError):
            temporary.unlink()
        reason = os.strerror(error.errno or errno.EIO)
        raise OSError(
            error.errno,
            f"could not write {len(data)} bytes ({reason}); what was there before is untouched",
            str(path),
        ) from error
    sync_folder(path.parent)


def sync_folder(folder: Path) -> None:
    """Write the directory entries of a folder to the disk (fsync), on systems that can.

    Raises:
        OSError: The disk failed; the names in the folder are new, but may not outlast a crash.
    """
    try:
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
    except OSError as error:
        if error.errno in _CANNOT_SYNC:
            return
        reason = os.strerror(error.errno or errno.EIO)
        raise OSError(
            error.errno,
            f"could not sync a folder ({reason}); what was written there last is in place, but a "
            "crash of the machine may undo it",
            str(folder),
        ) from error


def sweep(folder: Path) -> None:
    """Remove the temporary files of interrupted writes in a folder and below.

    Args:
        folder: A folder that this process alone writes to.
    """
    for leftover in folder.rglob(f".*{_SUFFIX}"):
        leftover.unlink()


def read_bytes(path: Path, limit: int) -> bytes:
    """The content of a regular file of bounded size.

    Args:
        path: Its path.
        limit: Largest size that makes sense [bytes].

    Raises:
        DamagedFileError: No regular file (a pipe would never end), or larger than the limit.
        FileNotFoundError: No file.
    """
    status = path.stat()
    if not stat.S_ISREG(status.st_mode):
        raise DamagedFileError(f"{path}: not a regular file")
    if status.st_size > limit:
        raise DamagedFileError(f"{path}: {status.st_size} bytes; expected at most {limit}")
    return path.read_bytes()


@contextmanager
def named_damage(path: Path, mend: str = "") -> Iterator[None]:
    """Errors of taking the content of a file apart become one that names the file.

    Args:
        path: The file.
        mend: How to get a good one.

    Raises:
        DamagedFileError: In place of what content of another shape, kind or size raises.
    """
    try:
        yield
    except DamagedFileError as error:  # which has a name already
        raise DamagedFileError(f"{error}{mend and '; '}{mend}") from error
    except _MISFITS as error:
        why = f"no {error}" if isinstance(error, KeyError) else str(error)
        raise DamagedFileError(f"{path}: {why[:_LONGEST]}{mend and '; '}{mend}") from error


def parse_json(data: bytes) -> Any:
    """The value of JSON in UTF-8, of which every reader has the same idea.

    Raises:
        ValueError: Something else, a key given twice, NaN, a number beyond those of doubles, or
            lists in lists without end.
    """
    try:
        return json.loads(
            data.decode(), object_pairs_hook=_once_each, parse_constant=_finite, parse_float=_finite
        )
    except RecursionError:
        raise ValueError("lists or objects are nested too deeply") from None


def _once_each(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"{twice!r:.100} is there twice; expected each name once")
    return found


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"{text:.100}: expected finite numbers")
    return value


def read_json(path: Path, limit: int) -> Any:
    """The value of a JSON file of bounded size.

    Args:
        path: Its path.
        limit: Largest size that makes sense [bytes].

    Raises:
        DamagedFileError: As `read_bytes`, or what `parse_json` refuses.
        FileNotFoundError: No file.
    """
    with named_damage(path):
        return parse_json(read_bytes(path, limit))


def digest(document: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]] | None = None) -> str:
    """SHA-256 of JSON values and arrays; neither order of keys nor layout in memory has an effect.

    Args:
        document: JSON values.
        arrays: Arrays of numbers by name.
    """
    found = hashlib.sha256(canonical_json(document).encode())
    for name, array in sorted((arrays or {}).items()):
        found.update(f"\0{name}\0{array.dtype.str}\0{array.shape}\0".encode())
        found.update(array.tobytes())
    return found.hexdigest()


def file_digest(path: Path) -> str:
    """SHA-256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def canonical_json(value: Mapping[str, Any], indent: int | None = None) -> str:
    """JSON of one spelling: keys sorted, ASCII, no NaN; equal content gives equal bytes.

    Args:
        value: JSON values.
        indent: Spaces for each level; None writes one line.
    """
    separators = (",", ":") if indent is None else (",", ": ")
    return json.dumps(value, sort_keys=True, allow_nan=False, separators=separators, indent=indent)


def lined_json(value: Mapping[str, Any]) -> str:
    """JSON with one line for each key, in their order, and without NaN.

    Args:
        value: JSON values.
    """
    lines = (f'"{key}": {json.dumps(each, allow_nan=False)}' for key, each in value.items())
    return "{\n" + ",\n".join(lines) + "\n}\n"


# JSON documents in files: one line for each key, the format first, a digest of all the rest last.
#
# A document that was changed is refused, whichever key it was: who reads one has only to ask
# whether its values make sense, inside `read_document`.

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


# Arrays by name in a NumPy archive (.npz), written at once and read without trust.
#
# What is read is numbers and booleans only: nothing in a file can name code (no pickle), and no
# array takes more memory than its header says, nor all of them more than a limit.

_LIMIT = 256 * 2**20  # bytes of a file, and of what is in it
_MOST = 50_000  # arrays in a file: to list many more takes seconds
_ENTRY = b"PK\x01\x02"  # how each one of them is listed
_NPY = ".npy"
_PACKINGS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # others may unpack more than is asked for


def write_arrays(path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write arrays of numbers, atomically. Equal content gives equal bytes.

    Args:
        path: The file; its folder exists.
        arrays: Arrays of numbers or booleans by name.

    Raises:
        ValueError: More than can be read again.
        OSError: As `write_atomic`.
    """
    size, buffer = sum(array.nbytes for array in arrays.values()), io.BytesIO()
    if len(arrays) <= _MOST and size <= _LIMIT:
        named: dict[str, Any] = dict(arrays)
        np.savez_compressed(buffer, **named)
        size = buffer.tell()  # more than is in it where nothing can be packed
    if len(arrays) > _MOST or size > _LIMIT:
        raise ValueError(f"{len(arrays)} arrays of {size} bytes; expected at most {_MOST} of "
                         f"{_LIMIT}: write several files")  # fmt: skip
    write_atomic(path, buffer.getvalue())


def read_arrays(
    path: Path, limit: int = _LIMIT, names: Collection[str] | None = None
) -> dict[str, NDArray[Any]]:
    """Read what `write_arrays` or `numpy.savez` wrote.

    Args:
        path: The file.
        limit: Largest size of the arrays that makes sense [bytes].
        names: Of the arrays, which must be there and no others; None takes all there are.

    Raises:
        DamagedFileError: Anything but an archive of arrays of numbers, or one that is too large.
        FileNotFoundError: There is no such file.
    """
    data = read_bytes(path, limit)
    if data.count(_ENTRY) > _MOST:
        raise DamagedFileError(f"{path}: more than {_MOST} arrays")
    try:
        return _arrays(data, limit, names)
    except Exception as error:  # zipfile, what unpacks and NumPy raise many kinds of wrong bytes
        raise DamagedFileError(f"{path}: not a whole .npz archive: {error!r:.200}") from error


def _arrays(data: bytes, limit: int, names: Collection[str] | None) -> dict[str, NDArray[Any]]:
    """The arrays, none of which takes more memory than is left of the limit."""
    found: dict[str, NDArray[Any]] = {}
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = {each.filename.removesuffix(_NPY): each for each in archive.infolist()}
        if len(members) < len(archive.infolist()):
            raise ValueError("two arrays of one name; expected each once")
        if names is not None and members.keys() != set(names):
            raise ValueError(f"arrays = {sorted(members)}; expected {sorted(names)}")
        for name, member in members.items():
            if member.compress_type not in _PACKINGS:
                raise ValueError(f"{name}: packed in a way that NumPy does not read or write")
            with archive.open(member) as stream:
                found[name] = _array(stream, limit)
            limit -= found[name].nbytes
    return found


def _array(stream: IO[bytes], limit: int) -> NDArray[Any]:
    """One array, of the bytes that its header says and of no others."""
    version = npy.read_magic(stream)
    if version != (1, 0):
        raise ValueError(f"npy version = {version}; expected (1, 0)")
    shape, by_column, dtype = npy.read_array_header_1_0(stream)
    if dtype.kind not in "biuf":
        raise ValueError(f"dtype = {dtype}; expected numbers or booleans")
    size = dtype.itemsize * math.prod(shape)
    if size > limit:
        raise ValueError(f"shape = {shape}: {size} bytes unpacked; expected at most {limit}")
    content = stream.read(size + 1)
    if len(content) != size:
        raise ValueError(f"{len(content)} bytes; expected {size} for shape {shape}")
    numbers = np.frombuffer(bytearray(content), dtype)  # which can be written to
    return numbers.reshape(shape, order="F" if by_column else "C")


# One file that holds named arrays and a JSON document, checked to the bit, and runs no code.
#
# The format is safetensors, which any tool of that name reads: the length of the header (8 bytes,
# little-endian), the header (JSON: dtype, shape and place of each array), and the numbers. The one
# metadata entry, `rigid-envs`, is JSON: {"document": ..., "sha256": of the document and of every
# array}. One file and not two, because two cannot be replaced at the same instant.
#
# Source: https://github.com/huggingface/safetensors, section "Format".

_METADATA = "rigid-envs"
_HEADER_LIMIT = 16 * 2**20
_MOST_AXES = 32  # to multiply very many lengths takes long
_KINDS = {
    "BOOL": "|b1",
    **{f"U{8 * size}": f"{'|' if size == 1 else '<'}u{size}" for size in (1, 2, 4, 8)},
    **{f"I{8 * size}": f"{'|' if size == 1 else '<'}i{size}" for size in (1, 2, 4, 8)},
    **{f"F{8 * size}": f"<f{size}" for size in (2, 4, 8)},
}
_NAMES = {kind: name for name, kind in _KINDS.items()}


def save_tensors(path: Path, arrays: Mapping[str, NDArray[Any]], document: dict[str, Any]) -> None:
    """Write arrays and a document, atomically. Equal content gives equal bytes.

    Args:
        path: File to write.
        arrays: Arrays of numbers or booleans by name.
        document: JSON values.
    """
    solid = {name: np.ascontiguousarray(a).reshape(a.shape) for name, a in arrays.items()}
    header: dict[str, Any] = {
        "__metadata__": {
            _METADATA: canonical_json({"document": document, "sha256": digest(document, solid)})
        }
    }
    parts, end = [], 0
    for name in sorted(solid, key=lambda name: (-solid[name].itemsize, name)):  # all are aligned
        array, begin = solid[name], end
        end += array.nbytes
        header[name] = {
            "dtype": _NAMES[array.dtype.str],
            "shape": list(array.shape),
            "data_offsets": [begin, end],
        }
        parts.append(array.tobytes())
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    write_atomic(path, b"".join([len(text).to_bytes(8, "little"), text, *parts]))


def load_tensors(path: Path, limit: int) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Read what `save_tensors` wrote.

    Args:
        path: File to read.
        limit: Largest size of file that makes sense [bytes].

    Returns:
        The arrays, writable, and the document.

    Raises:
        DamagedFileError: Anything but that; the message names the file and what is wrong with it.
        FileNotFoundError: There is no such file.
    """
    data = read_bytes(path, limit)
    with named_damage(path, "not a file of this program"):
        header, numbers = _header(data)
        entry = parse_json(header.pop("__metadata__")[_METADATA].encode())
        document = entry["document"]
        arrays = _tensors(header, numbers)
        whole = isinstance(document, dict) and entry["sha256"] == digest(document, arrays)
    if not whole:
        raise DamagedFileError(f"{path}: content does not match its checksum; the file is damaged")
    return arrays, document


def _header(data: bytes) -> tuple[dict[str, Any], memoryview]:
    """The header, and the numbers behind it."""
    length = int.from_bytes(data[:8], "little")
    most = min(len(data) - 8, _HEADER_LIMIT)
    if length > most:
        raise ValueError(f"header length = {length}; expected at most {most} bytes")
    return parse_json(data[8 : 8 + length]), memoryview(data)[8 + length :]


def _tensors(header: Mapping[str, Any], numbers: memoryview) -> dict[str, NDArray[Any]]:
    """The arrays, which follow each other without gap and fill the file."""
    arrays, end = {}, 0
    for name, place in sorted(header.items(), key=lambda item: tuple(item[1]["data_offsets"])):
        kind, shape = np.dtype(_KINDS[place["dtype"]]), place["shape"]
        begin, stop = ends = place["data_offsets"]
        if len(shape) > _MOST_AXES or any(type(n) is not int or n < 0 for n in (*shape, *ends)):
            raise ValueError(f"{name}: expected integers from 0, found {place!r:.100}")
        if begin != end or stop - begin != math.prod(shape) * kind.itemsize or stop > len(numbers):
            raise ValueError(f"{name}: expected {shape} numbers from {end}, found {place!r:.100}")
        arrays[name] = np.frombuffer(numbers[begin:stop], dtype=kind).reshape(shape).copy()
        end = stop
    if end != len(numbers):
        raise ValueError(f"{len(numbers)} bytes of numbers; expected {end}")
    return arrays


# Text for Markdown, LaTeX and plots: tables, and what comes from a file shown letter by letter.


def in_markdown(text: str) -> str:
    """A text as a cell of a table: no markup, no link, no HTML, and no end of the cell.

    Args:
        text: One line; it may come from a file.
    """
    return re.sub(r"[\\`*\[\]<>|&~$:]", r"\\\g<0>", text)


def in_plot(text: str) -> str:
    """A text as a label of matplotlib: no formula, which could have errors.

    Args:
        text: One line; it may come from a file.
    """
    return text.replace("$", r"\$")


_OF_LATEX = {sign: rf"\{sign}" for sign in "&%$#_{}"} | {sign: f"${sign}$" for sign in "<>|"}
_OF_LATEX |= {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"}


def in_latex(text: str) -> str:
    """A text in LaTeX: nothing in it is a command.

    Args:
        text: One line; it may come from a file.
    """
    return "".join(_OF_LATEX.get(sign, sign) for sign in text)


def latex_table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of LaTeX's package booktabs: words in the first column, numbers in the others.

    Args:
        header: Titles of the columns, plain text.
        rows: Cells, plain text, one sequence for each row.
    """
    titles, *lines = (
        re.sub(r"(?<!\w)-(?=\d)", "$-$", " & ".join(map(in_latex, row))) + r" \\"
        for row in (header, *rows)
    )
    top = [f"\\begin{{tabular}}{{l{'r' * (len(header) - 1)}}}", r"\toprule"]
    return "\n".join([*top, titles, r"\midrule", *lines, r"\bottomrule", r"\end{tabular}"])


def markdown_table(header: Sequence[str], rows: Iterable[Sequence[str]], align: str) -> str:
    """A table in the dialect of GitHub.

    Args:
        header: Titles of the columns.
        rows: Cells, in Markdown, one sequence for each row.
        align: For each column "<" of words or ">" of numbers.
    """
    rules = [{"<": "---", ">": "---:"}[side] for side in align]
    return "\n".join(f"| {' | '.join(row)} |" for row in (header, rules, *rows))
