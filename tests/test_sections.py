"""The form of a task's docstring: what is read from it, and what is refused."""

import pytest

from rigid_envs.systems.rolling_ball.tasks.ball_park import BallPark
from rigid_envs.tasks.task import Task
from rigid_envs.tools.pages.tables import SECTIONS, DocstringError, blocks, docstring_of


def told_by(docstring: str, base: type[Task] = Task) -> type[Task]:
    """A task with this docstring."""
    return type("Told", (base,), {"__doc__": docstring})


def docstring(*names: str) -> str:
    bodies = "".join(f"\n    {name}:\n        About {name}.\n" for name in names)
    return f"Do it.\n\n    It is hard.\n{bodies}"


def test_sections_of_a_docstring_are_read_by_name() -> None:
    story = docstring_of(told_by(docstring(*SECTIONS)))
    assert (story.summary, story.description) == ("Do it.", ["It is hard."])
    assert story.sections == {name: [f"About {name}."] for name in SECTIONS}


def test_a_subclass_takes_from_its_parent_all_but_the_reference() -> None:
    story, parent = docstring_of(told_by(docstring("Reference"), BallPark)), docstring_of(BallPark)
    assert story.sections["Reference"] == ["About Reference."]
    for name in set(SECTIONS) - {"Reference"}:
        assert story.sections[name] == parent.sections[name]
    with pytest.raises(DocstringError, match="Told has no section 'Reference' of its own"):
        docstring_of(told_by(docstring("Physics"), BallPark))


@pytest.mark.parametrize("name", SECTIONS)
def test_a_missing_section_is_refused_by_name(name: str) -> None:
    rest = [other for other in SECTIONS if other != name]
    with pytest.raises(DocstringError, match=f"Told has no section '{name}'"):
        docstring_of(told_by(docstring(*rest)))


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        (docstring(*reversed(SECTIONS)), "has the sections Source, Version History"),
        (docstring(*SECTIONS, "Attributes"), "Attributes; expected"),
        (docstring(*SECTIONS).replace("About Source.", ""), "has nothing in its section 'Source'"),
        (docstring(*SECTIONS).replace("    About", "About"), "not indented"),
        ("Do it", "is no sentence"),
        ("Do\n    it.\n\n    It is hard.", "is no sentence"),
        ("Do it.", "no description"),
    ],
)
def test_another_form_is_refused(text: str, complaint: str) -> None:
    with pytest.raises(DocstringError, match=complaint):
        docstring_of(told_by(text))


def test_paragraphs_and_items_are_told_apart_and_code_keeps_its_marks() -> None:
    text = "One\ntwo ``x``.\n\n- a\n  b\n- `c`\n\nThree."
    assert blocks(text) == ["One two `x`.", "- a b", "- `c`", "Three."]
