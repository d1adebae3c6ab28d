"""What is refused where it enters: the message names the value and what was expected, never NaN."""

import math
import re

import numpy as np
import pytest

from rigid_envs.mechanics import bodies, rotations
from rigid_envs.systems.dynamic_ball.system import DynamicBall
from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.systems.gyrostat.system import Gyrostat
from rigid_envs.systems.heavy_top.system import HeavyTop
from rigid_envs.systems.roller.system import Roller
from rigid_envs.systems.rolling_disk.system import EulerDisk, RollingDisk
from rigid_envs.systems.satellite.system import Satellite
from rigid_envs.systems.spheroid.system import Spheroid
from rigid_envs.systems.upright_coin.system import UprightCoin
from tests.refusals import NO_SCALARS, refusal, refuses
from tests.systems import examples
from tests.systems.measures import leaning

REST = examples.BODY.state()
FROM_ZERO = {
    *((UprightCoin, "I3"), (Roller, "beta"), (HeavyTop, "g"), (HeavyTop, "ell")),
    *((kind, "mu") for kind in (DynamicBall, RollingDisk, Roller, Spheroid, UprightCoin)),
    *((Gyrostat, name) for name in ("J1", "J2", "J3")),
    *((Satellite, "n"), (Satellite, "b")),
    *((EulerDisk, "mu"), (EulerDisk, "contour"), (EulerDisk, "drag"), (Spheroid, "drag")),
}
ANY_SIGN = {
    *((DynamicBall, "turntable_rate"), (UprightCoin, "slope"), (Roller, "slope")),
    *((Roller, "curvature"), (Satellite, "inclination"), (Spheroid, "offset")),
}


@examples.each_type
def test_parameters_are_numbers_of_their_sign(system_type):
    for name in {*system_type.parameter_names()} - {"beta" if system_type is DynamicBall else ""}:
        expected, wrong = "a positive", (0.0, -1.0)
        if (system_type, name) in FROM_ZERO:
            expected, wrong = "a finite number of at least 0", (-1e-9,)
            system_type(**{name: 0.0})
        elif (system_type, name) in ANY_SIGN:
            expected, wrong = "a finite number", ()
            system_type(**{name: -0.1})
        for value in [*wrong, *NO_SCALARS]:
            refuses(rf"^{name} = .*; expected {expected}", system_type, **{name: value})


def test_inertia_ratios_that_no_ball_has_are_refused():
    for value in [-0.01, 0.667, 1.0, *NO_SCALARS]:
        for beta in (0.0, 0.4, 2.0 / 3.0):
            DynamicBall(beta=beta)
        with pytest.raises(
            ValueError,
            match=r"^beta = .*; expected (a finite|I / \(m radius\^2\) of a ball, .* 2/3)",
        ):
            DynamicBall(beta=value)


@pytest.mark.parametrize("system_type", [RollingDisk, UprightCoin])
def test_an_axial_moment_above_twice_the_other_is_refused(system_type):
    system_type(I1=0.5, I3=1.0)  # flat: the limit is a disk
    refuses(r"^I3 = 1\.2; expected I3 <= (2 I1|I1 \+ I2) = 1: ", system_type, I1=0.5, I3=1.2)


@pytest.mark.parametrize("system_type", [FreeBody, HeavyTop, Satellite])
def test_moments_that_no_body_has_are_refused_by_name(system_type):
    for name, others in (("I1", "I2 \\+ I3"), ("I2", "I1 \\+ I3"), ("I3", "I1 \\+ I2")):
        moments = {"I1": 1.0, "I2": 1.0, "I3": 1.0, name: 2.1}
        message = f"^{name} = 2.1; expected {name} <= {others} = 2: no rigid body"
        refuses(message, system_type, **moments)
    system_type(1.0, 1.0, 2.0 - 2.0 / 9.81**2)  # a flat plate: the limit is a body


def test_numpy_numbers_are_parameters_too():
    assert FreeBody(np.float64(1.0), np.float32(2.0), np.int64(3)) == FreeBody(1.0, 2.0, 3.0)


CALLS = {
    "rhs": lambda system, y: system.rhs(y),
    "linearize": lambda system, y: system.linearize(y),
    "invariants": lambda system, y: system.invariants(y),
    "advance": lambda system, y: system.advance(y, None, 0.01),
    "simulate": lambda system, y: system.simulate(y, [0.0, 0.1]),
}
each_call = pytest.mark.parametrize("call", CALLS.values(), ids=CALLS.keys())
FIELD = ("rhs", "linearize")  # integrators evaluate them beside the states as well
STRICT = {name: call for name, call in CALLS.items() if name not in FIELD}
each_strict = pytest.mark.parametrize("call", STRICT.values(), ids=STRICT.keys())
each_of_field = pytest.mark.parametrize("call", [CALLS[name] for name in FIELD], ids=FIELD)


@examples.each_system
@each_call
def test_bad_states_are_refused_everywhere(system, call):
    rest = system.state()
    entries = ", ".join(system.state_entries)
    shape = rf"y has shape \(.*\); expected \(\.\.\., {len(rest)}\): the last axis is \({entries}\)"
    for y in (rest[:-1], np.append(rest, 0.0), 1.0, []):
        refuses(shape, call, system, y)
    last = len(rest) - 1
    for bad in (np.nan, np.inf, -np.inf):
        y = np.tile(rest, (2, 3, 1))
        y[1, 2, last] = bad
        refuses(rf"y\[1, 2, {last}\] = {bad}; expected finite", call, system, y)
    text, ragged = [str(x) for x in rest], [rest, rest[:-1]]
    for y in (None, "state", text, ragged, 1j * rest, {}, [None] * len(rest)):
        refuses(rf"y = [^;]*; expected real numbers \({entries}\)", call, system, y)


@examples.each_turning
@each_strict
def test_quaternions_that_are_not_unit_are_refused_with_their_norm(system, call):
    y = system.state()
    for norm in (0.0, 0.5, 1.0 + 2e-6, 2.0):
        y[:4] = (0.0, 0.6 * norm, 0.0, 0.8 * norm)
        with pytest.raises(ValueError, match=r"^q\[1\] = .*; expected length 1 .*: divide it"):
            call(system, np.stack([system.state(), y]))


@examples.each_turning
@each_of_field
def test_rates_are_given_beside_the_unit_sphere_but_not_at_a_quaternion_of_zero(system, call):
    y = system.state()
    for norm in (0.4, 1.0 + 2e-6, 40.0):
        call(system, np.concatenate([norm * y[:4], y[4:]]))
    y[:4] = 0.0
    with pytest.raises(ValueError, match=r"^q\[1\] = .*; expected a quaternion that is not zero"):
        call(system, np.stack([system.state(), y]))


@each_call
def test_a_disk_that_lies_flat_has_no_point_of_contact(call):
    for lean in (0.0, 0.98e-6, np.pi - 0.98e-6):
        y = np.stack([examples.DISK.state(), examples.DISK.state(q=leaning(lean))])
        refuses(r"^sin\(theta\)\[1\] = \S+; expected at least .* lies flat", call, examples.DISK, y)
    call(examples.DISK, examples.DISK.state(q=leaning(0.2)))


@each_strict
def test_a_coin_that_leans_is_refused_with_the_remedy(call):
    for lean in (1.1e-6, -0.3, 0.5 * np.pi):
        y = np.stack([examples.COIN.state(), examples.COIN.state(q=leaning(0.5 * np.pi - lean))])
        refuses(
            r"^y\[1\] = .*; expected .*vertical component 0 .*take q from ", call, examples.COIN, y
        )
    call(examples.COIN, examples.COIN.state(q=examples.COIN.attitude(0.3, -2.0)))


@pytest.mark.parametrize(
    "system", [examples.PLATE, examples.DISK, examples.COIN], ids=examples.name_of
)
def test_contact_forces_are_of_states_alone(system):
    y = system.state()
    y[:4] *= 1.0 + 2e-6
    refuses(r"^q = .*; expected length 1", system.contact_force, y)


@examples.each_system
def test_bad_inputs_are_refused_everywhere(system):
    y, n = system.state(), len(system.input_entries)
    entries = ", ".join(system.input_entries)
    calls = (
        lambda u: system.rhs(y, u),
        lambda u: system.linearize(y, u),
        lambda u: system.advance(y, u, 0.01),
        lambda u: system.simulate(y, [0.0, 0.1], u),
        lambda u: system.simulate(y, [0.0, 0.1], lambda _: u),
    )
    for call in calls:
        refuses(rf"u has shape .*\.\.\., {n}\).*\({entries}\)", call, np.zeros(n + 1))
        refuses(rf"u\[{n - 1}\] = nan; expected finite", call, [*[0.0] * (n - 1), np.nan])


def test_components_of_a_state_are_checked_by_name():
    with pytest.raises(
        ValueError, match=r"^component = 'omega'; expected one of q, omega_body, tilt"
    ):
        examples.BODY.state(omega=(1.0, 0.0, 0.0))
    with pytest.raises(ValueError, match=r"omega_body has shape \(2,\); expected \(\.\.\., 3\)"):
        examples.BODY.state(omega_body=(1.0, 0.0))
    refuses(r"pivot\[1\] = inf", examples.TOP.state, pivot=(0.0, np.inf))
    for system in examples.TURNING:
        with pytest.raises(ValueError, match=r"^q = \[2\.0, 0\.0, 0\.0, 0\.0\]; expected length 1"):
            system.state(q=(2.0, 0.0, 0.0, 0.0))
    refuses(r"spin\[1\b.*= nan", examples.PLATE.state, spin=[0.0, np.nan])


@examples.each_system
def test_steps_must_be_finite(system):
    for dt in [np.nan, np.inf, -np.inf]:
        refuses(f"dt = {dt}; expected a finite number", system.advance, system.state(), None, dt)


def test_steps_outside_the_stability_envelope_are_refused_with_the_remedy():
    y = examples.BODY.state(omega_body=(0.0, 0.0, 10.0))
    text = refusal(examples.BODY.advance, y, None, 1.0)
    # 10 rad/s about e3 can become sqrt(2.3 / 1.1) as fast about e1, and 0.5 rad are the limit.
    assert "rates up to 14.4" in text and text.endswith("take n_substeps >= 29")
    assert np.isfinite(examples.BODY.advance(y, None, 1.0, 29)).all()
    with pytest.raises(ValueError, match=r"^max_step = 1\.0; expected at most 0\.0345\d* s"):
        examples.BODY.simulate(y, [0.0, 1.0], max_step=1.0)
    refuses(
        "take n_substeps", examples.BODY.advance, REST, (1e4, 0.0, 0.0), 0.1
    )  # it is the torque that makes it fast
    refuses("take n_substeps", examples.BALL.advance, examples.BALL.state(), (12.0, 0.0, 0.0), 0.1)


@pytest.mark.parametrize(
    ("system", "components", "u"),
    [
        (examples.PLATE, {"velocity": (20.0, 0.0)}, None),
        (examples.PLATE, {"tilt_rate": (20.0, 0.0)}, None),
        (examples.DISK, {"omega_body": (0.0, 0.0, 20.0)}, None),
        (examples.DISK, {"omega_body": (0.0, 20.0, 0.0)}, None),
        (EulerDisk(drag=100.0), {"spin": 1.0}, None),
        (examples.COIN, {"steer_rate": 6.0}, None),
        (examples.COIN, {"roll_rate": 6.0}, None),
        (examples.ROLLER, {"velocity": 20.0}, None),
        (examples.ROLLER, {}, (5000.0, 0.0)),
    ],
)
def test_what_rolls_fast_or_is_pushed_hard_needs_short_steps(system, components, u):
    y = system.state(**components)
    (needed,) = re.findall(r"take n_substeps >= (\d+)$", refusal(system.advance, y, u, 0.1))
    assert np.isfinite(system.advance(y, u, 0.1, int(needed))).all()


def test_what_becomes_too_fast_on_the_way_is_refused_with_the_time_and_the_remedy():
    y, u = examples.PLATE.state(), (0.0, 0.0, 500.0, 0.0)  # the plate reaches 50 rad/s
    refuses(r"take n_substeps >= 2$", examples.PLATE.advance, y, u, 0.1)
    with pytest.raises(ValueError, match=r"^from t = 0\.\d+ s on: step = 0\.01; expected at most"):
        examples.PLATE.advance(y, u, 0.1, 10)
    assert np.isfinite(examples.PLATE.advance(y, u, 0.1, 40)).all()


@pytest.mark.parametrize("n_substeps", [20, 100, 1000])
def test_a_disk_that_falls_flat_within_a_step_is_refused(n_substeps):
    disk, lean = RollingDisk.uniform(1.3, 0.5), 0.1  # flat after 0.113 s
    y = disk.state(q=leaning(lean))
    refuses(r"^from t = 0\.\d+ s on: step|the motion ends", disk.advance, y, None, 0.2, n_substeps)
    with pytest.raises(ValueError, match=r"^from t = 0\.\d+ s on: step|the motion ends"):
        disk.simulate(y, [0.0, 3.0], max_step=0.2 / n_substeps)


@examples.each_system
def test_the_largest_step_must_be_a_positive_time(system):
    for max_step in [0.0, -0.1, np.nan, np.inf]:
        with pytest.raises(ValueError, match=f"max_step = {max_step}; expected a positive"):
            system.simulate(system.state(), [0.0, 1.0], max_step=max_step)


def test_a_ratio_below_the_rollers_own_is_refused():
    with pytest.raises(ValueError, match=r"^beta_change\[1\] = -0\.1; expected at least 0"):
        examples.ROLLER.rhs(examples.ROLLER.state(), [(0.0, 0.2), (0.0, -0.1)])


NO_TIMES = ["01", ["0", "1"], None, [0, 1j], [False, True], np.array([0, 1], dtype=object)]


@pytest.mark.parametrize(
    ("t", "message"),
    [
        *((t, r"^t = .*; expected real numbers") for t in (*NO_TIMES, [0, 10**400])),
        *((t, r"^t has shape \(\); expected \(M,\)") for t in (1.0, np.array(1.0))),
        ([[0.0, 1.0]], r"t has shape \(1, 2\)"),
        ([], r"t has shape \(0,\)"),
        ([0.0, 1.0, 1.0], r"^t = .*; expected strictly increasing or decreasing"),
        ([0.0, 2.0, 1.0], r"^t = .*; expected strictly increasing or decreasing"),
        ([0.0, np.nan], r"t\[1.*\] = nan"),
        ([-1.7e308, 1.7e308], r"^t = .*; expected times whose differences are finite"),
    ],
)
def test_times_must_be_a_monotone_sequence_of_real_numbers(t, message):
    refuses(message, examples.BODY.simulate, REST, t)


def test_inputs_must_be_one_row_or_one_for_each_interval():
    with pytest.raises(
        ValueError, match=r"u has shape \(3, 3\); expected \(3,\) or \(2, \.\.\., 3"
    ):
        examples.BODY.simulate(REST, [0.0, 1.0, 2.0], np.zeros((3, 3)))


def test_unknown_names_of_a_trajectory_are_answered_with_the_known_ones():
    trajectory = examples.BODY.simulate(REST, [0.0, 1.0])
    with pytest.raises(KeyError, match=r"name = 'tilt'; expected one of .*omega_body"):
        trajectory["tilt"]


Y = examples.BODY.state(omega_body=(0.1, 0.2, 0.3))


@pytest.mark.parametrize(
    ("u", "message"),
    [
        (lambda t: None, r"^u\(0\) = None; expected an input: return zeros for none"),
        (lambda t: None if t > 0.5 else (0.0, 0.0, 0.0), r"^u\(0\.75\) = None; expected an input"),
        (lambda t: 0.0, r"^u has shape \(\); expected"),
        (lambda t: "pull", r"^u = 'pull'; expected real numbers \(tau1, tau2, tau3\)"),
        (lambda t: [None] * 3, r"^u = \[None, None, None\]; expected real numbers"),
        (lambda t: (1j, 0.0, 0.0), r"^u = .*; expected real numbers"),
        (lambda t: np.zeros((2, 3) if t > 0.5 else 3), r"^shapes of u\(t\) = .*; expected one"),
    ],
)
def test_an_input_function_that_gives_no_input_is_refused(u, message):
    with pytest.raises(ValueError, match=message):
        examples.BODY.simulate(Y, [0.0, 1.0], u)


@examples.each_system
@pytest.mark.parametrize("n_substeps", [0, -1, 1.5, np.nan, "2", None, 10**400, 1e30, 2**53])
def test_substeps_that_cannot_be_counted_are_refused(system, n_substeps):
    with pytest.raises(ValueError, match=r"^n_substeps = .*; expected an integer of at least 1"):
        system.advance(system.state(), None, 0.1, n_substeps)


@pytest.mark.parametrize("max_step", [1e-320, 1e-17, 9e-10])
def test_more_steps_than_anybody_waits_for_are_refused(max_step):
    with pytest.raises(ValueError, match=r"^number of steps = .*; expected at most 1e\+09"):
        examples.BODY.simulate(Y, [0.0, 1.0], max_step=max_step)


@examples.each_system
@pytest.mark.parametrize("size", [1.1e50, 1e200, 1e308])
def test_states_and_inputs_whose_products_overflow_are_refused(system, size):
    y, u = system.state(), np.zeros(len(system.input_entries))
    y[-1] = u[0] = size
    shown = re.escape(repr(float(size)))
    for call in (system.rhs, system.linearize, system.invariants):
        refuses(rf"^y\[\d+\] = {shown}; expected numbers up to", call, y)
    refuses(rf"^u\[0\] = {shown}; expected numbers up to", system.rhs, system.state(), u)


@examples.each_system
def test_the_largest_states_and_inputs_have_finite_rates_or_are_refused(system):
    for size in (1e49, 1e-310, 5e-324):
        for k in range(4 if "q" in system.components else 0, len(system.state_entries)):
            if system.state_entries[k] in examples.ANGLES and size > 1e6:
                continue  # sines of such angles have no digit
            y = system.state()
            y[k] = size
            with np.errstate(all="raise", under="ignore"):
                assert np.isfinite(system.rhs(y)).all()
                assert np.isfinite(system.linearize(y)[0]).all()


@examples.each_type
@pytest.mark.parametrize("size", [1e-320, 1e-51, 1e51, 1e200])
def test_parameters_whose_products_overflow_are_refused(system_type, size):
    for name in system_type.parameter_names():
        refuses(r"^\w+ = .*; expected", system_type, **{name: size})
    refuses(r"^I1 = .*; expected a size from 1e-50 to 1e\+50, or 0", FreeBody, size, size, size)


def test_a_motion_that_outruns_the_clock_is_refused():
    y, u = examples.PLATE.state(), (1e45, 0.0, 0.0, 0.0)
    with pytest.raises(ValueError, match=r"^span \[s\] from t = 1 s on = .*; expected longer"):
        examples.PLATE.simulate(y, [1.0, 2.0], u)


def test_the_ends_of_parameters_still_are_systems():
    assert HeavyTop(g=0.0, ell=0.0).critical_spin == 0.0
    assert np.isfinite(Roller(beta=0.0).rhs([0.0, 1.0])).all()


EPS = np.finfo(np.float64).eps
CALM = {"q": rotations.exp([0.4, -0.3, 0.2]), "omega_body": [0.7, -0.4, 1.1]}


def about_its_end(body, ell, g=9.81):
    """The top that is this body with its pivot at the distance ell below the centre of mass."""
    I1, I2, I3 = np.diag(body.about(body.com - [0.0, 0.0, ell])).tolist()
    return HeavyTop(I1, I2, I3, body.mass, g, ell)


def test_moments_about_the_pivot_that_leave_none_about_the_centre_of_mass_are_refused():
    for I1, I2, I3, m, ell in [
        (1.0, 1.0, 0.5, 1.0, 2.0),  # I1 - m ell^2 = -3
        (1.0, 1.0, 0.5, 1.0, 0.9),  # 0.19, 0.19, 0.5: no triangle
        (2.0, 1.0, 1.0, 1.0, 1.1),  # 0.79, -0.21, 1.0
    ]:
        longest = math.sqrt((I1 + I2 - I3) / (2.0 * m))
        message = rf"^ell = {ell}; expected at most sqrt.* = {longest:.9g} m: .* about the pivot"
        refuses(message, HeavyTop, I1, I2, I3, m, ell=ell)
    refuses(r"^ell = 1e\+200; expected at most", HeavyTop, ell=1e200)


@pytest.mark.parametrize("m", [1e-9, 0.7, 1e6])
def test_every_body_is_accepted_at_every_distance_also_a_lamina_and_a_thin_rod(m):
    rng = np.random.default_rng(0)
    for ell in (0.0, 1e-6, 0.3, 1e3):  # far away the moments of the body are lost in rounding
        about_its_end(bodies.disk(m, 0.2), ell)
        about_its_end(bodies.elliptic_lamina(m, 0.2, 0.5), ell)
        about_its_end(bodies.solid_cylinder(m, 1e-4, 0.6), ell)
        for _ in range(50):
            r = rng.normal(size=(5, 3))
            cloud = bodies.point_masses(np.full(5, m / 5.0), r - r.mean(axis=0))
            about_its_end(bodies.Body(m, np.diag(cloud.principal().moments)), ell)


def test_points_along_and_across_the_axis_show_that_the_limit_is_sharp():
    # A ring around e3 at the height ell has exactly the largest I3 for its moments at the pivot.
    ring, ell = bodies.hoop(2.0, 0.5), 0.3
    top = about_its_end(ring, ell)
    assert top.I3 == pytest.approx(top.I1 + top.I2 - 2.0 * top.m * ell**2, rel=1e-15)
    refuses(r"^ell = ", HeavyTop, top.I1, top.I2, top.I3, top.m, ell=top.ell * (1.0 + 1e-6))


def test_what_rolls_on_its_rim_has_no_mass_beyond_it():
    m, radius = 2.0, 0.5
    RollingDisk(m, radius, I1=0.25, I3=m * radius**2)  # a hoop
    with pytest.raises(ValueError, match=r"^I3 = 0\.51; expected at most m radius\^2 = 0\.5 kg"):
        RollingDisk(m, radius, I1=0.3, I3=0.51)
    refuses(r": RollingDisk.uniform and RollingDisk.hoop fit the ", RollingDisk, radius=0.3)
    UprightCoin(radius=0.3)  # of a coin that is steered and driven often the radius alone is given


@pytest.mark.parametrize("top", [HeavyTop(1.3, 1.1, 0.6, g=0.0), HeavyTop(1.3, 1.1, 0.6, ell=0.0)])
def test_a_top_without_weight_or_lever_moves_like_the_free_body(top):
    free, t = FreeBody(1.3, 1.1, 0.6), np.linspace(0.0, 20.0, 41)
    start, u = top.state(**CALM), [0.1, -0.2, 0.05]
    for torque in (None, u):
        given = None if torque is None else [*torque, 0.0, 0.0, 0.0, 0.0, 0.0]
        moved = top.simulate(start, t, given, max_step=0.01)
        alone = free.simulate(free.state(**CALM), t, torque, max_step=0.01)
        # 2000 steps of the same map; kicks of nothing may round
        np.testing.assert_allclose(moved.y[:, :7], alone.y, rtol=0, atol=2000 * 8 * EPS)
        for name in ("L_world", "omega_world"):
            np.testing.assert_allclose(moved[name], alone[name], rtol=0, atol=2000 * 16 * EPS)
    A, B = top.linearize(start)
    assert np.isfinite(A).all()
    assert np.isfinite(B).all()
    assert top.critical_spin == 0.0
    kinetic = free.kinetic_energy(free.state(**CALM))
    np.testing.assert_allclose(top.energy(start), kinetic, rtol=4 * EPS)


def test_a_top_at_rest_without_weight_stays_where_it_is():
    for top in (HeavyTop(g=0.0), HeavyTop(ell=0.0)):
        y = top.state(q=CALM["q"])
        np.testing.assert_array_equal(top.simulate(y, [0.0, 1.0, 50.0]).y[-1], y)
        np.testing.assert_array_equal(top.advance(y, None, 10.0), y)
