"""Attitudes and their algebra against axioms, SciPy, 40-digit arithmetic; shapes and refusals."""

import inspect
import re

import mpmath
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from scipy.stats import kstest

from rigid_envs.mechanics import rotations as rot
from tests.mechanics.attitudes import (
    EPS,
    ULPS,
    angles,
    quaternions,
    random_vectors,
    scipy_of,
    vectors,
)
from tests.reference import cases, every
from tests.refusals import refusal, refuses

# Attitudes against the axioms of a group, SciPy and reference cases; shapes and refusals.


@given(quaternions)
def test_a_normalised_quaternion_passes_bit_for_bit(q):
    q = rot.normalize(q)
    assert np.array_equal(rot.conjugate(rot.conjugate(q)), q)
    assert np.array_equal(abs(rot.canonicalize(q)), abs(q))


@pytest.mark.parametrize("scale", [5e-324, 1e-300, 1e300])
def test_normalize_neither_overflows_nor_underflows(scale):
    q = rot.normalize([scale, 0.0, -scale, 0.0])
    np.testing.assert_allclose(q, [0.5**0.5, 0.0, -(0.5**0.5), 0.0], rtol=2 * EPS)


@given(quaternions, quaternions, vectors)
def test_products_rotations_and_matrices_agree_with_scipy(p, q, v):
    both = scipy_of(p) * scipy_of(q)
    R = rot.matrix_from_quaternion(rot.multiply(p, q))
    np.testing.assert_allclose(R, both.as_matrix(), rtol=0, atol=ULPS)
    np.testing.assert_allclose(rot.rotate(q, v), scipy_of(q).apply(v), rtol=0, atol=ULPS)
    back = scipy_of(q).apply(v, inverse=True)
    np.testing.assert_allclose(rot.rotate_inverse(q, v), back, rtol=0, atol=ULPS)


@given(quaternions)
def test_canonical_quaternions_have_the_same_bits_for_both_signs_and_no_negative_zero(q):
    for same in (q, q * [0, 1, 1, 1], q * [0, 0, 1, 1], q * [0, 0, 0, 1]):
        if np.any(same):
            same = rot.normalize(same)
            chosen = rot.canonicalize(same)
            assert chosen.tobytes() == rot.canonicalize(-same).tobytes()
            assert chosen[np.flatnonzero(chosen)[0]] > 0.0
            assert not np.any(np.signbit(chosen[chosen == 0.0]))


# Distance
@given(quaternions, quaternions, quaternions)
def test_distance_is_a_metric_of_attitudes_that_turning_both_leaves_alone(p, q, r):
    d = rot.distance(p, q)
    assert 0.0 <= d <= np.pi
    assert d == pytest.approx((scipy_of(p).inv() * scipy_of(q)).magnitude(), abs=ULPS)
    assert rot.distance(p, p) == rot.distance(p, -p) == 0.0
    assert rot.distance(q, p) == pytest.approx(d, abs=ULPS)
    assert d <= rot.distance(p, r) + rot.distance(r, q) + ULPS
    for left, right in (
        (rot.multiply(r, p), rot.multiply(r, q)),
        (rot.multiply(p, r), rot.multiply(q, r)),
    ):
        assert rot.distance(left, right) == pytest.approx(d, abs=ULPS)


@given(st.floats(1e-300, np.pi))
def test_the_angle_keeps_its_relative_accuracy_down_to_nothing(turn):
    q = np.array([np.cos(turn / 2), 0.0, -np.sin(turn / 2), 0.0])
    assert rot.angle(q) == pytest.approx(turn, rel=4 * EPS)
    assert rot.distance(rot.identity((2,)), -q) == pytest.approx(turn, rel=4 * EPS)


@given(st.floats(1e-300, 0.1))
def test_the_angle_is_accurate_near_a_half_turn(short):
    q = np.array([np.sin(short / 2), 0.0, 0.0, np.cos(short / 2)])
    assert rot.angle(q) == pytest.approx(np.pi - short, rel=2 * EPS)


def test_the_angle_of_a_random_attitude_has_density_one_minus_cosine_over_pi():
    a = rot.angle(rot.random_quaternion(np.random.default_rng(1), (20_000,)))
    assert kstest(a, lambda x: (x - np.sin(x)) / np.pi).pvalue > 1e-3


def test_samples_come_from_the_generator_alone_and_have_the_asked_shape():
    one, two = (rot.random_quaternion(np.random.default_rng(5), (2, 3)) for _ in range(2))
    assert one.shape == (2, 3, 4) and np.array_equal(one, two)
    assert rot.random_quaternion(np.random.default_rng(5)).shape == (4,)
    refuses("rng = 5; expected a numpy Generator", rot.random_quaternion, 5)


def test_the_identity_has_the_asked_shape_and_turns_nothing():
    assert rot.identity((2, 3)).shape == (2, 3, 4)
    assert np.array_equal(rot.rotate(rot.identity((2,)), [1.0, 2.0, 3.0]), [[1, 2, 3]] * 2)


corners = st.sampled_from([0.0, 1e-300, 1e-12, 1e-8, 0.5, np.pi - 1e-8, np.pi - 1e-12, np.pi])
nutations = st.one_of(st.floats(0.0, np.pi), corners)


@given(quaternions)
def test_quaternion_and_matrix_go_round_in_every_branch(q):
    R = rot.matrix_from_quaternion(q)
    back = rot.quaternion_from_matrix(R)
    np.testing.assert_allclose(back * np.sign(back @ q), q, rtol=0, atol=ULPS)
    np.testing.assert_allclose(R.T @ R, np.eye(3), rtol=0, atol=ULPS)


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, -1, 0), (0, 0, 1), (1, 0, 1), (1, -1, 1)])
@pytest.mark.parametrize("angle", [1e-12, 1.0, 2.0, np.pi - 1e-9, np.pi])
def test_quaternions_of_matrices_near_half_turns_are_accurate(axis, angle):
    turn = Rotation.from_rotvec(angle * np.array(axis) / np.linalg.norm(axis))
    found = rot.quaternion_from_matrix(turn.as_matrix())
    assert rot.distance(found, turn.as_quat(scalar_first=True)) <= ULPS


@every(cases("euler_angles"))
def test_reference_attitudes_of_euler_angles(case):
    euler = [case["in"][name] for name in ("phi", "theta", "psi")]
    R, q = np.reshape(case["out"]["R"], (3, 3)), np.array(case["out"]["q"])
    np.testing.assert_allclose(rot.matrix_from_euler(euler), R, rtol=4 * EPS, atol=4 * EPS)
    unsigned = rot.canonicalize(rot.quaternion_from_euler(euler))
    np.testing.assert_allclose(unsigned, q, rtol=8 * EPS, atol=2 * EPS)
    for found in (rot.euler_from_quaternion(q), rot.euler_from_matrix(R)):
        turn = found[0] + found[2] - case["out"]["phi_plus_psi_mod_2pi"]
        assert abs(np.exp(1j * turn) - 1.0) * np.cos(euler[1] / 2) <= ULPS  # undefined at pi
        assert rot.distance(rot.quaternion_from_euler(found), q) <= ULPS
        if euler[1] > 0.0:  # the entries of q and R that carry phi - psi are rounded by 1e-16
            np.testing.assert_allclose(found, euler, rtol=0, atol=ULPS / np.sin(euler[1]))


@every(cases("euler_angles"))
def test_reference_angular_velocities_of_euler_angle_rates(case):
    euler, rates = [case["in"][name] for name in ("phi", "theta", "psi")], case["in"]["rates"]
    for omega, forth, back in (
        ("w_body", rot.omega_body_from_euler_rates, rot.euler_rates_from_omega_body),
        ("w_space", rot.omega_world_from_euler_rates, rot.euler_rates_from_omega_world),
    ):
        expected, determinant = case["out"][omega], case["out"]["kinematic_determinant"]
        np.testing.assert_allclose(forth(euler, rates), expected, rtol=0, atol=ULPS)
        if determinant == 0.0:
            refuses("sin", back, euler, expected)
        else:
            lost = 2 * ULPS / determinant
            np.testing.assert_allclose(back(euler, expected), rates, rtol=0, atol=lost)


@given(angles, nutations, angles)
def test_euler_angles_go_round_within_their_ranges(phi, theta, psi):
    q = rot.quaternion_from_euler([phi, theta, psi])
    oracle = Rotation.from_euler("ZXZ", [phi, theta, psi])
    assert (oracle.inv() * scipy_of(q)).magnitude() <= ULPS
    found = rot.euler_from_quaternion(q)
    assert rot.distance(rot.quaternion_from_euler(found), q) <= ULPS
    assert np.all(abs(found) <= np.pi) and np.all(found > [-np.pi, -1e-300, -np.pi])
    assert np.array_equal(found, rot.euler_from_quaternion(-q))
    assert found[1] == pytest.approx(theta, rel=ULPS, abs=1e-300)


@given(angles, angles, st.sampled_from([0.0, np.pi]))
def test_at_gimbal_lock_phi_has_all_the_turn(phi, psi, theta):
    found = rot.euler_from_quaternion(rot.quaternion_from_euler([phi, theta, psi]))
    turn = phi + psi if theta == 0.0 else phi - psi
    assert found[1] == theta and found[2] == 0.0
    assert abs(np.exp(1j * found[0]) - np.exp(1j * turn)) <= ULPS


@given(angles, angles, nutations)
def test_angles_of_a_matrix_are_finite_and_rebuild_it_at_gimbal_lock_too(phi, psi, theta):
    R = Rotation.from_euler("ZXZ", [phi, theta, psi]).as_matrix()
    found = rot.euler_from_matrix(R)
    assert np.all(np.isfinite(found))
    np.testing.assert_allclose(rot.matrix_from_euler(found), R, rtol=0, atol=2 * ULPS)


@pytest.mark.parametrize("theta", [0.0, -0.0, 1e-300, 1e-16, np.pi, -np.pi, 2 * np.pi])
@pytest.mark.parametrize("name", ["euler_rates_from_omega_body", "euler_rates_from_omega_world"])
def test_rates_are_refused_where_they_do_not_exist_and_the_row_is_named(name, theta):
    rows = [[0.1, 1.0, 0.2], [0.1, theta, 0.2]]
    refuses(
        r"^euler\[1\] = .*sin.*quaternion_rate", getattr(rot, name), rows, [0.0, 0.0, 1.0]
    )  # even where a limit exists: it is not unique


@given(angles, st.floats(2e-15, 1e-3), st.booleans(), angles, vectors)
def test_rates_beside_gimbal_lock_are_finite_and_give_back_the_angular_velocity(
    phi, near, top, psi, omega
):
    euler = [phi, np.pi - near if top else near, psi]
    if abs(np.sin(euler[1])) > 2e-15:  # pi - 2e-15 is rounded by 4e-16
        rates = rot.euler_rates_from_omega_body(euler, omega)
        assert np.all(np.isfinite(rates))
        found = rot.omega_body_from_euler_rates(euler, rates)
        # psi' cancels phi' cos(theta), which grows like |omega| / sin(theta)
        lost = ULPS * (1.0 + np.linalg.norm(omega) / abs(np.sin(euler[1])))
        np.testing.assert_allclose(found[:2], omega[:2], rtol=0, atol=ULPS)
        np.testing.assert_allclose(found[2], omega[2], rtol=0, atol=lost)


def test_rot6d_is_the_first_two_columns_one_after_the_other():
    R = rot.matrix_from_quaternion(rot.exp([0.1, 0.2, 0.3]))
    assert np.array_equal(rot.rot6d_from_matrix(R), [*R[:, 0], *R[:, 1]])


@given(quaternions, st.floats(1e-300, 1e300), st.floats(-1e3, 1e3))
def test_gram_schmidt_ignores_length_and_shear(q, scale, shear):
    R = rot.matrix_from_quaternion(q)
    sheared = np.concatenate([R[:, 0], R[:, 1] + shear * R[:, 0]]) * min(scale, 1e300 / 1e3)
    found = rot.matrix_from_rot6d(sheared)
    np.testing.assert_allclose(found, R, rtol=0, atol=(1.0 + abs(shear)) * ULPS)
    np.testing.assert_allclose(found.T @ found, np.eye(3), rtol=0, atol=ULPS)


@pytest.mark.parametrize(
    "columns",
    [[0, 0, 0, 0, 1, 0], [1, 0, 0, 0, 0, 0], [1, 2, 3, -2, -4, -6], [1, 0, 0, 1, 1e-7, 0]],
)
def test_columns_that_span_no_plane_are_refused(columns):
    refuses(r"rot6d = \[.*parallel", rot.matrix_from_rot6d, columns)


@given(quaternions, vectors, vectors, vectors)
def test_the_body_rate_undoes_the_world_rate(q, v, rate, omega):
    there = rot.world_rate(q, v, rate, omega)
    back = rot.body_rate(q, rot.rotate(q, v), there, omega)
    np.testing.assert_allclose(back, rate, rtol=0, atol=2 * ULPS)


@given(quaternions, vectors, vectors)
def test_what_rests_in_the_world_goes_round_the_other_way_in_the_body(q, v, omega):
    still = rot.body_rate(q, rot.rotate(q, v), np.zeros(3), omega)
    np.testing.assert_allclose(still, np.cross(v, omega), rtol=0, atol=2 * ULPS)
    assert np.array_equal(rot.world_rate(q, omega, np.zeros(3), omega), np.zeros(3))


SHAPES = {"a": (), "d": (6,), "e": (3,), "q": (4,), "u": (3,), "v": (3,)}
SHAPES |= dict.fromkeys("RST", (3, 3))
LEADING = ((2, 1), (3,), (2, 3), (1, 1))
FUNCTIONS = {  # by the kinds of their arguments: all that take arrays
    "R": "euler_from_matrix quaternion_from_matrix rot6d_from_matrix",
    "RT": "transform_tensor",
    "S": "vee",
    "d": "matrix_from_rot6d",
    "e": "matrix_from_euler quaternion_from_euler",
    "ev": "euler_rates_from_omega_body euler_rates_from_omega_world "
    "omega_body_from_euler_rates omega_world_from_euler_rates",
    "q": "angle axis_angle_from_quaternion canonicalize conjugate euler_from_quaternion log "
    "matrix_from_quaternion normalize",
    "qT": "rotate_tensor",
    "qq": "distance multiply",
    "qqa": "slerp",
    "qv": "quaternion_rate rotate rotate_inverse",
    "qvvv": "body_rate world_rate",
    "ua": "quaternion_from_axis_angle",
    "v": "exp hat left_jacobian left_jacobian_inverse right_jacobian right_jacobian_inverse",
}
SIGNATURES = {name: kinds for kinds, names in FUNCTIONS.items() for name in names.split()}
every_function = pytest.mark.parametrize("name", SIGNATURES)


@pytest.fixture
def rng():
    return np.random.default_rng(0)


def sample(kind, shape, rng):
    if kind == "q":
        return rot.random_quaternion(rng, shape)
    if kind == "R":
        return Rotation.random(int(np.prod(shape)), rng).as_matrix().reshape(*shape, 3, 3)
    if kind == "S":
        m = rng.normal(size=(*shape, 3, 3))
        return m - np.swapaxes(m, -1, -2)
    if kind == "e":
        return rng.uniform((-3.0, 0.1, -3.0), (3.0, 3.0, 3.0), (*shape, 3))
    rows = rng.normal(size=(*shape, *SHAPES[kind]))
    return rows / np.linalg.norm(rows, axis=-1, keepdims=True) if kind == "u" else rows


def arguments(name, rng, shapes=((),) * 4):
    return [sample(kind, shape, rng) for kind, shape in zip(SIGNATURES[name], shapes, strict=False)]


def outputs(name, args):
    result = getattr(rot, name)(*args)
    return result if isinstance(result, tuple) else (result,)


def test_the_table_of_signatures_lists_every_public_function():
    own = {f.__name__ for f in vars(rot).values() if getattr(f, "__module__", "") == rot.__name__}
    public = {name for name in own if not name.startswith("_")}
    assert {*SIGNATURES, "identity", "random_quaternion", "norm", "direction"} == public


@every_function
def test_leading_axes_broadcast_and_each_row_is_on_its_own(name, rng):
    args = arguments(name, rng, LEADING)
    lead = np.broadcast_shapes(*LEADING[: len(args)])
    kinds = SIGNATURES[name]
    spread = [np.broadcast_to(a, lead + SHAPES[k]) for a, k in zip(args, kinds, strict=True)]
    for i, rows in enumerate(outputs(name, args)):
        assert rows.shape[: len(lead)] == lead
        for index in np.ndindex(lead):
            one = outputs(name, [a[index] for a in spread])[i]
            np.testing.assert_allclose(rows[index], one, rtol=ULPS, atol=ULPS, strict=True)
    assert all(rows.shape[0] == 0 for rows in outputs(name, [a[:0] for a in spread]))


@every_function
def test_results_are_new_float64_arrays_and_arguments_stay_as_they_were(name, rng):
    args = arguments(name, rng, ((5,),) * 4)
    before = [a.copy() for a in args]
    for result in outputs(name, args):
        assert result.dtype == np.float64
        assert not any(np.shares_memory(result, a) for a in args)
    assert all(np.array_equal(a, b) for a, b in zip(args, before, strict=True))
    single = [a.astype(np.float32) for a in args]
    for low, high in zip(outputs(name, single), outputs(name, args), strict=True):
        assert low.dtype == np.float64
        np.testing.assert_allclose(low, high, rtol=1e-4, atol=1e-4)  # 1e3 roundings of float32
    lists = outputs(name, [a.tolist() for a in args])
    assert all(map(np.array_equal, lists, outputs(name, args)))


@every_function
def test_bad_arguments_are_refused_by_name(name, rng):
    parameters = list(inspect.signature(getattr(rot, name)).parameters)
    for i, kind in enumerate(SIGNATURES[name]):
        good = arguments(name, rng)
        nan, infinite = good[i] * np.nan, np.where(good[i] == np.max(good[i]), np.inf, good[i])
        types = [None, "one", good[i] + 0j, np.ones(SHAPES[kind], bool), [[1.0], [1.0, 2.0]]]
        shapes = [] if kind == "a" else [good[i][..., :-1], 1.0, np.ones((*SHAPES[kind], 1))]
        for bad in [nan, infinite, *types, *shapes]:
            text = refusal(getattr(rot, name), *good[:i], bad, *good[i + 1 :])
            assert re.match(rf"{parameters[i]}\b", text), text


@pytest.mark.parametrize("name", [n for n, kinds in SIGNATURES.items() if {*kinds} & {*"qRu"}])
def test_what_is_no_attitude_is_refused_and_a_slight_error_of_length_is_normalised(name, rng):
    for i, kind in enumerate(SIGNATURES[name]):
        if kind not in "qRu":
            continue
        good = arguments(name, rng)
        spoiled = [good[i] * 0.0]
        spoiled += [] if name == "normalize" else [good[i] * (1.0 + 2e-6), good[i] * 1e200]
        spoiled += [-good[i]] if kind == "R" else []
        for bad in spoiled:
            with pytest.raises(
                ValueError, match=r"= \[.*\]; expected .*(not zero|length|column|right-handed)"
            ):
                getattr(rot, name)(*good[:i], bad, *good[i + 1 :])
        near = outputs(name, [*good[:i], good[i] * (1.0 + 4e-7), *good[i + 1 :]])
        tolerance = 1e-5 if kind == "R" else ULPS  # the nearest rotation is not looked for
        for result, exact in zip(near, outputs(name, good), strict=True):
            np.testing.assert_allclose(result, exact, rtol=tolerance, atol=tolerance)


# exp, log, Jacobians and geodesics against 40-digit arithmetic, matrix exponentials and SciPy.


LENGTHS = [(1e-300, 1e-8), (1e-8, 1e-2), (1e-2, np.pi - 1e-9)]
every_length = pytest.mark.parametrize(("low", "high"), LENGTHS)


def exact_exp(v):
    with mpmath.workdps(40):
        x = [mpmath.mpf(float(c)) for c in v]
        half = mpmath.sqrt(sum(c * c for c in x)) / 2
        return [float(c) for c in (mpmath.cos(half), *(mpmath.sinc(half) * c / 2 for c in x))]


def exact_expm(matrix):
    with mpmath.workdps(40):
        return np.array(mpmath.expm(mpmath.matrix(matrix.tolist())).tolist(), dtype=float)


def exact_log(q):
    with mpmath.workdps(40):
        w, *u = [mpmath.mpf(float(c)) for c in q]
        length = mpmath.sqrt(sum(c * c for c in u))
        return [float(2 * mpmath.atan2(length, w) / length * c) for c in u]


@every_length
def test_exp_is_accurate_to_rounding_in_every_entry(low, high):
    v = random_vectors(np.random.default_rng(0), 200, low, high)
    v[::2] *= [1.0, 1e-5, 1e-9]  # entries of different size
    q = rot.exp(v)
    exact = np.array([exact_exp(row) for row in v])
    np.testing.assert_allclose(q[:, 1:], exact[:, 1:], rtol=4 * EPS, atol=0)
    np.testing.assert_allclose(q[:, 0], exact[:, 0], rtol=0, atol=2 * EPS)  # a cosine


@every_length
def test_log_is_accurate_to_rounding_in_every_entry(low, high):
    q = rot.exp(random_vectors(np.random.default_rng(1), 200, low, high))
    np.testing.assert_allclose(rot.log(q), [exact_log(row) for row in q], rtol=6 * EPS, atol=0)


@given(quaternions)
def test_exp_inverts_log_which_is_the_shortest_and_the_same_for_both_signs(q):
    v = rot.log(q)
    assert np.linalg.norm(v) <= np.pi * (1.0 + EPS)
    assert v.tobytes() == rot.log(-q).tobytes()
    np.testing.assert_allclose(rot.exp(v), rot.canonicalize(q), rtol=0, atol=ULPS)
    assert (scipy_of(q).inv() * Rotation.from_rotvec(v)).magnitude() <= ULPS


@given(st.floats(1e-300, 0.1), vectors.filter(lambda v: np.linalg.norm(v) > 0.1))
def test_log_is_accurate_near_a_half_turn(short, v):
    axis = v / np.linalg.norm(v)
    found = rot.log([np.sin(short / 2), *(np.cos(short / 2) * axis)])
    np.testing.assert_allclose(found, (np.pi - short) * axis, rtol=0, atol=ULPS)


def test_no_rotation_and_a_half_turn_have_finite_logarithms_and_axes():
    axis, angle = rot.axis_angle_from_quaternion([-1.0, 0.0, 0.0, 0.0])
    assert np.array_equal(axis, [0, 0, 1]) and angle == 0.0
    assert np.array_equal(rot.log(rot.identity()), [0, 0, 0])
    assert np.array_equal(rot.exp([0.0, 0.0, 0.0]), rot.identity())
    assert np.array_equal(rot.log([0.0, 0.0, -1.0, 0.0]), [0, np.pi, 0])


@pytest.mark.parametrize("size", [5e-324, 1e-160, 1e17, 1e308])
def test_exp_is_unit_and_finite_for_any_finite_vector(size):
    assert np.linalg.norm(rot.exp([size, -size, size])) == pytest.approx(1.0, abs=ULPS)


@given(quaternions)
def test_axis_and_angle_go_round(q):
    axis, angle = rot.axis_angle_from_quaternion(q)
    assert 0.0 <= angle <= np.pi and abs(np.linalg.norm(axis) - 1.0) <= ULPS
    back = rot.quaternion_from_axis_angle(axis, angle)
    np.testing.assert_allclose(back, rot.canonicalize(q), rtol=0, atol=ULPS)


@pytest.mark.parametrize("size", [1e-300, 1e-8, 1.0])
def test_the_axis_of_a_tiny_turn_is_not_lost(size):
    axis, angle = rot.axis_angle_from_quaternion(rot.exp([0.0, 3 * size / 5, 4 * size / 5]))
    np.testing.assert_allclose(axis, [0.0, 0.6, 0.8], rtol=4 * EPS)
    assert angle == pytest.approx(size, rel=4 * EPS)


# so(3) and Jacobians
@given(vectors, vectors)
@example(np.array([0.0, 0.0, 4.19644759e-308]), np.zeros(3))  # its half is subnormal
def test_hat_is_the_cross_product_and_vee_its_inverse(v, u):
    np.testing.assert_allclose(rot.hat(v) @ u, np.cross(v, u), rtol=0, atol=4 * EPS)
    assert np.array_equal(rot.vee(rot.hat(v)), v)


@given(vectors)
def test_the_matrix_exponential_of_hat_is_the_matrix_of_exp(v):
    R = rot.matrix_from_quaternion(rot.exp(3.0 * v))
    np.testing.assert_allclose(R, exact_expm(rot.hat(3.0 * v)), rtol=0, atol=ULPS)


def test_vee_refuses_a_matrix_that_is_not_skew():
    refuses(r"^skew\[1\] = .*skew-symmetric", rot.vee, [np.zeros((3, 3)), np.eye(3)])


@pytest.mark.parametrize(("low", "high"), [(1e-300, 1e-2), (1e-2, 1.1), (0.9, 20.0)])
def test_the_left_jacobian_is_the_integral_of_the_rotation_along_the_way(low, high):
    for v in random_vectors(np.random.default_rng(3), 50, low, high):
        # exp of [[V, 1], [0, 0]] has the integral of exp(s V) over s in [0, 1] in its corner
        block = np.block([[rot.hat(v), np.eye(3)], [np.zeros((3, 6))]])
        J = rot.left_jacobian(v)
        np.testing.assert_allclose(J, exact_expm(block)[:3, 3:], rtol=0, atol=ULPS)
        np.testing.assert_allclose(rot.right_jacobian(v), J.T, rtol=0, atol=EPS)


@pytest.mark.parametrize("a", [1e-300, 1e-9, 1e-3, 0.5, 1.0 - EPS, 1.0, 1.5, 3.0, 6.0])
def test_the_left_jacobian_is_accurate_in_every_entry(a):
    with mpmath.workdps(40 if a > 1e-10 else 700):
        x = mpmath.mpf(a)
        one, quadratic = (1 - mpmath.cos(x)) / x, 1 - mpmath.sinc(x)
        axis = mpmath.mpf(0.6), mpmath.mpf(0.8)
        row = [1 - quadratic * axis[1] ** 2, quadratic * axis[0] * axis[1], one * axis[1]]
        exact = [float(entry) for entry in row]
    J = rot.left_jacobian([0.6 * a, 0.8 * a, 0.0])
    np.testing.assert_allclose(J[0], exact, rtol=16 * EPS, atol=1e-320)


@given(vectors)
def test_inverse_jacobians_invert(v):
    v = 3.0 * v  # up to 5.2: the condition number is a / (2 sin(a / 2)) < 6
    for one, other in (
        (rot.left_jacobian(v), rot.left_jacobian_inverse(v)),
        (rot.right_jacobian(v), rot.right_jacobian_inverse(v)),
    ):
        np.testing.assert_allclose(one @ other, np.eye(3), rtol=0, atol=6 * ULPS)


@pytest.mark.parametrize("inverse", [rot.left_jacobian_inverse, rot.right_jacobian_inverse])
def test_inverse_jacobians_refuse_a_full_turn(inverse):
    refuses(r"rotation_vector\[1\].*below 2 pi", inverse, [[0.0, 0.0, 6.28], [0.0, 0.0, 2 * np.pi]])


# Geodesics
@given(quaternions, quaternions, st.floats(0.0, 1.0))
def test_slerp_turns_at_constant_rate_on_the_shortest_way(p, q, t):
    way, turn = rot.slerp(p, q, t), rot.distance(p, q)
    assert rot.distance(p, way) == pytest.approx(t * turn, abs=ULPS)
    assert rot.distance(way, q) == pytest.approx((1.0 - t) * turn, abs=ULPS)
    assert rot.distance(rot.slerp(p, -q, t), way) <= ULPS


def test_slerp_starts_exactly_at_its_start_and_goes_on_beyond_its_end():
    p, q = rot.exp([[0.0, 0.0, 0.2], [0.0, 0.0, 0.5]])
    assert np.array_equal(rot.slerp(p, q, 0.0), p)
    np.testing.assert_allclose(rot.log(rot.slerp(p, q, [-1.0, 2.0]))[:, 2], [-0.1, 0.8], rtol=ULPS)
