"""Mutation test of the laws: every wrong sign in the kernels must break one.

Run from the checkout: ``python -m tests.mutations [--subjects engine/algebra] [--jobs 2]
[--sample 20 --seed 0]``. A mutant takes a second, or ten where only the compiled
kernels show it. The status is 1 if a mutant survives that is not known to be equivalent, or if an
equivalent no longer is one.
"""

import argparse
import random
import sys
from collections import Counter
from typing import NamedTuple

from tests.mutations.known import EQUIVALENTS
from tests.mutations.mutants import mutants_of
from tests.mutations.process import shared_among
from tests.mutations.trials import PackageCopy


class Source(NamedTuple):
    """Subjects whose laws check a file of compiled functions, and functions that are left out.

    Left out are functions for observations, actions and random numbers, and those that other tests
    compare bit for bit.
    """

    subjects: tuple[str, ...]
    leave_out: frozenset[str] = frozenset()


_NO_MOTION = frozenset({"rate", "weighted_sum", "_grip", "_slips"})
"""Envelope, reward and friction, which no law of motion reads: contracts and tests of tasks do."""

SOURCES = {
    "systems/free_body/dynamics": Source(("free_body",)),
    "systems/heavy_top/dynamics": Source(("heavy_top",)),
    "systems/rolling_ball/dynamics": Source(("rolling_ball",)),
    "systems/dynamic_ball/dynamics": Source(
        ("dynamic_ball",), frozenset({"level_step", "level_ground_force"})
    ),
    "systems/rolling_disk/dynamics": Source(("rolling_disk",)),
    "systems/rolling_disk/friction": Source(("euler_disk",)),
    "systems/upright_coin/dynamics": Source(("upright_coin",)),
    "systems/roller/dynamics": Source(("roller",)),
    "systems/spheroid/dynamics": Source(("spheroid",)),
    "systems/thrown_body/dynamics": Source(("thrown_body",)),
    "systems/gyrostat/dynamics": Source(("gyrostat",)),
    "systems/satellite/dynamics": Source(("satellite",)),
    "engine/algebra": Source(
        ("heavy_top", "rolling_ball", "rolling_disk", "free_body"),
        frozenset({"matrix", "matrix_product", "unit_quaternion", "log_rotation", "scaled"}),
    ),
    "engine/elementary": Source(
        ("roller", "dynamic_ball", "rolling_disk", "euler_disk"),
        frozenset({"atan2", "cbrt", "clamp", "expm1", "log", "select", "tanh"}),
    ),
}


def main(argv=None):
    """Check the laws against mutants and print the results."""
    options = _options(argv)
    copies = [PackageCopy() for _ in range(options.jobs)]
    try:
        _refuse_broken_laws(copies[0], options.subjects)
        every = [
            (name, mutant)
            for name in options.subjects
            for mutant in mutants_of(copies[0].source(name), SOURCES[name].leave_out | _NO_MOTION)
        ]
        chosen = every
        if options.sample is not None:
            chosen = random.Random(options.seed).sample(every, min(options.sample, len(every)))
            chosen.sort(key=every.index)
        trials = _try_all(chosen, copies)
    finally:
        for copy in copies:
            copy.close()
    left = survivors(trials)
    _show(trials, left)
    mistaken = _mistaken(every, trials, options.subjects)
    for equivalent, what in mistaken:
        print(f"\n{equivalent.source}.py ({equivalent.function}) `{equivalent.term}`: {what}")
    return 1 if mistaken or left else 0


def survivors(trials):
    """Trials that no law has noticed and that are not known to be equivalent."""
    known = {(e.source, e.key) for e in EQUIVALENTS}
    return [t for t in trials if not t.law and (t.source, t.mutant.key) not in known]


def _show(trials, left):
    """Print how many mutants each law was the first to notice, and those that none has."""
    first = Counter(t.law for t in trials if t.law and not t.is_void)
    void = sum(t.is_void for t in trials)
    print("| law that was the first to fail | mutants |\n|---|---:|")
    for law, count in first.most_common():
        print(f"| {law} | {count} |")
    print(f"\n{len(trials) - void} mutants, {first.total()} noticed, {len(left)} survived;")
    print(f"{void} terms more are tuples, which have no sign: they do not compile.")
    print("\nSurvivors:" if left else "\nNo survivor.")
    for each in left:
        place = f"{each.source}.py:{each.mutant.line} ({each.mutant.function})"
        print(f"- {place} `{each.mutant.term}` in `{each.mutant.text}`")


def _options(argv):
    parser = argparse.ArgumentParser("tests.mutations", allow_abbrev=False)
    parser.add_argument(
        "--subjects",
        nargs="+",
        choices=SOURCES,
        default=list(SOURCES),
        metavar="FILE",
        help="only these files of the package: " + ", ".join(SOURCES),
    )
    parser.add_argument("--jobs", type=int, default=1, help="processes at a time")
    parser.add_argument("--sample", type=int, help="only so many mutants, drawn at random")
    parser.add_argument("--seed", type=int, default=0, help="of the sample")
    return parser.parse_args(argv)


def _refuse_broken_laws(copy, names):
    """Stop if a law fails without any mutant."""
    subjects = dict.fromkeys(s for name in names for s in SOURCES[name].subjects)
    law, error = copy.first_broken(tuple(subjects))
    if law:
        raise SystemExit(f"a law fails without any mutant: {law} ({error})")


def _try_all(chosen, copies):
    def one(copy, each):
        name, mutant = each
        trial = copy.mutated(name, mutant, SOURCES[name].subjects)
        verdict = f"{trial.law} ({trial.error})" if trial.law else "SURVIVED"
        number = f"{chosen.index(each) + 1}/{len(chosen)}"
        place = f"{name}.py:{mutant.line} {mutant.term}"
        print(f"{number} {place}: {verdict}", file=sys.stderr, flush=True)
        return trial

    return list(shared_among(copies, chosen, one))


def _mistaken(every, trials, names):
    """Equivalents that are no longer in the source, or that a law has noticed."""
    there = {(name, mutant.key) for name, mutant in every}
    noticed = {(t.source, t.mutant.key): t.law for t in trials if t.law}
    found = []
    for known in EQUIVALENTS:
        key = (known.source, known.key)
        if known.source in names and key not in there:
            found.append((known, "is called equivalent, but there is no such term"))
        elif key in noticed:
            found.append((known, f"is called equivalent, but {noticed[key]} notices it"))
    return found


if __name__ == "__main__":
    sys.exit(main())
