"""Attitude, Euler angles and angular velocity of the top at any time."""

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.analytic.heavy_top._cayley_klein import Wave, waves
from rigid_envs.analytic.heavy_top._start import start_of
from rigid_envs.checks import Array, array

__all__ = ["attitude", "euler_angles", "omega"]


def attitude(
    t: ArrayLike, omega0: ArrayLike, q0: ArrayLike, *, i_perp: float, i3: float, mgl: float
) -> Array:
    """Attitude of a top from any initial state, continuous in t and equal to q0 at t = 0.

    Also where the axis passes through a vertical, and Euler's angles jump.

    Args:
        t: times, any shape [s].
        omega0: angular velocity at t = 0, shape (3,) [rad/s], principal body axes.
        q0: attitude at t = 0, shape (4,), unit (w, x, y, z), body to world.
        i_perp: transverse moment about the pivot [kg m^2].
        i3: axial moment [kg m^2].
        mgl: weight times distance of the centre of mass [N m].

    Returns:
        Attitude, shape t.shape + (4,), unit (w, x, y, z), body to world.

    Raises:
        ValueError: as `nutation`.

    Source: Whittaker, ch. VI.
    """
    (wz, _), (xy, _) = (
        wave.at(t) for wave in waves(start_of(omega0, q0, i_perp=i_perp, i3=i3, mgl=mgl))
    )
    q = np.stack([wz.real, xy.real, xy.imag, wz.imag], axis=-1)
    return np.asarray(q / np.linalg.norm(q, axis=-1, keepdims=True))


def omega(
    t: ArrayLike, omega0: ArrayLike, q0: ArrayLike, *, i_perp: float, i3: float, mgl: float
) -> Array:
    """Angular velocity of a top from any initial state, at any time.

    omega1 + i omega2 = 2 (conj(w + i z) (x + i y)' - (x + i y) conj(w + i z)'), and omega3 is
    constant.

    Args:
        t: times, any shape [s].
        omega0: angular velocity at t = 0, shape (3,) [rad/s], principal body axes.
        q0: attitude at t = 0, shape (4,), unit (w, x, y, z), body to world.
        i_perp: transverse moment about the pivot [kg m^2].
        i3: axial moment [kg m^2].
        mgl: weight times distance of the centre of mass [N m].

    Returns:
        Angular velocity, shape t.shape + (3,) [rad/s], principal body axes.

    Raises:
        ValueError: as `nutation`.

    Source: Whittaker, ch. I (Cayley-Klein parameters) and VI.
    """
    start = start_of(omega0, q0, i_perp=i_perp, i3=i3, mgl=mgl)
    (wz, wz_rate), (xy, xy_rate) = (wave.at(t) for wave in waves(start))
    across = 2.0 * (np.conj(wz) * xy_rate - xy * np.conj(wz_rate))
    axial = np.full(across.shape, start.omega3)
    return np.stack([across.real, across.imag, axial], axis=-1)


def euler_angles(
    t: ArrayLike, omega0: ArrayLike, q0: ArrayLike, *, i_perp: float, i3: float, mgl: float
) -> tuple[Array, Array, Array]:
    """Nutation, precession and spin angle of a top from any initial state, unwrapped.

    phi and psi are continuous from values in [-pi, pi] at t = 0, but for jumps by pi at the moments
    when the axis passes exactly through a vertical: there phi jumps by +pi, and psi by -pi at the
    upper and +pi at the lower pole. (By -pi and so on would do as well: an axis that passes beside
    the pole turns quickly by one or the other.) Where the axis stays on the vertical only phi + psi
    (upright) or phi - psi (hanging) has a meaning.

    Args:
        t: times, any shape [s].
        omega0: angular velocity at t = 0, shape (3,) [rad/s], principal body axes.
        q0: attitude at t = 0, shape (4,), unit (w, x, y, z), body to world.
        i_perp: transverse moment about the pivot [kg m^2].
        i3: axial moment [kg m^2].
        mgl: weight times distance of the centre of mass [N m].

    Returns:
        theta, in [0, pi], phi and psi, each of the shape of t [rad], z-x-z.

    Raises:
        ValueError: as `nutation`.

    Source: Whittaker, ch. VI; Goldstein, sec. 5.7.
    """
    start = start_of(omega0, q0, i_perp=i_perp, i3=i3, mgl=mgl)
    first, second = waves(start)
    (wz, _), (xy, _) = first.at(t), second.at(t)
    theta = np.asarray(2.0 * np.arctan2(np.abs(xy), np.abs(wz)))
    phi, psi = _phi_and_psi(first, second, t)
    turns = np.rint(np.array(_phi_and_psi(first, second, 0.0)) / (2.0 * np.pi))
    return theta, phi - 2.0 * np.pi * turns[0], psi - 2.0 * np.pi * turns[1]


def _phi_and_psi(first: Wave, second: Wave, t: ArrayLike) -> tuple[Array, Array]:
    """Sum and difference of the phases of w + i z and of x + i y; what is opposite cancels."""
    (turns1, rest1), (turns2, rest2) = first.argument(t), second.argument(t)
    phi = np.pi * (turns1 + turns2) + (rest1 + rest2)
    psi = np.pi * (turns1 - turns2) + (rest1 - rest2) + 2.0 * first.spin * array(t, "t")
    return phi, psi
