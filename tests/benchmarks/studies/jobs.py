"""What all studies share: jobs in processes, a record for each, trainings, and pages of records."""

import hashlib
import json
import multiprocessing
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from importlib import import_module
from pathlib import Path

import torch

from agents.config.entries import config_from
from agents.config.reading import recipe_for
from rigid_envs.base.files import lined_json, write_atomic
from rigid_envs.engine.provenance import provenance, versions
from rigid_envs.scores.leaderboard import file_of
from rigid_envs.tools.cli.words import say
from tests.agents.trainings import begun

NAMES = ("exploration", "holding", "critics")
"""Studies, each a module of its name.

Of a module, ``jobs(quick)`` gives the jobs as JSON values, each with a "name" of its own, ``work``
the JSON values found by one of them, ``results`` the Markdown of a list of records, and ``draw``
their figure. Beside it, the text of the page says claim and method.
"""

DOCS = Path(__file__).resolve().parents[3] / "docs" / "studies"
NONE = "There are no results yet.\n"
_HERE = Path(__file__).parent
_NEVER = 10**9


def study_of(name):
    """The module of a study."""
    return import_module(f"tests.benchmarks.studies.{name}")


def run(name, folder, n_jobs, quick=False):
    """Do the jobs of a study that have no record, and write one for each.

    Args:
        name: Of the study.
        folder: Of all studies; records go into `NAME` in it.
        n_jobs: Number of processes.
        quick: Little of it, for a first look; its jobs are others.
    """
    jobs = study_of(name).jobs(quick)
    files = [folder / name / f"{job['name']}.json" for job in jobs]
    left = [pair for pair in zip(jobs, files, strict=True) if not _is_done(*pair)]
    say(f"{len(jobs) - len(left)} of {len(jobs)} have their record")
    spawned = multiprocessing.get_context("spawn")  # torch and forks do not go together
    with ProcessPoolExecutor(n_jobs, spawned) as pool:
        started = [pool.submit(_record, name, job, file) for job, file in left]
        for number, future in enumerate(as_completed(started), 1):
            say(f"[{number}/{len(left)}] {future.result()}")


def _is_done(job, file):
    """Whether there is a record of a job; that of a job that has changed is none."""
    return file.is_file() and json.loads(file.read_text())["job"] == job


def _record(name, job, file):
    """Do a job and write its record; what to say of it."""
    torch.set_num_threads(1)
    begin = time.process_time()
    found = study_of(name).work(job)
    seconds = round(time.process_time() - begin, 1)
    where = provenance()
    where["versions"] |= versions(("stable-baselines3", "torch"))
    file.parent.mkdir(parents=True, exist_ok=True)
    record = {"job": job, "found": found, "cpu_seconds": seconds, "provenance": where}
    write_atomic(file, lined_json(record))
    return f"{job['name']}: {seconds:.1f} s"


def train(entries, each=lambda trainer: None):
    """A PPO or SAC model, trained as `agents` does, without files.

    Args:
        entries: Config entries over those of the recipe in the reduced frame, `env_id` among them.
        each: Called with the trainer before the first update and after every one.
    """
    recipe = recipe_for(entries["env_id"], entries.get("algo", "ppo"), "reduced")
    with tempfile.TemporaryDirectory() as folder:
        never = {"eval_every": _NEVER, "eval_episodes": 1, "log_dir": folder, "run_name": "run"}
        trainer = begun(config_from({**recipe, **entries, **never}))
        each(trainer)
        while not trainer.is_complete():
            trainer.iterate()
            each(trainer)
        trainer.close()
    return trainer.model


# Pages: the text beside the module, with what the records say.


def records(name, folder):
    """All records of a study, in the order of their names."""
    return [json.loads(file.read_text()) for file in sorted((folder / name).glob("*.json"))]


def digest_of(found):
    """Hash of what a figure shows."""
    return hashlib.sha256(json.dumps(found).encode()).hexdigest()


def markdown(name, found):
    """The page of a study.

    Args:
        name: Of the study.
        found: Its records.
    """
    text = (_HERE / f"{name}.md").read_text(encoding="utf-8")
    if not found:
        return text.replace("{results}", NONE.rstrip())
    cpu = sum(record["cpu_seconds"] for record in found) / 60.0
    commits = sorted({str(record["provenance"]["git_commit"])[:9] for record in found})
    where = found[0]["provenance"]
    about = (
        f"{len(found)} jobs, {cpu:.0f} minutes of {where['cpu']}, at commit {', '.join(commits)}; "
        f"raw data in `docs/studies/{name}`."
    )
    parts = (about, f"![Results]({name}.png)", study_of(name).results(found))
    return text.replace("{results}", "\n\n".join(parts))


def write_page(name, folder):
    """Write the page of a study and its figure, from the records in a folder."""
    found = records(name, folder)
    folder.mkdir(parents=True, exist_ok=True)
    if found:
        about = {"Description": digest_of(found)}
        figure = file_of(study_of(name).draw(found), about=about)
        write_atomic(folder / f"{name}.png", figure)
    write_atomic(folder / f"{name}.md", markdown(name, found))
