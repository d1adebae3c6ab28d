"""Closed forms have the same digits in all units of mass, length and time.

Units that differ by even powers of two change exponents alone, of numbers and of their roots: so
the results are compared to the last few bits, however large or small they are.
"""

import inspect
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
import pytest

from rigid_envs.systems.dynamic_ball import closed_forms as dynamic_ball
from rigid_envs.systems.free_body import closed_forms as free_body
from rigid_envs.systems.heavy_top import closed_forms as heavy_top
from rigid_envs.systems.roller import closed_forms as roller
from rigid_envs.systems.rolling_ball import closed_forms as rolling_ball
from rigid_envs.systems.rolling_disk import closed_forms as rolling_disk
from rigid_envs.systems.upright_coin import closed_forms as upright_coin

MASS, LENGTH, TIME = range(3)
# of each parameter: exponents of mass, length and time, and an ordinary value
PARAMETERS: dict[str, tuple[tuple[int, int, int], Any]] = {
    "amplitudes": ((0, 1, 0), [0.1, 0.2]),
    "beta": ((0, 0, 0), 0.4),
    "c1": ((0, 0, -1), 0.3),
    "c2": ((0, 0, -1), 0.5),
    "circle_radius": ((0, 1, 0), 0.7),
    "contact_radius": ((0, 1, 0), 0.8),
    "curvature": ((0, -1, 0), 0.2),
    "displacement": ((0, 1, 0), [0.4, 0.3]),
    "displacements": ((0, 1, 0), [[0.4, 0.3], [0.1, -0.6]]),
    "frequencies": ((0, 0, -1), [1.3, 0.7]),
    "g": ((0, 1, -2), 9.8),
    "heading": ((0, 0, 0), 0.2),
    "heading_acceleration": ((0, 0, -2), 0.3),
    "height": ((0, 1, 0), 2.0),
    "i3": ((1, 2, 0), 0.9),
    "i_perp": ((1, 2, 0), 1.3),
    "m": ((1, 0, 0), 1.1),
    "mgl": ((1, 2, -2), 2.1),
    "moments": ((1, 2, 0), [1.0, 2.0, 2.5]),
    "mu": ((0, 0, 0), 0.3),
    "omega": ((0, 0, -1), [0.5, -0.4, 0.7]),
    "omega0": ((0, 0, -1), [0.3, 1.2, -0.4]),
    "omega3": ((0, 0, -1), 6.0),
    "p_phi": ((1, 2, -1), 0.9),
    "p_psi": ((1, 2, -1), 0.6),
    "phase": ((0, 0, 0), 0.2),
    "phi": ((0, 0, 0), 0.1),
    "phi_rate": ((0, 0, -1), 0.7),
    "place": ((0, 1, 0), [0.2, -0.3]),
    "precession": ((0, 0, -1), 0.9),
    "psi": ((0, 0, 0), 0.2),
    "psi_rate": ((0, 0, -1), 0.5),
    "q0": ((0, 0, 0), [0.6, 0.0, 0.8, 0.0]),
    "radius": ((0, 1, 0), 0.3),
    "rate": ((0, 0, -1), 0.8),
    "s0": ((0, 1, 0), 0.2),
    "slope": ((0, 0, 0), 0.3),
    "speed": ((0, 1, -1), 0.5),
    "spin": ((0, 0, -1), 0.4),
    "steering_rate": ((0, 0, -1), 0.6),
    "t": ((0, 0, 1), [0.0, 0.3, 1.7]),
    "theta": ((0, 0, 0), 0.5),
    "theta_rate": ((0, 0, -1), 0.1),
    "tilt": ((0, 0, 0), 0.1),
    "torques": ((1, 2, -2), [0.1, 0.2]),
    "turntable_rate": ((0, 0, -1), 0.9),
    "twist": ((0, 0, 0), 0.2),
    "v0": ((0, 1, -1), 0.4),
    "velocity": ((0, 1, -1), [1.0, 0.3]),
}
# where the value above is outside the range of a function
OTHERS: dict[str, dict[str, Any]] = {
    "free_body.chandler_period": {"i_perp": 0.8},
    "free_body.chandler_turns": {"i_perp": 0.8},
    "free_body.symmetric_cones": {"moments": [1.0, 1.0, 1.5]},
    "free_body.symmetric_rates": {"moments": [1.0, 1.0, 1.5]},
    "heavy_top.homoclinic_tilt": {"omega3": 2.0},
    "roller.roll_wheel": {"omega": 2.0},
}


ROOMS = {
    room.__name__.split(".")[2]: room
    for room in (
        dynamic_ball,
        free_body,
        heavy_top,
        roller,
        rolling_ball,
        rolling_disk,
        upright_coin,
    )
}  # by system


def closed_forms() -> Iterator[str]:
    """Names of those whose parameters have units."""
    for module, forms in ROOMS.items():
        for name in forms.__all__:
            function = getattr(forms, name)
            if (
                inspect.isfunction(function)
                and not name.endswith("_fields")
                and set(inspect.signature(function).parameters) <= set(PARAMETERS)
            ):
                yield f"{module}.{name}"


def numbers_of(result: Any) -> Iterator[np.ndarray]:
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
        yield np.atleast_1d(np.asarray(result, dtype=np.float64))


def form_of(name: str) -> Callable[..., Any]:
    module, _, function = name.partition(".")
    form: Callable[..., Any] = getattr(ROOMS[module], function)
    return form


def arguments_of(name: str) -> dict[str, Any]:
    return {
        key: OTHERS.get(name, {}).get(key, PARAMETERS[key][1])
        for key in inspect.signature(form_of(name)).parameters
    }


def called(name: str, unit: int, exponent: int) -> list[np.ndarray]:
    """The closed form with the same motion, of a unit that is 2^-exponent of the old one."""
    arguments = {}
    for key, value in arguments_of(name).items():
        scaled = np.ldexp(np.array(value), PARAMETERS[key][0][unit] * exponent)
        arguments[key] = float(scaled) if scaled.ndim == 0 else scaled
    return list(numbers_of(form_of(name)(**arguments)))


@pytest.mark.parametrize("name", list(closed_forms()))
@pytest.mark.parametrize("unit", [MASS, LENGTH, TIME])
@pytest.mark.parametrize("exponent", [-400, -8, 8, 400])
def test_units_change_exponents_alone(name: str, unit: int, exponent: int) -> None:
    for before, after in zip(called(name, unit, 0), called(name, unit, exponent), strict=True):
        finite = np.isfinite(before) & (before != 0.0)
        np.testing.assert_array_equal(after[~finite], before[~finite])
        if finite.any():
            largest = np.argmax(np.where(finite, np.abs(before), 0.0))
            with np.errstate(over="ignore"):
                ratio = after.flat[largest] / before.flat[largest]
            power = round(np.log2(ratio))
            expected = np.ldexp(before[finite], power)
            # a few roundings: some quadratures choose their panels by the size of their results
            np.testing.assert_allclose(after[finite], expected, rtol=1e-14, atol=0)


WRONG = {
    **dict.fromkeys(
        ("circle_radius", "i3", "i_perp", "m", "mgl", "moments", "radius"), (0.0, -1.0)
    ),
    "g": (-1.0,),
}


@pytest.mark.parametrize("name", list(closed_forms()))
def test_what_is_no_number_or_no_size_is_refused_by_name(name: str) -> None:
    arguments = arguments_of(name)
    arguments.pop("precession", None)  # which may be NaN, where there is none
    for key, value in arguments.items():
        for wrong in (np.nan, *WRONG.get(key, ())):
            changed = np.array(value, dtype=np.float64)
            changed[(-1,) * changed.ndim] = wrong
            with pytest.raises(ValueError, match=rf"^{key}\b"):
                form_of(name)(**{**arguments_of(name), key: changed[()]})


def test_what_is_left_out_is_zero_in_all_units() -> None:
    for name in closed_forms():
        for parameter in inspect.signature(form_of(name)).parameters.values():
            assert parameter.default is parameter.empty or not np.any(parameter.default), name


def test_most_closed_forms_are_tried() -> None:
    assert len(list(closed_forms())) > 50
