"""A command ends in one line that names what is wrong, and tells its progress in one till then."""

import io
import itertools
import logging
import re
import shlex

import pytest

from rigid_envs.mechanics.laws import Outcome
from rigid_envs.scores.best import best_known
from rigid_envs.scores.evaluation import evaluate
from rigid_envs.tools.cli import main
from rigid_envs.tools.cli import words as progress
from rigid_envs.tools.laws import SUBJECTS
from tests.cli.test_bench import FIGURES
from tests.paths import NOT_A_FILE, NOT_A_FOLDER, PATHS

NO_IDS = ("BalPark", "rigidenvs/ballpark-v0", "RigidEnvs/BallPark-v7")
READ = [
    ["replay", "PATH"],
    ["replay", "PATH", "--html", "out.html"],
    ["leaderboard", "PATH"],
    ["evaluate", "BallPark", "--policy", "PATH", "--starts", "2"],
    ["best", "BallPark", "--with", "PATH"],
    ["dataset", "--check", "PATH"],
    ["dataset", "BallPark", "--policy", "PATH", "--episodes", "1"],
    ["verify", "--policies", "PATH"],
    ["verify", "PATH/row.json"],
    ["describe", "PATH"],
    ["compile", "PATH"],
    ["play", "PATH"],
    ["list", "--allow-import", "PATH"],
]
WRITTEN = [
    ["docs", "PATH", "--ids", "BallPark"],
    ["films", "PATH", "--ids", "BallPark"],
    ["gallery", "racket", "--out", "PATH"],
    ["best", "BallPark", "--starts", "1", "--out", "PATH"],
    ["bench", "--quick", "--ids", "BallPark", "--json", "PATH/out.json"],
    ["verify", "--json", "PATH/out.json"],
    ["frames", "--ids", "BallPark", "--page", "PATH/page.md"],
    ["evaluate", "BallPark", "--policy", "zero", "--starts", "2", "--out", "PATH/out.json"],
]

REFUSED = [
    ("list --all", "argument = '--all'"),
    *((f"describe {word}", "did you mean 'RigidEnvs/BallPark-v0'") for word in NO_IDS),
    ("describe BallPark --radiu 2", "config.radiu: unknown key; did you mean 'radius'?"),
    ("describe BallPark --radius -2", "radius: radius = -2; expected a number in [1e-09, 1e+06]"),
    ("describe BallPark --rotation angles", "rotation: rotation = 'angles'; expected one of"),
    ("describe BallPark --radius", "argument = '--radius'; expected --KEY VALUE"),
    ("describe BallPark radius 2", "argument = 'radius'"),
    ("compile BallPrk", "did you mean 'RigidEnvs/BallPark-v0'?"),
    ("compile BallPark --frame nowhere", "frame = 'nowhere'; expected one of"),
    ("compile BallPark --jobs 0", "--jobs = 0; expected 1 or more"),
    ("bench --ids BalPark-v0", "did you mean 'RigidEnvs/BallPark-v0'"),
    ("bench --json no/bench.json", "--json = no/bench.json; expected a file in a folder that ex"),
    ("verify heavytop", "subject = 'heavytop'; expected one of rotations, "),
    ("verify --json heavy_top", "heavy_top; expected a file: name subjects before --json"),
    ("verify --json no/laws.json", "--json = no/laws.json; expected a file in a folder that ex"),
    ("verify --fast", "argument = '--fast'; expected"),
    ("--scors verify", "of those that --help lists: did you mean --scores?"),
    ("evalute BallPark --policy zero", ": did you mean 'evaluate'?"),
    ("verify --scors", "of those that --help lists: did you mean --scores?"),
    ("play BallPark --sead 3 --help-keys", "argument 'sead'): did you mean --seed?"),
    ("verify --scores --json", "--json = -; expected only --scores, SUBJECT where scores"),
    ("verify --policies --json x.json", "--json = x.json; expected only --policies, --seed"),
    ("verify --policies BallPark --scores", "--scores = True; expected only --policies"),
    ("verify --seed 3", "--seed = 3; expected only SUBJECT, --json where laws are verified"),
    ("verify --policy zero", "--policy = zero; expected only SUBJECT, --json where laws"),
    ("best Detumble --starts 5", "with --out if it is less"),
    ("best --with x.npz", "expected the one id"),
    ("best Detumble --out none", "expected a folder that exists"),
    ("optima Detumble --prove", "expected one of RigidEnvs/BallPark-v0, RigidEnvs/BallParkGoal-v0"),
    ("optima Detumble", "expected one of RigidEnvs/BallPark-v0, RigidEnvs/BallParkGoal-v0"),
    ("evaluate Detumble --policy a.npz --starts 5", "expected no other option"),
    ("evaluate Detumble --policy a.npz --dt 0.1", "expected no other option"),
    ("evaluate Detumble --policy pid", "controller = 'pid'; expected one of"),
    ("evaluate BallPark --policy nmpc --starts 1", "controller = 'nmpc'; expected one of"),
    ("compare BallPark --policy zero --policy zero", "--policy = 'zero'; expected another name"),
    ("compare BallPark --policy zero --out x.doc", "--out = 'x.doc'; expected names with one of"),
    ("compare BallPark --policy zero --out no/x.tex", "--out = no/x.tex; expected a file in a fol"),
    ("leaderboard .", "expected results below it"),
    ("play CoinParc-v0", "did you mean 'RigidEnvs/CoinPark-v0'?"),
    ("play CoinPark --radus 1", "config.radus: "),
    ("play CoinPark --radus 1 --help-keys", "config.radus: "),
    ("play CoinPark --size 10", "size = 10; expected an integer of at least 240"),
    ("play CoinPark --save no/mine.npz", "--save = no/mine.npz; expected a file in"),
    ("dataset --policy random", "expected ID and --policy NAME, or --check DATASET"),
    ("dataset BallPark", "expected ID and --policy NAME, or --check DATASET"),
    ("dataset BallPrak --policy random", "did you mean 'RigidEnvs/BallPark-v0'"),
    ("dataset BallPark --policy lqr", "'shortest_path', 'three_rolls', the name of a published"),
    ("dataset BallPark --policy no.safetensors", "no.safetensors'; expected the path of a"),
    ("dataset BallPark --policy random --episodes 0", "episodes = 0; expected an integer"),
    ("dataset BallPark --policy random --seed -1", "seed = -1; expected an integer"),
    ("dataset BallPark --policy random --name 'a b'", "name = 'a b'; expected NAMESPACE"),
    ("dataset BallPark --policy random --name x", "name = 'x'; expected NAMESPACE"),
    ("dataset BallPark --policy random --radios 1", "config.radios: unknown key"),
    ("dataset BallPark --policy reference --frame reduced", "acts in that frame\n"),
    ("dataset --check 'a b'", "name = 'a b'; expected NAMESPACE"),
    ("dataset BallPark --check mine-v0", "argument = 'BallPark'; expected one of those that --h"),
]

FIXED = [  # verbs that take no hyperparameters
    *(["list"], ["docs", "new"], ["bench"], ["verify"], ["verify", "--policies"], ["best"]),
    *(["leaderboard", "."], ["frames"], ["films", "new"], ["gallery", "--out", "new"]),
    *(["replay", "some.npz"], ["dataset", "--check", "some"], ["optima"]),
]
OPEN = [
    *(["describe", "BallPark"], ["compile", "BallPark"], ["play", "BallPark", "--help-keys"]),
    ["evaluate", "BallPark", "--policy", "zero", "--starts", "1", "--out", "new"],
    ["compare", "BallPark", "--policy", "zero", "--starts", "1", "--out", "new.tex"],
    ["dataset", "BallPark", "--policy", "random", "--episodes", "1", "--out", "new"],
]


@pytest.mark.parametrize("words", FIXED + OPEN, ids=" ".join)
def test_an_option_that_a_verb_does_not_have_is_refused_before_anything_is_done(
    tmp_path, monkeypatch, capsys, words
):
    monkeypatch.chdir(tmp_path)
    assert main([*words, "--nonsense", "1"]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1
    assert ("argument = '--nonsense'" if words in FIXED else "config.nonsense: unknown") in err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("words", "message"), REFUSED)
def test_a_mistake_is_answered_in_one_line_before_anything_is_done(
    tmp_path, monkeypatch, capsys, words, message
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "sets"))
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    assert main(shlex.split(words)) == 2
    out, err = capsys.readouterr()
    assert message in err and err.startswith("rigid-envs: ") and err.count("\n") == 1
    assert out == "" and not list(tmp_path.rglob("*.*"))


def test_all_verbs_are_asked(capsys):
    with pytest.raises(SystemExit):
        main(["--help"])
    told = capsys.readouterr().out
    verbs = re.findall(r"^    (\w+)\b", told, re.MULTILINE)
    assert re.search("^    list +all environments$", told, re.MULTILINE)
    assert len(verbs) > 10 and set(verbs) == {words[0] for words in FIXED + OPEN}


@pytest.mark.parametrize("kind", NOT_A_FILE)
@pytest.mark.parametrize("words", READ, ids=" ".join)
def test_what_is_not_there_or_not_what_it_should_be_is_named_in_one_line(
    tmp_path, monkeypatch, capsys, words, kind
):
    monkeypatch.chdir(tmp_path)
    refuse(PATHS[kind](tmp_path), words, capsys)
    assert not (tmp_path / "out.html").exists()


@pytest.mark.parametrize("kind", NOT_A_FOLDER)
@pytest.mark.parametrize("words", WRITTEN, ids=" ".join)
def test_what_cannot_be_a_folder_is_named_in_one_line(tmp_path, capsys, words, kind):
    refuse(PATHS[kind](tmp_path), words, capsys)


def test_a_file_in_the_place_of_a_folder_of_pages_is_a_mistake_of_the_caller(tmp_path, capsys):
    (tmp_path / "docs").write_text("mine")
    assert main(["docs", str(tmp_path / "docs"), "--ids", "BallPark"]) == 2
    assert "docs; expected a folder: this is a file" in capsys.readouterr().err
    assert (tmp_path / "docs").read_text() == "mine"


def refuse(path, words, capsys):
    """Run a command that must end in one line with the path in it, and change no file there."""
    before = path.read_bytes() if path.is_file() else None
    assert main([word.replace("PATH", str(path)) for word in words]) in (1, 2)
    said = capsys.readouterr().err
    assert said.startswith("rigid-envs: ") and said.count("\n") == 1, said
    assert str(path) in said
    assert before is None or path.read_bytes() == before


def test_the_name_of_a_file_cannot_steer_the_terminal(tmp_path, capsys):
    (tmp_path / "\x1b[2J\r.json").touch()
    assert main(["leaderboard", str(tmp_path)]) == 2
    assert "\\x1b[2J\\r.json" in capsys.readouterr().err


@pytest.fixture
def clock(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(progress, "_pace", progress._Pace())
    return now


def test_off_a_terminal_lines_come_ever_more_seldom(clock, capsys):
    times = []
    for second in range(3600):
        clock[0] = float(second)
        progress.tell(f"{second}")
        times += [int(line) for line in capsys.readouterr().err.splitlines()]
    assert times[0] == 10 and len(times) < 60
    gaps = [b - a for a, b in itertools.pairwise(times)]
    assert gaps == sorted(gaps) and gaps[0] == 10 and gaps[-1] > 300


def test_a_quick_command_says_nothing_and_a_cleared_line_neither(clock, capsys):
    progress.tell("1 of 500")
    clock[0] = 60.0
    progress.tell("")
    assert capsys.readouterr().err == ""


def test_off_a_terminal_the_last_line_says_how_far_it_came(clock, capsys):
    for clock[0], what in enumerate([*(f"{k} of 15" for k in range(16)), "", "1 of 2", ""]):
        progress.tell(what)
        if what == "12 of 15":
            progress.say("this stays")
    assert capsys.readouterr().err == "10 of 15\nthis stays\n15 of 15\n"


def test_on_a_terminal_it_is_one_line(clock, capsys, monkeypatch):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    progress.tell("1 of 500")
    progress.tell("")
    assert capsys.readouterr().err == "\r\x1b[K1 of 500\r\x1b[K"


CLEAR = "\r\x1b[K"
WORK = {  # of the verbs that tell progress: what does it, and what it gives; None is left to do it
    "dataset BallPark --policy zero": ("rigid_envs.tools.datasets.write", "name"),
    "evaluate BallGrid --policy zero --starts 1": None,
    "compare BallGrid --policy zero --policy row.json --starts 1": None,
    "best BallGrid": ("rigid_envs.tools.cli.scoring._measured", best_known("BallGrid")),
    "bench --ids BallGrid": ("rigid_envs.tools.bench.bench", FIGURES),
    "verify upright_coin": (
        "rigid_envs.tools.laws.check_all",
        [Outcome(SUBJECTS["upright_coin"].laws[0], 0.0, 0.0)],
    ),
    "verify --policies BallGrid": None,
    "verify --scores BallGrid": ("rigid_envs.scores.best.best_known", None),
    "verify row.json": None,
    "gallery racket --out .": ("rigid_envs.tools.gallery.write_figures", []),
    "films . --ids BallGrid": ("rigid_envs.tools.cli.watching.write_films", None),
    "frames --ids BallGrid": ("rigid_envs.tools.bench.figures.frame_times", []),
    "compile BallGrid": ("rigid_envs.envs.lookup.compile_all", [("BallGrid step", True)]),
}


class Stream(io.StringIO):
    """One of the streams of a command to a terminal, where what both say stands together."""

    def __init__(self, screen):
        super().__init__()
        self.screen = screen

    def isatty(self):
        return True

    def write(self, text):
        self.screen.append(text)
        return super().write(text)

    def lines(self):
        """What stands on the terminal in the end."""
        return [line.rpartition(CLEAR)[2] for line in "".join(self.screen).split("\n")]


def streams(monkeypatch):
    """Those of output and of errors, from here on."""
    screen = []
    out, err = Stream(screen), Stream(screen)
    monkeypatch.setattr("sys.stdout", out)
    monkeypatch.setattr("sys.stderr", err)
    return out, err


def told(result):
    """Work that tells progress wherever it can, and gives a result or an error."""

    def work(*args, **more):
        for each in (*args, *more.values()):
            if callable(each):
                each("half way")
        if isinstance(result, BaseException):
            raise result
        return result

    return work


@pytest.mark.parametrize("words", WORK)
def test_on_a_terminal_nothing_stands_behind_the_progress_and_in_the_end_it_is_gone(
    tmp_path, monkeypatch, words
):
    monkeypatch.chdir(tmp_path)
    evaluate("BallGrid", "zero", n=1).save("row.json")
    if work := WORK[words]:
        monkeypatch.setattr(work[0], told(work[1]))
    out, err = streams(monkeypatch)
    assert main(words.split()) in (0, 1)
    assert any(err.getvalue().split(CLEAR))
    assert out.getvalue() or words.startswith("films")  # all others say what came of it
    assert err.lines() == out.getvalue().split("\n")


def test_what_is_logged_has_a_line_of_its_own_on_the_stream_of_the_moment(monkeypatch):
    log = logging.getLogger("rigid_envs.engine")
    with progress.messages():
        _, err = streams(monkeypatch)
        progress.tell("half way")
        log.info("compiled the step")
        progress.tell("whole")
        progress.tell("")
    log.warning("compiled the reset")
    assert err.lines() == ["rigid-envs: compiled the step", ""]


@pytest.mark.parametrize(
    ("error", "status"), [(ValueError("bad"), 2), (OSError("bad"), 1), (KeyboardInterrupt(), 130)]
)
def test_what_ends_a_command_has_a_status_and_a_line_of_its_own(monkeypatch, error, status):
    monkeypatch.setattr("rigid_envs.tools.laws.check_all", told(error))
    _, err = streams(monkeypatch)
    assert main(["verify", "upright_coin"]) == status
    assert "half way" in err.getvalue()
    assert "\n".join(err.lines()) == ("rigid-envs: bad\n" if error.args else "")


def test_ctrl_c_ends_a_command_that_has_not_begun_yet(monkeypatch):
    monkeypatch.setattr("rigid_envs.tools.cli.command_line.run", told(KeyboardInterrupt()))
    _, err = streams(monkeypatch)
    assert main(["list"]) == 130
    assert err.getvalue() == ""
