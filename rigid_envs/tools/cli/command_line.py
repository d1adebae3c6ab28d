"""Arguments of the command `rigid-envs`, and its verbs."""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

from rigid_envs.base.checks import one_named
from rigid_envs.base.files import write_atomic
from rigid_envs.engine.provenance import provenance
from rigid_envs.envs import lookup as catalogue
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools import bench
from rigid_envs.tools.cli import collecting, scoring, watching, words
from rigid_envs.tools.pages.document import describe
from rigid_envs.tools.pages.tables import list_all
from rigid_envs.tools.pages.writing import description, overview_as_data, write_pages


def run(argv: Sequence[str] | None = None) -> int:
    """Run the command.

    Args:
        argv: arguments; None takes those of the process.

    Returns:
        Exit status: 0; 1 if a law, a score or a figure's number does not hold, a package is
        missing or a file cannot be read or written; 2 for wrong arguments; 130 after Ctrl-C.
    """
    return words.answer(_parser(), argv)


def _parser() -> argparse.ArgumentParser:
    return words.parser_of(
        "rigid-envs",
        "Environments of rotating and rolling rigid bodies.",
        *(list_, describe_, collecting.compile_, watching.play_, docs_, bench_, verify_),
        *(
            scoring.evaluate_,
            scoring.compare_,
            scoring.best_,
            scoring.optima_,
            scoring.leaderboard_,
        ),
        *(collecting.dataset_, watching.frames_, watching.films_, watching.gallery_),
        watching.replay_,
    )


@words.verb(words.option("--json", action="store_true", help="print JSON instead of tables"))
def list_(options: argparse.Namespace) -> None:
    """All environments."""
    as_json = json.dumps([overview_as_data(env_id) for env_id in ENVIRONMENTS], indent=1)
    print(as_json if options.json else list_all())


@words.verb(
    words.option("id", metavar="ID"),
    words.option("--json", action="store_true", help="print JSON instead of a page"),
    usage="rigid-envs describe ID [--json] [--KEY VALUE ...]",
)
def describe_(options: argparse.Namespace) -> None:
    """One environment: action, observation, reward, hyperparameters.

    Describe an environment. Any hyperparameter can be given as an option, a range as LOW,HIGH:
    --dt 0.05 --I1 0.5,0.9
    """
    config = words.config_of(options.rest)
    if options.json:
        print(json.dumps(description(options.id, config), indent=1, allow_nan=False))
    else:
        print(describe(options.id, config))


@words.verb(words.option("folder", metavar="FOLDER", type=Path), words.IDS)
def docs_(options: argparse.Namespace) -> None:
    """A page for every environment, in Markdown.

    Write a page for every environment, and their index README.md, from the docstrings. In the
    repository they are in docs/environments.
    """
    if options.folder.exists() and not options.folder.is_dir():
        raise ValueError(f"FOLDER = {options.folder}; expected a folder: this is a file")
    ids = options.ids and words.checked_ids(options.ids)
    changed, strangers = write_pages(options.folder, ids)
    print(f"written to {options.folder}: {', '.join(changed) or 'nothing, all is as it was'}")
    if strangers:
        print(f"no id has these, remove them: {', '.join(strangers)}")


@words.verb(
    words.IDS,
    words.option("--quick", action="store_true", help="a first look, a minute"),
    words.option("--json", type=Path, metavar="FILE", help="write every sample there"),
)
def bench_(options: argparse.Namespace) -> None:
    """Speed and accuracy, beside Gymnasium's environments and MuJoCo.

    Measure environment steps per second of every environment, single and vectorised, beside
    Gymnasium's CartPole and Pendulum and, where it is installed, a free body in MuJoCo, all in one
    interleaved run; then accuracy and start-up. Takes about five minutes on an idle machine.
    """
    ids = words.checked_ids(options.ids or ENVIRONMENTS)
    words.refuse_missing_folder("--json", options.json)
    where = provenance()  # before the run: its own load does not count
    startup_ids = ids[:1] if options.quick else catalogue.one_of_each(ids)
    figures = bench.bench(ids, startup_ids, options.quick, words.tell)
    words.tell("")
    print(collecting.as_text(where, figures))
    if options.json:
        document = {"provenance": where, **figures.as_json()}
        write_atomic(options.json, json.dumps(document, indent=1) + "\n")
        print(f"\nwritten to {options.json}")


_VERIFIED = {
    "results": ("FILE.json", "--policy"),
    "policies": ("--policies", "--seed"),
    "scores": ("--scores", "SUBJECT"),
    "laws": ("SUBJECT", "--json"),
}
"""What can be verified, and the words that make sense beside one another."""


@words.verb(
    words.option(
        "subjects",
        nargs="*",
        metavar="SUBJECT|FILE.json",
        help="only these subjects; or instead results of `rigid-envs evaluate --out`, whose "
        "episodes are played again and compared to the last digit",
    ),
    words.option(
        "--json",
        nargs="?",
        const="-",
        metavar="FILE",
        help="print JSON instead of tables, or write it to FILE as well",
    ),
    words.option(
        "--scores",
        action="store_true",
        help="instead play the untrained policies of the ids given as subjects, or of one for "
        "every system, and compare their success and efficiency with the data",
    ),
    words.option(
        "--policies",
        nargs="*",
        metavar="NAME",
        help="instead evaluate published policies again, all or those named, and compare "
        "success and cost from every start with what is published, to the last digit",
    ),
    words.option("--seed", type=int, help="with --policies: other starts than the published ones"),
    words.option(
        "--policy",
        metavar="NAME|FILE",
        help="with FILE.json: the policy it is of, as of `rigid-envs evaluate`; not needed for "
        "controllers and published policies, which the file names",
    ),
)
def verify_(options: argparse.Namespace) -> int:
    """The laws of the physics, each with its error and its bound.

    Compare the physics with closed forms, conserved quantities and Newton's law in world axes. The
    exit status is 1 if a law does not hold. Takes half a minute the first time, a few seconds
    later.
    """
    what = _asked(options)
    if what == "results":
        holds = scoring.verify_results(options.subjects, options.policy)
    elif what == "policies":
        holds = scoring.verify_policies(options.policies, options.seed)
    elif what == "scores":
        holds = scoring.verify_scores(words.checked_ids(options.subjects))
    else:
        holds = _verify_laws(options)
    return 0 if holds else 1


def _asked(options: argparse.Namespace) -> str:
    """What is to be verified.

    Raises:
        ValueError: a word that makes no sense beside the others.
    """
    files = [name for name in options.subjects if name.endswith(".json")]
    subjects = [name for name in options.subjects if name not in files]
    options_given = {
        f"--{name}": getattr(options, name)
        for name in ("policies", "scores", "json", "seed", "policy")
        if getattr(options, name) not in (None, False)
    }
    given = options_given | ({"FILE.json": files} if files else {})
    given |= {"SUBJECT": subjects} if subjects else {}
    what = next((name for name, known in _VERIFIED.items() if known[0] in given), "laws")
    for word in given.keys() - _VERIFIED[what]:
        beside = ", ".join(_VERIFIED[what])
        expected = f"only {beside} where {what} are verified"
        raise ValueError(f"{word} = {given[word]}; expected {expected}")
    return what


def _verify_laws(options: argparse.Namespace) -> bool:
    from rigid_envs.tools.laws import SUBJECTS, verify  # imports SciPy: only here

    names = [one_named(name, SUBJECTS, "subject") for name in options.subjects]
    if options.json in SUBJECTS:
        raise ValueError(f"--json = {options.json}; expected a file: name subjects before --json")
    file = Path(options.json) if options.json not in (None, "-") else None
    words.refuse_missing_folder("--json", file)
    verdict = verify(list(dict.fromkeys(names)), words.tell)
    words.tell("")
    document = json.dumps(verdict.as_json(), indent=1, allow_nan=False)
    print(document if options.json == "-" else verdict.as_text())
    if file:
        write_atomic(file, document + "\n")
        print(f"\nwritten to {file}")
    return not verdict.failures
