"""`evaluations.npz` comes back to the bit; of checkpoints the newest good one is read.

Damage, pickles and bombs: `tests/loading`.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents.storage.logs import load_newest, read_evaluations, save_newest, write_evaluations
from rigid_envs.base.files import DamagedFileError

ARRAYS: dict[str, Any] = {
    "timesteps": np.array([512, 1024]),
    "results": np.arange(6.0).reshape(2, 3),
    "ep_lengths": np.arange(6).reshape(2, 3),
    "successes": np.eye(2, 3, dtype=bool),
    "costs": np.ones((2, 3)),
}


def test_evaluations_come_back_to_the_bit(tmp_path: Path) -> None:
    path = tmp_path / "evaluations.npz"
    write_evaluations(path, ARRAYS)
    found = read_evaluations(path)
    assert found.keys() == ARRAYS.keys()
    for name, array in ARRAYS.items():
        assert found[name].dtype == array.dtype
        np.testing.assert_array_equal(found[name], array)


@pytest.mark.parametrize(
    "changes",
    [
        {"timesteps": np.array([512])},
        {"costs": np.ones((2, 4))},
        {"costs": np.full((2, 3), np.nan)},
        {"costs": np.array(["a"])},
        {"more": np.ones(3)},
        {name: array[:0] for name, array in ARRAYS.items()},
    ],
)
def test_what_no_run_can_have_written_is_refused_by_name(
    tmp_path: Path, changes: dict[str, Any]
) -> None:
    path = tmp_path / "evaluations.npz"
    np.savez(path, **ARRAYS | changes)
    with pytest.raises(DamagedFileError, match=r"evaluations\.npz"):
        read_evaluations(path)


def save(folder: Path, *ages: int) -> None:
    for age in ages:
        save_newest(folder, age, {"a": np.full(3, age)}, {"age": age})


def good(arrays: Any, document: Any) -> None:
    """Nothing is wrong."""


def test_the_last_two_are_kept_and_the_newest_is_read(tmp_path: Path) -> None:
    folder = tmp_path / "checkpoints"
    assert load_newest(folder, good) is None
    save(folder, 5, 40, 300, 2000)
    assert [int(path.stem) for path in sorted(folder.iterdir())] == [300, 2000]
    found = load_newest(folder, good)
    assert found is not None
    assert found[1] == {"age": 2000} and found[0]["a"].tolist() == [2000] * 3 and found[2] == []


def test_one_that_is_not_good_is_named_and_passed_over(tmp_path: Path) -> None:
    def old(arrays: Any, document: dict[str, Any]) -> None:
        if document["age"] > limit:
            raise DamagedFileError(f"age = {document['age']}; expected less")

    save(tmp_path, 300, 2000)
    limit = 1000
    found = load_newest(tmp_path, old)
    assert found is not None and found[1] == {"age": 300}
    assert found[2] == [f"{tmp_path / '000000000002000.safetensors'}: age = 2000; expected less"]
    limit = 100
    with pytest.raises(DamagedFileError, match=r"2000\.safetensors: age .*300\.safetensors: age"):
        load_newest(tmp_path, old)
