"""Views of satellites with coils: orbit, field, L and dipole, by formulas of our own."""

import math
from dataclasses import asdict, replace
from types import SimpleNamespace

import numpy as np
import pytest

from rigid_envs import systems
from rigid_envs.systems.satellite.tasks import MagneticDetumble
from rigid_envs.systems.satellite.view import SatelliteView, lines
from rigid_envs.tasks.core import Moment
from rigid_envs.watch.drawing import Drawing, Look
from tests.from_pages.attitudes import matrix
from tests.render.examples import Q, at, placed


def orbiting(u=0.0, omega=(0.03, -0.02, 0.04), dipole=(0.0, 0.0, 0.0), **settings):
    """The view of a satellite with coils at a place in its orbit, and a moment there."""
    state = systems.Satellite.state(q=Q, omega_body=omega, latitude=u)
    return at(MagneticDetumble(**settings), state, np.array(dipole))


@pytest.mark.parametrize("u", [0.0, 0.8, 2.5, -1.9])
def test_the_place_in_the_orbit_and_the_earth_are_where_the_satellite_has_them(u):
    view, moment = orbiting(u)
    poses, outward = view.poses(moment), np.array([math.cos(u), math.sin(u), 0.0])
    middle = np.asarray(poses["orbit"].position)
    assert np.array_equal(poses["earth"].position, middle)
    assert np.array_equal(poses["lines"].position, middle)
    radius = poses["orbit"].scale[0]
    assert np.allclose(poses["place"].position, middle + radius * outward)
    assert np.allclose(poses["nadir"].position, -1.5 * outward)
    i = view.system.inclination
    for name in ("earth", "lines", "nadir"):
        axis = matrix(poses[name].q) @ [0.0, 0.0, 1.0]
        assert np.allclose(axis, [0.0, math.sin(i), math.cos(i)])
    assert radius > 1.5 * poses["earth"].scale[0]


@pytest.mark.parametrize("u", [0.0, 0.8, 2.5, -1.9])
def test_the_field_goes_through_the_middle_and_is_as_long_as_it_is_strong(u):
    view, moment = orbiting(u, inclination=1.2)
    r, e = np.array([math.cos(u), math.sin(u), 0.0]), [0.0, math.sin(1.2), math.cos(1.2)]
    field = e - 3.0 * (e @ r) * r  # of 2 at most
    arrows = view.arrows(moment)
    start, vector = map(np.asarray, arrows["field"])
    assert np.allclose(vector, 1.5 * field) and np.allclose(start, -0.5 * vector)
    start, vector = map(np.asarray, arrows["here"])
    assert np.allclose(start, view.poses(moment)["place"].position)
    assert np.allclose(np.cross(vector, field), 0.0, atol=1e-12) and vector @ field > 0.0


def test_the_arrows_of_momentum_and_dipole_are_theirs_in_the_world():
    omega, dipole = np.array([0.03, -0.02, 0.04]), np.array([0.03, 0.06, -0.02])
    view, moment = orbiting(0.4, omega, dipole, start_rate=(0.05, 0.2))
    arrows, moments = view.arrows(moment), view.system.moments
    L = matrix(Q) @ (moments * omega) / (moments[1] * 0.2)
    assert np.allclose(arrows["L"][1], 1.5 * L) and arrows["L"][0] == (0.0, 0.0, 0.0)
    assert np.allclose(view.points(moment)["L"], arrows["L"][1])
    start, vector = map(np.asarray, arrows["input"])
    assert np.allclose(vector, 1.2 * matrix(Q) @ dipole / 0.1)
    assert np.allclose(start, 0.25 * vector / np.linalg.norm(vector))
    still = replace(moment, u=np.zeros(3))
    assert not np.any(view.arrows(still)["input"])


def test_lines_of_the_field_are_along_it():
    """A dipole at the origin along z has B ~ 3 z r - r^2 e_z."""
    mesh = lines().vertices.astype(float)
    assert np.linalg.norm(mesh, axis=1).max() == pytest.approx(1.0, abs=0.02)
    for line in np.split(mesh, 8):
        centre = line[: 4 * 21].reshape(21, 4, 3)[:, :3].mean(axis=1)  # of a tube of three sides
        r = 0.5 * (centre[1:] + centre[:-1])
        field = 3.0 * r[:, 2:] * r - np.sum(r * r, axis=1, keepdims=True) * [0.0, 0.0, 1.0]
        along = np.diff(centre, axis=0)
        cosine = np.sum(field * along, axis=1)
        cosine /= np.linalg.norm(field, axis=1) * np.linalg.norm(along, axis=1)
        assert np.abs(cosine).min() > 0.998


def test_what_is_said_of_a_satellite_is_its_rate_and_how_L_lies_to_the_field():
    view, moment = orbiting(0.0, (0.0, 0.0, 0.05), inclination=math.pi / 2)
    assert view.readings(moment)[0] == "|omega| 0.05 rad/s, to be below 0.01"
    for direction, angle in (((0.0, 1.0, 0.0), 0), ((0.0, -1.0, 0.0), 0), ((1.0, 1.0, 0.0), 45)):
        L = matrix(Q).T @ np.array(direction)  # the field is along y there
        moment.y[4:7] = 0.01 * L / view.system.moments
        assert view.readings(moment)[1] == f"L is {angle} deg from the line of B"
    moment.y[4:7] = 0.0
    assert view.readings(moment) == (
        "|omega| 0 rad/s, to be below 0.01",
        "L is 90 deg from the line of B",
    )


def test_a_satellite_without_a_task_is_seen_at_the_pace_of_its_orbit_if_it_has_one():
    for n, rate in ((0.001, 0.002), (0.0, 1.0)):
        satellite = systems.Satellite(n=n, b=0.0)
        view = SatelliteView(SimpleNamespace(system=lambda _, s=satellite: s), asdict(satellite))
        y = satellite.state(omega_body=[0.0, rate, 0.0])
        moment = Moment(y, np.zeros(3), asdict(satellite), dynamics=satellite.dynamics)
        arrows = view.arrows(moment)
        assert np.allclose(arrows["L"][1], [0.0, 1.5, 0.0])
        assert not np.any(arrows["field"]) and not np.any(arrows["input"])
        assert view.readings(moment) == (f"|omega| {rate:g} rad/s   L is 90 deg from B",)


def test_a_satellite_its_arrows_and_its_orbit_are_in_the_picture():
    rng = np.random.default_rng(0)
    view, moment = orbiting()
    drawing = Drawing(view, Look())
    for row in rng.normal(size=(20, 8)):
        q, way = row[:4] / np.linalg.norm(row[:4]), row[4:7] / np.linalg.norm(row[4:7])
        y = systems.Satellite.state(q=q, omega_body=0.1 * way, latitude=3.0 * row[7])
        seen = replace(moment, y=y, u=0.1 * way)
        drawing.picture(seen)
        for name, pose in view.poses(seen).items():
            for point in view.scene.parts[name].mesh.vertices[::5]:
                assert np.abs(drawing.place_of(placed(pose, point))).max() < 0.98
        for start, vector in view.arrows(seen).values():
            assert np.abs(drawing.place_of(np.add(start, vector))).max() < 0.98
