"""The page docs/speed.md, from its text in page.md and the figures in docs/speed.json."""

import statistics
from pathlib import Path

from rigid_envs.tools.cli.collecting import as_factor, as_time
from rigid_envs.tools.pages.tables import Table
from rigid_envs.tools.pages.writing import as_markdown

_PAGE = Path(__file__).with_suffix(".md")
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


def markdown(data):
    """The page.

    Args:
        data: what `__main__` wrote into docs/speed.json.
    """
    where, bench, frames = data["provenance"], data["bench"], data["frames"]
    speeds = {
        (speed["name"], speed["column"]): speed["median"] for speed in bench["steps_per_second"]
    }
    rows = [cost["ratio"] for cost in bench["costs"] if cost["column"] == "4096"]
    return _PAGE.read_text(encoding="utf-8").format(
        cpu=where["cpu"],
        cores=where["cores"],
        date=where["date"][:10],
        rounds=bench["rounds"],
        **where["versions"],
        dearest=max(rows, default=1.0),
        steps=_steps(speeds),
        rows=_by_rows(speeds),
        sizes=_sizes(data["sizes"]),
        options=_options(data["options"]),
        frames_date=frames["provenance"]["date"][:10],
        frames=_frames(frames["rows"]),
        ratios=_ratios([*bench["ratios"], data["drones"]]),
        c_text=_in_words(data["loops"]["free body"]),
        loops=_loops(data["loops"]["free body"]),
        **data["limit"]["per_nanosecond"],
        operations=_operations(data["limit"]["periods"]),
        periods=_periods(data["limit"]["periods"]),
        training=_training(data["training"]),
        timesteps=f"{data['stock'][0]['timesteps']:,}",
        stock=_stock(data["stock"]),
        first=_first(bench["import_to_first_step"]),
    )


def _steps(speeds):
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


def _by_rows(speeds):
    shown = {**{n: f"`{_short(n)}`" for n in _SHOWN}, "CartPole-v1, NumPy": "CartPole-v1, NumPy"}
    rows = [(text, *_times(speeds, *((n, form) for form in _FORMS))) for n, text in shown.items()]
    return _table(("", "1", "16", "256", "4096", "4096, 2 threads"), rows, "<>>>>>")


def _sizes(sizes):
    forms = tuple(dict.fromkeys(growth["form"] for growth in sizes))
    times = {(g["name"], g["form"]): _row_time(g) for g in sizes}
    rows = [
        (f"`{name}`", *(times[name, form] for form in forms))
        for name in dict.fromkeys(growth["name"] for growth in sizes)
    ]
    head = ("", *(f"{int(form):,}" for form in forms))
    return _table(head, rows, "<" + ">" * len(forms))


def _options(options):
    rows = [(growth["form"], _row_time(growth), *_ratio(growth)) for growth in options]
    return _table(("option", "row", "times", "quartiles"), rows, "<>>>")


def _frames(rows):
    rows = list(rows)
    shown = [
        (f"`{there['name']}`", _row_time(here), _row_time(there), *_ratio(there))
        for here, there in zip(rows[::2], rows[1::2], strict=True)
    ]
    return _table(("", "world", "reduced", "times", "quartiles"), shown, "<>>>>")


def _row_time(found):
    return as_time(1e-9 * found["nanoseconds"])


def _ratio(found):
    """A ratio and its quartiles."""
    return f"{found['ratio']:.2f}", " .. ".join(f"{end:.2f}" for end in found["quartiles"])


def _ratios(ratios):
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


def _loops(loops):
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


def _in_words(loops):
    least = min(loop["ratio"] for loop in loops[1:])
    return f"the kernels take {1.0 / least:.2f} times as long as the faster loop in C"


def _operations(periods):
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


def _periods(periods):
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


def _with_quartiles(ratio):
    median, low, high = ratio
    return f"{median:.2f} ({low:.2f} .. {high:.2f})"


def _training(trainings):
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


def _stock(kinds):
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


def _over_seeds(values):
    return f"{statistics.fmean(values):.0f} ({min(values):.0f} .. {max(values):.0f})"


def _first(startups):
    rows = [
        (
            f"`{_short(s['env_id'])}`",
            f"{statistics.median(s['cold']):.1f} s",
            f"{statistics.median(s['warm']):.2f} s",
        )
        for s in startups
    ]
    return _table(("", "compiled now", "compiled before"), rows, "<>>")


def _times(speeds, *keys):
    return tuple(as_time(1.0 / speeds[key]) if (key := tuple(k)) in speeds else "" for k in keys)


def _short(name):
    return name.removeprefix("RigidEnvs/").removesuffix("-v0")


def _table(head, rows, align):
    return as_markdown(Table(head, list(rows), align))
