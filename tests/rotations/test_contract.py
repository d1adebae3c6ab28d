"""What every public function of rotations promises about shapes, types and bad input."""

import inspect

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rigid_envs.mechanics import rotations as rot
from tests.rotations.attitudes import ULPS

SHAPES = {"a": (), "d": (6,), "e": (3,), "q": (4,), "u": (3,), "v": (3,)}
SHAPES |= {"R": (3, 3), "S": (3, 3), "T": (3, 3)}
LEADING = ((2, 1), (3,), (2, 3), (1, 1))
SIGNATURES = {  # the kinds of the arguments of every function that takes arrays
    "angle": "q",
    "axis_angle_from_quaternion": "q",
    "body_rate": "qvvv",
    "canonicalize": "q",
    "conjugate": "q",
    "distance": "qq",
    "euler_from_matrix": "R",
    "euler_from_quaternion": "q",
    "euler_rates_from_omega_body": "ev",
    "euler_rates_from_omega_world": "ev",
    "exp": "v",
    "hat": "v",
    "left_jacobian": "v",
    "left_jacobian_inverse": "v",
    "log": "q",
    "matrix_from_euler": "e",
    "matrix_from_quaternion": "q",
    "matrix_from_rot6d": "d",
    "multiply": "qq",
    "normalize": "q",
    "omega_body_from_euler_rates": "ev",
    "omega_world_from_euler_rates": "ev",
    "quaternion_from_axis_angle": "ua",
    "quaternion_from_euler": "e",
    "quaternion_from_matrix": "R",
    "quaternion_rate": "qv",
    "right_jacobian": "v",
    "right_jacobian_inverse": "v",
    "rot6d_from_matrix": "R",
    "rotate": "qv",
    "rotate_inverse": "qv",
    "rotate_tensor": "qT",
    "slerp": "qqa",
    "transform_tensor": "RT",
    "vee": "S",
    "world_rate": "qvvv",
}
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
    assert {*SIGNATURES, "identity", "random_quaternion"} == set(rot.__all__)


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
            with pytest.raises(ValueError, match=rf"(?s)^{parameters[i]}\b.*expected"):
                getattr(rot, name)(*good[:i], bad, *good[i + 1 :])


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
