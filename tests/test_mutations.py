"""The tests themselves: wrong signs are planted and noticed, and every case is asked for."""

import ast
import re
from collections import Counter
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.mutations.__main__ import SOURCES, main
from tests.mutations.application import ROOT, Checkout
from tests.mutations.known import BUGS, EQUIVALENTS, LIBRARY_EQUIVALENTS, Bug
from tests.mutations.library import LibraryCopy, all_changes
from tests.mutations.mutants import mutants_of
from tests.mutations.operators import changes_of, sampled
from tests.mutations.reach import ROOMS, Reach, sources
from tests.mutations.trials import PackageCopy
from tests.programs import printed
from tests.reference import all_cases

SOURCE = '''
STATE: tuple[float, float] = (1.0, 0.0)
INDEX = tuple[float, float]
RATIO = 1.0 - 4.0 ** (1.0 / 3.0)


@scalar
def f(v: Vector, x: float) -> float:
    """Documented."""
    a, b = v[0], -x
    w = (2.0 * x, *v)
    return a * (x - b) + fma(x, b, -g(w, x**2))


@kernel
def loop(x: float) -> float:
    return -x
'''
PACKAGE = ROOT / "rigid_envs"


def test_every_term_has_its_mutant_and_nothing_else():
    terms = [(mutant.function, mutant.line, mutant.term) for mutant in mutants_of(SOURCE)]
    assert terms == [
        ("module", 4, "1.0"),
        ("module", 4, "4.0 ** (1.0 / 3.0)"),
        ("module", 4, "1.0 / 3.0"),
        ("f", 10, "v[0]"),
        ("f", 10, "-x"),
        ("f", 11, "2.0 * x"),
        ("f", 12, "a * (x - b)"),
        ("f", 12, "x"),
        ("f", 12, "b"),
        ("f", 12, "fma(x, b, -g(w, x**2))"),
        ("f", 12, "x"),
        ("f", 12, "-g(w, x**2)"),
        ("f", 12, "x**2"),
    ]
    assert [mutant.nth for mutant in mutants_of(SOURCE) if mutant.term == "x"] == [0, 1]


def test_a_mutant_differs_from_the_source_by_one_sign():
    def value(source):
        scope = {
            "scalar": lambda function: function,
            "kernel": lambda function: function,
            "fma": lambda a, b, c: a * b + c,
            "g": lambda w, x: w[0] + 10.0 * x,
            "Vector": SimpleNamespace,
        }
        exec(source, scope)
        return scope["f"]((3.0, 5.0), 7.0)

    right = value(SOURCE)
    assert right == 3.0 * 14.0 - 49.0 - 504.0
    planted = {m.term: value(m.planted(SOURCE)) for m in mutants_of(SOURCE) if m.line == 12}
    assert planted["a * (x - b)"] == right - 2.0 * 3.0 * 14.0
    assert planted["-g(w, x**2)"] == right + 2.0 * 504.0
    assert planted["x**2"] == right + 20.0 * 49.0


@pytest.mark.parametrize("name", SOURCES)
def test_equivalents_are_terms_that_are_still_there(name):
    source = (PACKAGE / f"{name}.py").read_text(encoding="utf-8")
    keys = {mutant.key for mutant in mutants_of(source, SOURCES[name].leave_out)}
    for equivalent in EQUIVALENTS:
        if equivalent.source == name:
            assert equivalent.key in keys
    assert {equivalent.source for equivalent in EQUIVALENTS} <= set(SOURCES)


@pytest.mark.long
@pytest.mark.push
def test_a_wrong_sign_in_a_copy_is_noticed_and_the_checkout_stays_as_it_was():
    before = {path: path.read_bytes() for path in PACKAGE.rglob("*.py")}
    copy, ball = PackageCopy(), "systems/rolling_ball/dynamics"
    try:
        rates = [m for m in mutants_of(copy.source(ball)) if m.function == "rhs"]
        trial = copy.mutated(ball, rates[-1], ("rolling_ball",))
        assert trial.law == "rolling_ball: rhs is the rate of the motion"
        assert copy.source(ball) == before[PACKAGE / f"{ball}.py"].decode()
    finally:
        copy.close()
    assert {path: path.read_bytes() for path in before} == before


@pytest.mark.parametrize("bug", BUGS, ids=lambda bug: bug.what)
def test_a_bug_to_plant_has_its_place_and_its_tests(bug):
    source = (ROOT / bug.file).read_text(encoding="utf-8")
    ast.parse(bug.planted(source))
    for test in bug.tests:
        path, _, name = test.partition("::")
        assert f"def {name}" in (ROOT / path).read_text() if name else (ROOT / path).exists()


@pytest.mark.long
@pytest.mark.push
def test_a_bug_in_a_copy_of_the_checkout_is_noticed_and_one_that_changes_nothing_is_not():
    copy = Checkout()
    try:
        source = "rigid_envs/base/files.py"
        bug = Bug("", source, "sort_keys=True", "sort_keys=False", ("tests/test_files.py",))
        assert copy.trial(bug) == "test_json_has_one_spelling_and_no_nan"
        assert copy.trial(bug._replace(new="sort_keys=bool(1)")) == ""
        assert (copy.folder / source).read_bytes() == (ROOT / source).read_bytes()
    finally:
        copy.close()


PLAIN = '''
"""Texts stay as they are: 1 + 2."""
from typing import TYPE_CHECKING

__all__ = ["f"]
if TYPE_CHECKING:
    import math
LIMIT: "tuple[1, 2]" = 0.0


@cache(3)
def f(x: "1 + 1", y=-1) -> "2 * 2":
    """Not 3 < 4."""
    require(x < 5, x + 6, "x", f"{y + 7}")
    if not x and y is None:
        raise ValueError(f"{x * 8}" + "9")
    if x in y:
        y += 2.0
        g(min(x, y))
    assert x == 10
    Camera(1.0, y + 1)
    return any(y) if x else x - y


class A:
    def __repr__(self):
        return 1 + 2
'''


def test_plain_python_has_these_bugs_and_no_others():
    assert [(c.function, c.line, c.what) for c in changes_of(PLAIN, "a.py")] == [
        ("module", 8, "0.0 -> 1.0"),
        ("module", 12, "-1 -> 0"),
        ("f", 14, "require(x < 5, x + 6, 'x', f'{y + 7}') -> pass"),
        ("f", 14, "x < 5 -> x <= 5"),
        ("f", 14, "5 -> 6"),
        ("f", 15, "not x -> x"),
        ("f", 15, "if not x and y is None -> if False"),
        ("f", 15, "not x and y is None -> not x or y is None"),
        ("f", 15, "y is None -> y is not None"),
        ("f", 17, "if x in y -> if False"),
        ("f", 17, "if x in y -> if True"),
        ("f", 17, "x in y -> x not in y"),
        ("f", 18, "y += 2.0 -> y -= 2.0"),
        ("f", 18, "2.0 -> 4.0"),
        ("f", 19, "g(min(x, y)) -> pass"),
        ("f", 19, "min(x, y) -> max(x, y)"),
        ("f", 21, "Camera(1.0, y + 1) -> pass"),
        ("f", 22, "any(y) -> all(y)"),
        ("f", 22, "if x -> if False"),
        ("f", 22, "if x -> if True"),
        ("f", 22, "x - y -> x + y"),
    ]


def test_a_bug_changes_its_place_in_the_bytes_of_the_source_and_nothing_else():
    source = '"""Kovalevskaya\'s ψ."""\n\n\ndef f(x):\n    return "ψ", (x) < (2)  # ψ\n'
    planted = {c.what: c.planted(source) for c in changes_of(source, "a.py")}
    assert planted == {
        "x < 2 -> x <= 2": source.replace("(x) < (2)", "(x <= 2)"),
        "2 -> 3": source.replace("2", "(3)"),
    }


def test_a_sample_is_the_same_whatever_stands_around_it():
    changes = changes_of(PLAIN, "a.py")
    drawn = sampled(changes, 5, 0)
    assert len(drawn) == 5 and drawn == sorted(drawn, key=changes.index)
    assert drawn == sampled([c for c in changes if c in drawn or c.line != 15], 5, 0)
    assert drawn != sampled(changes, 5, 1)


@pytest.mark.long
@pytest.mark.push
@pytest.mark.parametrize("room", ROOMS)
def test_bugs_that_are_argued_away_are_still_in_the_library(room):
    keys = {change.key for change in all_changes(room)}
    assert len(keys) == len(all_changes(room))
    files = {path.relative_to(ROOT).as_posix() for path in sources(ROOT, room)}
    ours = [equivalent for equivalent in LIBRARY_EQUIVALENTS if equivalent.file in files]
    assert {equivalent.key for equivalent in ours} <= keys
    assert len({equivalent.key for equivalent in ours}) == len(ours)
    assert all(equivalent.why for equivalent in ours)


@pytest.mark.long
def test_a_bug_in_the_library_is_noticed_by_a_test_that_reaches_it():
    copy = LibraryCopy()
    try:
        file = "rigid_envs/mechanics/special.py"
        before = (ROOT / file).read_bytes()
        reach = Reach(ROOT, ("tests/mechanics/test_special.py",), copy.python)
        changes = {c.what: c for c in changes_of(before.decode(), file) if c.function == "jacobi"}
        trial = copy.noticed(changes["cn / dn -> cn * dn"], reach)
        assert trial.test.startswith("test_") and 0 < trial.reached < len(reach.seconds)
        harmless = replace(changes["if m1 == 0.0 -> if False"], new="m1 <= 0.0")
        assert copy.noticed(harmless, reach).test == ""
        assert (copy.folder / file).read_bytes() == (ROOT / file).read_bytes() == before
        file = "rigid_envs/tasks/registry.py"
        refused = {c.what: c for c in changes_of((ROOT / file).read_text(), file)}
        change = replace(
            refused["not isinstance(limit, int) -> isinstance(limit, int)"], in_body=False
        )
        assert copy.noticed(change, reach).test == "none: no test can be run"
    finally:
        copy.close()


@pytest.mark.long
@pytest.mark.parametrize("name", SOURCES)
def test_a_sample_of_wrong_signs_is_noticed(name, capsys):
    assert main(["--subjects", name, "--sample", "5"]) == 0
    assert "No survivor." in capsys.readouterr().out


ROOT = Path(__file__).parent.parent


def collected_ids():
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
    assert kinds.total() == 397
