"""Every figure of the gallery and its motion: its numbers hold, and it is the same each time."""

import inspect
import struct

import numpy as np
import pytest
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg

from rigid_envs.base.checks import ConfigError, one_named
from rigid_envs.systems import Gyrostat, HeavyTop, RollingDisk, Spheroid, ThrownBody
from rigid_envs.tools.gallery import FIGURES, make, write_figures
from rigid_envs.tools.motions import MOTIONS, motion_of
from rigid_envs.watch.figures import DPI, STYLE, Match

pytestmark = pytest.mark.long


def each(names):
    """Names, of which the first one is looked at at every push."""
    first, *others = names
    return [pytest.param(first, marks=pytest.mark.push), *others]


@pytest.fixture(scope="module", params=each(FIGURES))
def drawn(request):
    figure, numbers = FIGURES[request.param].compose()
    with rc_context(STYLE):
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
    return figure, numbers, canvas


def test_numbers_lie_within_their_bounds_of_the_closed_form(drawn):
    _, numbers, _ = drawn
    assert numbers
    for number in numbers:
        assert number.holds, str(number)


TOP = HeavyTop(1.2, 1.2, 0.6, m=1.0, g=9.81, ell=0.15)
OWN = {
    "racket": {"spin": 9.0, "part": 0.05},
    "flip": {"moments": (1.0, 1.5, 2.2), "omega": (0.1, 2.0, 0.0), "duration": 20.0},
    "polhodes": {"moments": (0.8, 1.1, 1.7)},
    "herpolhode": {"moments": (0.8, 1.1, 1.7), "omega": (0.2, 0.9, 0.7), "periods": 2.0},
    "cones": {"spin": 3.0, "part": 0.2},
    "chandler": {"wobble": 0.3, "observed": 430.0},
    "nutation": {"top": TOP, "tilt": 0.8, "spin": 8.0, "precessions": (0.3, 0.0, -0.3)},
    "potential": {"top": TOP, "tilt": 0.7, "spin": 6.0},
    "precession": {"top": TOP, "tilt": 1.0, "spin": 7.0},
    "sleeping": {"top": TOP, "push": 0.02, "spins": (0.3, 0.7, 1.2)},
    "disk": {"wheel": RollingDisk.hoop(2.0, 0.4), "tilt": 1.2, "nutation": 0.8, "circle": 2.0},
    "steady_circles": {"wheel": RollingDisk.hoop(2.0, 0.4), "radii": (0.7, 1.2, 1.8)},
    "euler_disk": {"contour": 3e-5, "viscosity": 2e-4, "radius": 0.04, "starts": (0.04, 0.05)},
    "coin": {"torque": 0.01, "slope": 0.2, "speed": 0.8},
    "turntable": {"rate": 1.5, "beta": 2.0 / 3.0, "tilt": 0.03},
    "holonomy": {"largest": 1.2, "n_circles": 9},
    "brackets": {"smallest": 0.01, "largest": 0.5, "beside": 1.0},
    "shortest": {"turns": (30.0, 60.0, 100.0, 170.0), "place": (2.0, -3.0), "turn": 70.0},
    "race": {"slope": 0.6, "height": 2.0},
    "slipping": {"mu": 0.2, "speed": 2.0, "beta": 0.5},
    "tippe_top": {"top": Spheroid(offset=0.2, mu=0.4), "lean": 0.2, "duration": 30.0},
    "twist": {"racket": ThrownBody(0.001, 0.015, 0.0158, m=0.3), "angles": (90.0, 70.0)},
    "dual_spin": {"satellite": Gyrostat(1.0, 1.5, 2.2, J1=0.3), "shares": (0.1, 0.4, 0.6, 0.9)},
    "gravity_gradient": {"shapes": ((0.5, 0.3), (-0.04, -0.7), (0.6, -0.3)), "n": 0.7},
    "pump": {"beta_change": 0.4, "start": -0.3, "rim": 1.1},
}


@pytest.mark.parametrize("name", each(OWN))
def test_a_figure_of_ones_own_parameters_agrees_with_the_closed_form_too(name):
    figure, numbers = FIGURES[name].compose(**OWN[name])
    assert all(number.holds for number in numbers), numbers
    own, usual = (FigureCanvasAgg(each) for each in (figure, FIGURES[name]()))
    own.draw(), usual.draw()
    assert not np.array_equal(own.buffer_rgba(), usual.buffer_rgba())


def test_every_figure_has_parameters_and_refuses_others_with_the_nearest():
    for name, entry in FIGURES.items():
        taken = inspect.signature(entry).parameters
        assert OWN[name].keys() <= taken.keys(), name
        assert all(each.kind is each.KEYWORD_ONLY for each in taken.values()), name
    with pytest.raises(ConfigError, match=r"parameter = 'omga'; .* did you mean 'omega'\?"):
        FIGURES["flip"](omga=(0.0, 1.0, 0.0))


def test_nothing_is_cut_off_by_the_edge_of_the_picture(drawn):
    """A margin of three pixels is white, and title, numbers and legend lie inside."""
    figure, _, canvas = drawn
    pixels = np.asarray(canvas.buffer_rgba())[..., :3]
    inner = np.zeros(pixels.shape[:2], dtype=bool)
    inner[3:-3, 3:-3] = True
    assert np.all(pixels[~inner] == 255)
    for artist in (*figure.texts, *figure.legends):
        box = artist.get_window_extent()
        assert 0 < box.x0 and box.x1 < figure.bbox.x1, artist
        assert 0 < box.y0 and box.y1 < figure.bbox.y1, artist


def test_panels_do_not_cover_each_other_or_the_numbers(drawn):
    figure, _, canvas = drawn
    boxes = [axes.get_tightbbox(canvas.get_renderer()) for axes in figure.axes]
    boxes += [legend.get_window_extent() for legend in figure.legends]
    boxes += [text.get_window_extent() for text in figure.texts]
    for k, first in enumerate(boxes):
        for second in boxes[:k]:
            across = min(first.x1, second.x1) - max(first.x0, second.x0)
            along = min(first.y1, second.y1) - max(first.y0, second.y0)
            assert min(across, along) < 5.0, (first, second)


def test_pictures_have_their_size_and_are_the_same_bytes_each_time():
    entry = FIGURES["race"]
    first, second = make(entry), make(entry)
    assert (first.png, first.svg) == (second.png, second.svg)
    size = struct.unpack(">II", first.png[16:24])
    assert size == (round(DPI * entry.size[0]), round(DPI * entry.size[1]))
    assert first.svg.startswith(b"<?xml")


def test_texts_say_what_law_and_source_are_and_commands_name_the_figure():
    for name, entry in FIGURES.items():
        assert entry.caption.endswith("."), name
        assert entry.law and entry.source and not entry.source.endswith("."), name
        assert f" {name} " in entry.command
        assert entry.size[0] == 7.2, "all figures have one width"


def test_a_number_that_is_beyond_its_bound_or_no_number_does_not_hold():
    assert Match("x", 1.0, 1.1, 0.2).holds
    assert not Match("x", 1.0, 1.3, 0.2).holds
    assert not Match("x", float("nan"), 1.0, 0.2).holds


def test_names_that_are_no_figure_are_refused_with_the_nearest():
    assert one_named("flip", FIGURES, "figure") == "flip"
    with pytest.raises(ConfigError, match=r"figure = 'flips'; .* did you mean 'flip'\?"):
        one_named("flips", FIGURES, "figure")


def test_motions_belong_to_figures():
    assert set(MOTIONS) <= set(FIGURES)
    assert motion_of("potential") is None


@pytest.mark.parametrize("name", each(MOTIONS))
def test_every_motion_can_be_played(name):
    replay = motion_of(name)
    for episode in replay.episodes:
        assert len(episode) > 10
        assert np.isfinite(episode.y).all()
        assert np.abs(np.diff(episode.y, axis=0)).max() > 1e-3  # it moves


def test_the_flip_flips_and_conserves_energy():
    replay = motion_of("flip")
    (episode,) = replay.episodes
    system = replay.task.system(episode.parameters)
    energy = system.invariants(episode.y)["energy"]
    omega2 = episode.y[:, 5]
    assert omega2.min() < -0.9 < 0.9 < omega2.max()
    assert np.ptp(energy) / energy[0] < 1e-7  # fourth order at steps of 0.1 s


def test_the_frisbee_keeps_its_spin_and_the_cusped_top_stops_at_its_top():
    (frisbee,) = motion_of("cones").episodes
    assert np.ptp(frisbee.y[:, 6]) < 1e-7
    replay = motion_of("nutation")
    system = replay.task.system(replay.episodes[0].parameters)
    tilts = [system.accessors["tilt"](episode.y) for episode in replay.episodes]
    assert all(tilt[0] == pytest.approx(np.radians(35.0)) for tilt in tilts)
    assert all(tilt.min() > tilt[0] - 1e-4 for tilt in tilts[1:])


def test_tippe_tops_end_upright_leaning_and_upside_down():
    replay = motion_of("tippe_top")
    top = replay.task.system(replay.episodes[0].parameters)
    ends = np.degrees([top.tilt(episode.y[-1]) for episode in replay.episodes])
    assert ends == pytest.approx([0.0, 96.0, 180.0], abs=5.0)


def test_thrown_rackets_turn_once_and_twist_to_either_side():
    replay = motion_of("twist")
    racket = replay.task.system(replay.episodes[0].parameters)
    for episode, twist in zip(replay.episodes, (0.0, 180.0, -180.0), strict=True):
        L = racket.accessors["L_body"](episode.y)
        psi = np.degrees(np.unwrap(np.arctan2(L[:, 1], L[:, 2])))
        assert psi[-1] - psi[0] == pytest.approx(twist, abs=30.0)
        assert abs(racket.position(episode.y[-1])[2]) < 1e-12


def test_the_rotor_takes_up_the_momentum_and_the_satellite_turns_over():
    replay = motion_of("dual_spin")
    satellite = replay.task.system(replay.episodes[0].parameters)
    (episode,) = replay.episodes
    L, spins = satellite.L_body(episode.y), satellite.spin_momenta(episode.y)
    assert np.abs(L[0, 0]) < 0.1 and L[-20:, 0].min() > 0.9
    assert spins[[0, -1], 0] == pytest.approx([0.0, 1.0])
    assert np.linalg.norm(L, axis=-1) == pytest.approx(1.0)


def test_what_moves_is_written_as_a_page_too(tmp_path):
    write_figures(tmp_path, [FIGURES["shortest"], FIGURES["potential"]])
    assert (tmp_path / "shortest.html").stat().st_size < 1.5e6
    assert not (tmp_path / "potential.html").exists()
