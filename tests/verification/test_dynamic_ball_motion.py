"""The ball on its plate against reference cases, Newton's law with multipliers and closed forms."""

import math
from operator import itemgetter

import numpy as np
import pytest

from rigid_envs.mechanics.laws import EPS, matrices
from rigid_envs.systems.dynamic_ball.system import DynamicBall
from tests.reference import cases
from tests.verification.measures import orders, random_attitude, refined, slope, through
from tests.verification.multipliers import ball_on_plate, pack

BETA = {"solid_sphere": 0.4, "hollow_sphere": 2.0 / 3.0}
BALL = DynamicBall(m=1.2, radius=0.4, beta=0.55, g=9.6, turntable_rate=0.9)


def ball_of(case):
    given = case["in"]
    rate = given.get("Omega", 0.0)
    return DynamicBall(
        radius=given["a"], beta=BETA[given["beta"]], g=given["g"], turntable_rate=rate
    )


def plate_of(case):
    """Angles and rates of the plate at the start, input of time, and where O is at a time."""
    given, still = case["in"], lambda t: np.zeros((len(t), 3))
    match given["plate"]:
        case "tilting":
            size, rate, phase = given["al0"], given["nu"], given["phase"]

            def tilted(t):
                return (0.0, 0.0, -size * rate**2 * math.sin(rate * t + phase), 0.0)

            start = (size * math.sin(phase), 0.0, size * rate * math.cos(phase), 0.0)
            return start, tilted, still
        case "two_axis":
            a, b, c, d = (given[name] for name in ("ax0", "nux", "ay0", "nuy"))

            def tipped(t):
                return (0.0, 0.0, -a * b**2 * math.sin(b * t), -c * d**2 * math.sin(d * t))

            return (0.0, 0.0, a * b, c * d), tipped, still
        case "shaken":  # m = 1: the force that a plate accelerated by A seems to exert is -A
            a, b, c, d = (given[name] for name in ("A", "nu", "B", "nv"))

            def shaken(t):
                return (a * b**2 * math.sin(b * t), c * d**2 * math.sin(d * t), 0.0, 0.0)

            def moved(t):
                return np.stack([a * np.sin(b * t), c * np.sin(d * t), 0.0 * t], axis=-1)

            return (0.0, 0.0, 0.0, 0.0), shaken, moved
    return (given.get("tilt", 0.0), 0.0, 0.0, 0.0), None, still


def rolling(ball, q, position, omega_world, tilt, tilt_rate):
    """State whose velocity makes the contact move with the surface."""
    y = ball.state(q=q, position=position, tilt=tilt, tilt_rate=tilt_rate)
    P = ball.plate(y)
    w = tilt_rate[0] * np.array([1.0, 0.0, 0.0]) + tilt_rate[1] * P[:, 1]
    centre, n = ball.centre(y), P[:, 2]
    surface = np.cross(w + ball.turntable_rate * n, centre - ball.radius * n)
    velocity = surface + np.cross(omega_world, ball.radius * n)
    y[6:8] = (P.T @ (velocity - np.cross(w, centre)))[:2]
    y[8] = n @ omega_world
    return y


@pytest.mark.parametrize("case", cases("ball_dynamic"), ids=itemgetter("id"))
def test_the_ball_on_its_plate_agrees_with_the_reference(case):
    given, out, cond = case["in"], case["out"], case["cond"]
    ball = ball_of(case)
    (ax, ay, rate_x, rate_y), u, origin = plate_of(case)
    y = rolling(ball, given["q0"], given["XY0"], given["w0"], (ax, ay), (rate_x, rate_y))
    np.testing.assert_allclose(ball.centre(y), case["scalars"]["r0"], rtol=0, atol=4 * EPS)
    t = np.concatenate([[0.0], case["t"]])
    motion = refined(ball, y, t, u)
    found = motion.trajectory
    fields = (
        ("centre", "r", ball.radius * motion.turned),
        ("omega_world", "w_space", motion.rate),
        ("R", "R", motion.turned),
    )
    for name, field, size in fields:
        values = found[name][1:] + (origin(np.array(case["t"])) if name == "centre" else 0.0)
        expected = np.array(out[field]).reshape(values.shape)
        atol = motion.tolerance(name, size, cond[field])
        np.testing.assert_allclose(values, expected, rtol=0, atol=atol)


def moving(seed, turntable_rate=0.9):
    """A ball that is pushed about on a plate which tilts about both axes and turns."""
    rng = np.random.default_rng([30, seed])
    ball = DynamicBall(m=1.2, radius=0.4, beta=0.55, g=9.6, turntable_rate=turntable_rate)
    y = ball.state(
        q=random_attitude(rng),
        position=rng.normal(size=2),
        velocity=rng.normal(size=2),
        spin=rng.normal(),
        tilt=0.3 * rng.normal(size=2),
        tilt_rate=0.3 * rng.normal(size=2),
    )
    return ball, y, rng


def in_the_world(ball, y):
    """State of the model with multipliers."""
    R = matrices(y[:4])
    return pack(ball.centre(y), ball.velocity_world(y), R, ball.omega_world(y), y[9:])


@pytest.mark.parametrize("seed", range(3))
def test_random_forces_and_tilts_agree_with_newtons_law(seed):
    ball, y, rng = moving(seed)
    u = rng.uniform(-1.0, 1.0, (20, 4))
    z = through(lambda z, u: ball_on_plate(ball, z, u).rates, in_the_world(ball, y), 0.1, u)
    motion = ball.simulate(y, np.arange(21) * 0.1, u)
    # Default steps, 1e-11 per radian of some 20: 1e-12 to 2e-10 were found. DOP853 adds 1e-12.
    np.testing.assert_allclose(motion["centre"][1:], z[:, :3], rtol=0, atol=1e-9)
    np.testing.assert_allclose(motion["velocity_world"][1:], z[:, 3:6], rtol=0, atol=1e-9)
    np.testing.assert_allclose(motion["R"][1:].reshape(-1, 9), z[:, 6:15], rtol=0, atol=1e-9)
    np.testing.assert_allclose(motion["omega_world"][1:], z[:, 15:18], rtol=0, atol=1e-9)
    np.testing.assert_allclose(motion["tilt"][1:], z[:, 18:20], rtol=0, atol=1e-12)
    force = [ball_on_plate(ball, *at).contact for at in zip(z, u, strict=True)]
    found = np.einsum("nij,nj->ni", motion["plate"][1:], ball.contact_force(motion.y[1:], u))
    np.testing.assert_allclose(found, force, rtol=0, atol=1e-8)  # 30 N, by the accelerations


@pytest.mark.parametrize("seed", range(20))
def test_accelerations_and_contact_force_are_those_of_the_multipliers(seed):
    ball, y, rng = moving(100 + seed, turntable_rate=-1.7)
    u = rng.normal(size=4) * [5.0, 5.0, 3.0, 3.0]
    held = ball_on_plate(ball, in_the_world(ball, y), u)
    P, h = ball.plate(y), 1e-3
    force = P @ ball.contact_force(y, u)
    # The conditioning of the nine equations, and sums of terms up to 100 N.
    np.testing.assert_allclose(force, held.contact, rtol=0, atol=1e-11)
    near = np.array([ball.advance(y, u, k * h) if k else y for k in (-2, -1, 0, 1, 2)])
    # h^4 times fifth derivatives, and roundings over h: 1e-9 and 1e-12.
    found = slope(ball.velocity_world(near), h), slope(ball.omega_world(near), h)
    np.testing.assert_allclose(found[0], held.rates[3:6], rtol=0, atol=1e-8)
    np.testing.assert_allclose(found[1], held.rates[15:18], rtol=0, atol=1e-8)


@pytest.mark.parametrize("seed", range(5))
def test_the_contact_does_not_slip_as_seen_from_where_the_ball_is(seed):
    ball, y, rng = moving(200 + seed)
    u, h = rng.uniform(-1.0, 1.0, 4), 2e-4
    near = ball.simulate(y, [0.0, *(1.0 + h * np.arange(-2, 3))], u)
    centre, R, P = near["centre"][1:], near["R"][1:], near["plate"][1:]
    spun, tipped = slope(R, h) @ R[2].T, slope(P, h) @ P[2].T
    n = P[2, :, 2]
    foot = centre[2] - ball.radius * n
    surface = tipped @ foot + ball.turntable_rate * np.cross(n, foot)
    contact = slope(centre, h) - spun @ (ball.radius * n)
    # h^4 / 30 times the fifth power of some 20 rad/s, and roundings over h: 2e-10 and 1e-11.
    np.testing.assert_allclose(contact, surface, rtol=0, atol=1e-9)


@pytest.mark.parametrize("seed", range(10))
def test_the_energy_grows_by_the_power_of_force_and_plate(seed):
    ball, y, rng = moving(300 + seed)
    u, h = rng.normal(size=4), 1e-3
    near = np.array([ball.advance(y, u, k * h) if k else y for k in (-2, -1, 0, 1, 2)])
    P, rates = ball.plate(y), ball.tilt_rate(y)
    n = P[:, 2]
    w = np.array([rates[0], 0.0, 0.0]) + rates[1] * P[:, 1] + ball.turntable_rate * n
    surface = np.cross(w, ball.centre(y) - ball.radius * n)
    power = (P[:, :2] @ u[:2]) @ ball.velocity_world(y) + (P @ ball.contact_force(y, u)) @ surface
    assert slope(ball.energy(near), h) == pytest.approx(power, abs=1e-8)


def driven(t):
    return (0.8 * math.cos(2.0 * t), 0.5, 0.6 * math.sin(3.0 * t), -0.4 * math.cos(t))


@pytest.mark.parametrize("u", [None, (0.8, -0.5, 0.2, 0.1), driven])
def test_the_measured_order_is_four(u):
    ball, y, _ = moving(7)
    t = np.linspace(0.0, 1.6, 5)
    fine = ball.simulate(y, t, u, max_step=0.0005).y[-1]
    errors = [
        np.max(np.abs(ball.simulate(y, t, u, max_step=step).y[-1] - fine))
        for step in (0.02, 0.01, 0.005)
    ]
    np.testing.assert_allclose(orders(errors), 4.0, rtol=0, atol=0.2)


@pytest.mark.parametrize("beta", [0.0, 0.4, 2.0 / 3.0])
@pytest.mark.parametrize("steps", [10, 23])
def test_on_a_fixed_tilt_the_ball_follows_a_parabola_exactly(beta, steps):
    ball, tilt = DynamicBall(radius=0.5, beta=beta), (0.2, -0.1)
    y = ball.state(position=(0.1, 0.2), velocity=(-0.3, 0.4), spin=0.7, tilt=tilt)
    end, t = ball.advance(y, (0.3, -0.2, 0.0, 0.0), 0.5, steps), 0.5
    # Gravity in plate axes, from the plate's own matrix; a force divides by the mass, 1 kg.
    g = ball.plate(y).T @ [0.0, 0.0, -9.81]
    a = (g[:2] + np.array([0.3, -0.2])) / (1.0 + beta)
    roundings = 5.0 * EPS * steps
    np.testing.assert_allclose(end[6:8], y[6:8] + a * t, rtol=0, atol=2.0 * roundings)
    np.testing.assert_allclose(
        end[4:6], y[4:6] + y[6:8] * t + 0.5 * a * t**2, rtol=0, atol=roundings
    )
    assert end[8] == 0.7  # no moment about the normal


@pytest.mark.parametrize(("beta", "share"), [(0.4, 2.0 / 7.0), (2.0 / 3.0, 2.0 / 5.0), (0.0, 0.0)])
def test_a_level_turntable_turns_the_velocity_at_two_sevenths_of_its_rate(beta, share):
    ball = DynamicBall(radius=0.3, beta=beta, turntable_rate=2.3)
    y = ball.state(position=(0.5, -0.2), velocity=(0.4, 0.1))
    t = np.linspace(0.0, 10.0, 41)
    motion = ball.simulate(y, t)
    angle = share * 2.3 * t
    turn = np.exp(1j * angle) * (0.4 + 0.1j)
    # The turn of the velocity is exact; some thousand steps of it are rounded.
    np.testing.assert_allclose(motion["velocity"] @ (1.0, 1j), turn, rtol=0, atol=1e-12)
    # The place is the integral of that. Default steps: 1e-11 per radian of 80.
    centre = (0.4 + 0.1j) * np.where(share, (np.exp(1j * angle) - 1.0) / 1j, 0.0)
    way = centre / (share * 2.3) if share else (0.4 + 0.1j) * t
    np.testing.assert_allclose(motion["position"] @ (1.0, 1j), 0.5 - 0.2j + way, rtol=0, atol=1e-9)


@pytest.mark.parametrize("case", cases("ball_dynamic")[4:6], ids=itemgetter("id"))
def test_a_tilted_turntable_drives_the_ball_across_the_slope_not_down(case):
    ball, drift = ball_of(case), case["scalars"]["drift_vx"]
    # One period of the velocity: what is left of the way is the drift.
    period = 2.0 * math.pi / (2.0 / 7.0 * abs(ball.turntable_rate))
    y = ball.state(velocity=(0.3, -0.2), tilt=(case["in"]["tilt"], 0.0))
    end = ball.simulate(y, [0.0, period]).y[-1]
    np.testing.assert_allclose(end[4:6], (drift * period, 0.0), rtol=0, atol=1e-9)
    np.testing.assert_allclose(end[6:8], (0.3, -0.2), rtol=0, atol=1e-9)


def test_on_a_plate_that_is_pulled_away_the_ball_follows_at_two_sevenths():
    # Seen from the plate a force -m A: the ball falls behind by A / (1 + beta).
    ball, t = DynamicBall(m=1.3, radius=0.2, beta=0.4), 0.5
    end = ball.simulate(ball.state(), [0.0, t], (-1.3 * 2.0, 0.0, 0.0, 0.0)).y[-1]
    assert end[6] + 2.0 * t == pytest.approx(2.0 / 7.0 * 2.0 * t, rel=1e-13)


def test_a_spinning_ball_feels_its_spin_only_where_the_plate_tips():
    spinning = [BALL.state(velocity=(0.3, 0.2), spin=spin, tilt=(0.1, 0.2)) for spin in (0.0, 9.0)]
    still, spun = (BALL.rhs(y)[6:8] for y in spinning)
    np.testing.assert_array_equal(still, spun)
    for y in spinning:
        y[11] = 0.5  # its angular momentum along n turns with the plate: a gyroscopic push
    assert np.max(np.abs(np.subtract(*(BALL.rhs(y)[6:8] for y in spinning)))) > 0.1
