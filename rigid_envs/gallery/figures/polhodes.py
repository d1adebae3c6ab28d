"""Polhodes on the inertia ellipsoid, with the separatrices."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from rigid_envs.analytic import free_body as theory
from rigid_envs.gallery.entry import Entry, Number
from rigid_envs.gallery.space import Camera, arrow, bare, curve, solid, surface_grid
from rigid_envs.gallery.style import BLUE, GREEN, INK, RED
from rigid_envs.systems import FreeBody

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["POLHODES", "rates"]

Array = npt.NDArray[np.float64]
_BODY = FreeBody(1.0, 2.0, 3.0)
_EYE = Camera(55.0, 20.0)
_ABOUT_E1, _ABOUT_E3 = (1.06, 1.22, 1.45, 1.72, 1.93), (2.06, 2.2, 2.42, 2.66, 2.88)


def rates(moments: Array, L_squared: float, side: tuple[float, float]) -> Array:
    """Angular velocity without component along e2, of the energy 2 T = 1 and a given L^2.

    Args:
        moments: principal moments, ascending, shape (3,) [kg m^2].
        L_squared: between the first and the last of them [kg^2 m^4/s^2].
        side: signs of the components along e1 and e3.
    """
    outer = moments[[0, 2]]
    squares = np.linalg.solve(np.stack([outer, outer**2]), [1.0, L_squared])
    first, third = np.asarray(side) * np.sqrt(squares)
    return np.array([first, 0.0, third])


def draw(figure: Figure) -> tuple[Number, ...]:
    """Simulate twenty polhodes, compare them with Jacobi's functions."""
    axes = figure.subplots()
    bare(axes)
    semi_axes = 1.0 / np.sqrt(_BODY.moments)
    solid(axes, _EYE, semi_axes)
    surface_grid(axes, _EYE, semi_axes)
    errors = []
    families = ((_ABOUT_E1, BLUE, (1.0, 0.1)), (_ABOUT_E3, GREEN, (0.1, 1.0)))
    for levels, color, axis in families:
        for level in levels:
            for side in (1.0, -1.0):
                signs = tuple(np.sign(side * np.array(axis)))
                errors.append(_polhode(axes, rates(_BODY.moments, level, signs), color))
    _separatrices(axes)
    _axes_of_body(axes, semi_axes)
    for color, text in (
        (BLUE, "polhodes about e1, least moment: stable"),
        (GREEN, "polhodes about e3, largest moment: stable"),
        (RED, "separatrices through e2: unstable"),
    ):
        axes.plot([], [], color=color, label=text)
    figure.legend(ncols=1)
    error = max(errors)
    return (Number("largest error of omega against Jacobi's functions", error, 0.0, 1e-9, "rad/s"),)


def _polhode(axes: Axes, omega0: Array, color: str) -> float:
    t = np.linspace(0.0, theory.polhode(_BODY.moments, omega0).period, 241)
    omega = _BODY.simulate(_BODY.state(omega_body=omega0), t)["omega_body"]
    curve(axes, _EYE, omega, _EYE.faces(omega, np.diag(_BODY.moments)), color=color, faint=0.13)
    return float(np.max(np.abs(omega - theory.omega(t, _BODY.moments, omega0))))


def _separatrices(axes: Axes) -> None:
    t = np.linspace(-40.0, 40.0, 801)
    for signs in ((1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)):
        start = rates(_BODY.moments, float(_BODY.moments[1]), signs)
        omega = theory.omega(t, _BODY.moments, start)
        seen = _EYE.faces(omega, np.diag(_BODY.moments))
        curve(axes, _EYE, omega, seen, color=RED, lw=2.2, faint=0.2)


def _axes_of_body(axes: Axes, semi_axes: Array) -> None:
    for k, size in enumerate(semi_axes):
        end = np.eye(3)[k]
        arrow(axes, _EYE, size * end, (size + 0.3) * end, f"e{k + 1}", color=INK)


POLHODES = Entry(
    name="polhodes",
    title="Polhodes on the inertia ellipsoid of the moments 1, 2, 3",
    caption="Where the angular velocity can go in the body at one energy: each polhode is the "
    "cut of the ellipsoid with a sphere of constant |L|. They circle the axes of the least and of "
    "the largest moment; the two separatrices cross on the intermediate axis e2. "
    "Thin lines are on the far side.",
    law="omega . I omega = 2 T,  |I omega|^2 = L^2;  omega = (a1 cn u, a2 sn u, a3 dn u)",
    source="Landau & Lifshitz, Mechanics, section 37; Goldstein, section 5.6",
    draw=draw,
    size=(7.2, 5.4),
)
