"""What a trajectory shows of itself: omega, figures, and the page, inline and in a file."""

import base64
import html
import json
import re
import sys
import zlib

import numpy as np
import pytest
from gymnasium.error import DependencyNotInstalled
from scipy.spatial.transform import Rotation

from rigid_envs.systems import EulerDisk, FreeBody, HeavyTop, RollingBall, ThrownBody
from rigid_envs.watch.replays.motion import text_of
from tests.refusals import refuses
from tests.replays import test_page
from tests.systems.examples import BALL, ROLLER, SYSTEMS, TURNING, inputs, name_of, states

browser = test_page.browser
T = np.linspace(0.0, 2.0, 41)


def motion_of(system, *lead):
    """A motion under an input that changes after half of the time."""
    rng = np.random.default_rng(3)
    u = np.repeat([inputs(system, rng), inputs(system, rng)], 20, axis=0)
    y0 = 0.3 * states(system, rng, *lead) if system is ROLLER else states(system, rng, *lead)
    u = u.reshape(40, *(1,) * len(lead), -1)
    return system.simulate(y0, T, np.broadcast_to(u, (40, *lead, u.shape[-1])))


@pytest.fixture(scope="module")
def tops():
    """Three tops that nod in three ways."""
    y0 = HeavyTop.state(tilt=0.6, spin=6.0, precession=[0.22, 0.0, -0.45])
    return HeavyTop().simulate(y0, np.linspace(0.0, 10.0, 401))


@pytest.mark.parametrize("system", TURNING, ids=name_of)
@pytest.mark.parametrize("lead", [(), (2,)], ids=["one", "two"])
def test_omega_is_the_derivative_of_the_attitude(system, lead):
    motion, h = motion_of(system, *lead), 1e-4
    inside = T[1:-1:3]
    turns = [motion(inside + dt)[..., :4].reshape(-1, 4) for dt in (0.0, h)]
    here, there = (Rotation.from_quat(q, scalar_first=True) for q in turns)
    later = system.accessors["q"](motion(inside + 2.0 * h)).reshape(-1, 4)
    later = Rotation.from_quat(later, scalar_first=True)
    # one-sided, for the input jumps at a time: -3/2, 2, -1/2 of the turns, exact to h^2
    body = [(here.inv() * R).as_rotvec() / h for R in (there, later)]
    world = [(R * here.inv()).as_rotvec() / h for R in (there, later)]
    for found, (one, two) in ((motion.omega_body, body), (motion.omega_world, world)):
        assert found.shape == (41, *lead, 3)
        expected = (2.0 * one - 0.5 * two).reshape(-1, *lead, 3)
        np.testing.assert_allclose(found[1:-1:3], expected, rtol=0, atol=1e-5)


def test_what_has_no_attitude_has_no_omega():
    motion = motion_of(ROLLER)
    for name in ("omega_body", "omega_world"):
        with pytest.raises(AttributeError, match="a Roller has no attitude, and no omega"):
            getattr(motion, name)


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_the_input_at_a_time_is_the_one_that_acts_from_there_on(sense):
    held = np.array([[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]])
    t = sense * np.array([0.0, 1.0, 2.0])
    motion = BALL.simulate(BALL.state(), t, held)
    found = motion.input_at(sense * np.array([0.0, 0.9, 1.0, 2.0]))
    np.testing.assert_array_equal(found, held[[0, 0, 1, 1]])
    swung = BALL.simulate(BALL.state(), t, lambda s: [np.cos(s), 0.0, s])
    np.testing.assert_array_equal(swung.input_at(t), np.stack([np.cos(t), 0 * t, t], axis=-1))
    np.testing.assert_array_equal(BALL.simulate(BALL.state(), t).input_at(t), np.zeros((3, 3)))
    refuses(r"^t has shape \(\)", motion.input_at, 0.5)


def panels_of(figure):
    """Lines of the panels by the first words of their titles."""
    return {axes.get_title(loc="left").partition(" [")[0]: axes.lines for axes in figure.axes}


def test_a_figure_shows_the_quantities_of_the_motion(tops):
    figure = tops.plot()
    lines = panels_of(figure)
    assert all(axes.get_xlabel() == "time [s]" and axes.get_legend() for axes in figure.axes)
    assert list(lines) == ["Angular velocity", "Tilt", "Energy error", "Momentum error"]
    tilts = [line.get_ydata() for line in lines["Tilt"]]
    assert [line.get_label() for line in lines["Tilt"]] == ["motion 1", "motion 2", "motion 3"]
    np.testing.assert_allclose(np.radians(tilts).T, tops["tilt"], atol=1e-14)
    assert [line.get_label() for line in lines["Tilt"]] == ["motion 1", "motion 2", "motion 3"]
    np.testing.assert_array_equal(lines["Angular velocity"][1].get_ydata(), tops.y[:, 0, 5])
    assert max(np.abs(line.get_ydata()).max() for line in lines["Energy error"]) < 1e-11
    circle = RollingBall().simulate(
        RollingBall.state(), np.linspace(0.0, 6.0, 61), lambda s: [np.cos(s), np.sin(s), 0.0]
    )
    (path,) = panels_of(circle.plot())["Path on the plane, from above"]
    radius = np.hypot(path.get_xdata(), path.get_ydata() - 1.0)
    np.testing.assert_allclose(radius, 1.0, rtol=1e-6)


def test_no_legend_covers_a_curve():
    """The curves of a racket that twists leave no place free between their bounds."""
    racket = ThrownBody(0.0012, 0.0164, 0.0176, m=0.33)
    throw = racket.state(omega_body=[1.25, 9.15, 0.0], velocity=[0.0, 0.0, 3.4])
    four = HeavyTop.state(tilt=[0.1, 0.2, 0.3, 0.4], spin=20.0)
    for motion in (racket.simulate(throw, T), HeavyTop().simulate(four, T)):
        figure = motion.plot()
        figure.canvas.draw()
        for axes in figure.axes:
            legend = axes.get_legend()
            for line in axes.lines if legend else ():
                points = axes.transData.transform(line.get_xydata())
                assert points[:, 1].max() < legend.get_window_extent().y0


def test_energy_and_momentum_change_where_an_input_acts_on_one_motion_alone():
    u = np.zeros((40, 2, 3))
    u[:, 1] = 0.1
    motion = FreeBody().simulate(FreeBody.state(spin=[1.0, 1.0]), T, u)
    assert {"Energy change", "|L| change"} <= panels_of(motion.plot()).keys()
    assert "Energy change" in text_of(motion)


def test_energy_that_friction_takes_is_a_change_and_no_error():
    for contour, title in ((0.0, "Energy error"), (0.1, "Energy change")):
        disk = EulerDisk(contour=contour)
        motion = disk.simulate(disk.state(tilt=1.0, spin=3.0), np.linspace(0.0, 0.5, 6))
        assert title in panels_of(motion.plot())


@pytest.mark.parametrize("system", SYSTEMS, ids=name_of)
def test_every_system_has_a_figure_and_a_page(system, tmp_path):
    motion = motion_of(system)
    figure = motion.plot()
    figure.savefig(tmp_path / "motion.png")
    assert all(len(axes.lines) == 1 or axes.get_legend() for axes in figure.axes)
    assert len(figure.axes) >= 2
    file = motion.replay(tmp_path / "new" / "motion.html", "What it does")
    document = json.loads(re.search(r'id="replay">(.*?)</script>', file.read_text())[1])
    assert document["title"] == "What it does" and document["facts"][0][0] == "parameters"
    (shown,) = document["episodes"]
    assert all(line[0].startswith("time ") for line in shown["text"])
    assert not {plot["key"] for plot in document["plots"]} & {"reward", "cost", "action"}


def test_times_of_a_page_stand_so_close_that_nothing_turns_far_between_and_not_much_closer():
    motion = FreeBody().simulate(FreeBody.state(), [0.0, 2.0], [0.0, 0.0, 75.0])  # to 50 rad/s
    document = json.loads(re.search(r'id="replay">(.*?)</script>', text_of(motion))[1])
    (shown,) = document["episodes"]
    assert 1.0 <= len(shown["text"]) / (2.0 * 50.0 / 0.2) < 2.0
    assert document["title"] == "FreeBody"


def test_what_does_not_fit_a_page_is_refused_and_shown_otherwise(tmp_path):
    five = HeavyTop().simulate(HeavyTop.state(tilt=[0.1] * 5), [0.0, 1.0])
    once = HeavyTop().simulate(HeavyTop.state(tilt=0.1), [0.0])
    for motion, complaint in ((five, r"^motions = 5; expected 1 to 4"), (once, r"^len\(t\) = 1")):
        refuses(complaint, motion.replay, tmp_path / "no.html")
        refuses(complaint, motion.plot)
        assert motion._repr_html_() is None
    assert not list(tmp_path.iterdir())


def test_a_missing_matplotlib_is_refused_with_what_installs_it(tops, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(DependencyNotInstalled, match=r'pip install "rigid-envs\[render\]"'):
        tops.plot()


def test_the_frame_of_a_notebook_holds_the_page_in_less_than_half_of_its_bytes(tops):
    frame, page = tops._repr_html_(), text_of(tops)
    (packed,) = re.findall(r'atob\("(.*?)"\)', html.unescape(frame))
    unpacked = zlib.decompress(base64.b64decode(packed)).decode()
    at = r"[-\d]+T[\d:+]+|before [\d.]+"  # when it was made, and the load before
    assert re.sub(at, "", unpacked) == re.sub(at, "", page)
    assert frame.startswith('<iframe srcdoc="') and len(frame) < 0.5 * len(page)


@pytest.mark.long
@pytest.mark.push
def test_the_frame_unpacks_plays_and_asks_for_nothing(browser, tops, tmp_path):
    file = tmp_path / "notebook.html"
    file.write_text(f"<!doctype html><body>{tops._repr_html_()}</body>")
    watched = test_page.Watched(browser, 1100, 700)
    watched.page.goto(file.as_uri())
    watched.page.frame_locator("iframe").locator("#canvas").wait_for()
    frame = watched.page.frames[1]
    test_page.wait_until(frame, "window.rigidReplay !== undefined")
    assert frame.locator("h1").inner_text() == "HeavyTop"
    assert frame.locator(".head strong").all_inner_texts() == ["motion 1", "motion 2", "motion 3"]
    frame.locator("#play").click()
    test_page.wait_until(frame, "window.rigidReplay.clock.time > 0.5")
    assert watched.complaints == [] and watched.requests == [file.as_uri()]
    watched.page.close()
