"""What all systems have in common: shapes, broadcasting, rows that do not know of each other."""

import pickle
from dataclasses import FrozenInstanceError, fields

import numpy as np
import pytest

from tests.systems.examples import BODY, COIN, DISK, SYSTEMS, TURNING, inputs, name_of, states

each_system = pytest.mark.parametrize("system", SYSTEMS, ids=name_of)
each_type = pytest.mark.parametrize("system_type", [type(system) for system in SYSTEMS])


# Within the stability envelope of all states and inputs of `examples`, at any number of rows.
DT = 0.02


@each_system
def test_results_have_the_leading_axes_of_the_state(system):
    for lead in [(), (1,), (3,), (2, 3), (0,)]:
        rng = np.random.default_rng(1)
        y, u = states(system, rng, *lead), inputs(system, rng, *lead)
        n, m = y.shape[-1], u.shape[-1]
        assert system.rhs(y, u).shape == (*lead, n)
        assert system.advance(y, u, DT).shape == (*lead, n)
        assert {value.shape for value in system.invariants(y).values()} == {lead}
        A, B = system.linearize(y, u)
        assert (A.shape, B.shape) == ((*lead, n, n), (*lead, n, m))
        assert system.simulate(y, [0.0, 0.1, 0.2], u if not lead else None).y.shape == (3, *lead, n)


@each_system
def test_states_and_inputs_are_broadcast_against_each_other(system):
    rng = np.random.default_rng(2)
    y, u = states(system, rng, 4, 1), inputs(system, rng, 3)
    wide_y, wide_u = np.repeat(y, 3, axis=1), np.tile(u, (4, 1, 1))
    np.testing.assert_array_equal(system.rhs(y, u), system.rhs(wide_y, wide_u))
    np.testing.assert_array_equal(system.advance(y, u, DT), system.advance(wide_y, wide_u, DT))
    for narrow, wide in zip(system.linearize(y, u), system.linearize(wide_y, wide_u), strict=True):
        np.testing.assert_array_equal(narrow, wide)


@each_system
@pytest.mark.parametrize("n_rows", [2, 64, 65, 200])
def test_a_row_is_the_same_bits_alone_and_among_others(system, n_rows):
    rng = np.random.default_rng(3)
    y, u = states(system, rng, n_rows), inputs(system, rng, n_rows)
    together = system.rhs(y, u), system.advance(y, u, DT, 3), *system.linearize(y, u)
    for k in (0, n_rows // 2, n_rows - 1):
        alone = system.rhs(y[k], u[k]), system.advance(y[k], u[k], DT, 3)
        for one, many in zip((*alone, *system.linearize(y[k], u[k])), together, strict=True):
            np.testing.assert_array_equal(one, many[k])
        for name, values in system.invariants(y).items():
            assert system.invariants(y[k])[name] == values[k]


@each_system
def test_inputs_left_out_are_zero(system):
    y = states(system, np.random.default_rng(4), 5)
    zero = np.zeros(len(system.input_entries))
    np.testing.assert_array_equal(system.rhs(y), system.rhs(y, zero))
    np.testing.assert_array_equal(system.advance(y, None, DT), system.advance(y, zero, DT))


@each_system
def test_nothing_that_is_passed_in_is_changed_or_handed_back(system):
    rng = np.random.default_rng(5)
    y, u = states(system, rng, 3), inputs(system, rng, 3)
    kept = y.copy(), u.copy()
    results = [system.rhs(y, u), system.advance(y, u, DT), system.simulate(y, [0.0, DT]).y]
    results += [accessor(y) for accessor in system.accessors.values()]
    for result in results:
        assert not np.shares_memory(result, y)
        result[...] = np.nan
    np.testing.assert_array_equal(y, kept[0])
    np.testing.assert_array_equal(u, kept[1])


@each_system
def test_lists_integers_and_strided_arrays_are_taken(system):
    rng = np.random.default_rng(6)
    y = states(system, rng, 6)
    np.testing.assert_array_equal(system.rhs(y[::2]), system.rhs(y)[::2])
    np.testing.assert_array_equal(system.rhs(np.asfortranarray(y)), system.rhs(y))
    u = [1] * len(system.input_entries)
    np.testing.assert_array_equal(system.rhs(y.tolist(), u), system.rhs(y, np.ones(len(u))))
    np.testing.assert_array_equal(
        BODY.rhs([0, 0, 1, 0, 2, 1, 0]), BODY.rhs([0.0, 0, 1, 0, 2, 1, 0])
    )


@each_system
def test_advancing_is_simulating_one_step(system):
    rng = np.random.default_rng(7)
    y, u = states(system, rng, 3), inputs(system, rng)
    one = system.advance(y, u, DT, 4)
    np.testing.assert_array_equal(system.simulate(y, [0.0, DT], u, max_step=DT / 4).y[-1], one)


@each_system
def test_substeps_are_steps(system):
    rng = np.random.default_rng(8)
    y, u = states(system, rng, 3), inputs(system, rng, 3)
    twice = system.advance(system.advance(y, u, 0.5 * DT), u, 0.5 * DT)
    np.testing.assert_array_equal(system.advance(y, u, DT, 2), twice)


@each_system
def test_a_state_is_made_of_its_named_components(system):
    y = states(system, np.random.default_rng(9), 4)
    parts = {name: system.accessors[name](y) for name in system.components}
    np.testing.assert_array_equal(system.state(**parts), y)
    covered = np.concatenate([np.arange(y.shape[-1])[k] for k in system.components.values()])
    np.testing.assert_array_equal(np.sort(covered), np.arange(len(system.state_entries)))
    for name, where in system.components.items():
        np.testing.assert_array_equal(parts[name].reshape(4, -1), y[..., where])


@each_system
def test_components_left_out_are_at_rest(system):
    rest, expected = system.state(), np.zeros(len(system.state_entries))
    if system in TURNING:
        half = 0.25 * np.pi if system in (DISK, COIN) else 0.0  # wheels stand upright
        expected[:2] = np.cos(half), np.sin(half)
    np.testing.assert_allclose(rest, expected, rtol=0, atol=np.finfo(np.float64).eps)
    name = next(iter(system.components))
    many = np.tile(rest, (5, 1, 1))
    np.testing.assert_array_equal(system.state(**{name: system.accessors[name](many)}), many)


def test_components_are_broadcast_against_each_other():
    y = BODY.state(q=np.eye(4), omega_body=(1.0, 2.0, 3.0))
    np.testing.assert_array_equal(y[:, :4], np.eye(4))
    np.testing.assert_array_equal(y[:, 4:], np.tile((1.0, 2.0, 3.0), (4, 1)))


@each_type
def test_the_rest_state_stays_where_nothing_pulls(system_type):
    # Upright tops and wheels are balanced, plates level, inclines flat.
    system = system_type()
    assert not system.rhs(system.state()).any()


@each_system
def test_systems_are_frozen_equal_by_value_and_survive_pickling(system):
    assert system == type(system)(*(getattr(system, field.name) for field in fields(system)))
    assert system != type(system)()
    assert system.parameter_names() == tuple(field.name for field in fields(system))
    system.rhs(system.state())
    copy = pickle.loads(pickle.dumps(system))
    assert copy == system
    assert hash(copy) == hash(system)
    with pytest.raises(FrozenInstanceError):
        setattr(system, fields(system)[0].name, 1.0)
