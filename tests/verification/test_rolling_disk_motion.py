"""The rolling disk against reference cases, Newton's law with multipliers and closed forms."""

import math
from operator import itemgetter

import mpmath
import numpy as np
import pytest
from scipy.integrate import quad

from rigid_envs.mechanics import rotations
from rigid_envs.mechanics.laws import matrices
from rigid_envs.systems.free_body import closed_forms as free_body
from rigid_envs.systems.rolling_disk.system import RollingDisk
from tests.reference import cases
from tests.verification.measures import orders, refined, slope, through
from tests.verification.multipliers import disk_on_plane, pack


def from_case(case):
    """Disk and state of Euler angles, their rates (psi' through w3) and the place of the centre."""
    given = case["in"]
    disk = RollingDisk(given["m"], given["a"], given["A"], given["C"], given["g"])
    angles = given["phi"], given["theta"], given["psi"]
    q = rotations.quaternion_from_euler(angles)
    # omega = phi' e_z + theta' (line of nodes) + psi' e3, in body axes.
    s, c = math.sin(given["psi"]), math.cos(given["psi"])
    wn, nodes = given["phid"] * math.sin(given["theta"]), given["thetad"]
    omega = (nodes * c + wn * s, wn * c - nodes * s, given["w3"])
    y = disk.state(q=q, omega_body=omega)
    y[7:9] = np.array(given["xy0"]) - disk.centre(y)[:2]
    return disk, y


@pytest.mark.parametrize("case", cases("disk_fall"), ids=itemgetter("id"))
def test_the_falling_disk_agrees_with_the_reference(case):
    disk, y = from_case(case)
    assert disk.energy(y) == pytest.approx(case["scalars"]["E"], rel=1e-15)
    t = np.union1d(case["t"], np.linspace(0.0, case["t"][-1], 61))  # to see where it is fastest
    motion, rows = refined(disk, y, t, per_radian=32.0), np.searchsorted(t, case["t"])
    found, out, cond = motion.trajectory, case["out"], case["cond"]
    fields = (
        ("R", "R", motion.turned),
        ("centre", "r", disk.radius * motion.turned),
        ("omega_body", "w", motion.rate),
        ("contact", "contact", disk.radius * motion.turned),
        ("contact_force", "F", disk.m * disk.radius * motion.rate**2),
        ("tilt", "theta", motion.turned),
    )
    for name, field, size in fields:
        expected = np.reshape(out[field], found[name][rows].shape)
        atol = motion.tolerance(name, size, cond[field])
        np.testing.assert_allclose(found[name][rows], expected, rtol=0, atol=atol)


@pytest.mark.parametrize("case", cases("disk_fall"), ids=itemgetter("id"))
def test_the_lean_swings_between_the_reference_limits_in_the_reference_period(case):
    disk, y = from_case(case)
    scalars = case["scalars"]
    period, low, high = (scalars[name] for name in ("lean_period", "theta_min", "theta_max"))
    motion = disk.simulate(y, np.linspace(0.0, period, 101))
    tilt = motion["tilt"]
    # Default steps, and how a whole swing stretches an error of the start.
    atol = 1e-10 * max(1.0, case["cond"]["theta"])
    assert tilt[-1] == pytest.approx(tilt[0], abs=atol)
    assert falling(disk, motion.y[-1]) == pytest.approx(falling(disk, y), abs=10.0 * atol)
    assert np.min(tilt) >= low - atol
    assert np.max(tilt) <= high + atol
    if case["in"]["thetad"] == 0.0:  # it starts at one of the limits: half a swing to the other
        assert tilt[50] == pytest.approx(low + high - tilt[0], abs=atol)


def falling(disk, y):
    """theta', the rate about the line of nodes, from d(cos theta)/dt = -theta' sin(theta)."""
    axis = disk.accessors["R"](y)[:, 2]
    return -np.cross(disk.omega_world(y), axis)[2] / math.sin(disk.tilt(y))


def appell_korteweg(disk, y):
    """The coefficients of w3 = c1 P(cos theta) + c2 P(-cos theta), P a Legendre function.

    ``d w3 / d theta = m r^2 / (I3 + m r^2) wn``, and ``d(wn sin theta) / d theta = (I3 / I1) w3
    sin(theta)``: together Legendre's equation. Routh, *Advanced Rigid Dynamics*, section 244.
    """
    rim = disk.m * disk.radius**2
    share = rim / (disk.I3 + rim)
    root = mpmath.sqrt(mpmath.mpc(0.25 - disk.I3 / disk.I1 * share))
    a, b = 0.5 + root, 0.5 - root

    def P(x):
        return mpmath.re(mpmath.hyp2f1(a, b, 1, (1 - x) / 2))

    def P_x(x):
        return mpmath.re(-a * b / 2 * mpmath.hyp2f1(a + 1, b + 1, 2, (1 - x) / 2))

    x, s = math.cos(disk.tilt(y)), math.sin(disk.tilt(y))
    across = float(disk.omega_world(y) @ disk.radius_up(y))
    matrix = mpmath.matrix([[P(x), P(-x)], [P_x(x), -P_x(-x)]])
    return [float(c) for c in mpmath.lu_solve(matrix, [disk.omega_body(y)[2], -share * across / s])]


@pytest.mark.parametrize("case", cases("disk_fall"), ids=itemgetter("id"))
def test_the_two_integrals_of_appell_and_korteweg_are_conserved(case):
    disk, y = from_case(case)
    motion = disk.simulate(y, np.linspace(0.0, case["t"][-1], 13))
    found = [appell_korteweg(disk, row) for row in motion.y]
    expected = case["scalars"]["legendre_c1"], case["scalars"]["legendre_c2"]
    # The steps keep the two almost exactly: 1e-12 was found, near flat the worst.
    np.testing.assert_allclose(found, np.tile(expected, (13, 1)), rtol=0, atol=1e-11)


def rolling(seed):
    """A disk of no special shape that leans and rolls."""
    rng = np.random.default_rng([31, seed])
    disk = RollingDisk(m=1.1, radius=0.6, I1=0.13, I3=0.2, g=9.5)
    angles = rng.uniform(-3.0, 3.0), 0.5 * np.pi + rng.uniform(-0.4, 0.4), rng.uniform(-3.0, 3.0)
    y = disk.state(
        q=rotations.quaternion_from_euler(angles),
        omega_body=rng.normal(size=3) + np.array([0.0, 0.0, 5.0]),
        contact=rng.normal(size=2),
    )
    return disk, y, rng


def in_the_world(disk, y):
    """State of the model with multipliers."""
    return pack(disk.centre(y), disk.velocity(y), matrices(y[:4]), disk.omega_world(y))


@pytest.mark.parametrize("seed", range(3))
def test_random_torques_agree_with_newtons_law(seed):
    disk, y, rng = rolling(seed)
    u = rng.uniform(-0.3, 0.3, (20, 3))
    z = through(lambda z, u: disk_on_plane(disk, z, u).rates, in_the_world(disk, y), 0.1, u)
    motion = disk.simulate(y, np.arange(21) * 0.1, u)
    # Default steps, 1e-11 per radian of some 30: 1e-11 was found. DOP853 adds 1e-12.
    np.testing.assert_allclose(motion["centre"][1:], z[:, :3], rtol=0, atol=1e-9)
    np.testing.assert_allclose(motion["velocity"][1:], z[:, 3:6], rtol=0, atol=1e-9)
    np.testing.assert_allclose(motion["R"][1:].reshape(-1, 9), z[:, 6:15], rtol=0, atol=1e-9)
    np.testing.assert_allclose(motion["omega_world"][1:], z[:, 15:18], rtol=0, atol=1e-9)
    force = [disk_on_plane(disk, *at).contact for at in zip(z, u, strict=True)]
    np.testing.assert_allclose(disk.contact_force(motion.y[1:], u), force, rtol=0, atol=1e-8)


def around(disk, y, u, h):
    """States at five moments at a distance h, y in the middle."""
    return np.array([disk.advance(y, u, k * h) if k else y for k in (-2, -1, 0, 1, 2)])


@pytest.mark.parametrize("seed", range(20))
def test_accelerations_and_contact_force_are_those_of_the_multipliers(seed):
    disk, y, rng = rolling(100 + seed)
    u, h = rng.normal(size=3), 2e-4
    held = disk_on_plane(disk, in_the_world(disk, y), u)
    # The conditioning of the nine equations, and sums of terms up to 100 N.
    np.testing.assert_allclose(disk.contact_force(y, u), held.contact, rtol=0, atol=1e-11)
    near = around(disk, y, u, h)
    # h^4 / 30 times the fifth power of some 20 rad/s, and roundings over h: 2e-10 and 1e-11.
    found = slope(disk.velocity(near), h), slope(disk.omega_world(near), h)
    np.testing.assert_allclose(found[0], held.rates[3:6], rtol=0, atol=1e-8)
    np.testing.assert_allclose(found[1], held.rates[15:18], rtol=0, atol=1e-8)


@pytest.mark.parametrize("seed", range(5))
def test_the_contact_force_is_mass_times_acceleration_and_weight(seed):
    disk, y, rng = rolling(200 + seed)
    u, h = rng.normal(size=3), 1e-3
    centre = disk.centre(around(disk, y, u, h))
    # Second differences of the place: h^4 / 90 times sixth derivatives, and roundings over h^2.
    second = np.tensordot([-1.0, 16.0, -30.0, 16.0, -1.0], centre, 1) / (12.0 * h**2)
    force = disk.m * (second + np.array([0.0, 0.0, disk.g]))
    np.testing.assert_allclose(disk.contact_force(y, u), force, rtol=0, atol=1e-6)


@pytest.mark.parametrize("seed", range(5))
def test_the_contact_does_not_slip_as_seen_from_where_the_disk_is(seed):
    disk, y, rng = rolling(300 + seed)
    u, h = 0.3 * rng.normal(size=3), 2e-4
    near = disk.simulate(y, [0.0, *(1.0 + h * np.arange(-2, 3))], u)
    centre, R, n = near["centre"][1:], near["R"][1:], disk.radius_up(near.y[3])
    contact = slope(centre, h) - slope(R, h) @ R[2].T @ (disk.radius * n)
    np.testing.assert_allclose(contact, 0.0, rtol=0, atol=1e-9)  # as above
    assert centre[2] @ [0.0, 0.0, 1.0] == pytest.approx(disk.radius * n[2], abs=1e-15)


@pytest.mark.parametrize("seed", range(10))
def test_the_energy_grows_by_the_power_of_the_torques(seed):
    disk, y, rng = rolling(400 + seed)
    u, h = rng.normal(size=3), 2e-4
    n, axis, omega = disk.radius_up(y), matrices(y[:4])[:, 2], disk.omega_world(y)
    power = u @ [omega @ n, omega @ np.cross(axis, n), omega @ axis]
    gain = slope(disk.energy(around(disk, y, u, h)), h)
    assert gain == pytest.approx(power, abs=1e-8)  # the energy is 20 J: roundings over h are 2e-11


def pushed(t):
    return (0.2 * math.cos(2.0 * t), -0.1, 0.3 * math.sin(3.0 * t))


@pytest.mark.parametrize("u", [None, (0.2, -0.1, 0.3), pushed])
def test_the_measured_order_is_four(u):
    disk, y, _ = rolling(7)
    t = np.linspace(0.0, 1.6, 5)
    fine = disk.simulate(y, t, u, max_step=0.0005).y[-1]
    errors = [
        np.max(np.abs(disk.simulate(y, t, u, max_step=step).y[-1] - fine))
        for step in (0.02, 0.01, 0.005)
    ]
    np.testing.assert_allclose(orders(errors), 4.0, rtol=0, atol=0.2)


def falling_flat(lean):
    """A disk let go at rest, and when it lies flat: (I1 + m r^2) theta'^2 / 2 = m g r (sin - sin).

    With theta = lean (1 - x^2) the integrand is smooth.
    """
    disk = RollingDisk.uniform(m=1.3, radius=0.5)
    y = disk.state(q=rotations.quaternion_from_euler((0.3, lean, 0.7)))
    pull = 2.0 * disk.m * disk.g * disk.radius / (disk.I1 + disk.m * disk.radius**2)

    def integrand(x):
        drop = 2.0 * math.sin(0.5 * lean * x * x) * math.cos(lean * (1.0 - 0.5 * x * x))
        return 2.0 * lean * x / math.sqrt(pull * drop)

    return disk, y, quad(integrand, 0.0, 1.0, epsabs=1e-13, epsrel=1e-13)[0]


@pytest.mark.parametrize("lean", [1.4, 0.9, 0.3, 0.03])
def test_a_disk_let_go_at_rest_falls_in_its_plane_and_ends_when_it_lies_flat(lean):
    disk, y, end = falling_flat(lean)
    n = disk.radius_up(y)
    for u in (None, (0.0, 0.0, 0.0)):
        with pytest.raises(ValueError, match=r"at t = \S+ s the motion ends.*lies flat") as refused:
            disk.simulate(y, [0.0, 0.5 * end, 2.0], u)
        # Six digits are said, and the disk is flat but for 1e-6 rad.
        said = float(str(refused.value).split()[3])
        assert said == pytest.approx(end, rel=1e-5, abs=2e-6)
    motion = disk.simulate(y, np.linspace(0.0, 0.99 * end, 12))
    level = motion["centre"][:, :2] - motion["contact"]
    # Towards the end roundings of the precession grow with its rate, like 1 / sin(theta)^2.
    np.testing.assert_allclose(motion["contact"], 0.0, rtol=0, atol=1e-12)
    np.testing.assert_allclose(level @ [-n[1], n[0]], 0.0, rtol=0, atol=1e-12)
    np.testing.assert_allclose(motion.invariants["energy"], disk.energy(y), rtol=1e-12)


class AnyRatio(RollingDisk):
    """The equations beyond the bodies that there are: moments may be large for mass and radius."""

    def __post_init__(self):
        pass


@pytest.mark.parametrize("seed", range(4))
def test_without_mass_the_disk_turns_like_a_free_body(seed):
    rng = np.random.default_rng([32, seed])
    disk = AnyRatio(m=1e-13, radius=0.5, I1=1.1, I3=0.7, g=1.0)
    # Precessing about a momentum that is nearly level it never lies flat.
    q = rotations.quaternion_from_euler((0.3, 0.5 * np.pi - 0.1, 0.7))
    omega = np.array([*rng.uniform(-0.4, 0.4, 2), 2.0])
    t = np.linspace(0.0, 8.0, 17)
    motion = disk.simulate(disk.state(q=q, omega_body=omega), t)
    moments = (1.1, 1.1, 0.7)
    # Default steps, some 30 radians.
    expected = free_body.omega(t, moments, omega)
    np.testing.assert_allclose(motion["omega_body"], expected, rtol=0, atol=1e-10)
    R = matrices(free_body.attitude(t, moments, omega, q))
    np.testing.assert_allclose(motion["R"], R, rtol=0, atol=1e-10)
