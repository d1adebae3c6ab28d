"""`evaluations.npz` comes back to the bit; what is damaged or hostile is named, and never runs."""

import io
import sys
import time
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents.storage.logs import read_evaluations, write_evaluations
from rigid_envs.base.files import DamagedFileError

ARRAYS: dict[str, Any] = {
    "timesteps": np.array([512, 1024]),
    "results": np.arange(6.0).reshape(2, 3),
    "ep_lengths": np.arange(6).reshape(2, 3),
    "successes": np.eye(2, 3, dtype=bool),
    "costs": np.ones((2, 3)),
}


class Payload:
    """What a pickle would do."""

    def __reduce__(self) -> tuple[Any, ...]:
        return exec, ("import tests.agents.deadly",)


def npz(**arrays: Any) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


def bomb() -> bytes:
    """A gigabyte of zeros in a megabyte."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        with archive.open("results.npy", "w", force_zip64=True) as member:
            for _ in range(1024):
                member.write(bytes(2**20))
    return buffer.getvalue()


HOSTILE: dict[str, Callable[[], bytes]] = {
    "pickle": lambda: npz(**ARRAYS | {"costs": np.array([Payload()], dtype=object)}),
    "bomb": bomb,
    "missing": lambda: npz(timesteps=ARRAYS["timesteps"]),
    "another number of rows": lambda: npz(**ARRAYS | {"timesteps": np.array([512])}),
    "another number of episodes": lambda: npz(**ARRAYS | {"costs": np.ones((2, 4))}),
    "no rows": lambda: npz(**{name: array[:0] for name, array in ARRAYS.items()}),
    "nan": lambda: npz(**ARRAYS | {"costs": np.full((2, 3), np.nan)}),
    "one more": lambda: npz(**ARRAYS, more=np.ones(3)),
    "text": lambda: npz(**ARRAYS | {"costs": np.array(["a"])}),
    "empty": lambda: b"",
    "no archive": lambda: b"PK\x03\x04" + bytes(500),
}


def test_evaluations_come_back_to_the_bit(tmp_path: Path) -> None:
    path = tmp_path / "evaluations.npz"
    write_evaluations(path, ARRAYS)
    found = read_evaluations(path)
    assert found.keys() == ARRAYS.keys()
    for name, array in ARRAYS.items():
        assert found[name].dtype == array.dtype
        np.testing.assert_array_equal(found[name], array)


@pytest.mark.parametrize("kind", HOSTILE)
def test_what_is_hostile_is_refused_at_once_and_runs_nothing(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "evaluations.npz"
    path.write_bytes(HOSTILE[kind]())
    seen: list[str] = []
    sys.addaudithook(lambda event, _: seen.append(event) if armed else None)
    armed, begin = True, time.process_time()
    try:
        with pytest.raises(DamagedFileError, match=r"evaluations\.npz"):
            read_evaluations(path)
    finally:
        armed = False
    assert time.process_time() - begin < 1
    assert not {"pickle.find_class", "exec", "os.system", "subprocess.Popen"} & set(seen)


def test_damage_is_named_or_harmless(tmp_path: Path) -> None:
    path, rng = tmp_path / "evaluations.npz", np.random.default_rng(0)
    write_evaluations(path, ARRAYS)
    whole = path.read_bytes()
    cuts = [whole[:k] for k in rng.integers(0, len(whole), 100)]
    flips = []
    for k in rng.integers(0, 8 * len(whole), 300):
        data = bytearray(whole)
        data[k // 8] ^= 1 << (k % 8)
        flips.append(bytes(data))
    for data in cuts + flips:
        path.write_bytes(data)
        try:
            found = read_evaluations(path)
        except DamagedFileError as error:
            assert str(path) in str(error)
        else:
            for name, array in ARRAYS.items():
                np.testing.assert_array_equal(found[name], array)
