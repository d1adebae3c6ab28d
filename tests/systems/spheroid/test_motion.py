"""Motion of spheroids on a plane: closed forms against references, simulations against both."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from rigid_envs.mechanics import rotations
from rigid_envs.mechanics.events import crossing
from rigid_envs.mechanics.laws import EPS
from rigid_envs.systems.roller import closed_forms as roller
from rigid_envs.systems.spheroid import closed_forms as spheroid
from rigid_envs.systems.spheroid.system import Spheroid
from tests.reference import cases, every
from tests.systems.measures import assert_energy_stays, million_steps, refined

EGG = {"m": 1.2, "radius": 0.7, "half_height": 0.9, "offset": 0.15, "g": 2.5}
TOP = {"m": 0.02, "radius": 0.02, "offset": 0.006, "g": 9.81}
MOMENTS = {"i_perp": 2.9e-6, "i3": 3.2e-6}
ICE = {"mu": 0.0, "drag": 0.0, "slip_speed": 1.0}


def top_of(given, **friction):
    """The loaded sphere of a reference case."""
    return Spheroid(
        **{"m": given["m"], "radius": given["r"], "half_height": given["r"], "g": given["g"]},
        **{"offset": given["a"], "I1": given["A"], "I3": given["C"]},
        **(ICE | friction),
    )


# Tippe tops against reference cases.


def friction_of(given):
    if given["law"] == "viscous":
        return {"drag": given["c"]}
    return {"mu": given["mu"], "slip_speed": given["eps"]}


def from_case(case):
    given = case["in"]
    top = top_of(given, **friction_of(given))
    q = rotations.quaternion_from_euler([given["phi0"], given["theta0"], given["psi0"]])
    return top, top.state(q=q, omega_body=given["w0"], centre=given["xy0"], velocity=given["v0"])


@every(cases("tippe_top"))
def test_the_tippe_top_agrees_with_the_reference(case):
    top, y = from_case(case)
    t = np.union1d(case["t"], np.linspace(0.0, case["t"][-1], 61))  # to see where it is fastest
    motion, rows = refined(top, y, t), np.searchsorted(t, case["t"])
    found, out, cond = motion.trajectory, case["out"], case["cond"]
    speed, weight = top.radius * motion.rate, top.m * top.g
    fields = (
        ("R", "R", found["R"], motion.turned),
        ("omega_body", "w", found["omega_body"], motion.rate),
        ("tilt", "theta", found["tilt"], motion.turned),
        ("slip", "slip", found["slip"], speed),
        ("contact_force", "F", found["contact_force"][:, :2], weight * motion.turned),
        ("normal_force", "N", found["normal_force"], weight * motion.turned),
        ("centre", "com", found["centre"], top.radius * motion.turned),
        ("height", "com", found["height"], top.radius * motion.turned),
    )
    for name, field, values, size in fields:
        expected = np.array(out[field])
        if field == "com":
            expected = expected[:, 2] if name == "height" else expected[:, :2]
        expected = np.reshape(expected, values[rows].shape)
        atol = motion.tolerance(name, size, cond[field])
        np.testing.assert_allclose(values[rows], expected, rtol=0, atol=atol, err_msg=name)


@every(cases("tippe_top"))
def test_energy_and_jelletts_integral_of_the_tippe_top_agree_with_the_reference(case):
    top, y = from_case(case)
    scalars, level = case["scalars"], top.m * top.g * top.radius  # heights are above its centre
    before = top.invariants(y)
    # some dozen roundings of the largest term
    assert before["jellett"] == pytest.approx(scalars["jellett"], rel=16 * EPS)
    assert before["energy"] - level == pytest.approx(scalars["energy0"], rel=16 * EPS)
    motion = refined(top, y, np.array([0.0, *case["t"]]))
    J, energy = (motion.trajectory.invariants[name] for name in ("jellett", "energy"))
    # Steps keep it but for roundings, as of `Refined.tolerance`: to the same side at worst.
    assert np.max(np.abs(J / scalars["jellett"] - 1.0)) <= EPS * (16.0 + 5.0 * motion.steps)
    coarse = motion.coarse.invariants["energy"]
    missed = np.max(np.abs(energy - coarse)) / 5.0  # as of `Refined.tolerance`
    atol = missed + EPS * (64.0 * case["cond"]["energy"] + 5.0 * motion.steps * energy[0])
    np.testing.assert_allclose(energy[1:] - level, scalars["energy"], rtol=0, atol=atol)


@pytest.mark.long
@every([case for case in cases("tippe_top") if case["in"].get("rise")])
def test_the_tippe_top_rises_when_the_reference_says(case):
    top, y = from_case(case)
    events = [
        crossing(top, "gamma", 2, value=math.cos(math.radians(angle))) for angle in (90.0, 160.0)
    ]
    motion = top.simulate(y, [0.0, case["t"][-1]], events=events)
    for name, times in zip(("t_rise_90", "t_rise_160"), motion.t_events, strict=True):
        # 1e-11 per radian, of some hundred radians, times what a change of the start does to it
        atol = 1e-9 * max(1.0, case["cond"][name])
        assert times[0] == pytest.approx(case["scalars"][name], abs=atol)


@every(cases("tippe_threshold"))
def test_thresholds_agree_with_the_reference(case):
    given, scalars = case["in"], case["scalars"]
    top = top_of(given, **friction_of(given))
    body = {"m": top.m, "radius": top.radius, "offset": top.offset, "g": top.g}
    rise, stand = spheroid.jellett_thresholds(**body, i_perp=top.I1, i3=top.I3)
    found = {
        "n_up_unstable_above": top.rising_spin,
        "n_inverted_stable_above": top.standing_spin,
        "jellett_up": top.radius * rise,
        "jellett_inv": top.radius * stand,
    }
    assert found.keys() == scalars.keys()
    for name, value in found.items():
        expected = math.inf if scalars[name] is None else scalars[name]
        rtol = 4.0 * EPS * max(4.0, case["cond"].get(name, 0.0) / expected)
        assert value == pytest.approx(expected, rel=rtol), name


@every(cases("tippe_threshold"))
def test_the_exponents_change_their_sign_at_the_thresholds(case):
    given, scalars = case["in"], case["scalars"]
    body = {"m": given["m"], "radius": given["r"], "half_height": given["r"], "g": given["g"]}
    body |= {"i_perp": given["A"], "i3": given["C"], "drag": given["c"]}

    def growth(offset):
        return lambda n: spheroid.upright_exponents(n, **body, offset=offset)[0].real

    for name, offset in (
        ("n_up_unstable_above", given["a"]),
        ("n_inverted_stable_above", -given["a"]),
    ):
        threshold = scalars[name]
        if threshold is None:
            assert all(growth(offset)(n) < 0.0 for n in np.linspace(1.0, 400.0, 100))
            continue
        found = brentq(growth(offset), 0.8 * threshold, 1.2 * threshold, xtol=1e-14, rtol=4 * EPS)
        # the growth crosses zero so slowly that its rounding, EPS times rates of 1e3, counts
        slope = (growth(offset)(1.01 * threshold) - growth(offset)(0.99 * threshold)) / 0.02
        assert found == pytest.approx(threshold, rel=256.0 * EPS * 1e3 / abs(slope))


# Balls that slide: Coulomb's law in the limit, and the smooth law itself.
#
# Under the smooth law the slip is never further from that of Coulomb's than x slip_speed, where
# arsinh(1 / x) = sqrt(x^2 + 1): they part most where Coulomb's is gone. So no velocity is further
# off than the part beta / (1 + beta) of that, and no place than as much times the time.


PARTING = 0.6627434193491816


def thrown(case):
    """Ball, velocity and angular velocity of a case, along x and about y where it has one each."""
    given = case["in"]
    ball = {"beta": given["beta"], "radius": given["r"], "mu": given["mu"], "g": given["g"]}
    if case["kind"] == "slide_1d":
        return ball, (given["v0"], 0.0), (0.0, given["w0"], 0.0)
    return ball, given["v0"], given["w0"]


def planar(case, name):
    """Values of a case at its times, as vectors."""
    values = np.array(case["out"][name])
    if case["kind"] == "slide_2d":
        return values
    zero = np.zeros_like(values)
    return np.stack([zero, values, zero] if name == "w" else [values, zero], axis=-1)


SLIDES = [*cases("slide_1d"), *cases("slide_2d")]


@every(SLIDES)
def test_coulombs_friction_agrees_with_the_reference(case):
    ball, v, w = thrown(case)
    found = roller.slide(case["t"], v, w, **ball)
    for values, name in zip(found, ("x", "v", "w"), strict=True):
        expected, tolerance = planar(case, name), 16.0 * EPS * (1.0 + case["cond"][name])
        np.testing.assert_allclose(values, expected, rtol=0, atol=tolerance)
    end, scalars, cond = roller.slip_to_roll(v, w, **ball), case["scalars"], case["cond"]
    for name, values in (
        ("t_roll", end.time),
        ("x_roll", end.position),
        ("v_roll", end.velocity),
        ("v_final", end.velocity),
    ):
        if name in scalars:
            expected = np.array(scalars[name])
            found = values if np.shape(values) == expected.shape else values[0]
            tolerance = 16.0 * EPS * (1.0 + cond[name])
            np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance)
    if "deflection" in scalars and np.any(v):
        turned = math.atan2(*end.velocity[::-1]) - math.atan2(v[1], v[0])
        assert turned == pytest.approx(scalars["deflection"], abs=16.0 * EPS * (1.0 + abs(turned)))


@every(SLIDES)
@pytest.mark.parametrize("slip_speed", [1e-2, 1e-9])
def test_a_ball_slides_as_under_coulombs_friction_up_to_the_slip_speed(case, slip_speed):
    ball, v, w = thrown(case)
    found = spheroid.slide_with_friction(case["t"], v, w, **ball, slip_speed=slip_speed)
    most = PARTING * slip_speed * ball["beta"] / (1.0 + ball["beta"]) + 1e-13 * np.hypot(*v)
    v_off = np.linalg.norm(found.velocity - planar(case, "v"), axis=-1)
    x_off = np.linalg.norm(found.position - planar(case, "x"), axis=-1)
    w_off = np.linalg.norm(found.omega - planar(case, "w"), axis=-1)
    assert np.all(v_off <= most)
    assert np.all(x_off <= most * np.array(case["t"]))
    assert np.all(w_off * ball["radius"] * ball["beta"] <= most + 1e-13)
    scalars = case["scalars"]
    if scalars.get("t_turn") is not None:
        turn = spheroid.slide_with_friction(scalars["t_turn"], v, w, **ball, slip_speed=slip_speed)
        assert abs(turn.velocity[0]) <= most
        assert abs(turn.position[0] - scalars["x_turn"]) <= most * scalars["t_turn"]


@every(SLIDES)
def test_the_simulated_ball_slides_as_the_closed_form_and_loses_the_energy_of_the_reference(case):
    given, (ball, v, w), slip_speed = case["in"], thrown(case), 0.02
    inertia = given["beta"] * given["m"] * given["r"] ** 2
    body = Spheroid(
        **{"m": given["m"], "radius": given["r"], "half_height": given["r"], "offset": 0.0},
        **{"I1": inertia, "I3": inertia, "g": given["g"], "mu": given["mu"]},
        slip_speed=slip_speed,
    )
    t = np.array([0.0, *case["t"]])
    motion = refined(body, body.state(velocity=v, omega_body=w), t, per_radian=4.0)
    exact = spheroid.slide_with_friction(t, v, w, **ball, slip_speed=slip_speed)
    speed = np.hypot(*v) + given["r"] * np.linalg.norm(w)
    for name, expected, size in (
        ("centre", exact.position, speed * t[-1]),
        ("velocity", exact.velocity, speed),
        ("omega_world", exact.omega, speed / given["r"]),
        ("slip", exact.slip, speed),
    ):
        atol = motion.tolerance(name, size, speed)
        np.testing.assert_allclose(motion.trajectory[name], expected, rtol=0, atol=atol)
    energy = motion.trajectory.invariants["energy"]
    u = np.hypot(*exact.slip[0])
    lost = 0.5 * given["m"] * given["beta"] / (1.0 + given["beta"]) * u * u
    if "energy_lost" in case["scalars"]:
        assert lost == pytest.approx(case["scalars"]["energy_lost"], rel=16 * EPS)
    # what slips at the end: it dies out at k / slip_speed = 100 / s, and it is squared
    left = (np.hypot(*exact.slip[-1]) / u) ** 2
    assert energy[0] - energy[-1] == pytest.approx(lost, rel=1e-9 + left)


def test_a_ball_that_rolls_already_goes_on_whatever_the_friction():
    rolling = {"velocity": (0.6, -0.3), "omega": (1.0, 2.0, 5.0), "beta": 0.4, "radius": 0.3}
    for motion in (
        spheroid.slide_with_drag([0.0, 3.0], **rolling, drag=0.2, g=9.8),
        spheroid.slide_with_friction([0.0, 3.0], **rolling, mu=0.2, slip_speed=0.1, g=9.8),
    ):
        assert not np.any(motion.slip)
        np.testing.assert_allclose(motion.position[1], (1.8, -0.9), rtol=1e-15)
        np.testing.assert_array_equal(motion.velocity, [rolling["velocity"]] * 2)
        np.testing.assert_array_equal(motion.omega, [rolling["omega"]] * 2)


@pytest.mark.parametrize("slip_speed", [1e-6, 0.3, 40.0])
def test_both_frictions_are_one_where_the_slip_is_far_below_the_slip_speed(slip_speed):
    start = {"velocity": (1e-9 * slip_speed, 0.0), "omega": (0.0, 0.0, 0.0)}
    ball = {"beta": 0.4, "radius": 0.3, "g": 9.8}
    t = slip_speed * np.array([0.0, 0.1, 1.0, 8.0])
    smooth = spheroid.slide_with_friction(t, **start, **ball, mu=0.2, slip_speed=slip_speed)
    drag = spheroid.slide_with_drag(t, **start, **ball, drag=0.2 / slip_speed)
    # relative; in an exponent of up to 55, which is a difference of two such numbers
    # The place is the difference of two integrals: roundings of the farthest.
    np.testing.assert_allclose(smooth.slip, drag.slip, rtol=256 * EPS)
    farthest = np.max(np.abs(drag.position))
    np.testing.assert_allclose(smooth.position, drag.position, rtol=0, atol=16 * EPS * farthest)


# Without friction.


@pytest.mark.parametrize(
    ("half_height", "offset"), [(0.9, 0.15), (0.5, -0.2), (0.7, 0.3)], ids=["egg", "pill", "ball"]
)
@pytest.mark.parametrize(
    ("theta", "phi_rate", "omega3"), [(0.8, 0.9, 2.5), (2.0, 0.5, 3.0), (1.2, -1.0, 0.5)]
)
def test_a_body_on_ice_nods_with_the_period_of_the_quadrature(
    half_height, offset, theta, phi_rate, omega3
):
    shape = {**EGG, "half_height": half_height, "offset": offset}
    nod = spheroid.nutation(theta, phi_rate, omega3, **shape, i_perp=0.35, i3=0.3)
    body = Spheroid(**shape, **ICE, I1=0.35, I3=0.3)
    t = nod.period * np.array([0.0, 0.25, 0.5, 0.75, 1.0, 10.0])
    start = body.state(tilt=theta, precession=phi_rate, spin=omega3, velocity=(0.3, -0.2))
    tilt = body.simulate(start, t)["tilt"]
    ends = [nod.theta_min, nod.theta_max]
    other = max(ends, key=lambda end: abs(end - theta))
    assert min(abs(end - theta) for end in ends) <= 4 * EPS
    # 1e-11 per radian, of up to 200 radians
    np.testing.assert_allclose(tilt[[0, 2, 4, 5]], [theta, other, theta, theta], rtol=0, atol=2e-9)
    assert tilt[1] == pytest.approx(tilt[3], abs=2e-9)


@every([case for case in cases("tippe_top") if case["in"].get("c") == 0.0])
def test_the_reference_on_ice_stays_between_the_turning_points(case):
    top, y = from_case(case)
    kept, out = top.invariants(y), case["out"]
    # It starts where its tilt turns: omega2 alone is across the axis, and upright to the node.
    given = case["in"]
    nod = spheroid.nutation(
        given["theta0"],
        given["w0"][1] / math.sin(given["theta0"]),
        given["w0"][2],
        **TOP,
        **{"half_height": given["r"], "i_perp": given["A"], "i3": given["C"]},
    )
    assert nod.energy == pytest.approx(kept["energy"], rel=16 * EPS)
    assert nod.p_phi == pytest.approx(kept["L_vertical"], rel=16 * EPS)
    assert nod.p_psi == pytest.approx(kept["L_spin"], rel=16 * EPS)
    theta = np.array(out["theta"])
    assert np.all((nod.theta_min < theta) & (theta < nod.theta_max))
    again = top.simulate(y, [0.0, nod.period])["tilt"][-1]
    assert again == pytest.approx(given["theta0"], abs=1e-10)  # 1e-11 per radian, some 8


def test_the_swing_falls_to_nothing_at_a_steady_precession():
    body = {**EGG, "i_perp": 0.35, "i3": 0.3}

    def push(phi_rate):
        smooth = Spheroid(**EGG, **ICE, I1=0.35, I3=0.3)
        y = smooth.state(tilt=0.8, precession=phi_rate, spin=2.5)
        # theta'' where psi = theta' = 0, of omega1 = theta' cos(psi) + phi' sin(theta) sin(psi)
        return float(smooth.rhs(y)[4]) - phi_rate * math.sin(0.8) * (2.5 - phi_rate * math.cos(0.8))

    steady = brentq(push, 0.0, 1.5, xtol=1e-15)
    swings = []
    for away in (0.02, 0.01):
        near = spheroid.nutation(0.8, steady + away, 2.5, **body)
        swings.append(near.theta_max - near.theta_min)
    assert swings[0] < 0.05
    assert swings[0] / swings[1] == pytest.approx(2.0, rel=0.1)  # and squares of the swing


@pytest.mark.long
@pytest.mark.parametrize("offset", [0.15, 0.0])
def test_a_million_steps_on_ice_bound_the_energy(offset):
    body = Spheroid(**{**EGG, "offset": offset}, **ICE, I1=0.35, I3=0.3)
    start = body.state(tilt=0.8, precession=0.9, spin=2.5)
    trajectory = million_steps(body, start, 0.05, 1500)
    # Found: 1.6e-10 and 3.6e-9.
    # Seen at 1500 moments an oscillation leaves a tenth of itself.
    assert_energy_stays(trajectory, 1e-8, share=0.25)
    for name in ("L_vertical", "L_spin"):
        values = trajectory.invariants[name]
        # a random walk of 1e7 roundings, or a drift of 1e-16 per step
        assert np.max(np.abs(values - values[0])) <= 2e-10


# With friction: Jellett's integral, and where it leads.


@pytest.mark.parametrize("tilt", [0.3, 1.4, 2.7])
def test_no_motion_has_less_energy_than_without_slip(tilt):
    top = Spheroid(**TOP, half_height=0.02, I1=2.9e-6, I3=3.2e-6)
    rng = np.random.default_rng(3)
    omega = 60.0 * rng.normal(size=(200, 3))
    y = top.state(tilt=tilt)[None] + np.zeros((200, 1))
    y[:, 4:7], y[:, 9:] = omega, 0.3 * rng.normal(size=(200, 2))
    level = top.energy(y) - TOP["m"] * TOP["g"] * TOP["radius"]
    p = top.invariants(y)["jellett"] / TOP["radius"]
    least = [float(spheroid.no_slip_potential(tilt, float(each), **TOP, **MOMENTS)) for each in p]
    assert np.all(level >= least)


def test_tumblings_are_the_extrema_of_the_potential():
    rise, stand = spheroid.jellett_thresholds(**TOP, **MOMENTS)
    theta = np.linspace(0.0, math.pi, 20001)
    for p in (0.5 * rise, 0.9 * rise, 1.1 * rise, 0.5 * (rise + stand), 0.99 * stand, 2.0 * stand):
        V = spheroid.no_slip_potential(theta, p, **TOP, **MOMENTS)
        lows = theta[1:-1][(V[1:-1] < V[:-2]) & (V[1:-1] < V[2:])]
        found = spheroid.tumbling(p, **TOP, **MOMENTS)
        stable = [each.theta for each in found if each.stable]
        # a step of the net
        np.testing.assert_allclose(stable, lows, rtol=0, atol=theta[1])
        for each in found:
            level = spheroid.no_slip_potential(each.theta, p, **TOP, **MOMENTS)
            assert each.energy == pytest.approx(float(level), rel=64 * EPS)
        assert bool(found) == (rise < p < stand)


@pytest.mark.parametrize("i_perp", [2.2e-6, 2.9e-6, 4.4e-6])
def test_a_top_stands_or_rises_where_the_curvature_of_the_potential_says(i_perp):
    body = {**TOP, "i_perp": i_perp, "i3": 3.2e-6}
    rise, stand = spheroid.jellett_thresholds(**body)
    for p in np.geomspace(1e-5, 1e-3, 30):
        for limit, pole, above in ((rise, 0.0, -1.0), (stand, math.pi, 1.0)):
            if abs(p / limit - 1.0) > 0.01:
                V = spheroid.no_slip_potential([pole, pole + 1e-3], float(p), **body)
                assert np.sign(V[1] - V[0]) == (above if p > limit else -above)


@pytest.mark.long
@pytest.mark.parametrize(("share", "sign"), [(0.3, 1.0), (0.8, -1.0)])
def test_friction_leads_to_the_tumbling_of_jelletts_integral(share, sign):
    rise, stand = spheroid.jellett_thresholds(**TOP, **MOMENTS)
    top = Spheroid(**TOP, **(ICE | {"drag": 0.3}), half_height=0.02, I1=2.9e-6, I3=3.2e-6)
    spin = (rise + share * (stand - rise)) / MOMENTS["i3"] / (1.0 - TOP["offset"] / TOP["radius"])
    start = top.state(tilt=0.4, spin=sign * spin)
    end = top.simulate(start, [0.0, 60.0]).y[-1]
    p = float(top.invariants(start)["jellett"]) / TOP["radius"]
    (steady,) = spheroid.tumbling(p, **TOP, **MOMENTS)
    assert steady.stable
    assert top.tilt(end) == pytest.approx(steady.theta, abs=1e-6)
    assert np.linalg.norm(top.omega_body(end)) == pytest.approx(abs(steady.omega), rel=1e-6)
    level = top.energy(end) - TOP["m"] * TOP["g"] * TOP["radius"]
    assert level == pytest.approx(steady.energy, rel=1e-9)


@pytest.mark.long
def test_below_the_first_threshold_a_top_stands_and_above_both_it_turns_over():
    top = Spheroid(**TOP, **(ICE | {"drag": 0.3}), half_height=0.02, I1=2.9e-6, I3=3.2e-6)
    for spin, end in ((0.8 * top.rising_spin, 0.0), (6.0 * top.rising_spin, math.pi)):
        motion = top.simulate(top.state(tilt=0.1, spin=spin), [0.0, 60.0])
        assert motion["tilt"][-1] == pytest.approx(end, abs=1e-6)


# The egg.


def test_an_egg_rises_in_gyroscopic_balance():
    """Its precession is J / (A h), to the part of gravity in the balance; it takes 20 s."""
    shape, speed, tilt = {"radius": 0.02, "half_height": 0.03}, 100.0, 1.3
    egg = Spheroid(**shape, **(ICE | {"drag": 0.02}), m=0.06, offset=0.0, I1=1.56e-5, I3=0.96e-5)
    body = {**shape, "i_perp": egg.I1, "i3": egg.I3}
    p = egg.I1 * speed * math.hypot(math.sin(tilt), 1.5 * math.cos(tilt))
    precession, spin = map(float, spheroid.gyroscopic_spin(tilt, p, **body))
    assert precession == pytest.approx(speed, rel=4 * EPS)
    start = egg.state(tilt=tilt, precession=precession, spin=spin)
    upwards = egg.I1 * np.array([0.0, 0.0, speed])
    np.testing.assert_allclose(egg.L_world(start), upwards, rtol=0, atol=8 * EPS * upwards[2])
    motion = egg.simulate(start, np.linspace(0.0, 20.0, 2001))
    found = motion["L_world"][:, 2] / egg.I1
    expected, _ = spheroid.gyroscopic_spin(motion["tilt"], p, **body)
    share = egg.m * egg.g * egg.radius / (egg.I1 * speed**2)  # 0.075
    assert np.max(np.abs(found / expected - 1.0)) < share
    assert motion["tilt"][-1] < 0.35
    assert np.all(motion["normal_force"] > 0.0)  # faster, it would hop
