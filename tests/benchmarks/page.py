"""The page docs/speed.md, from docs/speed.json."""

import statistics
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from rigid_envs.tools.cli.collecting import as_factor, as_time
from rigid_envs.tools.pages.tables import Table
from rigid_envs.tools.pages.writing import as_markdown

_HEAD = """\
<!-- Written by `python -m tests.benchmarks` from docs/speed.json. -->

# Speed

Figures of {cpu}, {cores} cores with nothing else to do, on {date}; Python {python}, Gymnasium
{gymnasium}, numba {numba}, NumPy {numpy}. Everything is float64. What is compared was measured in
one run, in turns: medians, and quartiles over {rounds} rounds.

```bash
rigid-envs bench                    # steps, peers, first use
python -m tests.benchmarks          # all of this page, in a checkout
python -m tests.benchmarks.targets  # beside the aims of this project
```"""
_STEPS = """
## A step

Resets included: of a single environment without its wrappers, and of one row of a vector of 4096
rows, in one thread. The dearest row costs {dearest:.1f} times as much as the median of all.
"""
_ROWS = """
Time of a row by the number of rows, in one thread and in two:
"""
_SIZES = """
With more rows than the caches hold, a step waits for memory:
"""
_OPTIONS = """
What options add to a row of `BallPark` (4096 rows, one thread), against none:
"""
_FRAMES = """
What the reduced frame adds to a row (4096 rows, one thread), against that of the world;
`python -m tests.benchmarks.frames`, on {date}:
"""
_RATIOS = """
## Against others

Steps per second over those of a peer: Gymnasium's CartPole, single and as its NumPy vector
environment; PufferLib's drone, a rigid body in C of one Euler step in float32, compiled from its
source package (`python -m tests.benchmarks.pufferlib_drone`); MuJoCo's `rollout` of the same free
body, physics only, in steps that keep the energy as well as ours do over 6000 s; two threads over
one.
"""
_LOOPS = """
## Against C

The integration loop of the free body, and the same operations in C on vectors of eight doubles
(`gcc -O3 -march=native`, `python tests/benchmarks/kernel_vs_c.py`, which also compares the other
systems): {c_text}.
"""
_LIMIT = """
## The limit

What some environments integrate in a control period, beside the same in C and what the core can do:
{fma:.0f} multiply-adds, {sum:.0f} sums, {quotient:.1f} quotients or {root:.1f} roots per
nanosecond, on vectors in registers. Operations of a row, counted from the source; not again what a
stage has computed before, and not what is the same for all rows. A multiply-add is two flops.
`python -m tests.benchmarks.flops`.
"""
_PERIODS = """
Time of a row, 4096 rows in one thread. "All fused": all flops in multiply-adds. "As written": the
operations above one after the other, products at the rate of multiply-adds; the processor can add
and divide while it multiplies, so that less is possible. "C" and "ours": loops over states, inputs
and parameters alone; of those in C the faster. "Step": all of a step, with action, reward,
observation and resets. Then our loop over three of these, with quartiles, and its share of the
step.
"""
_TRAINING = """
## Training

Where the time of PPO goes, by the recipes for the reduced frame up to their first evaluation, on
one torch thread: steps of the environment, actions of the policy; losses, gradients and Adam;
evaluation on the starts of validation. `python -m tests.benchmarks.ppo_phases`.
"""
_STOCK = """
`IntermediateAxis` by its recipe for the reduced frame, {timesteps} steps, three seeds in turns: by
Stable-Baselines3 with its own vector of single environments, with ours, and by this application,
whose times include evaluations on the way. Then returns after parts of the steps, on 100 starts
apart: means over the seeds, and the least and the largest. `python -m tests.benchmarks.stock_ppo`.
"""
_FIRST = """
## First use

From the import to the first step in a new process, which compiles the environment if no process has
before (`rigid-envs compile` does it beforehand):
"""
_N_COLUMNS = 2  # pairs of columns in the table of steps
_SHOWN = ("IntermediateAxis-v0", "BallPark-v0", "SleepingTop-v0", "DiskRoll-v0", "Reorient-v0")
_KINDS = {
    "sum": "sums",
    "product": "products",
    "fma": "multiply-adds",
    "quotient": "quotients",
    "root": "roots",
}
_TIMES = ("all fused", "as written", "C", "ours", "step")
_BOUNDS = ("all fused", "as written", "C")
_FORMS = ("N = 1", "16", "256", "4096", "2 threads")


def markdown(data: Mapping[str, Any]) -> str:
    """The page.

    Args:
        data: what `__main__` wrote into docs/speed.json.
    """
    where, bench = data["provenance"], data["bench"]
    speeds = {
        (speed["name"], speed["column"]): speed["median"] for speed in bench["steps_per_second"]
    }
    rows = [cost["ratio"] for cost in bench["costs"] if cost["column"] == "4096"]
    head = _HEAD.format(
        cpu=where["cpu"],
        cores=where["cores"],
        date=where["date"][:10],
        rounds=bench["rounds"],
        **where["versions"],
    )
    parts = [
        head,
        _STEPS.format(dearest=max(rows, default=1.0)),
        _steps(speeds),
        _ROWS,
        _by_rows(speeds),
        _SIZES,
        _sizes(data["sizes"]),
        _OPTIONS,
        _options(data["options"]),
        _FRAMES.format(date=data["frames"]["provenance"]["date"][:10]),
        _frames(data["frames"]["rows"]),
        _RATIOS,
        _ratios([*bench["ratios"], data["drones"]]),
        _LOOPS.format(c_text=_in_words(data["loops"])),
        _loops(data["loops"]),
        _LIMIT.format(**data["limit"]["per_nanosecond"]),
        _operations(data["limit"]["periods"]),
        _PERIODS,
        _periods(data["limit"]["periods"]),
        _TRAINING,
        _training(data["training"]),
        _STOCK.format(timesteps=f"{data['stock'][0]['timesteps']:,}"),
        _stock(data["stock"]),
        _FIRST,
        _first(bench["import_to_first_step"]),
    ]
    return "\n".join(parts) + "\n"


def _steps(speeds: Mapping[tuple[str, str], float]) -> str:
    ours = [name for name, column in speeds if column == "4096" and name.endswith("-v0")]
    cells = [(f"`{_short(n)}`", *_times(speeds, (n, "bare"), (n, "4096"))) for n in ours]
    peers = (("CartPole-v1", "CartPole-v1, NumPy", "4096"), ("Pendulum-v1", "", ""))
    cells += [(single, *_times(speeds, (single, "bare"), rest)) for single, *rest in peers]
    half = -(-len(cells) // _N_COLUMNS)
    blank = ("",) * 3
    lines = [
        (*one, *other)
        for one, other in zip(cells, [*cells[half:], *[blank] * half][:half], strict=False)
    ]
    return _table(("", "single", "row") * _N_COLUMNS, lines, "<>><>>")


def _by_rows(speeds: Mapping[tuple[str, str], float]) -> str:
    shown = {**{n: f"`{_short(n)}`" for n in _SHOWN}, "CartPole-v1, NumPy": "CartPole-v1, NumPy"}
    rows = [(text, *_times(speeds, *((n, form) for form in _FORMS))) for n, text in shown.items()]
    return _table(("", "1", "16", "256", "4096", "4096, 2 threads"), rows, "<>>>>>")


def _sizes(sizes: Sequence[Mapping[str, Any]]) -> str:
    forms = tuple(dict.fromkeys(growth["form"] for growth in sizes))
    times = {(g["name"], g["form"]): _row_time(g) for g in sizes}
    rows = [
        (f"`{name}`", *(times[name, form] for form in forms))
        for name in dict.fromkeys(growth["name"] for growth in sizes)
    ]
    head = ("", *(f"{int(form):,}" for form in forms))
    return _table(head, rows, "<" + ">" * len(forms))


def _options(options: Iterable[Mapping[str, Any]]) -> str:
    rows = [(growth["form"], _row_time(growth), *_ratio(growth)) for growth in options]
    return _table(("option", "row", "times", "quartiles"), rows, "<>>>")


def _frames(rows: Iterable[Mapping[str, Any]]) -> str:
    rows = list(rows)
    shown = [
        (f"`{there['name']}`", _row_time(here), _row_time(there), *_ratio(there))
        for here, there in zip(rows[::2], rows[1::2], strict=True)
    ]
    return _table(("", "world", "reduced", "times", "quartiles"), shown, "<>>>>")


def _row_time(found: Mapping[str, Any]) -> str:
    return as_time(1e-9 * found["nanoseconds"])


def _ratio(found: Mapping[str, Any]) -> tuple[str, str]:
    """A ratio and its quartiles."""
    return f"{found['ratio']:.2f}", " .. ".join(f"{end:.2f}" for end in found["quartiles"])


def _ratios(ratios: Iterable[Mapping[str, Any]]) -> str:
    rows = [
        (
            f"`{_short(r['name'])}`",
            r["form"],
            "one thread" if r["peer"] == r["name"] else r["peer"],
            as_factor(r["median"]),
            " .. ".join(map(as_factor, r["quartiles"])),
        )
        for r in ratios
    ]
    return _table(("", "form", "against", "faster by", "quartiles"), rows, "<<<>>")


def _loops(loops: Sequence[Mapping[str, Any]]) -> str:
    rows = [
        (
            loop["name"],
            f"{loop['nanoseconds']:.1f} ns",
            *_ratio(loop),
            f"{loop['difference']:.0e}" if loop["difference"] else "none",
        )
        for loop in loops
    ]
    head = ("loop", "step of a row", "time", "quartiles", "difference of results")
    return _table(head, rows, "<>>>>")


def _in_words(loops: Sequence[Mapping[str, Any]]) -> str:
    least = min(loop["ratio"] for loop in loops[1:])
    return f"the kernels take {1.0 / least:.2f} times as long as the faster loop in C"


def _operations(periods: Iterable[Mapping[str, Any]]) -> str:
    rows = [
        (
            f"`{period['env_id']}`",
            f"{period['n_substeps']}",
            *(f"{period['counts'][kind]:,}" for kind in _KINDS),
            f"{period['flops']:,}",
        )
        for period in periods
    ]
    head = ("", "substeps", *_KINDS.values(), "flops")
    return _table(head, rows, "<" + ">" * (len(head) - 1))


def _periods(periods: Iterable[Mapping[str, Any]]) -> str:
    rows = [
        (
            f"`{period['env_id']}`",
            *(f"{period['nanoseconds'][name]:.1f} ns" for name in _TIMES),
            *(_with_quartiles(period["ratios"][name]) for name in _BOUNDS),
            f"{100 * period['ratios']['step'][0]:.0f} %",
        )
        for period in periods
    ]
    head = ("", *_TIMES, *(f"ours / {name}" for name in _BOUNDS), "share")
    return _table(head, rows, "<" + ">" * (len(head) - 1))


def _with_quartiles(ratio: Sequence[float]) -> str:
    median, low, high = ratio
    return f"{median:.2f} ({low:.2f} .. {high:.2f})"


def _training(trainings: Sequence[Mapping[str, Any]]) -> str:
    rows = [
        (
            f"`{found['env_id']}`",
            f"{found['steps_per_second']:,.0f}",
            *(f"{100 * share:.1f} %" for share in found["shares"].values()),
        )
        for found in trainings
    ]
    phases = tuple(trainings[0]["shares"])
    return _table(("", "steps/s", *phases), rows, "<" + ">" * (1 + len(phases)))


def _stock(kinds: Sequence[Mapping[str, Any]]) -> str:
    rows = [
        (
            kind["name"],
            f"{kind['timesteps'] / statistics.median(kind['seconds']):,.0f}",
            *(_over_seeds(returns) for returns in zip(*kind["returns"], strict=True)),
        )
        for kind in kinds
    ]
    points = tuple(f"{100 * fraction:.0f} %" for fraction in kinds[0]["fractions"])
    return _table(("", "steps/s", *points), rows, "<" + ">" * (1 + len(points)))


def _over_seeds(values: Sequence[float]) -> str:
    return f"{statistics.fmean(values):.0f} ({min(values):.0f} .. {max(values):.0f})"


def _first(startups: Iterable[Mapping[str, Any]]) -> str:
    rows = [
        (
            f"`{_short(s['env_id'])}`",
            f"{statistics.median(s['cold']):.1f} s",
            f"{statistics.median(s['warm']):.2f} s",
        )
        for s in startups
    ]
    return _table(("", "compiled now", "compiled before"), rows, "<>>")


def _times(speeds: Mapping[tuple[str, str], float], *keys: Any) -> tuple[str, ...]:
    return tuple(as_time(1.0 / speeds[key]) if (key := tuple(k)) in speeds else "" for k in keys)


def _short(name: str) -> str:
    return name.removeprefix("RigidEnvs/").removesuffix("-v0")


def _table(head: tuple[str, ...], rows: Sequence[tuple[str, ...]], align: str) -> str:
    return as_markdown(Table(head, list(rows), align))
