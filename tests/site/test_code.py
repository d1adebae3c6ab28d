"""The site shows no code that no test has run, no broken link, and each object once."""

from __future__ import annotations

import ast
import importlib
import importlib.util
import re
import shlex
from pathlib import Path

import pytest

from rigid_envs.envs.lookup import task_of
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.testing.environments import PUSH
from rigid_envs.tools.cli.command_line import _parser as library
from rigid_envs.tools.cli.words import config_of
from tests.programs import printed
from tests.site.links import broken_links

PAGE = """
<a href="other.html#there">a</a> <a href="#here">b</a> <h2 id="here">c</h2> <img src="a%20b.png">
<a href="https://doi.org/10.1007/BF00375605">d</a> <a href="sub/">e</a>
"""
BROKEN = ["#gone", "gone.html", "http://plain.org/x", "https://nowhere", "other.html#gone", "sub/"]


def test_what_leads_nowhere_is_named_with_its_page(tmp_path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "a b.png").write_bytes(b"")
    (tmp_path / "other.html").write_text('<p id="there">')
    links = "".join(f'<a href="{target}">x</a>' for target in BROKEN)
    (tmp_path / "index.html").write_text(PAGE + links)
    assert broken_links(tmp_path) == [f"index.html: {target}" for target in BROKEN]


def test_an_empty_folder_is_no_site(tmp_path):
    with pytest.raises(FileNotFoundError, match="expected a site"):
        broken_links(tmp_path)


ROOT = Path(__file__).parents[2]
PAGES = sorted(
    path.relative_to(ROOT).as_posix()
    for path in [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *ROOT.glob("docs/**/*.md")]
    if "_build" not in path.parts
)

# Python of these pages is run by the test that is named, which knows what must come out, or runs it
# in parts, or for shorter. Of all other pages it is run here, as it stands.
ELSEWHERE = {
    "docs/control.md": "tests/test_docs.py::test_the_page_on_control_prints_what_it_says",
    "docs/datasets.md": "tests/datasets/test_datasets.py::test_the_page_runs",
    "docs/gallery.md": "tests/gallery/test_page.py::test_code_of_the_gallery_is_what_draws",
    "docs/extending.md": "tests/test_registry.py::test_the_script_of_the_page_runs",
    "docs/policies.md": "tests/policies/test_published.py::"
    "test_the_example_of_the_page_loads_acts_and_evaluates",
    "docs/references.md": "tests/references/test_references.py::test_the_page_runs",
    "docs/rendering.md": "tests/gallery/test_page.py::test_code_of_the_guide_runs",
    "docs/replays.md": "tests/replays/test_recording.py::test_the_example_of_the_guide_runs",
    "docs/sb3.md": "tests/sb3/test_exporting.py::test_the_page_runs",
    "docs/scoring.md": "tests/test_docs.py::"
    "test_the_example_of_the_page_trains_evaluates_and_ranks_an_outsider",
    "docs/symmetry.md": "tests/envs/test_settings.py::test_the_examples_of_the_page_run",
    "docs/watching.md": "tests/films/test_episodes.py::test_the_example_of_the_guide_runs",
}
GENERATED = "docs/environments/"  # tests/test_docs.py runs the example of each page

# Tools of others, which are not called here.
TOOLS = {"cd", "git", "lint-imports", "mypy", "npm", "pip", "pre-commit", "ray", "ruff", "source"}


def text_of(page):
    return (ROOT / page).read_text(encoding="utf-8")


def blocks_of(page, *languages):
    """Code of a page in some languages, in order."""
    found = re.findall(r"^```(\w+)\n(.*?)^```$", text_of(page), re.MULTILINE | re.DOTALL)
    return [code for language, code in found if language in languages]


def commands_of(page):
    """Commands of the shell that a page shows, as words."""
    found = []
    for block in blocks_of(page, "bash", "sh", "console", "shell"):
        for line in block.replace("\\\n", " ").splitlines():
            words = shlex.split(line, comments=True)
            while "&&" in words:
                at = words.index("&&")
                found.append(words[:at])
                words = words[at + 1 :]
            found.append(words)
    return [words for words in found if words]


HERE = [
    page
    for page in PAGES
    if page not in ELSEWHERE and not page.startswith(GENERATED) and blocks_of(page, "python")
]


def test_the_tests_that_are_named_are_there_and_read_their_page():
    for page, test in ELSEWHERE.items():
        file, _, name = test.partition("::")
        text = (ROOT / file).read_text(encoding="utf-8")
        assert f"def {name}(" in text, test
        assert Path(page).name in text, test
        assert blocks_of(page, "python"), f"{page} has no Python: remove it from the list"


SLOW = "docs/physics.md"  # run at a push


@pytest.mark.parametrize(
    "page", [pytest.param(page, marks=PUSH if page == SLOW else ()) for page in HERE]
)
def test_python_of_a_page_runs(page, tmp_path, monkeypatch):
    """A block that stands on a page of the list, too, is not run again."""
    known = {block for other in ELSEWHERE for block in blocks_of(other, "python")}
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")  # of the window that the first page opens,
    monkeypatch.setattr("rigid_envs.envs.display.frames_per_second", lambda task: 0)  # at once
    names = {"__name__": "page"}
    for block in blocks_of(page, "python"):
        if block not in known:
            exec(compile(block, page, "exec"), names)


def understood(parser, words):
    """Words that a parser leaves for the settings of a task, as ``--radius 0.5``."""
    try:
        _, rest = parser.parse_known_args(words)
    except SystemExit:
        pytest.fail(f"wrong words: {words}")
    return rest


def check_agents(words):
    pytest.importorskip("stable_baselines3")
    from agents.cli.command_line import _parser as application

    rest = understood(application(), words) if words else []
    names = [word for word in rest if word.startswith("--")]
    assert all(name.startswith(("--env_kwargs.", "--train_kwargs.")) for name in names), words


def check_python(words):
    if words[0] != "-m":
        assert (ROOT / words[0]).is_file(), words
    elif words[1] == "agents":
        check_agents(words[2:])
    else:
        assert importlib.util.find_spec(words[1]), words


def check(words):
    """Fail for a command that the program it calls would refuse."""
    program, rest = words[0].removeprefix(".venv/bin/"), words[1:]
    for word in rest:
        assert not word.startswith("configs/") or (ROOT / word).is_file(), words
    if program == "rigid-envs":
        config_of(understood(library(), rest))
    elif program in ("python", "python3"):
        check_python(rest)
    elif program.startswith(".ci/"):
        assert (ROOT / program).is_file(), words
    else:
        assert program in TOOLS, f"{words}: neither a command of ours nor one of {sorted(TOOLS)}"


@pytest.mark.parametrize("page", [page for page in PAGES if commands_of(page)])
def test_commands_of_a_page_are_understood(page):
    for words in commands_of(page):
        check(words)


@pytest.mark.parametrize(
    "command",
    [
        "rigid-envs describ BallPark",
        "rigid-envs list --colour",
        "python -m agents train --no_such_entry 1",
        "python -m agents train --config configs/nothing.yaml",
        "python -m rigid_envs.nothing",
        "frobnicate",
    ],
)
def test_wrong_commands_are_noticed(command):
    with pytest.raises((AssertionError, pytest.fail.Exception, ValueError)):
        check(command.split())


def documented(page):
    """The classes and functions on a page."""
    text, found = page.read_text(encoding="utf-8"), []
    for name, options in re.findall(r"automodule:: (\S+)\n((?:   .*\n)*)", text):
        left_out = re.findall(r":exclude-members: (.*)", options)
        names = {each.strip() for line in left_out for each in line.split(",")}
        module = importlib.import_module(name)
        own = [k for k, v in vars(module).items() if getattr(v, "__module__", "") == name]
        public = getattr(module, "__all__", [each for each in own if not each.startswith("_")])
        members = [getattr(module, each) for each in public if each not in names]
        found += [member for member in members if hasattr(member, "__qualname__")]
    return found


def test_no_object_is_documented_twice():
    pages = {}
    for page in sorted((ROOT / "docs" / "reference").glob("*.md")):
        for member in documented(page):
            other = pages.setdefault(id(member), page.name)
            assert other == page.name, f"{member} is on {other} and {page.name}"


def test_every_system_has_a_page_that_leads_to_its_environments():
    for env_id in ENVIRONMENTS:
        text = text_of(f"docs/reference/systems/{task_of(env_id).system_type.__name__}.md")
        assert f"(../../environments/{env_id[len('RigidEnvs/') : -len('-v0')]}.md)" in text


FOLDER = ROOT / "docs" / "tutorials"
NAMES = sorted(path.stem for path in FOLDER.glob("*.py"))


def test_all_are_on_the_site_and_begin_with_a_title():
    index = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    for name in NAMES:
        text = (FOLDER / f"{name}.py").read_text(encoding="utf-8")
        assert f"\ntutorials/{name}\n" in index
        assert text.startswith("# %% [markdown]\n# # "), name
        assert ast.parse(text)


@pytest.mark.long  # at a push, the site is built of them, each cell executed
@pytest.mark.parametrize("name", NAMES)
def test_it_runs_as_a_script(name, tmp_path):
    printed(FOLDER / f"{name}.py", cwd=tmp_path, PYTHONPATH=str(ROOT), MPLBACKEND="Agg")


@pytest.mark.parametrize("name", NAMES)
def test_it_is_a_notebook(name):
    jupytext = pytest.importorskip("jupytext")
    nbformat = pytest.importorskip("nbformat")
    notebook = jupytext.read(FOLDER / f"{name}.py")
    nbformat.validate(notebook)
    assert {cell["cell_type"] for cell in notebook.cells} == {"markdown", "code"}
