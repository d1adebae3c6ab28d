"""Named bodies against published numbers and against what they are known to do."""

from operator import itemgetter

import numpy as np
import pytest
from scipy.integrate import quad

from rigid_envs.mechanics import bodies
from rigid_envs.mechanics.bodies.body import Body
from tests.mechanics.bodies.examples import ROUNDING
from tests.reference import cases

NAMED = ["american_football", "book", "coin", "earth", "frisbee", "t_handle", "tennis_racket"]


def growth(body, axis):
    """Largest real part of the rates at which a unit spin about a principal axis is left [1/s]."""
    h = 2.0**-10  # the acceleration is quadratic in omega: its central difference is exact
    ahead, behind = (body.angular_acceleration(axis + s * h * np.eye(3)) for s in (1, -1))
    return float(np.max(np.linalg.eigvals((ahead - behind).T / (2 * h)).real))


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("american_football", "symmetric_prolate"),
        ("book", "asymmetric"),
        ("coin", "symmetric_oblate"),
        ("earth", "symmetric_oblate"),
        ("frisbee", "symmetric_oblate"),
        ("t_handle", "asymmetric"),
        ("tennis_racket", "asymmetric"),
    ],
)
def test_named_bodies_are_of_their_kind(name, kind):
    assert getattr(bodies, name)().kind() == kind


@pytest.mark.parametrize("name", ["book", "t_handle", "tennis_racket"])
def test_only_a_spin_about_the_intermediate_axis_is_left(name):
    body = getattr(bodies, name)()
    rates = [growth(body, axis) for axis in body.principal().axes.T]
    assert rates[1] > 0.1 and rates[0] < 1e-6 and rates[2] < 1e-6


def test_the_t_handle_turns_over_when_spun_about_its_stem():
    handle = bodies.t_handle()
    assert np.array_equal(np.abs(handle.principal().axes[:, 1]), [0, 1, 0])
    assert handle.com[0] == handle.com[2] == 0.0 < handle.com[1]
    long_stem = bodies.t_handle(stem_length=0.2)
    assert np.array_equal(np.abs(long_stem.principal().axes[:, 0]), [0, 1, 0])


def test_the_t_handle_is_of_aluminium_and_fits_a_hand():
    handle = bodies.t_handle()
    crossbar, stem = (2700.0 * np.pi * 0.006**2 * length for length in (0.1, 0.06))
    assert handle.mass == pytest.approx(crossbar + stem, rel=ROUNDING)
    assert handle.mass * handle.com[1] == pytest.approx(stem * (0.006 + 0.03), rel=4 * ROUNDING)


def test_the_racket_balances_and_swings_like_those_that_are_measured():
    racket = bodies.tennis_racket()
    assert racket.mass == pytest.approx(0.32, rel=ROUNDING)
    assert racket.com[1] == pytest.approx(0.33, abs=0.005)
    assert racket.about_axis([0.0, 0.1, 0.0], [1.0, 0.0, 0.0]) == pytest.approx(0.030, abs=5e-4)
    assert racket.inertia[1, 1] == pytest.approx(0.0013, abs=5e-5)
    assert 0.022 < racket.about_axis([0.0, 0.1, 0.0], [1.0, 0.0, 0.0]) < 0.038  # Spurr et al.
    assert abs(bodies.perpendicular_axis(racket)) <= ROUNDING * racket.inertia[2, 2]
    assert np.array_equal(np.abs(racket.principal().axes[:, 1]), [1, 0, 0])


def test_the_football_is_a_uniform_skin():
    ball, a, c = bodies.american_football(), 0.5366 / (2 * np.pi), 0.1413

    def over_the_skin(f):  # adaptive quadrature in z, another variable than that of the hoops
        def ring(z):
            rho = a * np.sqrt(1.0 - (z / c) ** 2)
            return f(rho, z) * np.hypot(rho, a**2 * z / c**2)

        return quad(ring, -c, c, epsabs=0.0, epsrel=1e-12)[0]

    area = over_the_skin(lambda rho, z: 1.0)
    axial = ball.mass / area * over_the_skin(lambda rho, z: rho**2)
    across = ball.mass / area * over_the_skin(lambda rho, z: 0.5 * rho**2 + z**2)
    np.testing.assert_allclose(np.diag(ball.inertia), [across, across, axial], rtol=1e-12)
    np.testing.assert_allclose(ball.com, 0.0, atol=ROUNDING)
    assert ball.mass == pytest.approx(0.411, rel=ROUNDING)


def test_book_and_coin_have_the_sizes_that_they_are_described_by():
    book, coin = bodies.book(), bodies.coin()
    # A box has I_x = m (b^2 + c^2) / 12, so I_y + I_z - I_x = m a^2 / 6; the thinnest side is left
    # of differences of the squares of others, 64 times its own
    moments = np.diag(book.inertia)
    sides = np.sqrt(6.0 * (moments.sum() - 2.0 * moments) / book.mass)
    np.testing.assert_allclose([book.mass, *sides], [0.9, 0.16, 0.24, 0.03], rtol=64 * ROUNDING)
    # A cylinder has C = m r^2 / 2 and A = C / 2 + m h^2 / 12
    A, _, C = np.diag(coin.inertia)
    width, height = 2.0 * np.sqrt(2.0 * C / coin.mass), np.sqrt((12.0 * A - 6.0 * C) / coin.mass)
    # the height is left of a difference of its size: (r / h)^2 = 25 roundings
    np.testing.assert_allclose(
        [coin.mass, width, height], [0.0075, 0.02325, 0.00233], rtol=25 * ROUNDING
    )


def test_the_frisbee_has_the_mass_of_the_rules_and_its_measured_moments():
    disk = bodies.frisbee()
    assert disk.mass == 0.175
    np.testing.assert_allclose(np.diag(disk.inertia), [1.219e-3, 1.219e-3, 2.352e-3], rtol=ROUNDING)


def test_the_frisbee_is_nearly_flat():
    disk = bodies.frisbee()
    thickness = np.sqrt(-0.5 * bodies.perpendicular_axis(disk) / disk.mass)
    assert 0.01 < thickness < 0.03  # [m] rms: a disk for Ultimate is some 3 cm deep


def test_the_earth_has_its_published_moments():
    earth = bodies.earth()
    A, _, C = np.diag(earth.inertia)
    # Groten, J. Geodesy 77 (2004) 724: A = 8.0101, B = 8.0103, C = 8.0365 (2) in 1e37 kg m^2, of a
    # mass of 5.9737e24 kg by an older constant of gravitation, 2.5e-4 more than ours
    np.testing.assert_allclose([A, C], [8.0102e37, 8.0365e37], rtol=4e-4)
    assert C / (earth.mass * 6378136.6**2) == pytest.approx(0.330698, abs=1e-6)
    assert (C - A) / C == pytest.approx(3273795e-9, rel=1e-12)
    assert A / (C - A) == pytest.approx(304.456, abs=1e-3)


@pytest.mark.parametrize("case", cases("chandler"), ids=itemgetter("id"))
def test_the_rate_of_the_pole_is_that_of_the_reference(case):
    A, C, spin = (case["in"][name] for name in ("Iperp", "I3", "w3"))
    acceleration = Body(1.0, np.diag([A, A, C])).angular_acceleration([1e-6 * spin, 0.0, spin])
    rate = acceleration[1] / (1e-6 * spin)
    # C - A cancels: eps C / (C - A)
    assert rate == pytest.approx(case["out"]["Omega"], rel=C / (C - A) * ROUNDING)


@pytest.mark.parametrize("name", NAMED)
def test_named_bodies_have_their_centre_where_they_say(name):
    com = getattr(bodies, name)().com
    if name in ("t_handle", "tennis_racket"):
        assert com[0] == com[2] == 0.0 < com[1]
    else:
        np.testing.assert_allclose(com, 0.0, atol=ROUNDING)
