"""Tensor files are whole or not there; what is damaged is said to be, and never runs."""

import json
import re
import time
from contextlib import nullcontext

import numpy as np
import pytest
import safetensors.numpy

from rigid_envs.base.files import DamagedFileError, load_tensors, save_tensors, sweep
from tests.agents.sessions import finish, start_writer

ARRAYS = {
    "weights": np.arange(12, dtype=np.float32).reshape(3, 4).T,
    "count": np.array(7, dtype=np.uint64),
    "mask": np.array([True, False]),
    "empty": np.zeros((0, 3)),
    "bytes": np.arange(5, dtype=np.uint8),
    **{kind: np.arange(3).astype(kind) for kind in np.typecodes["AllInteger"] + "efd"},
}
DOCUMENT = {"step": 3, "big": 2**200, "third": 1 / 3, "list": [None, True, "é"]}


@pytest.fixture
def path(tmp_path):
    """Of a good file."""
    save_tensors(tmp_path / "a.safetensors", ARRAYS, DOCUMENT)
    return tmp_path / "a.safetensors"


def test_arrays_and_document_come_back_to_the_bit_and_to_the_library_of_the_format(path):
    arrays, document = load_tensors(path, 10**6)
    assert document == DOCUMENT
    for found in (arrays, safetensors.numpy.load_file(path)):
        assert found.keys() == ARRAYS.keys()
        for name, array in ARRAYS.items():
            assert found[name].dtype == array.dtype
            np.testing.assert_array_equal(found[name], array)
    for array in arrays.values():
        array[...] = 0


def test_equal_content_gives_equal_bytes(tmp_path):
    one, two = tmp_path / "1", tmp_path / "2"
    save_tensors(one, ARRAYS, DOCUMENT)
    save_tensors(two, dict(reversed(ARRAYS.items())), dict(reversed(DOCUMENT.items())))
    assert one.read_bytes() == two.read_bytes()


def test_what_the_library_of_the_format_wrote_is_read(path):
    with safetensors.safe_open(path, "numpy") as file:
        metadata = file.metadata()
    solid = {name: array.copy(order="C") for name, array in ARRAYS.items()}
    safetensors.numpy.save_file(solid, path, metadata)
    arrays, document = load_tensors(path, 10**6)
    assert document == DOCUMENT
    for name, array in ARRAYS.items():
        np.testing.assert_array_equal(arrays[name], array)


def test_what_the_library_of_the_format_refuses_is_refused(path):
    good = path.read_bytes()
    rng = np.random.default_rng(3)
    refused = 0
    for _ in range(1000):
        data = bytearray(good)
        data[int(rng.integers(int.from_bytes(good[:8], "little")))] = int(rng.integers(32, 127))
        path.write_bytes(data)
        try:
            safetensors.numpy.load(bytes(data))
        except safetensors.SafetensorError:
            refused += 1
            with pytest.raises(DamagedFileError):
                load_tensors(path, 10**6)
    assert refused > 100


@pytest.mark.parametrize("kind", ["flip", "cut", "tail"])
def test_damage_is_named_or_harmless(path, kind):
    good = path.read_bytes()
    rng = np.random.default_rng(0)
    for _ in range(500):
        data = bytearray(good)
        place = int(rng.integers(len(data)))
        if kind == "flip":
            data[place] ^= 1 << int(rng.integers(8))
        elif kind == "cut":
            del data[place:]
        else:
            data += rng.bytes(place)
        path.write_bytes(data)
        with pytest.raises(DamagedFileError, match=r"a\.safetensors"):
            load_tensors(path, 10**6)


def header(text):
    return len(text).to_bytes(8, "little") + text.encode()


def rewritten(path, change):
    """A file with another header before the same numbers."""
    data = path.read_bytes()
    size = int.from_bytes(data[:8], "little")
    path.write_bytes(header(change(data[8 : 8 + size].decode())) + data[8 + size :])


HOSTILE = {
    "empty": b"",
    "short": b"\x02\x00",
    "no header": bytes(8),
    "length of the header beyond the file": (2**62).to_bytes(8, "little") + b"{}",
    "no metadata": header("{}"),
    "deep": header("[" * 100_000),
    "deep inside": header('{"__metadata__":{"rigid-envs":"' + "[" * 100_000 + '"}}'),
    "list": header("[]"),
    "pickle": b"\x80\x04\x8c\x05posix\x94\x8c\x06system\x94\x93\x94\x8c\x02id\x94\x85\x94R\x94.",
    "zip": b"PK\x03\x04" + b"\0" * 100,
    "huge tensor": header(
        '{"__metadata__":{"rigid-envs":"{\\"document\\":{},\\"sha256\\":\\"\\"}"},'
        '"a":{"dtype":"F64","shape":[100000000000],"data_offsets":[0,800000000000]}}'
    ),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_file_is_refused_at_once(tmp_path, name):
    path = tmp_path / "hostile"
    path.write_bytes(HOSTILE[name])
    begin = time.process_time()
    with pytest.raises(DamagedFileError, match="hostile"):
        load_tensors(path, 10**6)
    assert time.process_time() - begin < 1


@pytest.mark.parametrize("more", [0, 1])
def test_a_header_has_at_most_16_mebibytes(path, more):
    rewritten(path, lambda text: text.ljust(2**24 + more))
    with (
        pytest.raises(DamagedFileError, match="16777217; expected at most")
        if more
        else nullcontext()
    ):
        assert load_tensors(path, 2**25)[1] == DOCUMENT


def test_a_header_that_is_longer_than_the_file_is_told_by_its_length(tmp_path):
    (tmp_path / "a.safetensors").write_bytes((3).to_bytes(8, "little") + b"{}")
    with pytest.raises(DamagedFileError, match="header length = 3; expected at most 2 bytes"):
        load_tensors(tmp_path / "a.safetensors", 10**6)


@pytest.mark.parametrize("n_axes", [32, 33])
def test_an_array_has_at_most_32_axes(tmp_path, n_axes):
    path, array = tmp_path / "a.safetensors", np.ones((1,) * n_axes)
    save_tensors(path, {"a": array}, {})
    with (
        pytest.raises(DamagedFileError, match="expected integers") if n_axes > 32 else nullcontext()
    ):
        assert load_tensors(path, 10**6)[0]["a"].shape == array.shape


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"shape":[4,3]', '"shape":[3,4]'),
        ('"shape":[4,3]', '"shape":[12] '),
        ('"shape":[2]', '"shape":[1,2]'),
        ('"F32"', '"I32"'),
        ('"U64","shape":[]', '"I64","shape":[]'),
        ('"BOOL"', '"U8"'),
        ('"mask"', '"task"'),
    ],
)
def test_shapes_types_and_names_are_part_of_the_checksum(path, old, new):
    assert old.encode() in path.read_bytes()
    rewritten(path, lambda text: text.replace(old, new))  # the same numbers, read otherwise
    with pytest.raises(DamagedFileError, match="does not match its checksum"):
        load_tensors(path, 10**6)


@pytest.mark.parametrize(
    ("places", "numbers"),
    [
        ([[0, 8], [0, 8]], b"%b"),  # both arrays are the same bytes
        ([[0, 8], [12, 20]], b"%bgap-%b"),
        ([[4, 12], [12, 20]], b"gap-%b%b"),
        ([[0, 8], [8, 16]], b"%b%bmore"),
        ([[0, 8], [8, 12]], b"%b"),
        ([[0, 8], [8, 24]], b"%b%b%b"),
    ],
)
def test_arrays_follow_each_other_and_fill_the_file(tmp_path, places, numbers):
    """Also where the checksum is right, as whoever makes a file can compute it."""
    path, value = tmp_path / "a", np.array([0.5])
    save_tensors(path, {"a": value, "b": value}, {})
    data = path.read_bytes()
    content = json.loads(data[8:-16])
    for name, place in zip("ab", places, strict=True):
        content[name]["data_offsets"] = place
    path.write_bytes(header(json.dumps(content)) + numbers.replace(b"%b", value.tobytes()))
    with pytest.raises(DamagedFileError, match="not a file of this program"):
        load_tensors(path, 10**6)


@pytest.mark.parametrize("bad", [-1, True, 1.0, "1", None, [1]])
@pytest.mark.parametrize(("key", "place"), [("shape", 0), ("data_offsets", 0), ("data_offsets", 1)])
def test_sizes_and_places_of_arrays_are_whole_numbers_from_0(tmp_path, key, place, bad):
    path, value = tmp_path / "a", np.array([0.5])
    save_tensors(path, {"a": value}, {})
    content = json.loads(path.read_bytes()[8:-8])
    content["a"][key][place] = bad
    path.write_bytes(header(json.dumps(content)) + value.tobytes())
    with pytest.raises(DamagedFileError, match="a: expected integers from 0, found"):
        load_tensors(path, 10**6)


def test_a_number_that_json_does_not_have_is_damage(path):
    whole = path.read_bytes()
    assert b"0.3333333333333333" in whole
    for text in (b"1" + 14 * b"0" + b"e99", b"NaN".rjust(18), b"-Infinity".rjust(18)):
        path.write_bytes(whole.replace(b"0.3333333333333333", text.ljust(18, b"9")))
        with pytest.raises(DamagedFileError, match=re.escape(str(path))):
            load_tensors(path, 10**6)


SIZES = (1_000, 100_000, 3_000_000)
KILLS = [
    pytest.param(100_000, 5, marks=(pytest.mark.long, pytest.mark.push)),
    *(pytest.param(size, 100, marks=pytest.mark.long) for size in SIZES),
]


@pytest.mark.parametrize(("size", "interruptions"), KILLS)
def test_a_kill_in_the_middle_of_a_write_leaves_a_whole_file(tmp_path, size, interruptions):
    """Writers of one file are killed at random until so many were in the middle of a write."""
    path = tmp_path / "a.safetensors"
    rng = np.random.default_rng(2)
    kills = interrupted = 0
    while interrupted < interruptions:
        kills += 1
        path.unlink(missing_ok=True)
        writer = start_writer(path, size)
        while not path.exists():
            time.sleep(0.001)
        time.sleep(float(rng.uniform(0, 0.03)))
        writer.kill()
        finish(writer)
        arrays, document = load_tensors(path, 10**9)
        assert (arrays["a"] == document["k"]).all() and arrays["a"].shape == (size,)
        interrupted += bool(list(tmp_path.glob(".*.tmp")))
        sweep(tmp_path)
        assert not list(tmp_path.glob(".*.tmp"))
    print(f"{interrupted} of {kills} kills in the middle of a write of {8 * size} bytes")
