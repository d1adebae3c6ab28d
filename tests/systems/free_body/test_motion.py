"""Motion of the free body: closed forms against references, simulations against both."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from rigid_envs.mechanics import rotations
from rigid_envs.mechanics.laws import matrices
from rigid_envs.systems.free_body import closed_forms as free_body
from rigid_envs.systems.free_body.system import FreeBody
from tests.from_pages.attitudes import quaternion_rate
from tests.reference import cases, every
from tests.systems.measures import (
    assert_energy_stays,
    million_steps,
    random_attitude,
    random_moments,
    seeds,
)

# Closed forms of the free body, Poinsot's construction and cones, against references.


EPS = np.finfo(np.float64).eps
BODY = (1.0, 2.0, 3.0)
UPRIGHT = (1.0, 0.0, 0.0, 0.0)


@every(cases("free_top"))
def test_free_rotation_agrees_with_the_reference(case):
    moments, omega0, q0 = case["in"]["I"], case["in"]["w0"], case["in"]["q0"]
    omega = free_body.omega(case["t"], moments, omega0)
    rotation = matrices(free_body.attitude(case["t"], moments, omega0, q0))
    found = {
        "w": omega,
        "R": rotation.reshape(-1, 9),
        "w_space": np.einsum("nij,nj->ni", rotation, omega),
    }
    for name, values in found.items():
        # A rounding of the input moves the answer by cond eps, and each formula rounds a few times.
        # A closed form has no past to amplify its errors: even where cond is 1e17, beside the
        # separatrix, only the rounding of a phase of some hundred radians is left.
        scale = 1.0 if name == "R" else max(1.0, float(np.linalg.norm(omega0)))
        tolerance = EPS * min(8.0 * case["cond"][name], 4000.0 * scale)
        np.testing.assert_allclose(values, case["out"][name], rtol=0, atol=tolerance, err_msg=name)


@every(cases("free_top"))
def test_constants_of_the_polhode_agree_with_the_reference(case):
    scalars = case["scalars"]
    path = free_body.polhode(case["in"]["I"], case["in"]["w0"])
    np.testing.assert_allclose(path.momentum, scalars["L"], rtol=4 * EPS)
    if scalars["class"] == "asymmetric":
        # 1 - m is the one number that cancels, and it is exact: no allowance for the separatrix.
        np.testing.assert_allclose(path.m1, scalars["one_minus_m"], rtol=16 * EPS)
        np.testing.assert_allclose(path.m, scalars["ellip_m"], rtol=16 * EPS)
        np.testing.assert_allclose(path.flip_interval, float(scalars["flip_interval"]), rtol=1e-14)
        if path.m1 > 0.0:
            assert path.axes[2] + 1 == scalars["circulates_about_axis"]
    if "growth_rate" in scalars:
        spin = float(np.max(np.abs(case["in"]["w0"])))
        growth = free_body.growth_rate(case["in"]["I"], spin)
        np.testing.assert_allclose(growth, scalars["growth_rate"], rtol=8 * EPS)
        assert path.axes[1] + 1 == scalars["intermediate_axis"]


@every(cases("flip_period"))
def test_flips_down_to_a_perturbation_of_1e_10_keep_full_accuracy(case):
    path, spin = free_body.polhode(case["in"]["I"], case["in"]["w0"]), max(case["in"]["w0"])
    found = {
        "flip_interval": path.flip_interval,
        "polhode_period": path.period,
        "growth_rate": free_body.growth_rate(case["in"]["I"], spin),
        "log_asymptote_flip_interval": path.flip_asymptote,
        "p": abs(path.rate),
        "m": path.m,
        "one_minus_m": path.m1,
    }
    for name, expected in case["out"].items():
        np.testing.assert_allclose(found[name], expected, rtol=8 * EPS, err_msg=name)


def test_the_interval_of_flips_reaches_its_asymptote_with_the_square_of_the_perturbation():
    for eps in (1e-2, 1e-3, 1e-4):
        path = free_body.polhode(BODY, (eps, 1.0, 0.0))
        # K = ln(4 / k') + (ln(4 / k') - 1) m1 / 4 + O(m1^2 ln), DLMF 19.12.1.
        excess = path.m1 / 4.0 * (math.log(4.0 / math.sqrt(path.m1)) - 1.0)
        gap = 0.5 * abs(path.rate) * (path.flip_interval - path.flip_asymptote)
        assert gap == pytest.approx(excess, rel=2.0 * path.m1 * 9.0, abs=32 * EPS)


@pytest.mark.parametrize("omega0", [(0.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
def test_a_body_at_rest_or_on_its_intermediate_axis_never_flips(omega0):
    path = free_body.polhode(BODY, omega0)
    assert path.flip_asymptote == path.flip_interval == path.period == math.inf
    assert path.m + path.m1 == 1.0


@every(cases("racket_rates"))
def test_rates_about_the_three_axes_agree_with_the_reference(case):
    moments, spin, out = case["in"]["I"], case["in"]["w"], case["out"]
    smallest, largest = free_body.oscillation_rates(moments, spin)
    growth = free_body.growth_rate(moments, spin)
    np.testing.assert_allclose(growth, out["growth_rate_about_intermediate"], rtol=8 * EPS)
    np.testing.assert_allclose(smallest, out["frequency_about_smallest"], rtol=8 * EPS)
    np.testing.assert_allclose(largest, out["frequency_about_largest"], rtol=8 * EPS)


def test_small_oscillations_have_the_period_of_the_linear_theory():
    smallest, largest = free_body.oscillation_rates(BODY, 1.0)
    for rate, omega0 in ((smallest, (1.0, 1e-9, 0.0)), (largest, (0.0, 1e-9, 1.0))):
        period = free_body.polhode(BODY, omega0).period
        np.testing.assert_allclose(period, 2.0 * np.pi / rate, rtol=1e-14)


def components(limit):
    special = st.sampled_from([0.0, -0.0, 1.0, -1.0, 1e-8, -1e-12])
    # Rounded: at rates of 1e-160 rad/s the squares that the tests take underflow, not the code.
    return st.one_of(special, st.floats(-limit, limit).map(lambda x: round(x, 13)))


MOMENTS = st.lists(
    # Repeated and all but repeated moments on purpose; the range keeps growth rates below 1 / s.
    st.one_of(st.sampled_from([0.5, 1.0, 1.0 + 1e-15, 1.0 - 1e-9]), st.floats(0.5, 1.0)),
    min_size=3,
    max_size=3,
)
OMEGAS = st.tuples(components(2.0), components(2.0), components(2.0))
ATTITUDE = st.integers(0, 2**32 - 1).map(
    lambda seed: Rotation.random(rng=np.random.default_rng(seed)).as_quat(scalar_first=True)
)


@given(moments=MOMENTS, omega0=OMEGAS, q0=ATTITUDE, t=st.floats(-4.0, 4.0))
def test_the_motion_obeys_eulers_equations(moments, omega0, q0, t):
    h = 1e-3
    near, weights = t + h * np.array([-2.0, -1.0, 1.0, 2.0]), np.array([1.0, -8.0, 8.0, -1.0])
    omega_rate = weights @ free_body.omega(near, moments, omega0) / (12.0 * h)
    q_rate = weights @ free_body.attitude(near, moments, omega0, q0) / (12.0 * h)
    omega, q = free_body.omega(t, moments, omega0), free_body.attitude(t, moments, omega0, q0)
    torque_free = np.cross(np.multiply(moments, omega), omega) / moments
    # Five-point difference: h^4 |omega|^5 / 30 < 1e-11, and rounding eps / h < 1e-12.
    np.testing.assert_allclose(omega_rate, torque_free, rtol=0, atol=1e-10)
    np.testing.assert_allclose(q_rate, quaternion_rate(q, omega), rtol=0, atol=1e-10)


@pytest.mark.parametrize("axes", list(itertools.permutations(range(3))))
def test_spin_exactly_about_any_axis_never_changes(axes):
    moments, t = np.array(BODY)[list(axes)], np.linspace(-50.0, 50.0, 11)
    for k in range(3):
        omega0 = 1.3 * np.eye(3)[k]
        np.testing.assert_array_equal(free_body.omega(t, moments, omega0), np.tile(omega0, (11, 1)))
        turned = matrices(free_body.attitude(t, moments, omega0, UPRIGHT))
        expected = Rotation.from_rotvec(np.outer(t, omega0)).as_matrix()
        np.testing.assert_allclose(turned, expected, rtol=0, atol=1e-13)


def test_a_body_at_rest_stays():
    t = np.linspace(0.0, 9.0, 4)
    for moments in (BODY, (1.0, 1.0, 2.0), (1.0, 1.0, 1.0)):
        assert not free_body.omega(t, moments, (0.0, -0.0, 0.0)).any()
        q = free_body.attitude(t, moments, (0.0, -0.0, 0.0), (0.6, 0.0, 0.8, 0.0))
        np.testing.assert_allclose(q, np.tile((0.6, 0.0, 0.8, 0.0), (4, 1)), rtol=0, atol=2 * EPS)


def test_exactly_on_the_separatrix_omega_is_sech_and_tanh():
    moments, omega0 = (2.0, 5.0, 6.0), (0.5, 1.0, 0.5)  # 2 T 5 = L^2 in binary
    path = free_body.polhode(moments, omega0)
    assert path.m1 == 0.0
    assert path.flip_interval == math.inf
    late = free_body.omega(200.0, moments, omega0)
    np.testing.assert_allclose(np.abs(late), (0.0, path.amplitudes[1], 0.0), rtol=0, atol=1e-15)


def test_angular_momenta_and_phases_beyond_double_precision_are_refused():
    for inertia, rate in ((1e-200, 1e-200), (1e200, 1e200), (1.0, 1e-310)):
        with pytest.raises(ValueError, match=r"^omega0 = .*; expected an angular momentum within"):
            free_body.polhode(np.array(BODY) * inertia, (0.3 * rate, 0.5 * rate, 0.0))
    with pytest.raises(ValueError, match=r"^t = .*; expected times with a finite phase"):
        free_body.omega(1e200, BODY, (1e200, 0.5e200, 0.0))


def test_the_largest_moments_there_are_change_exponents_alone():
    rates = np.array((0.3, 0.5, 0.0))
    path = free_body.polhode(np.ldexp(BODY, 1022), np.ldexp(rates, -1022))  # of 3 2^1022 at most
    assert path.m == free_body.polhode(BODY, rates).m


@every(cases("free_top"))
def test_poinsots_construction_agrees_with_the_reference(case):
    moments, omega0, scalars = case["in"]["I"], case["in"]["w0"], case["scalars"]
    roll = free_body.poinsot(moments, omega0)
    found = {
        "L": roll.momentum,
        "twoT": 2.0 * roll.energy,
        "plane_distance_rho": roll.ellipsoid_distance,
        "omega_along_L": roll.distance,
        "herpolhode_rmin": roll.radius_min,
        "herpolhode_rmax": roll.radius_max,
        "herpolhode_advance_per_polhode_period": roll.advance,
        "polhode_period": roll.period,
    }
    for name, expected in scalars["poinsot"].items():
        # Relative to the last bits, the radius of 1e-14 beside the separatrix too; on the
        # separatrix the 50 digits of the reference leave 1e-43 of what is 0.
        np.testing.assert_allclose(
            found[name], float(expected), rtol=16 * EPS, atol=1e-40, err_msg=name
        )
    assert 2.0 * roll.energy == pytest.approx(scalars["twoT"], rel=8 * EPS)
    normal, distance = free_body.invariable_plane(moments, omega0, case["in"]["q0"])
    np.testing.assert_allclose(
        normal * roll.momentum, scalars["Lspace"], rtol=0, atol=8 * EPS * roll.momentum
    )
    assert distance == roll.distance


@every(cases("free_top"))
def test_the_herpolhode_agrees_with_the_reference(case):
    moments, omega0, n = case["in"]["I"], case["in"]["w0"], np.array(case["scalars"]["Lspace"])
    n /= np.linalg.norm(n)
    omega = np.array(case["out"]["w_space"])
    expected = omega - np.outer(omega @ n, n)
    radius, angle = free_body.herpolhode(case["t"], moments, omega0)
    # As for omega: cond eps from the input, and the rounding of a phase of some hundred radians.
    scale = max(1.0, float(np.linalg.norm(omega0)))
    tolerance = EPS * min(16.0 * case["cond"]["w_space"], 4000.0 * scale)
    np.testing.assert_allclose(radius, np.linalg.norm(expected, axis=-1), rtol=0, atol=tolerance)
    # The angle is counted from t = 0, which is not among the samples: from the first one instead.
    first = expected[0]
    along, left = expected @ first, expected @ np.cross(n, first)
    turned = np.stack([along, left]) / (np.linalg.norm(first) or 1.0)
    found = radius * np.stack([np.cos(angle - angle[0]), np.sin(angle - angle[0])])
    # The direction of a short first radius is uncertain, of one that is 0 without meaning.
    lever = np.max(radius) / max(radius[0], tolerance)
    np.testing.assert_allclose(found, turned, rtol=0, atol=4.0 * tolerance * max(lever, 1.0))


def test_the_herpolhode_of_a_symmetric_body_is_the_edge_of_its_space_cone():
    moments, omega0 = (1.3, 1.3, 0.7), (0.4, -0.3, 1.1)
    roll, cones = free_body.poinsot(moments, omega0), free_body.symmetric_cones(moments, omega0)
    edge = math.hypot(*omega0) * math.sin(cones.space_angle)
    assert roll.radius_min == pytest.approx(edge, rel=1e-14)
    assert roll.radius_max == pytest.approx(edge, rel=1e-14)
    assert roll.advance / roll.period == pytest.approx(cones.space_rate, rel=1e-14)


def test_a_body_at_rest_or_in_steady_rotation_has_a_contact_that_stands_still():
    t = np.linspace(0.0, 5.0, 3)
    for moments in (BODY, (1.0, 1.0, 2.0), (1.0, 1.0, 1.0)):
        for omega0 in ((0.0, 0.0, 0.0), *(2.0 * np.eye(3))):
            roll = free_body.poinsot(moments, omega0)
            assert roll.distance == pytest.approx(np.linalg.norm(omega0), rel=1e-15)
            assert roll.radius_min == roll.radius_max == 0.0
            assert not free_body.herpolhode(t, moments, omega0)[0].any()
            normal, _ = free_body.invariable_plane(moments, omega0, UPRIGHT)
            assert np.linalg.norm(normal) == pytest.approx(1.0, rel=1e-15)
            if any(omega0):
                assert normal[int(np.argmax(omega0))] == 1.0
            inertia = moments[int(np.argmax(normal))]  # at rest the limit of a slow spin about it
            assert roll.ellipsoid_distance == pytest.approx(inertia**-0.5, rel=1e-15)


SYMMETRIC = [c for c in cases("free_top") if c["scalars"]["class"] == "symmetric"]


def angle(v, w):
    """Angle of two vectors, exact where it is small."""
    return math.atan2(float(np.linalg.norm(np.cross(v, w))), float(np.dot(v, w)))


@every(SYMMETRIC)
def test_the_cones_of_a_symmetric_top_agree_with_the_reference(case):
    moments, omega0 = np.array(case["in"]["I"]), np.array(case["in"]["w0"])
    scalars, cones = case["scalars"], free_body.symmetric_cones(moments, omega0)
    assert cones.axis + 1 == scalars["symmetry_axis"]
    assert cones.body_rate == pytest.approx(scalars["Omega_body"], rel=8 * EPS)
    assert cones.space_rate == pytest.approx(scalars["precession_rate_space"], rel=8 * EPS)
    # Along the motion of the reference, in the body and in space.
    axis = np.copysign(np.eye(3)[cones.axis], omega0[cones.axis])
    for body, world in zip(case["out"]["w"], case["out"]["w_space"], strict=True):
        assert angle(body, axis) == pytest.approx(cones.body_angle, rel=1e-13)
        assert angle(world, scalars["Lspace"]) == pytest.approx(cones.space_angle, rel=1e-13)
        assert angle(moments * body, axis) == pytest.approx(cones.tilt, rel=1e-13)


@every(cases("chandler"))
def test_the_chandler_period_agrees_with_the_reference(case):
    given_, out = case["in"], case["out"]
    body = {"i_perp": given_["Iperp"], "i3": given_["I3"]}
    period = free_body.chandler_period(given_["w3"], **body)
    moments = (given_["Iperp"], given_["Iperp"], given_["I3"])
    rate, _ = free_body.symmetric_rates(moments, (0.0, 0.0, given_["w3"]))
    found = {
        "Omega": rate,
        "period": period,
        "period_in_turns": free_body.chandler_turns(**body),
        "period_days_86400s": period / 86400.0,
    }
    for name, expected in out.items():
        # I3 - I1 of neighbouring doubles is exact: nothing is lost to the small difference.
        np.testing.assert_allclose(found[name], expected, rtol=4 * EPS, err_msg=name)


def test_a_sphere_has_no_space_cone():
    cones = free_body.symmetric_cones((2.0, 2.0, 2.0), (0.3, 0.4, 1.2))
    assert (cones.space_cone, cones.space_angle, cones.body_rate) == ("none", 0.0, 0.0)
    assert cones.space_rate == pytest.approx(1.3, rel=4 * EPS)


def test_a_symmetric_top_at_rest_has_cones_of_no_angle():
    cones = free_body.symmetric_cones((1.0, 1.0, 2.0), (0.0, 0.0, 0.0))
    assert (cones.body_angle, cones.space_angle, cones.tilt) == (0.0, 0.0, 0.0)


def test_the_limit_of_equal_moments_is_reached_without_a_step():
    omega0, t = (0.7, -0.2, 1.1), np.linspace(0.0, 20.0, 11)
    for equal in ((2.0, 2.0, 3.0), (2.0, 2.0, 1.0), (2.0, 2.0, 2.0)):
        near = np.array(equal) * [1.0, 1.0 + 1e-12, 1.0]
        for solution in (free_body.omega, free_body.herpolhode):
            found, expected = (np.asarray(solution(t, body, omega0)) for body in (near, equal))
            if solution is free_body.herpolhode:  # of a sphere only the point itself
                found, expected = found[0], expected[0]
            # The moments differ by 1e-12, for 20 s at 1 rad/s.
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10)


# The free body against references and Jacobi's functions; a million steps.


@every(cases("driven_body"))
def test_rotation_under_body_torque_agrees_with_the_reference(case):
    given_ = case["in"]
    body, tau = FreeBody(*given_["I"]), np.array(given_["tau"])
    y = body.state(q=given_["q0"], omega_body=given_["w0"])
    u = tau
    if "tau_freq" in given_:
        u = lambda t: tau * np.cos(given_["tau_freq"] * t)  # noqa: E731
    trajectory = body.simulate(y, np.concatenate([[0.0], case["t"]]), u)
    # Default steps: near 1e-11 per radian turned, some 20 to 40 radians.
    for found, name in ((trajectory["omega_body"], "w"), (matrices(trajectory["q"]), "R")):
        expected = np.array(case["out"][name])
        np.testing.assert_allclose(
            found[1:].reshape(expected.shape), expected, rtol=0, atol=2e-10, err_msg=name
        )


@pytest.mark.parametrize("seed", seeds(4, 100))
def test_random_bodies_at_any_rate_in_the_envelope_keep_their_invariants(seed):
    rng = np.random.default_rng([7, seed])
    body, dt, turn = FreeBody(*random_moments(rng)), 0.1, rng.uniform(0.05, FreeBody.envelope)
    direction = rng.normal(size=3)
    fastest = body.rate_bound(body.state(omega_body=direction), np.zeros(3), 0.0)
    omega = direction * turn / dt / fastest
    trajectory = million_steps(body, body.state(q=random_attitude(rng), omega_body=omega), dt)
    # Fourth order: C (rate dt)^4, where C was 0.0064 at most in 60 bodies; and roundings.
    assert_energy_stays(trajectory, 0.02 * turn**4 + 1e-12)
    # The turns of a step are rotations to rounding; a million steps of 20 turns are a random walk
    # of 2e7 roundings, which is 1e-12 or less.
    found = trajectory.invariants
    np.testing.assert_allclose(found["L_squared"], found["L_squared"][0], rtol=1e-11)
    L = np.stack([found[f"L_world_{k}"] for k in "xyz"], axis=-1)
    assert np.max(np.linalg.norm(L - L[0], axis=-1)) <= 1e-11 * np.linalg.norm(L[0])


BODIES = (
    (1.0, 2.0, 3.0),
    (0.01, 1.0, 1.0),
    (1e-4, 1.0, 1.0),
    (1e-4, 0.5, 0.5 + 1e-4),
    (1.0, 1.0, 2.0),
    (0.6, 0.8, 1.4),
    (1.0, 1.0, 1.0 + 1e-12),
)
OMEGA = np.array([0.3, 0.5, 0.7])


@pytest.mark.parametrize("moments", BODIES, ids=str)
def test_every_order_of_the_moments_follows_jacobi(moments):
    # 1e-11 per radian, some hundred radians, and 1e-10 where moments are very unequal
    t = np.linspace(0.0, 60.0, 13)
    for order in set(itertools.permutations(moments)):
        body = FreeBody(*order)
        start = body.state(omega_body=OMEGA)
        motion = body.simulate(start, t)
        np.testing.assert_array_equal(motion.y[0], start)
        np.testing.assert_allclose(
            motion["omega_body"], free_body.omega(t, order, OMEGA), rtol=0, atol=1e-8
        )
        attitudes = free_body.attitude(t, order, OMEGA, start[:4])
        np.testing.assert_allclose(motion["q"], attitudes, rtol=0, atol=1e-8)


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))), ids=str)
def test_a_body_whose_axes_are_renamed_moves_as_before(order):
    rng, moments = np.random.default_rng(0), np.array([1.1, 1.7, 2.3])
    # columns: the old axes in the new ones; one of them turned round where the order is odd
    turn = np.eye(3)[list(order)]
    turn[0] *= np.linalg.det(turn)
    torques, times = rng.uniform(-1.0, 1.0, (30, 3)), 0.1 * np.arange(31)
    q = rotations.random_quaternion(rng)
    body, renamed = FreeBody(*moments), FreeBody(*moments[list(order)])
    motion = body.simulate(body.state(q=q, omega_body=OMEGA), times, torques)
    start = renamed.state(
        q=rotations.multiply(q, rotations.quaternion_from_matrix(turn.T)), omega_body=turn @ OMEGA
    )
    other = renamed.simulate(start, times, torques @ turn.T)
    np.testing.assert_allclose(other["L_world"], motion["L_world"], rtol=0, atol=1e-9)
    np.testing.assert_allclose(other["R"] @ turn, motion["R"], rtol=0, atol=1e-9)
    one = renamed.advance(start, torques[0] @ turn.T, 0.1)
    np.testing.assert_allclose(
        renamed.omega_world(one), body.omega_world(motion.y[1]), rtol=0, atol=1e-6
    )  # a single step of 0.1 s


def test_a_plan_of_more_steps_than_minutes_are_worth_is_refused_with_its_reason():
    needle = FreeBody(1.0, 1e-9, 1.0)
    start = needle.state(omega_body=(0.0, 1.0, 0.0))
    assert needle.simulate(start, [0.0, 1.0])["omega_body"][-1].tolist() == [0.0, 1.0, 0.0]
    with pytest.raises(ValueError, match=r"number of steps = .*; expected at most 1e\+09, .*rad/s"):
        needle.simulate(needle.state(omega_body=(0.0, 1e3, 1e3)), [0.0, 60.0])
