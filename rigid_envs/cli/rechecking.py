"""Evaluated again: `rigid-envs verify --policies` and `rigid-envs verify FILE.json`."""

from __future__ import annotations

import time
from collections.abc import Sequence

from rigid_envs.cli.progress import tell
from rigid_envs.pages.tables import table
from rigid_envs.provenance import heading, provenance

__all__ = ["verify_policies", "verify_results"]

_HEADER = ("policy", "acts as", "success", "published", "efficiency", "published", "seconds", "")


def verify_results(files: Sequence[str], policy: str | None) -> bool:
    """Play the episodes of results again.

    Args:
        files: From `rigid-envs evaluate --out`.
        policy: Name or file of the policy; None takes the one that each result names.

    Returns:
        Whether every number of every start is hit to the last digit.
    """
    from rigid_envs.scores import repeat

    print(heading(provenance()), end="\n\n")
    holds = True
    for file in files:
        tell(file)
        again = repeat(file, policy)
        tell("")
        then, n = again.then, again.then.n
        print(f"{file}: {then.env_id}, {then.policy}, {n} starts of seed {then.seed}")
        for line in again.differences:
            print(f"FAILS: {line}")
        if again.differences:
            rates = (f"{100 * each.success.mean:.1f} %" for each in (then, again.now))
            print("success {} then, {} now".format(*rates))
        else:
            print("every number of every start is the same, to the last digit")
        holds &= not again.differences
    return holds


def verify_policies(names: Sequence[str], seed: int | None) -> bool:
    """Evaluate published policies again.

    Args:
        names: Their names; all if there are none.
        seed: Seed of other starts than the published ones; None takes those.

    Returns:
        Whether all published figures are hit.
    """
    from rigid_envs.policies import published
    from rigid_envs.scores.published import recheck

    print(heading(provenance()), end="\n\n")
    rows, complaints = [], []
    for name in names or published():
        tell(name)
        begin = time.perf_counter()
        again = recheck(name, seed)
        record, found = again.record, again.found
        efficiency = None if found.efficiency is None else found.efficiency.mean
        figures = (
            f"{100 * found.success.mean:.1f} %",
            f"{100 * record.success_rate:.1f} %",
            *("-" if each is None else f"{each:.4f}" for each in (efficiency, record.efficiency)),
            f"{time.perf_counter() - begin:.1f}",
        )
        rows.append(
            (again.name, record.policy, *figures, "FAILS" if again.differences else "holds")
        )
        complaints += [f"{again.name}: {line}" for line in again.differences]
    tell("")
    print(table(_HEADER, rows, "<<>>>>><"))
    for line in complaints:
        print(f"FAILS: {line}")
    claim = (
        "success and cost of every published start, compared to the last digit"
        if seed is None
        else f"success from starts of seed {seed}, compared with the 95 % interval published"
    )
    print(f"\n{claim}: {len(rows)} policies")
    return not complaints
