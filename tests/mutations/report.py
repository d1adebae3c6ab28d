"""Trials as Markdown for people and as JSON for programs."""

from collections.abc import Iterable, Sequence
from typing import Any

from tests.mutations.known import Equivalent
from tests.mutations.trials import Trial


def survivors(trials: Iterable[Trial], equivalents: Iterable[Equivalent]) -> list[Trial]:
    """Trials that no law has noticed and that are not known to be equivalent."""
    known = {(e.source, e.key) for e in equivalents}
    return [t for t in trials if not t.law and (t.source, t.mutant.key) not in known]


def as_markdown(trials: Sequence[Trial], equivalents: Sequence[Equivalent]) -> str:
    """A table of all functions, and the survivors one by one."""
    left = survivors(trials, equivalents)
    lines = ["| file | function | mutants | killed | equivalent | survived |"]
    lines.append("|---|---|---:|---:|---:|---:|")
    places = dict.fromkeys((t.source, t.mutant.function) for t in trials if not t.is_void)
    for place in places:
        here = [t for t in trials if (t.source, t.mutant.function) == place and not t.is_void]
        lines.append(_row(*place, here, left))
    lines.append(_row("all", "", [t for t in trials if not t.is_void], left))
    void = sum(t.is_void for t in trials)
    lines.append(f"\n{void} terms more are tuples, which have no sign: they do not compile.")
    lines.append("\nSurvivors:" if left else "\nNo survivor.")
    lines += [f"- {place_of(t)} `{t.mutant.term}` in `{t.mutant.text}`" for t in left]
    return "\n".join([*lines, "", *_kills_by_law(trials)])


def place_of(trial: Trial) -> str:
    """File, line and function of a mutant."""
    return f"{trial.source}.py:{trial.mutant.line} ({trial.mutant.function})"


def _row(source: str, function: str, here: Sequence[Trial], left: Sequence[Trial]) -> str:
    killed, survived = sum(bool(t.law) for t in here), sum(t in left for t in here)
    equivalent = len(here) - killed - survived
    return f"| {source} | {function} | {len(here)} | {killed} | {equivalent} | {survived} |"


def _kills_by_law(trials: Iterable[Trial]) -> list[str]:
    """How many mutants each law was the first to notice."""
    laws = [t.law for t in trials if t.law and not t.is_void]
    lines = ["| law that was the first to fail | mutants |", "|---|---:|"]
    counts = {law: laws.count(law) for law in dict.fromkeys(laws)}
    for law, count in sorted(counts.items(), key=lambda item: -item[1]):
        lines.append(f"| {law} | {count} |")
    return lines


def as_json(trials: Iterable[Trial]) -> list[dict[str, Any]]:
    """Every trial with its place, term, law and error."""
    return [
        {
            "file": f"rigid_envs/{t.source}.py",
            "line": t.mutant.line,
            "function": t.mutant.function,
            "term": t.mutant.term,
            "text": t.mutant.text,
            "nth": t.mutant.nth,
            "law": t.law,
            "error": t.error,
            "void": t.is_void,
        }
        for t in trials
    ]
