"""Every reference case is asked for by at least one test that runs by default."""

import re
from collections import Counter
from pathlib import Path

import pytest

from tests.programs import printed
from tests.reference import all_cases

ROOT = Path(__file__).parent.parent


def collected_ids() -> set[str]:
    """What stands in the brackets of the names of all tests that know of the cases."""
    paths = Path(__file__).parent.rglob("test_*.py")
    files = [path for path in paths if "tests.reference" in path.read_text()]
    words = ("-m", "pytest", "--collect-only", "-q", "-p", "no:cacheprovider")
    listing = printed(*words, *files, cwd=ROOT)
    return set(re.findall(r"\[(.+)\]$", listing, flags=re.MULTILINE))


@pytest.mark.long
@pytest.mark.push
def test_every_reference_case_is_covered(record_property):
    asked = collected_ids()
    kinds = Counter(case["kind"] for case in all_cases())
    covered = Counter(case["kind"] for case in all_cases() if case["id"] in asked)
    table = "\n".join(f"{covered[kind]:4d} of {n:3d} {kind}" for kind, n in sorted(kinds.items()))
    record_property("reference cases", table)
    print(f"{covered.total()} of {kinds.total()} reference cases:\n{table}")
    assert covered == kinds, table
    assert kinds.total() == 316
