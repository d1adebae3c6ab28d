"""Satellite: a rigid body on a circular orbit, under gravity gradient and a magnetic dipole.

State y = (q, omega, latitude): attitude (w, x, y, z), angular velocity in space, in body axes
[rad/s], and the argument of latitude alpha, the angle in the orbit from the ascending node [rad].
The world's axes are fixed in space: z along the orbit's normal, x to the ascending node.
"""

from typing import NamedTuple

from rigid_envs.engine import algebra
from rigid_envs.engine.algebra import Quaternion, Vector
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.dynamics import Dynamics, unchanged
from rigid_envs.engine.elementary import fma, sincos
from rigid_envs.systems.free_body import dynamics as free


class State(NamedTuple):
    """Attitude q, angular velocity in body axes [rad/s], argument of latitude [rad]."""

    w: float = 1.0
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    omega1: float = 0.0
    omega2: float = 0.0
    omega3: float = 0.0
    latitude: float = 0.0


class Input(NamedTuple):
    """Magnetic dipole of the satellite in body axes [A m^2]."""

    m1: float
    m2: float
    m3: float


class Parameters(NamedTuple):
    """Moments [kg m^2], mean motion [rad/s], field [T], inclination [rad]; what follows.

    `b` is the field on the magnetic equator; `in_plane` and `normal` are its product with sine and
    cosine of the inclination. G1 = 3 n^2 (I3 - I2) / I1 and so on [1/s^2]; inverses of the moments,
    and the ratios of `free_body`'s `rotor`.
    """

    I1: float
    I2: float
    I3: float
    n: float
    b: float
    inclination: float
    in_plane: float
    normal: float
    G1: float
    G2: float
    G3: float
    inverse1: float
    inverse2: float
    inverse3: float
    k1: float
    k3: float
    r12: float
    r21: float
    r23: float
    r32: float


class Invariants(NamedTuple):
    """Kept without dipole: energy in the orbit's frame [J], spin momentum (I1 = I2) [N m s]."""

    energy: float
    L_spin: float


@scalar
def derive(I1: float, I2: float, I3: float, n: float, b: float, inclination: float) -> Parameters:
    """Parameter row of the moments [kg m^2], n [rad/s], b [T] and inclination [rad]."""
    s, c = sincos(inclination)
    inverses, pull = (1.0 / I1, 1.0 / I2, 1.0 / I3), 3.0 * n * n
    gradient = (
        pull * (I3 - I2) * inverses[0],
        pull * (I1 - I3) * inverses[1],
        pull * (I2 - I1) * inverses[2],
    )
    ratios = free.rotor(I1, I2, I3)
    return Parameters(I1, I2, I3, n, b, inclination, b * s, b * c, *gradient, *inverses, *ratios)


@scalar
def radial(q: Quaternion, latitude: float) -> Vector:
    """Unit vector r = R^T (cos alpha, sin alpha, 0) away from the Earth's centre, in body axes."""
    s, c = sincos(latitude)
    return algebra.rotate_inverse(q, (c, s, 0.0))


@scalar
def field(q: Quaternion, latitude: float, p: Parameters) -> Vector:
    """Magnetic field B = b (e - 3 (e . r) r) in body axes [T], e along the Earth's axis.

    It is that of a dipole along -e; in world axes e = (0, sin i, cos i).
    """
    s, c = sincos(latitude)
    across = 3.0 * p.in_plane * s
    return algebra.rotate_inverse(q, (-across * c, fma(-across, s, p.in_plane), p.normal))


@scalar
def acceleration(q: Quaternion, latitude: float, u: Input, p: Parameters) -> Vector:
    """Angular acceleration I^-1 (3 n^2 r x I r + m x B) by the torques, body axes [rad/s^2].

    Hughes, *Spacecraft Attitude Dynamics*, chapter 9.
    """
    r, tau = radial(q, latitude), algebra.cross((u.m1, u.m2, u.m3), field(q, latitude, p))
    return (
        fma(p.G1 * r[1], r[2], p.inverse1 * tau[0]),
        fma(p.G2 * r[2], r[0], p.inverse2 * tau[1]),
        fma(p.G3 * r[0], r[1], p.inverse3 * tau[2]),
    )


@scalar
def rhs(y: State, u: Input, p: Parameters) -> State:
    """Euler's equations I omega' = I omega x omega + 3 n^2 r x I r + m x B; latitude' = n."""
    w1, w2, w3 = y.omega1, y.omega2, y.omega3
    a1, a2, a3 = acceleration(algebra.attitude(y), y.latitude, u, p)
    return State(
        *algebra.turning(algebra.attitude(y), (w1, w2, w3)),
        (p.I2 - p.I3) * w2 * w3 / p.I1 + a1,
        (p.I3 - p.I1) * w3 * w1 / p.I2 + a2,
        (p.I1 - p.I2) * w1 * w2 / p.I3 + a3,
        p.n,
    )


@scalar
def step(y: State, u: Input, p: Parameters, h: float) -> State:
    """Half a kick by all torques, free rotation on the way along the orbit, half a kick.

    It is symmetric and of second order. With attitude and place the torques derive from a
    potential, so the energy error stays bounded.
    """
    q, half = algebra.attitude(y), 0.5 * h
    omega = _kick(q, (y.omega1, y.omega2, y.omega3), y.latitude, u, p, half)
    q, omega = free.free_rotation(q, omega, (p.k1, p.k3, p.r12, p.r21, p.r23, p.r32), h)
    q, latitude = algebra.normalize(q), fma(h, p.n, y.latitude)
    return State(*q, *_kick(q, omega, latitude, u, p, half), latitude)


@scalar
def _kick(
    q: Quaternion, omega: Vector, latitude: float, u: Input, p: Parameters, h: float
) -> Vector:
    a = acceleration(q, latitude, u, p)
    return fma(h, a[0], omega[0]), fma(h, a[1], omega[1]), fma(h, a[2], omega[2])


@scalar
def invariants(y: State, p: Parameters) -> Invariants:
    """Jacobi's integral omega . I omega / 2 + 3 n^2 r . I r / 2 - n L_z, and I3 omega3.

    The energy in the frame that turns with the orbit, constant without dipole; the spin momentum
    is for I1 = I2 only.
    """
    q, omega = algebra.attitude(y), (y.omega1, y.omega2, y.omega3)
    r, L = radial(q, y.latitude), (p.I1 * omega[0], p.I2 * omega[1], p.I3 * omega[2])
    pull = fma(p.I1 * r[0], r[0], fma(p.I2 * r[1], r[1], p.I3 * r[2] * r[2]))
    energy = 0.5 * fma(3.0 * p.n * p.n, pull, algebra.dot(L, omega))
    return Invariants(fma(-p.n, algebra.dot(algebra.vertical(q), L), energy), L[2])


@scalar
def rate(y: State, p: Parameters) -> float:
    """Larger one of the free rotation's rate and 2 n, at which the torques turn [rad/s]."""
    return max(free.rate(y, p), 2.0 * p.n)


SATELLITE = Dynamics(
    State, Input, Parameters, Invariants, derive, rhs, step, unchanged, invariants, rate=rate
)
