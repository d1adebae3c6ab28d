"""What holds of all closed forms: units, shapes, and what is refused.

They have the same digits in all units of mass, length and time. Units that differ by even powers of
two change exponents alone, of numbers and of their roots: so the results are compared to the last
few bits, however large or small they are.
"""

import inspect
import itertools
import re
from dataclasses import fields, is_dataclass

import numpy as np
import pytest
from numpy.typing import ArrayLike

from rigid_envs.systems import modules_of_all
from tests.refusals import NO_NUMBERS, refusal, refuses

MASS, LENGTH, TIME = range(3)
# of each parameter: exponents of mass, length and time, and an ordinary value
PARAMETERS = {
    "amplitudes": ((0, 1, 0), [0.1, 0.2]),
    "axial_moments": ((1, 2, 0), [3.0, 4.0]),
    "axial_rates": ((0, 0, -1), [0.5, 6.0]),
    "beta": ((0, 0, 0), 0.4),
    "c1": ((0, 0, -1), 0.3),
    "c2": ((0, 0, -1), 0.5),
    "carrier": ((1, 2, 0), 1.2),
    "circle_radius": ((0, 1, 0), 0.7),
    "contact_radius": ((0, 1, 0), 0.8),
    "curvature": ((0, -1, 0), 0.2),
    "displacement": ((0, 1, 0), [0.4, 0.3]),
    "drag": ((0, -1, 1), 0.2),
    "displacements": ((0, 1, 0), [[0.4, 0.3], [0.1, -0.6]]),
    "drags": ((1, 2, -1), [0.02, 0.01]),
    "eccentricities": ((0, 0, 0), [0.02, 0.05]),
    "field": ((0, 0, 0), [0.3, -0.2, 0.5]),  # the tesla is kept, the ampere changes
    "field_rate": ((0, 0, -1), [0.1, 0.4, -0.2]),
    "flattening": ((0, 0, 0), 0.003),
    "frequencies": ((0, 0, -1), [1.3, 0.7]),
    "g": ((0, 1, -2), 9.8),
    "gain": ((1, 2, -1), 0.6),
    "half_height": ((0, 1, 0), 0.4),
    "heading": ((0, 0, 0), 0.2),
    "heading_acceleration": ((0, 0, -2), 0.3),
    "height": ((0, 1, 0), 2.0),
    "i3": ((1, 2, 0), 0.9),
    "i_perp": ((1, 2, 0), 1.3),
    "inclinations": ((0, 0, 0), [0.0, 0.09]),
    "loss": ((1, 2, -2), 0.1),  # of the power 1
    "losses": ((1, 2, -2), [0.2, 0.1]),
    "m": ((1, 0, 0), 1.1),
    "mgl": ((1, 2, -2), 2.1),
    "moment": ((1, 2, 0), 0.8),
    "moments": ((1, 2, 0), [1.0, 2.0, 2.5]),
    "momentum": ((1, 2, -1), 1.5),
    "mu": ((0, 0, 0), 0.3),
    "n": ((0, 0, -1), 0.9),
    "obliquity": ((0, 0, 0), 0.4),
    "offset": ((0, 1, 0), 0.1),
    "omega": ((0, 0, -1), [0.5, -0.4, 0.7]),
    "omega0": ((0, 0, -1), [0.3, 1.2, -0.4]),
    "omega3": ((0, 0, -1), 6.0),
    "p_jellett": ((1, 2, -1), 2.0),
    "p_phi": ((1, 2, -1), 0.9),
    "p_psi": ((1, 2, -1), 0.6),
    "phase": ((0, 0, 0), 0.2),
    "phi": ((0, 0, 0), 0.1),
    "phi_rate": ((0, 0, -1), 0.7),
    "pitch0": ((0, 0, 0), 0.3),
    "pitch_rate0": ((0, 0, -1), 0.2),
    "place": ((0, 1, 0), [0.2, -0.3]),
    "position0": ((0, 1, 0), [0.2, -0.3, 1.5]),
    "power": ((0, 0, 0), 1.0),
    "precession": ((0, 0, -1), 0.9),
    "psi": ((0, 0, 0), 0.2),
    "psi0": ((0, 0, 0), 0.9),
    "psi_rate": ((0, 0, -1), 0.5),
    "pulls": ((0, 0, -2), [0.04, 0.09]),
    "q0": ((0, 0, 0), [0.6, 0.0, 0.8, 0.0]),
    "radius": ((0, 1, 0), 0.3),
    "rate": ((0, 0, -1), 0.8),
    "rise": ((0, 1, 0), 1.2),
    "s0": ((0, 1, 0), 0.2),
    "slip_speed": ((0, 1, -1), 0.2),
    "slope": ((0, 0, 0), 0.3),
    "slugs": ((1, 2, 0), [0.05, 0.02]),
    "speed": ((0, 1, -1), 0.5),
    "spin": ((0, 0, -1), 0.4),
    "spin_momenta": ((1, 2, -1), [0.3, -0.2, 0.1]),
    "spin_momentum": ((1, 2, -1), 0.2),
    "spin_per_rate": ((0, 0, 0), 0.1),
    "steering_rate": ((0, 0, -1), 0.6),
    "t": ((0, 0, 1), [0.0, 0.3, 1.7]),
    "theta": ((0, 0, 0), 0.5),
    "theta0": ((0, 0, 0), 1.4),
    "theta_rate": ((0, 0, -1), 0.1),
    "tilt": ((0, 0, 0), 0.1),
    "torque": ((1, 2, -2), 0.3),
    "torques": ((1, 2, -2), [0.1, 0.2]),
    "turn1": ((0, 0, 0), 0.4),
    "turn2": ((0, 0, 0), -0.7),
    "turned": ((0, 0, 0), [0.4, -0.3, 0.2]),
    "turns": ((0, 0, 0), 1.3),
    "turntable_rate": ((0, 0, -1), 0.9),
    "twist": ((0, 0, 0), 0.2),
    "v0": ((0, 1, -1), 0.4),
    "velocity": ((0, 1, -1), [1.0, 0.3]),
    "velocity0": ((0, 1, -1), [2.0, -1.0, 6.0]),
    "viscosity": ((1, -1, -1), 0.01),
    "wheel_rate": ((0, 0, -1), 3.0),
    "wheel_rate0": ((0, 0, -1), -2.0),
    "wheels": ((1, 2, 0), [0.0, 0.0, 0.3]),
}
# where the value above is outside the range of a function
OTHERS = {
    "free_body.chandler_period": {"i_perp": 0.8},
    "free_body.chandler_turns": {"i_perp": 0.8},
    "free_body.symmetric_cones": {"moments": [1.0, 1.0, 1.5]},
    "free_body.symmetric_rates": {"moments": [1.0, 1.0, 1.5]},
    "gyrostat.carrier_rates": {"wheels": [0.1, 0.2, 0.3]},
    "gyrostat.wheel_turns": {"wheels": [0.1, 0.2, 0.3]},
    "heavy_top.homoclinic_tilt": {"omega3": 2.0},
    "roller.roll_wheel": {"omega": 2.0},
    "rolling_ball.roll_segments": {"segments": [[1.0, 0.0, 0.1, 2.0]]},
    "satellite.libration_frequencies": {"moments": [2.0, 2.5, 1.0]},
    "thrown_body.flight_time": {"velocity": 6.0},
}
ROOMS = {forms.__name__.split(".")[2]: forms for forms in modules_of_all("closed_forms")}
"""Closed forms by system."""


def functions_of(forms):
    """The public functions of a module, without those that it imports."""
    found = inspect.getmembers(forms, inspect.isfunction)
    return {name: f for name, f in found if f.__module__ == forms.__name__ and name[0] != "_"}


def named():
    """Names of those whose parameters are known, units or not."""
    for module, forms in ROOMS.items():
        for name, function in functions_of(forms).items():
            full = f"{module}.{name}"
            known = PARAMETERS.keys() | OTHERS.get(full, {}).keys()
            if inspect.signature(function).parameters.keys() <= known:
                yield full


ALL = tuple(named())
# of functions there are no units, and of segments several
WITH_UNITS = [n for n in ALL if not n.endswith("_fields") and "segments" not in n]
each_form = pytest.mark.parametrize("name", ALL)


def numbers_of(result):
    """All arrays and numbers of a result, one after the other."""
    if is_dataclass(result):
        for field in fields(result):
            yield from numbers_of(getattr(result, field.name))
    elif isinstance(result, tuple):
        for part in result:
            yield from numbers_of(part)
    elif isinstance(result, complex):
        yield np.array([result.real, result.imag])
    elif not isinstance(result, str):
        yield np.asarray(result, dtype=np.float64)


def form_of(name):
    module, _, function = name.partition(".")
    return getattr(ROOMS[module], function)


def arguments_of(name):
    return {
        key: OTHERS.get(name, {}).get(key) or PARAMETERS[key][1]
        for key in inspect.signature(form_of(name)).parameters
    }


def called(name, unit, exponent):
    """The closed form with the same motion, of a unit that is 2^-exponent of the old one."""
    arguments = {}
    for key, value in arguments_of(name).items():
        scaled = np.ldexp(np.array(value), PARAMETERS[key][0][unit] * exponent)
        arguments[key] = float(scaled) if scaled.ndim == 0 else scaled
    return list(numbers_of(form_of(name)(**arguments)))


def assert_rescaled(before, after):
    """Numbers are as before, but for a power of two."""
    finite = np.isfinite(before) & (before != 0.0)
    np.testing.assert_array_equal(after[~finite], before[~finite])
    if finite.any():
        largest = np.argmax(np.where(finite, np.abs(before), 0.0))
        with np.errstate(over="ignore"):
            power = round(np.log2(after.flat[largest] / before.flat[largest]))
        expected = np.ldexp(before[finite], power)
        # a few roundings: some quadratures choose their panels by the size of their results
        np.testing.assert_allclose(after[finite], expected, rtol=1e-14, atol=0)


@pytest.mark.parametrize("name", WITH_UNITS)
def test_units_change_exponents_alone(name):
    for unit, exponent in itertools.product((MASS, LENGTH, TIME), (-400, -8, 8, 400)):
        for before, after in zip(called(name, unit, 0), called(name, unit, exponent), strict=True):
            assert_rescaled(before, after)


@pytest.mark.parametrize("key", ["t", "theta"])
def test_times_and_angles_of_any_shape_are_taken(key):
    for name in WITH_UNITS:
        parameter = inspect.signature(form_of(name)).parameters.get(key)
        if parameter is None or parameter.annotation is not ArrayLike:
            continue
        values = np.linspace(0.2, 1.2, 6)
        one, rows = (
            [*numbers_of(form_of(name)(**{**arguments_of(name), key: at}))]
            for at in (values[0], values)
        )
        for shape in ((2, 3), (0,)):
            at = values[: int(np.prod(shape))].reshape(shape)
            found = numbers_of(form_of(name)(**{**arguments_of(name), key: at}))
            for part, row, single in zip(found, rows, one, strict=True):
                if row.ndim > single.ndim:  # else it does not depend on the values
                    expected = row[: at.size].reshape(*shape, *single.shape)
                    np.testing.assert_allclose(part, expected, rtol=1e-13, atol=0, strict=True)


WRONG = {
    **dict.fromkeys(
        (
            *("axial_moments", "carrier", "circle_radius", "half_height", "i3", "i_perp", "loss"),
            *(
                "gain",
                "m",
                "mgl",
                "moment",
                "moments",
                "momentum",
                "n",
                "pulls",
                "radius",
                "torque",
            ),
            "viscosity",
        ),
        (0.0, -1.0),
    ),
    **dict.fromkeys(("beta", "g", "height", "mu", "power", "turns"), (-1.0,)),
    **dict.fromkeys(("drag", "slip_speed"), (0.0, -1.0)),
    **dict.fromkeys(("drags", "losses", "slugs"), (-1.0,)),
    "curvature": (0.0,),
    "eccentricities": (1.0, -0.1),
    "theta0": (0.0, 4.0),
    "wheels": (-1.0, 2.5),
}


def spoiled(key, value):
    """What is no such number or size."""
    for wrong in (np.nan, *WRONG.get(key, ())):
        changed = np.array(value, dtype=np.float64)
        changed[(-1,) * changed.ndim] = wrong
        yield changed[()]
    yield from NO_NUMBERS
    if np.ndim(value) and key != "t":
        yield np.ones((2, 5))


@each_form
def test_what_is_no_number_or_no_size_is_refused_by_name(name):
    arguments = arguments_of(name)
    parameters = inspect.signature(form_of(name)).parameters
    form_of(name)(**arguments)
    for key, value in arguments.items():
        if key == "precession":  # which may be NaN, where there is none
            continue
        bad = [*spoiled(key, value)]
        bad += [[], np.ones(2)] if parameters[key].annotation is float else []
        for wrong in bad:
            text = refusal(form_of(name), **{**arguments, key: wrong})
            assert re.match(rf"{key}\b", text), text


@pytest.mark.parametrize(
    ("name", "changed", "message"),
    [
        ("roller.descend", {"slope": 2.0}, r"^slope = 2\.0"),
        ("roller.slide", {"t": -1.0}, r"^t = -1\.0; expected at least 0"),
        ("spheroid.nutation", {"omega3": 0.0}, r"^omega3 = 0\.0; expected a spin"),
        ("spheroid.nutation", {"theta": 0.0}, r"^theta = 0\.0"),
        ("spheroid.nutation", {"offset": 0.4}, r"^offset = 0\.4; expected from -0\.4 to 0\.4 m"),
        ("spheroid.tumbling", {"offset": -0.3}, r"^offset = -0\.3; expected from -0\.3 to 0\.3 m"),
        ("spheroid.jellett_thresholds", {"offset": 0.0}, r"^offset = 0\.0; expected a positive"),
        ("spheroid.slide_with_friction", {"t": -1.0}, r"^t = -1\.0; expected at least 0"),
        ("thrown_body.flight_time", {"rise": 2.0}, r"^rise = 2\.0; expected at most 1\.83673 m"),
        ("thrown_body.flight_time", {"velocity": -6.0}, r"^rise = 1\.2; expected at most 0 m"),
        ("thrown_body.flight_time", {"g": 0.0}, r"^g = 0\.0; expected a positive"),
        ("thrown_body.racket_twist", {"moments": [2.0, 1.0, 2.5]}, "^moments.*; expected 0 < I1"),
        (
            "thrown_body.racket_twist",
            {"theta0": 0.5 * np.pi, "psi0": 0.5 * np.pi},
            r"^psi0 = .*; expected an angle off the separatrix",
        ),
        ("thrown_body.wobble_ratio", {"tilt": 1.6}, r"^tilt = 1\.6; expected at least 0"),
        ("upright_coin.drift_across_slope", {"steering_rate": 0.0}, r"^steering_rate = 0\.0"),
        ("dynamic_ball.roll_on_plate", {"beta": 0.0}, r"^beta = 0\.0"),
        ("dynamic_ball.turntable_circle", {"turntable_rate": 0.0}, r"^turntable_rate = 0\.0"),
        ("dynamic_ball.drift_across_slope", {"turntable_rate": 0.0}, r"^turntable_rate = 0\.0"),
        ("rolling_ball.roll_polygon", {"displacements": np.ones((3, 1, 2))}, r"expected \(n, 2\)"),
        ("rolling_ball.roll_segments", {"t": 3.0}, "within"),
        ("rolling_ball.roll_segments", {"segments": [[1.0, 0.0, 0.0, -2.0]]}, "duration"),
        ("rolling_ball.clothoid_path", {"heading_acceleration": 0.0}, "use roll_straight"),
        ("rolling_ball.complete_clothoid_angle", {"heading_acceleration": -1.0}, "^heading_acc"),
        ("free_body.symmetric_rates", {"moments": [1.0, 2.0, 3.0]}, "two equal"),
        ("free_body.symmetric_cones", {"moments": [1.0, 2.0, 3.0]}, "two equal"),
        ("free_body.chandler_period", {"i_perp": 1.0, "i3": 1.0}, r"^i3 = 1.0; expected above"),
        ("free_body.chandler_period", {"omega3": 0.0}, r"^omega3 = 0.0; expected"),
        ("gyrostat.volterra", {"wheels": np.zeros(3)}, "^wheels = .*; expected one positive"),
        ("gyrostat.volterra", {"wheels": [0.1, 0.0, 0.1]}, "^wheels = .*; expected one positive"),
        ("gyrostat.omega", {"omega0": [0.0, 0.0, 1e308]}, "^omega0 = .*; expected an angular"),
        *(
            (
                "gyrostat.attitude",
                dict(moments=moments, wheels=[0.0, 0.0, 0.5], omega0=rates, wheel_rate0=s),
                r"^omega0 = \[.*\]; expected a motion off the separatrix",
            )
            for moments, rates, s in (
                ([1.0, 3.0, 3.0], [0.3, 0.3, 0.2], -0.2),
                ([3.0, 1.5, 1.0], [-0.5, 0.5, 0.0], -3.0),
            )
        ),
        ("gyrostat.energy_sink", {"axial_rates": [0.0, 0.0]}, "^axial_rates.* = 0.0; expected"),
        ("gyrostat.damped_nutation", {"axial_rates": [-4.0, 3.0]}, "^axial_rates = .*; expected"),
        ("gyrostat.carrier_rates", {"wheels": [0.1, 0.2, 0.0]}, r"^spin_momenta\[2\] = 0.1; exp"),
        ("gyrostat.wheel_turns", {"wheels": [0.1, 0.2, 0.0]}, r"^turned\[2\] = 0.2; expected 0"),
        ("satellite.detumble", {"field": np.zeros(3)}, "^field = .*; expected a field that is not"),
        (
            "satellite.libration_frequencies",
            {"moments": [1.0, 2.0, 2.5]},
            "^moments = .*; expected",
        ),
        ("satellite.precession_of_equinoxes", {"spin": 0.0}, r"^spin = 0\.0; expected a spin"),
        (
            "satellite.precession_of_equinoxes",
            {"inclinations": [0.1]},
            r"^inclinations has shape \(1,\)",
        ),
        ("satellite.regression", {"omega3": 0.0}, r"^omega3 = 0\.0; expected a spin"),
        ("heavy_top.homoclinic_tilt", dict(i_perp=1.0, i3=0.5, mgl=1.0, omega3=4.0), "below the"),
        ("heavy_top.fast_top", {"omega3": 0.0}, r"^omega3\[?.*\]? = 0.0; expected a spin"),
        ("heavy_top.tilt", {"omega0": [0.0, 1e100, 0.0]}, "^omega0 = .*; expected rates, moments"),
        ("heavy_top.tilt", {"mgl": 1e-310}, "^omega0 = .*; expected rates, moments"),
        *(
            ("heavy_top.nutation_frequency", {"precession": wrong}, "^precession = ")
            for wrong in (None, "fast", 1j, True, 10**400)
        ),
        ("rolling_disk.steady_circle", {"theta": 1.0, "contact_radius": -1.0}, "further outside"),
        *(
            (f"rolling_disk.{name}", {"theta": theta}, "^theta = ")
            for name in ("fall", "steady_precession", "spins", "stationary_centre_precession")
            for theta in (0.0, np.pi, -0.1)
        ),
        *(
            (f"rolling_disk.{name}", changed, message)
            for name in ("settle", "settle_in_air")
            for changed, message in (
                ({"theta": 1.6}, "^theta = 1.6; expected numbers above 0 and below"),
                ({"t": [0.0, 100.0]}, r"^t\[1\] = 100.0; expected from 0 on and before the disk"),
                ({"t": -0.1}, r"^t = -0.1; expected from 0 on"),
            )
        ),
        *(
            ("rolling_disk.spins", {key: size}, f"^{key} = .*; expected 1e-100 to 1e100 times m")
            for key, size in itertools.product(("i_perp", "i3"), (1e-200, 1e200))
        ),
    ],
)
def test_what_a_formula_does_not_hold_for_is_refused(name, changed, message):
    refuses(message, form_of(name), **{**arguments_of(name), **changed})


def test_what_is_left_out_is_zero_in_all_units():
    for name in ALL:
        for parameter in inspect.signature(form_of(name)).parameters.values():
            assert parameter.default is parameter.empty or not np.any(parameter.default), name


def test_all_closed_forms_are_tried():
    functions = {
        f"{system}.{name}" for system, forms in ROOMS.items() for name in functions_of(forms)
    }
    # the others take fields, which are functions, or what was made of them
    assert {name.partition(".")[2] for name in functions - {*ALL}} == {
        "bracket",
        "bracket_norms",
        "degree_of_nonholonomy",
        "growth_vector",
        "iterated_brackets",
    }
