"""Reference cases: answers to 15 digits, computed with 50 digits or more by independent routes.

Conventions and the fields of each kind are in `meta` of the data files. Inputs are the exact
doubles printed; `cond`, where given, is how much a relative input error of one eps moves each
output.
"""

import json
from functools import cache
from operator import itemgetter
from pathlib import Path

import pytest


@cache
def all_cases():
    """Return the cases of all kinds."""
    paths = sorted((Path(__file__).parent / "data").glob("*_cases.json"))
    return [case for path in paths for case in json.loads(path.read_text("utf-8"))["cases"]]


@cache
def _by_kind():
    kinds = {}
    for case in all_cases():
        kinds.setdefault(case["kind"], []).append(case)
    return kinds


def cases(kind):
    """Return the cases of one kind."""
    if kind not in _by_kind():
        raise ValueError(f"kind = {kind!r}: expected one of {', '.join(sorted(_by_kind()))}")
    return _by_kind()[kind]


def every(found):
    """Give a test every one of some cases, as `case`."""
    return pytest.mark.parametrize("case", found, ids=itemgetter("id"))
