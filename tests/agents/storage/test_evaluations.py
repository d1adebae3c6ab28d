"""`evaluations.npz` comes back to the bit; what no run can have written is named.

Damage, pickles and bombs: `tests/loading`.
"""

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
