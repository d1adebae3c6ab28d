"""No file that is read runs code, imports, starts processes, opens sockets or writes."""

import json
import pickle
import subprocess
import sys
from pathlib import Path

import pytest

from tests.loading.payloads import changed, harmful
from tests.loading.readers import READERS

N = 112  # changed files of each kind: more than 1000 together


@pytest.fixture(scope="module")
def audited():
    words = [sys.executable, "-m", "tests.loading.audited", str(N)]
    root = Path(__file__).parents[2]
    done = subprocess.run(words, cwd=root, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.parametrize("kind", READERS)
def test_reading_does_nothing_but_read(audited, kind):
    assert audited[kind]["found"] == {}
    assert not audited[kind]["ran"]


@pytest.mark.parametrize("kind", READERS)
def test_what_is_no_good_file_is_refused_by_name(audited, kind):
    n_harmful = len([*harmful(Path("mark"))])
    ends = audited[kind]["ends"]
    assert sum(ends.values()) == n_harmful + N
    refused = {"config": "ConfigError"}.get(kind, "DamagedFileError")
    assert set(ends) <= {refused, "read"}
    assert ends[refused] >= n_harmful - 2  # text may be YAML, though no configuration


def test_payloads_do_run_where_a_reader_lets_them(tmp_path):
    for k, data in enumerate(harmful(tmp_path / "mark")):
        if k <= pickle.HIGHEST_PROTOCOL:
            (tmp_path / "mark").unlink(missing_ok=True)
            pickle.loads(data)
            assert (tmp_path / "mark").exists()
    assert len({*changed(b"0123456789" * 20, N, 0)}) > 0.95 * N
