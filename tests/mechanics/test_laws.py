"""The laws of the physics hold, every one within its bound."""

import re

import pytest

from rigid_envs import systems
from rigid_envs.mechanics.laws import Subject, check
from rigid_envs.tools import laws
from rigid_envs.tools.laws import SUBJECTS

LAWS = [law for subject in SUBJECTS.values() for law in subject.laws]


@pytest.mark.parametrize("law", LAWS, ids=lambda law: f"{law.subject}: {law.name}")
def test_the_law_holds(law):
    outcome = check(law)
    assert outcome.holds, outcome.message or f"{outcome.error} > {law.bound}: {law.why}"


def test_every_system_is_a_subject():
    kinds = [getattr(systems, name) for name in systems.__all__]
    kinds = [kind for kind in kinds if isinstance(kind, type) and issubclass(kind, systems.System)]
    names = {re.sub(r"(?<!^)(?=[A-Z])", "_", kind.__name__).lower() for kind in kinds}
    assert names - {"system"} <= set(SUBJECTS)


@pytest.mark.parametrize("subject", SUBJECTS.values(), ids=SUBJECTS)
def test_a_subject_has_laws_of_different_names(subject):
    names = [law.name for law in subject.laws]
    assert names
    assert len(set(names)) == len(names)


def test_laws_state_themselves_their_bounds_and_the_reasons():
    for law in LAWS:
        assert law.measure.__doc__ and law.compared and law.why, law
        assert law.bound >= 0.0, law


def test_all_laws_of_the_chosen_subjects_are_checked_in_order(monkeypatch):
    subjects = {name: Subject(name, "two laws") for name in ("one", "two")}
    for subject in subjects.values():
        subject.law("0 with 0", bound=0.0, why="equal")(lambda: 0.0)
        subject.law("1 with 0", bound=0.0, why="not equal")(lambda: 1.0)
    monkeypatch.setattr(laws, "SUBJECTS", subjects)
    told = []
    outcomes = laws.check_all(["two"], told.append)
    assert [outcome.law for outcome in outcomes] == subjects["two"].laws
    assert [outcome.holds for outcome in outcomes] == [True, False]
    assert [text.partition(":")[0] for text in told] == ["two", "two"]
    assert len(laws.check_all()) == 4
