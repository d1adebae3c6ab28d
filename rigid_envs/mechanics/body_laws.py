"""Laws of mass properties, against integrals over slices and sums over points."""

import math
from collections.abc import Callable

import numpy as np
from scipy.integrate import quad

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import bodies
from rigid_envs.mechanics.bodies.body import Body
from rigid_envs.mechanics.laws import Subject, matrices, max_abs

Radius = Callable[[float], float]
Slice = Callable[[float], tuple[float, float, float]]
SUBJECT = Subject("bodies", "mass, centre of mass and inertia tensor of rigid bodies")

_QUADRATURE = "quadrature asked for 1e-12, of numbers near 1"
_ROUNDINGS = "roundings of sums over fifty points"

_RNG = np.random.default_rng(8)
_MASSES, _POINTS = _RNG.uniform(0.1, 1.0, 50), _RNG.normal(size=(50, 3))
_CLOUD = bodies.point_masses(_MASSES, _POINTS)
_AWAY, _AXIS, _TURN = _RNG.normal(size=(3, 3))
_Q = np.array([0.5, -0.1, 0.7, 0.5])  # a unit quaternion
_FLAT = np.array([math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0])  # sets a lamina upright: y to z


def _sum(masses: Array, points: Array, about: Array) -> Array:
    """Inertia tensor of mass points about a point: I_ij = sum m (r^2 d_ij - r_i r_j)."""
    r = points - about
    second: Array = np.einsum("n,ni,nj->ij", masses, r, r)
    return np.asarray(np.trace(second) * np.eye(3) - second)


def _deviation(body: Body, low: float, high: float, of: Slice) -> float:
    """Largest difference of mass properties between a body and integrals over its slices along z.

    Args:
        body: slices symmetric about x and y.
        low: lower end along z [m].
        high: upper end along z [m].
        of: of z: mass per length, in any unit, and the means of x^2 and y^2 in the slice.
    """

    def total(weight: Callable[[float, float, float], float]) -> float:
        def integrand(z: float) -> float:
            share, x2, y2 = of(z)
            return share * weight(z, x2, y2)

        return float(quad(integrand, low, high, epsabs=1e-12, epsrel=1e-12, limit=200)[0])

    mass = total(lambda *_: 1.0)
    centre = total(lambda z, *_: z) / mass
    x2, y2 = total(lambda _, x2, __: x2) / mass, total(lambda _, __, y2: y2) / mass
    z2 = total(lambda z, *_: (z - centre) ** 2) / mass
    tensor = np.diag([y2 + z2, z2 + x2, x2 + y2])
    return max_abs(body.inertia / body.mass - tensor, body.com - [0.0, 0.0, centre])


def _ring(inner: Radius, outer: Radius) -> Slice:
    """Slices that are annuli."""

    def of(z: float) -> tuple[float, float, float]:
        a, b = inner(z) ** 2, outer(z) ** 2
        return b - a, (a + b) / 4.0, (a + b) / 4.0

    return of


def _rim(radius: Radius, share: Radius) -> Slice:
    """Slices that are circles."""
    return lambda z: (share(z), radius(z) ** 2 / 2.0, radius(z) ** 2 / 2.0)


def _strip(inner: Radius, outer: Radius) -> Slice:
    """Slices that are lines along x with a gap in the middle."""

    def of(z: float) -> tuple[float, float, float]:
        a, b = inner(z), outer(z)
        return b - a, (a * a + a * b + b * b) / 3.0, 0.0

    return of


def _arc(radius: float) -> Radius:
    return lambda z: math.sqrt(max(radius**2 - z * z, 0.0))


def _always(value: float) -> Radius:
    return lambda _: value


@SUBJECT.law("solids with integrals over their slices", bound=1e-10, why=_QUADRATURE)
def solids_are_sums_of_slices() -> float:
    """Centre of mass and moments of ten solids."""
    none, arc = _always(0.0), _arc(0.3)

    def ellipse(z: float) -> tuple[float, float, float]:
        square = 1.0 - (z / 1.1) ** 2
        return square, 0.25 * 0.5**2 * square, 0.25 * 0.8**2 * square

    def capsule(z: float) -> float:
        return _arc(0.4)(max(abs(z) - 0.5, 0.0))

    return max_abs(
        _deviation(bodies.box(2.0, 0.6, 1.0, 1.4), -0.7, 0.7, lambda _: (1.0, 0.03, 1.0 / 12.0)),
        _deviation(bodies.solid_sphere(2.0, 0.8), -0.8, 0.8, _ring(none, _arc(0.8))),
        _deviation(bodies.thick_shell(2.0, 0.5, 0.9), -0.9, 0.9, _ring(_arc(0.5), _arc(0.9))),
        _deviation(bodies.solid_cylinder(2.0, 0.5, 1.2), -0.6, 0.6, _ring(none, _always(0.5))),
        _deviation(
            bodies.hollow_cylinder(2.0, 0.3, 0.5, 1.2), -0.6, 0.6, _ring(_always(0.3), _always(0.5))
        ),
        _deviation(bodies.cone(2.0, 0.7, 1.4), 0.0, 1.4, _ring(none, lambda z: 0.5 * z)),
        _deviation(bodies.hemisphere(2.0, 0.9), 0.0, 0.9, _ring(none, _arc(0.9))),
        _deviation(bodies.ellipsoid(2.0, 0.5, 0.8, 1.1), -1.1, 1.1, ellipse),
        _deviation(
            bodies.torus(2.0, 1.0, 0.3),
            *(-0.3, 0.3),
            _ring(lambda z: 1.0 - arc(z), lambda z: 1.0 + arc(z)),
        ),
        _deviation(bodies.capsule(2.0, 0.4, 1.0), -0.9, 0.9, _ring(none, capsule)),
    )


@SUBJECT.law("shells and a rod with integrals over their slices", bound=1e-10, why=_QUADRATURE)
def shells_are_sums_of_rims() -> float:
    """A sphere has the same surface at every height, and so has a tube; that of a cone grows."""
    even, half = _always(1.0), _always(0.5)
    return max_abs(
        _deviation(bodies.hollow_sphere(2.0, 0.8), -0.8, 0.8, _rim(_arc(0.8), even)),
        _deviation(bodies.cylindrical_shell(2.0, 0.5, 1.2), -0.6, 0.6, _rim(half, even)),
        _deviation(
            bodies.conical_shell(2.0, 0.7, 1.4), 0.0, 1.4, _rim(lambda z: 0.5 * z, lambda z: z)
        ),
        _deviation(bodies.rod(2.0, 1.4), -0.7, 0.7, _rim(_always(0.0), even)),
    )


@SUBJECT.law("laminae with integrals over their strips", bound=1e-10, why=_QUADRATURE)
def laminae_are_sums_of_strips() -> float:
    """Set upright, so that strips along x are slices; and the perpendicular-axis theorem."""
    none, corners = _always(0.0), np.exp(0.25j * math.pi * np.arange(8))
    octagon = 0.5 * np.stack([corners.real, corners.imag, 0.0 * corners.real], axis=-1)
    flat = {
        bodies.disk(2.0, 0.8): (0.8, _strip(none, _arc(0.8))),
        bodies.annulus(2.0, 0.3, 0.5): (0.5, _strip(_arc(0.3), _arc(0.5))),
        bodies.rectangular_lamina(2.0, 0.6, 1.4): (0.7, _strip(none, _always(0.3))),
        bodies.elliptic_lamina(2.0, 0.5, 0.8): (0.8, _strip(none, lambda z: 0.625 * _arc(0.8)(z))),
    }
    hoop = bodies.hoop(2.0, 0.5)
    return max_abs(
        *(_deviation(body.rotated(_FLAT), -top, top, of) for body, (top, of) in flat.items()),
        hoop.inertia - _sum(np.full(8, 0.25), octagon, np.zeros(3)),  # the moments of a circle
        *(bodies.perpendicular_axis(body) for body in (*flat, hoop)),
    )


@SUBJECT.law("triangle and tetrahedron with quadrature", bound=1e-13, why=_ROUNDINGS)
def simplices_are_sums_over_their_corners() -> float:
    """Rules that are exact for squares: middles of edges, and Keast's four points."""
    corners = _RNG.normal(size=(4, 3))
    middles = 0.5 * (corners[[0, 1, 2]] + corners[[1, 2, 0]])
    a = (5.0 - math.sqrt(5.0)) / 20.0
    inner = a * corners.sum(axis=0) + (1.0 - 4.0 * a) * corners
    triangle = bodies.triangular_lamina(3.0, corners[:3])
    whole = bodies.tetrahedron(4.0, corners)
    return max_abs(
        triangle.inertia - _sum(np.ones(3), middles, middles.mean(axis=0)),
        triangle.com - middles.mean(axis=0),
        whole.inertia - _sum(np.ones(4), inner, corners.mean(axis=0)),
        whole.com - corners.mean(axis=0),
    )


@SUBJECT.law("a closed mesh with the box inside it", bound=1e-13, why=_ROUNDINGS)
def a_mesh_has_the_mass_properties_of_what_it_encloses() -> float:
    """Twelve triangles around a box, turned and displaced."""
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    squares = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [face for a, b, c, d in squares for face in ((a, b, c), (a, c, d))]
    R = matrices(_Q)
    mesh = bodies.from_mesh(signs * [0.3, 0.5, 0.7] @ R.T + _AWAY, faces, 2.5)
    box = bodies.box(2.5 * 0.6 * 1.0 * 1.4, 0.6, 1.0, 1.4).rotated(_Q).translated(_AWAY)
    return max_abs(mesh.mass - box.mass, mesh.com - box.com, mesh.inertia - box.inertia)


@SUBJECT.law("tensors and moments about anything with sums", bound=1e-12, why=_ROUNDINGS)
def steiners_theorem_moves_the_point() -> float:
    """I about any point, and the moment sum m |n x r|^2 about any axis, of fifty points."""
    n = _AXIS / np.linalg.norm(_AXIS)
    arms = np.cross(n, _POINTS - _AWAY)
    return max_abs(
        _CLOUD.mass - _MASSES.sum(),
        _CLOUD.com - _MASSES @ _POINTS / _MASSES.sum(),
        _CLOUD.inertia - _sum(_MASSES, _POINTS, _CLOUD.com),
        _CLOUD.about(_AWAY) - _sum(_MASSES, _POINTS, _AWAY),
        _CLOUD.about_axis(_AWAY, _AXIS) - _MASSES @ np.sum(arms * arms, axis=-1),
    )


@SUBJECT.law("rotated, translated and composed bodies with sums", bound=1e-12, why=_ROUNDINGS)
def bodies_move_and_join_as_their_points_do() -> float:
    """Points go to R x + d; the whole has the points of its parts."""
    moved = _POINTS @ matrices(_Q).T + _AWAY
    one = _CLOUD.rotated(_Q).translated(_AWAY)
    both = bodies.compose([(_CLOUD, np.eye(3), np.zeros(3)), (_CLOUD, _Q, _AWAY)])
    masses, points = np.tile(_MASSES, 2), np.concatenate([_POINTS, moved])
    return max_abs(
        one.com - _MASSES @ moved / _MASSES.sum(),
        one.inertia - _sum(_MASSES, moved, one.com),
        both.com - masses @ points / masses.sum(),
        both.inertia - _sum(masses, points, both.com),
    )


@SUBJECT.law("principal axes with the tensor that they make", bound=1e-12, why=_ROUNDINGS)
def principal_axes_diagonalise() -> float:
    """A diag(moments) A^T = I, A a rotation, moments ascending; 1 / |x|^2 is the moment about x."""
    moments, axes = _CLOUD.principal()
    semi_axes, directions = _CLOUD.inertia_ellipsoid()
    n = _AXIS / np.linalg.norm(_AXIS)
    pierced = 1.0 / np.linalg.norm((n @ directions) / semi_axes)
    return max_abs(
        axes @ np.diag(moments) @ axes.T - _CLOUD.inertia,
        axes.T @ axes - np.eye(3),
        np.linalg.det(axes) - 1.0,
        np.minimum(np.diff(moments), 0.0),
        1.0 / pierced**2 - _CLOUD.about_axis(_CLOUD.com, n),
    )


@SUBJECT.law("momentum, energy and acceleration with sums", bound=1e-11, why=_ROUNDINGS)
def turning_bodies_obey_newton_point_by_point() -> float:
    """L = sum m r x v, T = sum m v^2 / 2, and sum m r x v' = tau, with v = omega x r."""
    r, tau = _POINTS - _CLOUD.com, _AWAY
    omega, rate = _TURN, _CLOUD.angular_acceleration(_TURN, _AWAY)
    v = np.cross(omega, r)
    push = np.cross(rate, r) + np.cross(omega, v)
    return max_abs(
        _CLOUD.angular_momentum(omega) - _MASSES @ np.cross(r, v),
        _CLOUD.kinetic_energy(omega) - 0.5 * _MASSES @ np.sum(v * v, axis=-1),
        _MASSES @ np.cross(r, push) - tau,
    )
