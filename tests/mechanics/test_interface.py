"""What all systems have in common: shapes, rows, times, steps, inputs, trajectories."""

import pickle
from dataclasses import FrozenInstanceError, fields

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rigid_envs.mechanics.integration import Trajectory
from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.systems.roller import closed_forms as roller
from tests.systems import examples
from tests.systems.measures import orders

# What all systems have in common: shapes, broadcasting, rows that do not know of each other.


# Within the stability envelope of all states and inputs of `examples`, at any number of rows.
DT = 0.02


@examples.each_system
def test_results_have_the_leading_axes_of_the_state(system):
    for lead in [(), (1,), (3,), (2, 3), (0,)]:
        rng = np.random.default_rng(1)
        y, u = examples.states(system, rng, *lead), examples.inputs(system, rng, *lead)
        n, m = y.shape[-1], u.shape[-1]
        assert system.rhs(y, u).shape == (*lead, n)
        assert system.advance(y, u, DT).shape == (*lead, n)
        assert {value.shape for value in system.invariants(y).values()} == {lead}
        A, B = system.linearize(y, u)
        assert (A.shape, B.shape) == ((*lead, n, n), (*lead, n, m))
        assert system.simulate(y, [0.0, 0.1, 0.2], u if not lead else None).y.shape == (3, *lead, n)


@examples.each_system
def test_states_and_inputs_are_broadcast_against_each_other(system):
    rng = np.random.default_rng(2)
    y, u = examples.states(system, rng, 4, 1), examples.inputs(system, rng, 3)
    wide_y, wide_u = np.repeat(y, 3, axis=1), np.tile(u, (4, 1, 1))
    np.testing.assert_array_equal(system.rhs(y, u), system.rhs(wide_y, wide_u))
    np.testing.assert_array_equal(system.advance(y, u, DT), system.advance(wide_y, wide_u, DT))
    for narrow, wide in zip(system.linearize(y, u), system.linearize(wide_y, wide_u), strict=True):
        np.testing.assert_array_equal(narrow, wide)


@examples.each_system
@pytest.mark.parametrize("n_rows", [2, 64, 65, 200])
def test_a_row_is_the_same_bits_alone_and_among_others(system, n_rows):
    rng = np.random.default_rng(3)
    y, u = examples.states(system, rng, n_rows), examples.inputs(system, rng, n_rows)
    together = system.rhs(y, u), system.advance(y, u, DT, 3), *system.linearize(y, u)
    for k in (0, n_rows // 2, n_rows - 1):
        alone = system.rhs(y[k], u[k]), system.advance(y[k], u[k], DT, 3)
        for one, many in zip((*alone, *system.linearize(y[k], u[k])), together, strict=True):
            np.testing.assert_array_equal(one, many[k])
        for name, values in system.invariants(y).items():
            assert system.invariants(y[k])[name] == values[k]


@examples.each_system
def test_inputs_left_out_are_zero(system):
    y = examples.states(system, np.random.default_rng(4), 5)
    zero = np.zeros(len(system.input_entries))
    np.testing.assert_array_equal(system.rhs(y), system.rhs(y, zero))
    np.testing.assert_array_equal(system.advance(y, None, DT), system.advance(y, zero, DT))


@examples.each_system
def test_nothing_that_is_passed_in_is_changed_or_handed_back(system):
    rng = np.random.default_rng(5)
    y, u = examples.states(system, rng, 3), examples.inputs(system, rng, 3)
    kept = y.copy(), u.copy()
    results = [system.rhs(y, u), system.advance(y, u, DT), system.simulate(y, [0.0, DT]).y]
    results += [accessor(y) for accessor in system.accessors.values()]
    for result in results:
        assert not np.shares_memory(result, y)
        result[...] = np.nan
    np.testing.assert_array_equal(y, kept[0])
    np.testing.assert_array_equal(u, kept[1])


@examples.each_system
def test_lists_integers_and_strided_arrays_are_taken(system):
    rng = np.random.default_rng(6)
    y = examples.states(system, rng, 6)
    np.testing.assert_array_equal(system.rhs(y[::2]), system.rhs(y)[::2])
    np.testing.assert_array_equal(system.rhs(np.asfortranarray(y)), system.rhs(y))
    u = [1] * len(system.input_entries)
    np.testing.assert_array_equal(system.rhs(y.tolist(), u), system.rhs(y, np.ones(len(u))))
    np.testing.assert_array_equal(
        examples.BODY.rhs([0, 0, 1, 0, 2, 1, 0]), examples.BODY.rhs([0.0, 0, 1, 0, 2, 1, 0])
    )


@examples.each_system
def test_advancing_is_simulating_one_step(system):
    rng = np.random.default_rng(7)
    y, u = examples.states(system, rng, 3), examples.inputs(system, rng)
    one = system.advance(y, u, DT, 4)
    np.testing.assert_array_equal(system.simulate(y, [0.0, DT], u, max_step=DT / 4).y[-1], one)


@examples.each_system
def test_substeps_are_steps(system):
    rng = np.random.default_rng(8)
    y, u = examples.states(system, rng, 3), examples.inputs(system, rng, 3)
    twice = system.advance(system.advance(y, u, 0.5 * DT), u, 0.5 * DT)
    np.testing.assert_array_equal(system.advance(y, u, DT, 2), twice)


@examples.each_system
def test_a_state_is_made_of_its_named_components(system):
    y = examples.states(system, np.random.default_rng(9), 4)
    parts = {name: system.accessors[name](y) for name in system.components}
    np.testing.assert_array_equal(system.state(**parts), y)
    covered = np.concatenate([np.arange(y.shape[-1])[k] for k in system.components.values()])
    np.testing.assert_array_equal(np.sort(covered), np.arange(len(system.state_entries)))
    for name, where in system.components.items():
        for found in (parts[name], getattr(system, name, system.accessors[name])(y)):
            np.testing.assert_array_equal(found.reshape(4, -1), y[..., where])


@examples.each_system
def test_components_left_out_are_at_rest(system):
    rest, expected = system.state(), np.zeros(len(system.state_entries))
    if system in examples.TURNING:
        wheels = examples.DISK, examples.EULER, examples.COIN
        half = 0.25 * np.pi if system in wheels else 0.0  # they stand upright
        expected[:2] = np.cos(half), np.sin(half)
    np.testing.assert_allclose(rest, expected, rtol=0, atol=np.finfo(np.float64).eps)
    name = next(iter(system.components))
    many = np.tile(rest, (5, 1, 1))
    np.testing.assert_array_equal(system.state(**{name: system.accessors[name](many)}), many)


def test_components_are_broadcast_against_each_other():
    y = examples.BODY.state(q=np.eye(4), omega_body=(1.0, 2.0, 3.0))
    np.testing.assert_array_equal(y[:, :4], np.eye(4))
    np.testing.assert_array_equal(y[:, 4:], np.tile((1.0, 2.0, 3.0), (4, 1)))


@examples.each_type
def test_the_rest_state_stays_where_nothing_pulls(system_type):
    # Upright tops and wheels are balanced, plates level, inclines flat; a thrown body falls, and a
    # satellite goes on along its orbit.
    system = system_type()
    rates = system.rhs(system.state())
    if system_type is type(examples.THROWN):
        rates[-1] += system.g
    elif system_type is type(examples.ORBITER):
        rates[-1] -= system.n
    assert not rates.any()


@examples.each_system
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


# `simulate`: times, steps, inputs, trajectories; the equations in the hands of others.


EPS = np.finfo(np.float64).eps


def fixed_axis():
    """A body turning about e3 only: omega3 and the angle are integrals of the torque."""
    body = FreeBody(1.0, 1.0, 2.0)
    return body, body.state(omega_body=(0.0, 0.0, 0.3))


def wave(system, rate):
    """Inputs that change with time, each in a phase of its own."""
    phase = np.arange(len(system.input_entries))
    level = np.array([0.0, 0.5]) if system is examples.ROLLER else 0.0  # a ratio is only increased
    return lambda s: level + 0.5 * np.sin(rate * s + phase)


@examples.each_system
def test_a_trajectory_begins_with_the_first_state_and_keeps_the_times(system):
    y, t = examples.states(system, np.random.default_rng(1), 2), [0.5, 0.6, 0.9]
    trajectory = system.simulate(y, t)
    assert isinstance(trajectory, Trajectory)
    assert trajectory.system is system
    assert len(trajectory) == 3
    np.testing.assert_array_equal(trajectory.t, t)
    np.testing.assert_array_equal(trajectory.y[0], y)


@examples.each_system
def test_a_trajectory_gives_every_named_quantity_at_all_times(system):
    y = examples.states(system, np.random.default_rng(2), 4)
    trajectory = system.simulate(y, np.linspace(0.0, 0.1, 6))
    assert set(trajectory) == set(system.accessors)
    for name in trajectory:
        values = trajectory[name]
        assert values.shape[:2] == (6, 4)
        np.testing.assert_array_equal(values[3], system.accessors[name](trajectory.y[3]))
    for name, values in trajectory.invariants.items():
        np.testing.assert_array_equal(values[5], system.invariants(trajectory.y[5])[name])


@examples.each_system
@pytest.mark.parametrize("u", [None, "held", "sampled"])
def test_a_single_time_gives_the_first_state(system, u):
    y = examples.states(system, np.random.default_rng(3))
    row = np.zeros(len(system.input_entries))
    chosen = {None: None, "held": row, "sampled": lambda _: row}[u]
    np.testing.assert_array_equal(system.simulate(y, [1.0], chosen).y, y[None])


@examples.each_system
def test_rows_are_simulated_as_if_each_were_alone(system):
    for n_rows in [1, 3, 64, 65, 130]:
        rng = np.random.default_rng(4)
        y, u = examples.states(system, rng, n_rows), examples.inputs(system, rng, 3, n_rows)
        t = np.array([0.0, 0.02, 0.03, 0.05])
        together = system.simulate(y, t, u, max_step=0.01).y
        for k in {0, n_rows // 2, n_rows - 1}:
            alone = system.simulate(y[k], t, u[:, k], max_step=0.01).y
            np.testing.assert_array_equal(together[:, k], alone)


@examples.each_system
def test_one_start_is_broadcast_to_many_inputs_and_many_starts_to_one(system):
    rng = np.random.default_rng(5)
    y, u, t = examples.states(system, rng), examples.inputs(system, rng, 1, 4), [0.0, 0.05]
    fan = system.simulate(y, t, u, max_step=0.01).y
    assert fan.shape == (2, 4, len(system.state_entries))
    np.testing.assert_array_equal(fan[1, 2], system.simulate(y, t, u[0, 2], max_step=0.01).y[1])
    np.testing.assert_array_equal(fan[0], np.tile(y, (4, 1)))
    many = examples.states(system, rng, 2, 3)
    assert system.simulate(many, t, u[0, 0]).y.shape == (2, 2, 3, len(system.state_entries))
    assert system.simulate(many, t, lambda _: u[0, :3]).y.shape == (2, 2, 3, many.shape[-1])


@examples.each_system
def test_inputs_are_held_over_their_intervals(system):
    rng = np.random.default_rng(6)
    y, u = examples.states(system, rng), examples.inputs(system, rng, 4)
    t = np.cumsum([0.0, 0.02, 0.01, 0.03, 0.02])
    trajectory = system.simulate(y, t, u, max_step=0.01)
    # The same steps by hand. Their lengths are differences of t: roundings.
    for k, n_substeps in enumerate((2, 1, 3, 2)):
        y = system.advance(y, u[k], t[k + 1] - t[k], n_substeps)
        np.testing.assert_allclose(trajectory.y[k + 1], y, rtol=0, atol=64 * EPS)


@examples.each_system
def test_one_input_row_is_held_for_ever(system):
    rng = np.random.default_rng(7)
    y, u, t = examples.states(system, rng), examples.inputs(system, rng), np.linspace(0.0, 0.1, 4)
    held = system.simulate(y, t, u, max_step=0.01).y
    np.testing.assert_array_equal(system.simulate(y, t, np.tile(u, (3, 1)), max_step=0.01).y, held)


@pytest.mark.parametrize(
    ("max_step", "steps"), [(0.1, 10), (0.1 + 1e-12, 10), (0.1 - 1e-12, 10), (0.099, 11), (0.5, 2)]
)
def test_no_step_is_longer_than_asked_and_none_is_added_by_rounding(max_step, steps):
    times = []

    def torque(s):
        times.append(s)
        return (0.0, 0.0, 0.0)

    body, y = fixed_axis()
    body.simulate(y, [0.0, 1.0], torque, max_step=max_step)
    # Five probes of how large the input is, then one for each of the five stages of a step.
    assert len(times) == 5 + 5 * steps


@examples.each_system
def test_as_many_rows_as_stages_are_no_stages(system):
    rng = np.random.default_rng(12)
    y, t = examples.states(system, rng, 5), [0.0, 0.01]

    def u(s):
        return np.full(len(system.input_entries), 50.0 * s)

    together = system.simulate(y, t, u, max_step=0.01).y
    for k in range(5):
        alone = system.simulate(y[k], t, u, max_step=0.01).y
        np.testing.assert_array_equal(together[:, k], alone)


@examples.each_system
def test_a_function_of_time_is_undone_backwards_too(system):
    y, u = examples.states(system, np.random.default_rng(9)), wave(system, 3.0)
    forth = system.simulate(y, [0.0, 1.0], u, max_step=0.02).y[-1]
    np.testing.assert_allclose(
        system.simulate(forth, [1.0, 0.0], u, max_step=0.02).y[-1], y, rtol=0, atol=2000 * EPS
    )


@examples.each_system
def test_inputs_of_time_are_integrated_to_fourth_order(system):
    y, u, t = examples.states(system, np.random.default_rng(13)), wave(system, 2.0), [0.0, 0.8]
    fine = system.simulate(y, t, u, max_step=0.0005).y[-1]
    errors = [
        np.max(np.abs(system.simulate(y, t, u, max_step=step).y[-1] - fine))
        for step in (0.02, 0.01, 0.005)
    ]
    np.testing.assert_allclose(orders(errors), 4.0, rtol=0, atol=0.2)


@examples.each_system
def test_the_default_step_resolves_a_function_of_time(system):
    y, u = examples.states(system, np.random.default_rng(10)), wave(system, 2.0)
    found = system.simulate(y, [0.0, 4.0], u).y[-1]
    fine = system.simulate(y, [0.0, 4.0], u, max_step=4.0 / 8000).y[-1]
    # 2000 steps of 0.002 s: h^4 times fourth derivatives of some ten, and roundings.
    np.testing.assert_allclose(found, fine, rtol=0, atol=2e-10)


@examples.each_system
def test_the_default_step_leaves_nothing_to_gain_from_a_shorter_one(system):
    rng = np.random.default_rng(11)
    y, u = examples.states(system, rng), examples.inputs(system, rng)
    t = np.linspace(0.0, 4.0, 9)
    for held in (None, u):
        found = system.simulate(y, t, held)
        rate = max(system.rate_bound(row, u, 0.5) for row in found.y)
        fine = system.simulate(y, t, held, max_step=1.0 / 512.0 / rate)
        # Stated: a truncation error near 1e-11 per radian, here of some 20 to 50 radians.
        np.testing.assert_allclose(found.y, fine.y, rtol=0, atol=1e-9)


def test_a_roller_whose_ratio_is_increased_swings_as_one_of_that_ratio():
    t, bottom = np.linspace(0.0, 15.0, 31), 0.4 / 0.3
    motion = examples.ROLLER.simulate((bottom + 2.0, -1.0), t, (0.0, 0.35))
    place, speed = roller.valley(t, 2.0, -1.0, curvature=0.3, beta=0.8, g=9.5)
    # Stated: 1e-11 per radian, some 10 of them, at places of 3 m.
    np.testing.assert_allclose(motion["arc_length"] - bottom, place, rtol=0, atol=1e-9)
    np.testing.assert_allclose(motion["velocity"], speed, rtol=0, atol=1e-9)


def test_a_trajectory_knows_which_names_it_has():
    trajectory = examples.TOP.simulate(examples.TOP.state(), [0.0, 0.1])
    assert "tilt" in trajectory
    assert "omega" not in trajectory
    assert list(examples.BODY.simulate(examples.BODY.state(), [0.0, 0.1])) == list(
        examples.BODY.accessors
    )


each_seed = pytest.mark.parametrize("seed", range(2))
TIME = 2.0  # [s] some radians of each motion


def start(system, seed):
    """A random state and a gentle input: the motions stay regular for some seconds."""
    rng = np.random.default_rng(seed)
    return examples.states(system, rng), 0.1 * examples.inputs(system, rng)


@examples.each_system
@each_seed
def test_solve_ivp_converges_to_simulate(system, seed):
    y, u = start(system, seed)
    found = solve_ivp(
        lambda _, y: system.rhs(y, u), (0.0, TIME), y, method="DOP853", rtol=1e-10, atol=1e-10
    )
    exact = system.simulate(y, found.t, u).y
    # some dozens of steps of 1e-10 that grow tenfold; simulate itself is good to 1e-10
    np.testing.assert_allclose(found.y.T, exact, rtol=0, atol=1e-8)


@examples.each_system
@pytest.mark.parametrize("method", ["RK23", "DOP853", "Radau", "BDF", "LSODA"])
def test_every_integrator_of_scipy_runs_with_its_defaults(system, method):
    y, u = start(system, 0)
    jacobian = {"jac": lambda _, y: system.linearize(y, u)[0]}
    options = jacobian if method in ("Radau", "BDF", "LSODA") else {}
    found = solve_ivp(lambda _, y: system.rhs(y, u), (0.0, TIME), y, method=method, **options)
    assert found.success
    exact = system.simulate(y, [0.0, TIME], u).y[-1]
    # some dozens of steps, each within 1e-3
    np.testing.assert_allclose(found.y[:, -1], exact, rtol=0, atol=0.03)


@examples.each_turning
def test_the_field_beside_the_sphere_keeps_the_length_of_the_quaternion(system):
    rng = np.random.default_rng(1)
    y, u = examples.states(system, rng, 20), examples.inputs(system, rng, 20)
    y[:, :4] *= rng.uniform(0.4, 2.0, (20, 1))
    rates = system.rhs(y, u)
    along = np.sum(y[:, :4] * rates[:, :4], axis=-1)
    size = np.linalg.norm(y[:, :4], axis=-1) * np.linalg.norm(rates[:, :4], axis=-1)
    np.testing.assert_allclose(along / size, 0.0, atol=1e-14)


def test_the_field_of_the_upright_coin_keeps_its_lean():
    rng = np.random.default_rng(2)
    y = examples.states(examples.COIN, rng, 20)
    y[:, :4] = rng.normal(size=(20, 4))
    rates = examples.COIN.rhs(y)
    signs = np.array([1.0, -1.0, -1.0, 1.0])  # e3 . e_z = w^2 - x^2 - y^2 + z^2
    np.testing.assert_allclose(np.sum(signs * y[:, :4] * rates[:, :4], axis=-1), 0.0, atol=1e-14)
