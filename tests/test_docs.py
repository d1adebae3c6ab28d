"""The pages of the environments: complete, up to date, and true of what `gym.make` gives.

Pages are read as the Markdown that they are; only one test makes them anew.
"""

import dataclasses
import re
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from rigid_envs.envs.lookup import task_of
from rigid_envs.envs.spaces import info_keys
from rigid_envs.scores.best import best_known
from rigid_envs.systems.rolling_ball.tasks.ball_park import BallPark
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tasks.task import Task
from rigid_envs.tools.cli import main
from rigid_envs.tools.pages.formulas import latex, with_latex
from rigid_envs.tools.pages.tables import SECTIONS, DocstringError, blocks, docstring_of
from rigid_envs.tools.pages.writing import INDEX, file_of, pages, with_tables
from tests.from_pages.model import arguments_of

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "docs" / "environments"
MEND = "write the pages anew: rigid-envs docs docs/environments"
IDS = list(ENVIRONMENTS)
TITLES = ["Description", "Action Space", "Observation Space", "Reduced Frame", "Rewards",
          "Starting State", "Episode End", "Arguments", "Info", "Physics", "Reference score",
          "References"]  # fmt: skip
MATRIX = "`, `".join(f"R{i}{j}" for i in "123" for j in "123")

each_id = pytest.mark.parametrize("env_id", IDS)
each_file = pytest.mark.parametrize("name", [INDEX, *map(file_of, IDS)])


def text_of(name):
    path = FOLDER / name
    assert path.is_file(), f"{path} is not there; {MEND}"
    return path.read_text(encoding="utf-8")


def sections_of(env_id):
    """What stands under each heading of the second level."""
    _, *parts = re.split(r"^## (.+)\n", text_of(file_of(env_id)), flags=re.MULTILINE)
    assert len(set(parts[::2])) == len(parts[::2])
    found = dict(zip(parts[::2], parts[1::2], strict=True))
    lead = re.search(r"\nThe same as in .*\((\w+)\.md\): ([^;]+);", text_of(file_of(env_id)))
    if lead is None:
        return found
    parent, titles = sections_of(f"RigidEnvs/{lead[1]}-v0"), lead[2].split(", ")
    assert not {*titles} & found.keys()
    found |= {title: parent[title] for title in titles}
    return {title: found[title] for title in TITLES}


def cells(line):
    """Cells of a row of a table, as they are read: without code marks, bars as bars."""
    assert line.startswith("| ")
    assert line.endswith(" |")
    found = re.split(r"(?<!\\)\|", line[1:-1])
    return [cell.strip().strip("`").replace(r"\|", "|") for cell in found]


def tables_of(text):
    """Every table as rows by the names of its columns."""
    found = []
    for block in re.findall(r"(?:^\|.*\n?)+", text, flags=re.MULTILINE):
        header, rule, *rows = map(cells, block.splitlines())
        assert all(re.fullmatch("-{3}:?", cell) for cell in rule)
        assert {len(row) for row in rows} == {len(header)} == {len(rule)}
        found.append([dict(zip(header, row, strict=True)) for row in rows])
    return found


def entries_of(rows, name):
    """A row for each entry, of rows that say `0 .. 2` and have several names."""
    found = []
    for row in rows:
        first, last = re.fullmatch(r"(\d+)(?: \.\. (\d+))?", row["Num"]).groups()
        names = row[name].replace("R11` .. `R33", MATRIX).split("`, `")
        assert [int(first), int(last or first)] == [len(found), len(found) + len(names) - 1]
        found += [row | {name: each} for each in names]
    return found


def rounded(number):
    """A number as a page rounds it."""
    return float(f"{number:.4g}")


@each_id
def test_page_has_every_section_in_order_and_none_is_empty(env_id):
    sections = sections_of(env_id)
    assert list(sections) == TITLES
    for title, text in sections.items():
        assert len(text.split()) >= 3, title
    ends = re.findall("^### (.+)", sections["Episode End"], re.MULTILINE)
    assert ends == ["Termination", "Truncation"]


def test_pages_are_what_the_docstrings_say_now():
    stale = [name for name, text in pages().items() if text_of(name) != text]
    assert not stale, f"{', '.join(stale)} differ from the docstrings; {MEND}"


def test_there_is_no_page_without_an_id():
    known = {INDEX, *map(file_of, IDS)}
    assert len(known) == 1 + len(IDS)
    pages = {path.name for path in FOLDER.glob("*.md")}
    assert pages == known, "remove the pages that no id has"


@each_id
def test_page_begins_with_the_id_and_its_spaces(env_id):
    env = gymnasium.make(env_id)
    head = text_of(file_of(env_id)).partition("\n## ")[0]
    (rows,) = tables_of(head)
    facts = {row["id"]: row[env_id] for row in rows}
    assert facts["import"] == f'gym.make("{env_id}")'
    for title, space in (
        ("Action Space", env.action_space),
        ("Observation Space", env.observation_space),
    ):
        parts = list(space.values()) if isinstance(space, spaces.Dict) else [space]
        told = re.findall(r"Box\([^()]*\([^()]*\), \w+\)|Discrete\(\d+\)", facts[title])
        assert len(told) == len(parts)
        for text, part in zip(told, parts, strict=True):
            if isinstance(part, spaces.Discrete):
                assert text == f"Discrete({part.n})"
            else:
                assert text.endswith(f"{part.shape}, {part.dtype})")


@each_id
def test_table_of_actions_is_the_action_space(env_id):
    env = gymnasium.make(env_id)
    text = sections_of(env_id)["Action Space"]
    (rows,) = tables_of(text)
    space, rows = env.action_space, entries_of(rows, "Action")
    if isinstance(space, spaces.Discrete):
        low, high = 0, space.n - 1
        assert f"one of {space.n} choices" in text
    else:
        low, high = -1, 1
        assert (np.all(space.low == low), np.all(space.high == high)) == (True, True)
        assert text.startswith(f"\nShape {space.shape}: ") and space.dtype == np.float32
    for row, entry in zip(rows, env.unwrapped.task.actions(), strict=True):
        assert (row["Action"], row["Unit"]) == (entry.symbol, entry.unit)
        values = float(row[f"Value at {low}"]), float(row[f"Value at {high}"])
        assert values == (rounded(entry.low), rounded(entry.high))


@each_id
def test_table_of_observations_is_the_observation_space(env_id):
    space = gymnasium.make(env_id).observation_space
    text = sections_of(env_id)["Observation Space"]
    tables = tables_of(text)
    if isinstance(space, spaces.Dict):
        parts = re.findall(r"^### (.+)", text, re.MULTILINE)
        assert parts == ["`observation`", "`achieved_goal` and `desired_goal`"]
        assert space["achieved_goal"] == space["desired_goal"]
        parts = [space["observation"], space["achieved_goal"]]
    else:
        parts = [space]
    for table, part in zip(tables, parts, strict=True):
        rows = entries_of(table, "Observation")
        bounds = [(float(row["Min"]), float(row["Max"])) for row in rows]
        assert bounds == list(zip(map(rounded, part.low), map(rounded, part.high), strict=True))
        assert f"\nShape {part.shape}" in text and part.dtype == np.float32
        symbols = [row["Observation"] for row in rows]
        assert len(set(symbols)) == len(symbols)


@each_id
def test_table_of_rewards_names_every_term_with_its_weight(env_id):
    task = gymnasium.make(env_id).unwrapped.task
    (rows,) = tables_of(sections_of(env_id)["Rewards"])
    assert [row["Argument"] for row in rows] == [f"weight_{term}" for term in task.terms]
    for row in rows:
        assert float(row["Weight"]) == getattr(task, row["Argument"])
        rule = type(task).__dataclass_fields__[row["Argument"]].metadata["rule"]
        assert f"Weights may be {rule.low:g} to {rule.high:g}." in text_of(INDEX)
    prose = sections_of(env_id)["Rewards"].partition("\n| ")[0]
    assert not [term for term in task.terms if f"`{term}`" not in prose]


@each_id
def test_arguments_are_those_that_are_accepted_with_their_defaults(env_id):
    task = gymnasium.make(env_id).unwrapped.task
    given = arguments_of(file_of(env_id))
    rows = [row for table in tables_of(sections_of(env_id)["Arguments"]) for row in table]
    assert len({row["Argument"] for row in rows}) == len(rows)
    assert all(row["Meaning"] and row["Allowed"] for row in rows)
    assert set(given) == {field.name for field in dataclasses.fields(task)}
    made = gymnasium.make(env_id, **given).unwrapped.task
    for name, value in dataclasses.asdict(task).items():
        told = getattr(made, name)
        assert told == value, name


@each_id
def test_arguments_of_the_body_without_a_row_are_described_with_its_system(env_id):
    task = gymnasium.make(env_id).unwrapped.task
    name, system_type = task.system_type.__name__, task.system_type
    system = text_of(INDEX).partition(f"\n### System `{name}`\n")[2].partition("\n#")[0]
    assert all(f"`{component}`" in system for component in system_type.components)
    assert "by their defaults alone may be 1e-9 to 1e6, or such a pair" in text_of(INDEX)
    page = text_of(file_of(env_id))
    line = re.search(rf"^Of \[the body\]\({INDEX}#system-{name.lower()}\): .+\.$", page, re.M)
    assert line or "\nThe same as in " in page
    for argument in re.findall(r"`(\w+)` = ", line[0] if line else ""):
        assert f"\n- `{argument}`: " in system
        rule = type(task).__dataclass_fields__[argument].metadata["rule"]
        assert (rule.low, rule.high, rule.drawn) == (1e-9, 1e6, True)


@each_id
def test_example_of_the_arguments_is_accepted(env_id):
    (code,) = re.findall(r"```python\n(.+)\n```", sections_of(env_id)["Arguments"])
    names = {"gym": gymnasium}
    exec(code, names)
    assert names["env"].spec.id == env_id
    assert names["env"].spec.kwargs.keys() > {"task"}


@each_id
def test_info_and_time_limit_are_those_of_the_environment(env_id):
    env, sections = gymnasium.make(env_id), sections_of(env_id)
    rows = re.findall(r"^- `(\w+)` \((float|bool)\): (.+)\.$", sections["Info"], re.MULTILINE)
    task, shared = env.unwrapped.task, {"is_success", "action_clipped", "physics_error"}
    shared |= {f"reward/{term}" for term in task.terms}
    grip = {"normal_force", "needed_friction", "slips"}
    assert grip & {*info_keys(task)} == (grip if hasattr(task, "mu") else set())
    shared |= grip
    assert [key for key, _, _ in rows] == [key for key in info_keys(task) if key not in shared]
    common = text_of(INDEX).partition("\n### Info\n")[2].partition("\n#")[0]
    assert all(f"`{re.sub('/.*', '/TERM', key)}`" in common for key in shared)
    _, info = env.reset(seed=0)
    assert [type(info[key]).__name__ for key, _, _ in rows] == [kind for _, kind, _ in rows]
    assert env.unwrapped.task.cost_unit in rows[0][2]
    assert f"After {env.spec.max_episode_steps} steps" in sections["Episode End"]


@each_file
def test_markdown_is_well_formed_and_its_links_lead_somewhere(name):
    text = text_of(name)
    assert text.endswith("\n")
    assert text.startswith("<!--")
    prose = re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
    for line in prose.splitlines():
        bare = re.sub(r"`[^`]+`", "", line)
        assert "`" not in bare, line
        assert not re.search(r"<(?!!--)\w|~~|\*\*|__", bare), line
    for target in re.findall(r"\]\((?!https://doi)([^)]+)\)", prose):
        file, _, anchor = target.partition("#")
        assert (FOLDER / file).is_file()
        if anchor:
            headings = re.findall(r"^#+ (.+)", text_of(file).replace("`", ""), re.MULTILINE)
            assert anchor in {title.lower().replace(" ", "-") for title in headings}


@pytest.mark.parametrize(
    ("plain", "written"),
    [
        (
            "I omega' = I omega x omega + tau_body",
            r"I \omega' = I \omega \times \omega + \tau_{\text{body}}",
        ),
        (
            "tan x + wn <= sqrt(2 (a + b)) / |p|^2",
            r"\tan x + \text{wn }\le \sqrt{2 (a + b)} / \lvert p\rvert^2",
        ),
        ("R R*^T -> R11 I3^-1 e_z", r"R {R^\ast}^T \to R_{11} I_3^{-1} e_z"),
        ("m radius dt > start_tilt", r"m\text{ radius}\text{ dt} > \texttt{start_tilt}"),
        ("dtheta / ds . n +- 1e-9 VX", r"d\theta / ds \cdot n \pm 10^{-9} V_X"),
        ("-cbrt(|m|) [0, 4e-11)", r"-\sqrt[3]{\lvert m\rvert} [0, 4 \cdot 10^{-11})"),
    ],
)
def test_formulas_in_plain_text_are_latex_in_a_page(plain, written):
    assert latex(plain) == written
    assert with_latex(f"so `x` = ${plain}$.", "<{}>") == f"so `x` = <{written}>."


@each_file
def test_formulas_of_a_page_are_latex_that_markdown_leaves_as_it_is(name):
    prose = re.sub(r"`[^`]*`", "", text_of(name))
    formulas = re.findall(r"\$([^$]+)\$", prose)
    assert prose.count("$") == 2 * len(formulas)
    for formula in formulas:
        assert formula == formula.strip() and formula.count("{") == formula.count("}")
        assert formula.count(r"\lvert") == formula.count(r"\rvert")
        assert not re.search(r"[*|`]|}_|\\[^A-Za-z]|<\w", formula), formula  # marks of Markdown
        bare = re.sub(r"\\text\w*\{[^}]*\}|\\operatorname\{\w+\}|\\[A-Za-z]+", " ", formula)
        words = re.findall("[A-Za-z]+", bare)
        assert all(re.fullmatch("d?[A-Za-z]", word) for word in words), formula


@pytest.mark.parametrize(
    ("file", "prefix"), [(FOLDER / INDEX, ""), (ROOT / "README.md", "docs/environments/")]
)
def test_every_environment_is_listed_once_and_linked(file, prefix):
    text = file.read_text(encoding="utf-8")
    for env_id in IDS:
        assert text.count(f"]({prefix}{file_of(env_id)})") == 1, env_id


def test_command_writes_what_is_missing_and_names_what_is_too_much(capsys, tmp_path):
    folder = tmp_path / "new" / "pages"
    assert main(["docs", str(folder)]) == 0
    assert {path.name: path.read_text(encoding="utf-8") for path in folder.iterdir()} == pages()
    assert capsys.readouterr().out == f"written to {folder}: {', '.join(pages())}\n"
    (folder / file_of(IDS[0])).write_text("old")
    (folder / "Gone.md").write_text("of an id that is no more")
    assert main(["docs", str(folder)]) == 0
    told, strangers = capsys.readouterr().out.splitlines()
    assert told == f"written to {folder}: {file_of(IDS[0])}"
    assert strangers.endswith("remove them: Gone.md")
    assert (folder / "Gone.md").exists()


@pytest.mark.parametrize("page", ["README.md", "docs/best_known.md"])
def test_tables_of_a_page_are_those_of_registry_and_data(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    assert text == with_tables(text), f"write them anew: python -m rigid_envs.tools.pages {page}"
    with pytest.raises(ValueError, match="no marks for its tables"):
        with_tables("# Another README")


@each_id
def test_reference_scores_are_the_data(env_id):
    text, found = sections_of(env_id)["Reference score"], best_known(env_id)
    (rows,) = tables_of(text)
    assert list(found.policies) == [*ENVIRONMENTS[env_id].controllers, "zero", "random"]
    some = {name: told for name, told in found.policies.items() if told["successes"]}
    assert [row["Policy"] for row in rows] == list(some)
    for name, told in found.policies.items():
        none = f"`{name}`, return {told['return_mean']:.4g}"
        assert (none in text.partition("\nNo success (0.0 .. 0.8 %): ")[2]) == (name not in some)
    for row, told in zip(rows, some.values(), strict=True):
        success, efficiency = row["success (95 %)"].split()[0], row["efficiency (95 %)"].split()[0]
        assert float(success) == pytest.approx(100.0 * told["success_rate"], abs=0.05)
        assert float(efficiency) == pytest.approx(told["efficiency"], abs=5e-4)
        (cost,) = [cell for name, cell in row.items() if name.split()[0] == found.cost]
        assert cost == f"{told['cost_mean']:.4g}"
    assert f"`{next(iter(found.shares))}` (" in text


@each_id
def test_prose_on_reference_controllers_has_no_measured_figures(env_id):
    prose = " ".join(docstring_of(type(task_of(env_id))).sections["Reference"])
    assert not re.search(r"\d of \d+ starts|of 500|on average|\d %", prose)


def test_figures_of_the_leaderboard_are_those_of_the_data():
    text = (ROOT / "docs" / "leaderboard.md").read_text(encoding="utf-8")
    _, rows, *_ = tables_of(text)  # after them those of a part of the starts
    assert {f"RigidEnvs/{row['environment']}" for row in rows} == set(IDS)
    for row in rows:
        found = best_known(f"RigidEnvs/{row['environment']}")
        assert row["cost"].split()[0] == found.cost
        if row["policy"] in found.policies:
            told = found.policies[row["policy"]]["efficiency"]
            assert row["efficiency"] == f"**{told:.3f}**"


@pytest.mark.long
@pytest.mark.push
def test_the_page_on_control_prints_what_it_says(capsys):
    pytest.importorskip("casadi")
    pytest.importorskip("control")
    text = (ROOT / "docs" / "control.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.+?)```\n\n```text\n(.+?)```", text, flags=re.DOTALL)
    assert len(blocks) == text.count("```python") == 6
    names = {}
    for code, told in blocks:
        exec(code, names)
        assert capsys.readouterr().out == told
    _, commands = re.findall(r"```bash\n(.+?)```", text, flags=re.DOTALL)  # the first installs
    for command in commands.splitlines():
        assert main(command.split()[1:]) == 0
        assert re.search("success +100.0 %", capsys.readouterr().out)


def test_the_example_of_the_page_trains_evaluates_and_ranks_an_outsider(
    tmp_path, monkeypatch, capsys
):
    pytest.importorskip("stable_baselines3")
    from rigid_envs.scores.records import read_results

    text = (ROOT / "docs" / "scoring.md").read_text(encoding="utf-8")
    (code, *_) = re.findall(r"```python\n(.+?)```", text, flags=re.DOTALL)
    assert len(code.strip().splitlines()) <= 12 and "100_000" in code
    monkeypatch.chdir(tmp_path)
    exec(code.replace("100_000", "1"), {})
    assert "success" in capsys.readouterr().out
    (row,) = read_results(tmp_path)
    assert row.policy == "ppo" and row.n == 500 and row.efficiency is not None


def test_every_cell_of_who_may_say_what_names_tests_that_are_there():
    files = (
        file for name in ("tests", "rigid_envs/testing") for file in (ROOT / name).rglob("*.py")
    )
    known = {name for file in files for name in re.findall(r"def (test_\w+)", file.read_text())}
    text = (ROOT / "docs/trust.md").read_text(encoding="utf-8")
    rows = [line for line in text.splitlines() if line.startswith("| ") and "---" not in line]
    named = [re.findall(r"`(test_\w+)`", row.split(" | ")[-1]) for row in rows]
    assert [bool(names) for names in named].count(False) == 2  # the headings
    assert sorted({name for names in named for name in names} - known) == []


def told_by(docstring, base=Task):
    """A task with this docstring."""
    return type("Told", (base,), {"__doc__": docstring})


def docstring(*names):
    bodies = "".join(f"\n    {name}:\n        About {name}.\n" for name in names)
    return f"Do it.\n\n    It is hard.\n{bodies}"


def test_sections_of_a_docstring_are_read_by_name():
    story = docstring_of(told_by(docstring(*SECTIONS)))
    assert (story.summary, story.description) == ("Do it.", ["It is hard."])
    assert story.sections == {name: [f"About {name}."] for name in SECTIONS}


def test_a_page_has_a_version_history_where_something_changed():
    whole = docstring(*SECTIONS)
    first = whole.replace("\n    Version History:\n        About Version History.\n", "")
    assert docstring_of(told_by(whole)).sections["Version History"] == ["About Version History."]
    assert docstring_of(told_by(first)).sections["Version History"] == []


def test_a_subclass_takes_from_its_parent_all_but_the_reference():
    story, parent = docstring_of(told_by(docstring("Reference"), BallPark)), docstring_of(BallPark)
    assert story.sections["Reference"] == ["About Reference."]
    for name in set(SECTIONS) - {"Reference"}:
        assert story.sections[name] == parent.sections[name]
    with pytest.raises(DocstringError, match="Told has no section 'Reference' of its own"):
        docstring_of(told_by(docstring("Physics"), BallPark))


@pytest.mark.parametrize("name", [name for name in SECTIONS if name != "Version History"])
def test_a_missing_section_is_refused_by_name(name):
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
def test_another_form_is_refused(text, complaint):
    with pytest.raises(DocstringError, match=complaint):
        docstring_of(told_by(text))


def test_paragraphs_and_items_are_told_apart_and_code_keeps_its_marks():
    text = "One\ntwo ``x``.\n\n- a\n  b\n- `c`\n\nThree."
    assert blocks(text) == ["One two `x`.", "- a b", "- `c`", "Three."]
