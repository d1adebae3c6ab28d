"""Notebooks: they run, with sliders and without, and what they print agrees with their formulas."""

import json
import re
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from rigid_envs.systems.free_body.closed_forms import polhode

plt = pytest.importorskip("matplotlib.pyplot")
DOCS = Path(__file__).parents[2] / "docs"
NAMES = ("free_body", "tops", "rolling")
SLIDERS = {"free_body": 2, "tops": 3, "rolling": 3}


def cells_of(name, kind):
    """Sources of the cells of a notebook."""
    notebook = json.loads((DOCS / "notebooks" / f"{name}.ipynb").read_text())
    return ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == kind]


def pixels(figure):
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.array(canvas.buffer_rgba())


def run(name, monkeypatch, widgets=None):
    """The names that Python has after all cells, and the pictures that pyplot was to show."""
    shown = []

    def show():
        shown.append(pixels(plt.gcf()))
        plt.close("all")

    monkeypatch.setattr(plt, "show", show)
    monkeypatch.setitem(sys.modules, "ipywidgets", widgets)
    names = {"pictures": shown}
    for source in cells_of(name, "code"):
        exec(compile(source, name, "exec"), names)
    return names


@pytest.mark.parametrize("name", NAMES)
def test_it_is_on_the_site_without_outputs_and_says_where_it_runs(name):
    assert f"\nnotebooks/{name}\n" in (DOCS / "index.md").read_text()
    notebook = json.loads((DOCS / "notebooks" / f"{name}.ipynb").read_text())
    assert not any(cell.get("outputs") for cell in notebook["cells"])
    assert (DOCS / "notebooks" / f"{name}.ipynb").stat().st_size < 12_000
    first, *_ = cells_of(name, "markdown")
    assert first.startswith("# ") and "Colab" in first
    assert "JupyterLite cannot run it" in first and "no wheel for Pyodide" in first


@pytest.mark.long
@pytest.mark.push
@pytest.mark.parametrize("name", NAMES)
def test_both_ends_of_each_slider_draw_another_picture(name, monkeypatch):
    """As ipywidgets would draw them; without it one is drawn between, which is tested below."""
    moved = []

    def interact(draw, **sliders):
        ((label, (low, high, _)),) = sliders.items()
        moved.append((draw, label, low, high))

    names = run(name, monkeypatch, SimpleNamespace(interact=interact))
    assert len(moved) == SLIDERS[name]
    for draw, label, *ends in moved:
        seen = []
        for value in ends:
            found = draw(**{label: value})
            if isinstance(found, Figure):
                seen.append(pixels(found))
            else:
                seen.append(names["pictures"].pop() if found is None else found.y)
        assert not np.array_equal(*seen), (name, label)


@pytest.mark.parametrize("name", NAMES)
def test_without_ipywidgets_it_prints_what_theory_says(name, monkeypatch, capsys):
    run(name, monkeypatch)
    said = capsys.readouterr().out
    numbers = re.findall(r"measured ([\d.]+).*?= ([\d.]+)", said)
    assert len(numbers) == {"free_body": 1, "tops": 1, "rolling": 2}[name]
    for measured, expected in numbers:  # the precession of a top is one of a fast one, to 5 %
        assert float(measured) == pytest.approx(
            float(expected), rel=0.05 if name == "tops" else 1e-3
        )


def largest(draw, share, capsys):
    """Largest angle [degrees] that a picture says."""
    capsys.readouterr()
    draw(share)
    return float(re.search(r"largest \w+ ([\d.]+) degrees", capsys.readouterr().out)[1])


@pytest.mark.long
@pytest.mark.push
def test_thresholds_of_the_notebooks_part_what_stays_from_what_falls(monkeypatch, capsys):
    push = run("tops", monkeypatch)["push"]
    assert largest(push, 1.05, capsys) < 3.0 < 20.0 < largest(push, 0.95, capsys)
    roll = run("rolling", monkeypatch)["roll"]
    assert largest(roll, 1.1, capsys) < 6.0 < 10.0 < largest(roll, 0.9, capsys)


@pytest.mark.long
@pytest.mark.push
def test_the_lecture_has_fifteen_lines_and_shows_what_it_says(tmp_path, monkeypatch):
    text = (DOCS / "physics.md").read_text()
    lecture = re.search(r"```python\n(.*?)```", text, re.DOTALL)[1]
    assert len([line for line in lecture.splitlines() if line]) <= 15
    monkeypatch.chdir(tmp_path)
    names = {}
    exec(lecture, names)
    t, omega2 = names["t"], names["flight"].omega_body[:, 1]
    flips = t[1:][np.diff(np.sign(omega2)) != 0]
    interval = polhode(names["body"].moments, [0.01, 1.0, 0.01]).flip_interval
    assert np.diff(flips) == pytest.approx([interval] * 2, abs=0.04)  # two steps of t
    smooth, cusped, looping = names["nods"]["tilt"].T
    assert cusped.min() == pytest.approx(0.6, abs=1e-6) and looping.min() > 0.6 - 1e-9
    assert np.ptp(smooth) < np.ptp(cusped) < np.ptp(looping)
    assert np.ptp(names["roll"]["tilt"]) < 0.5
    assert {path.name for path in tmp_path.iterdir()} >= {"flip.html", "nutation.html", "disk.png"}
