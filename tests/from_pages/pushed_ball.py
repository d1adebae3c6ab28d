"""The motion of a ball on a plate that tilts and turns, from Newton's and Euler's laws.

In plate axes, n the third. The centre is at ``s = (X, Y, radius)``; with the rate w of the plate
and the velocity V in it, its acceleration is ``V' + 2 w x V + w' x s + w x (w x s)``. The contact
force C of Newton's law goes into Euler's law, and rolling gives omega from V: two linear equations
for V' remain.
"""

import math
from dataclasses import dataclass

import numpy as np

from rigid_envs.base.checks import Array
from tests.from_pages import rolling
from tests.from_pages.attitudes import compose
from tests.vectors import cross


@dataclass(frozen=True)
class Ball:
    """Parameters of the system."""

    m: float
    radius: float
    beta: float
    g: float
    turntable_rate: float


def plate_axes(alpha_x: float, alpha_y: float) -> Array:
    """Axes of the plate in the world, Rx(alpha_x) Ry(alpha_y)."""
    a, b, c, d = math.cos(alpha_x), math.sin(alpha_x), math.cos(alpha_y), math.sin(alpha_y)
    return np.array([[1.0, 0, 0], [0, a, -b], [0, b, a]]) @ [[c, 0, d], [0, 1.0, 0], [-d, 0, c]]


def ball_rate(y: Array, ball: Ball) -> Array:
    """Angular velocity of the ball in plate axes, from rolling.

    ``V = (omega - w) x radius n + turn n x (X, Y)`` with the rate w of the plate.
    """
    X, Y, VX, VY, spin, _, alpha_y, rate_x, rate_y = y[4:]
    r, turn = ball.radius, ball.turntable_rate
    w_x, w_y = rate_x * math.cos(alpha_y), rate_y
    return np.array([w_x - (VY - turn * X) / r, w_y + (VX + turn * Y) / r, spin])


def rate_of_change(y: Array, u: Array, ball: Ball) -> Array:
    """y' of the state y and the input u = (FX, FY, a_x, a_y)."""
    X, Y, VX, VY, _, alpha_x, alpha_y, rate_x, rate_y = y[4:]
    r, turn = ball.radius, ball.turntable_rate
    P = plate_axes(alpha_x, alpha_y)
    c, s = math.cos(alpha_y), math.sin(alpha_y)
    w = np.array([rate_x * c, rate_y, rate_x * s])
    dw = np.array([u[2] * c - rate_x * rate_y * s, u[3], u[2] * s + rate_x * rate_y * c])
    omega = ball_rate(y, ball)
    V, place = np.array([VX, VY, 0.0]), np.array([X, Y, r])
    # the acceleration without V', less gravity
    A = 2 * cross(w, V) + cross(dw, place) + cross(w, cross(w, place)) + ball.g * P[2]
    transport = cross(w, omega)
    push_x = u[0] / ball.m - A[0] - ball.beta * (r * dw[1] + turn * VY + r * transport[1])
    push_y = u[1] / ball.m - A[1] + ball.beta * (r * dw[0] + turn * VX + r * transport[0])
    dq = 0.5 * compose([0.0, *(P @ omega)], y[:4])
    dV = np.array([push_x, push_y]) / (1.0 + ball.beta)
    return np.array([*dq, VX, VY, *dV, -transport[2], rate_x, rate_y, u[2], u[3]])


def moved(y: Array, u: Array, ball: Ball, dt: float) -> Array:
    """The state after the input was held for a time."""
    return rolling.moved(lambda y: rate_of_change(y, u, ball), y, dt)
