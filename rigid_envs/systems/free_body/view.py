"""Views of the tasks of a free body, and its polhode beside them."""

import functools
import math
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import rotations
from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.tasks.core import Moment
from rigid_envs.watch import meshes, views

# Meshes, each made once in a process.

TO_X = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])  # rotation of z to x
TO_Y = TO_X @ TO_X  # of z to y
HALF_TURN = np.diag([-1.0, -1.0, 1.0])  # about z
_ENDS = [meshes.LIGHT, meshes.STEEL]
_DISH = [(0.0, 0.0), (0.03, 0.0), (0.05, 0.08), (0.22, 0.18), (0.21, 0.19), (0.0, 0.09)]


@functools.cache
def book() -> meshes.Mesh:
    """Book, its spine at -y, the title on +z."""
    cover = [meshes.BLUE] * 4
    boards = [
        meshes.moved(meshes.box((1.7, 1.16, 0.05), [*cover, color, color]), (0.0, 0.0, z))
        for z, color in ((0.15, meshes.BLUE), (-0.15, meshes.ORANGE))
    ]
    pages = meshes.moved(meshes.box((1.6, 1.08, 0.25), [meshes.CREAM]), (0.0, -0.01, 0.0))
    spine = meshes.moved(meshes.box((1.7, 0.05, 0.25), [meshes.BLUE]), (0.0, -0.555, 0.0))
    title = meshes.moved(meshes.box((0.9, 0.22, 0.02), [meshes.YELLOW]), (0.0, 0.25, 0.18))
    author = meshes.moved(meshes.box((0.5, 0.1, 0.02), [meshes.CREAM]), (0.0, -0.2, 0.18))
    back = meshes.moved(meshes.box((0.4, 0.4, 0.02), [meshes.CREAM]), (-0.5, -0.25, -0.18))
    return meshes.join(*boards, pages, spine, title, author, back)


@functools.cache
def t_handle() -> meshes.Mesh:
    """T-handle: crossbar along x, stem along y, its ends of different colours."""
    red = meshes.moved(_rod(0.85, 0.13, meshes.RED), rotation=TO_X)
    blue = meshes.moved(_rod(0.85, 0.13, meshes.SKY), rotation=HALF_TURN @ TO_X)
    stem = meshes.moved(_rod(1.0, 0.13, meshes.GREY), rotation=TO_Y)
    band = meshes.moved(meshes.cylinder(0.145, 0.16, meshes.YELLOW, 24), (0.0, 0.72, 0.0), TO_Y)
    return meshes.moved(meshes.join(red, blue, stem, band), (0.0, -0.2, 0.0))


@functools.cache
def tennis_racket() -> meshes.Mesh:
    """Tennis racket with strings."""
    return meshes.join(racket_frame(), *_strings())


@functools.cache
def racket_frame() -> meshes.Mesh:
    """Frame of a racket: handle towards -x, face across z, the sides of its head in two colours."""
    angle = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 25)
    half = np.stack([0.5 * np.sin(angle) + 0.45, 0.4 * np.cos(angle), 0.0 * angle], axis=-1)
    right = meshes.tube(half, 0.045, meshes.RED, 10)
    left = meshes.tube(half * (1.0, -1.0, 1.0), 0.045, meshes.BLUE, 10)
    shaft = meshes.moved(meshes.frustum(0.04, 0.05, 0.35, meshes.DARK, 12), (-0.35, 0.0, 0.0), TO_X)
    throat = [
        meshes.tube([(-0.06, 0.0, 0.0), (0.12, 0.3 * side, 0.0)], 0.035, meshes.DARK, 8)
        for side in (-1, 1)
    ]
    grip = meshes.moved(meshes.cylinder(0.075, 0.62, meshes.YELLOW, 16), (-0.62, 0.0, 0.0), TO_X)
    return meshes.join(right, left, shaft, *throat, grip)


@functools.cache
def satellite() -> meshes.Mesh:
    """Satellite: golden body, panels along x, a dish at +z, a nozzle at -z, a red lamp at +y."""
    body = meshes.box(
        (0.5, 0.6, 0.5), [meshes.ORANGE, meshes.ORANGE, meshes.YELLOW, meshes.YELLOW, *_ENDS]
    )
    wings = []
    for side in (-1.0, 1.0):
        arm = meshes.moved(
            meshes.cylinder(0.03, 0.2, meshes.GREY, 10), (0.34 * side, 0.0, 0.0), TO_X
        )
        cells = [
            meshes.moved(
                meshes.box((0.2, 0.62, 0.03), [meshes.BLUE]), (side * (0.53 + 0.22 * k), 0.0, 0.0)
            )
            for k in range(3)
        ]
        frame = meshes.moved(
            meshes.box((0.68, 0.66, 0.02), [meshes.LIGHT]), (side * 0.75, 0.0, 0.0)
        )
        wings += [arm, frame, *cells]
    dish = meshes.moved(meshes.lathe(_DISH, meshes.CREAM, 24), (0.0, 0.0, 0.25))
    nozzle = meshes.moved(meshes.frustum(0.14, 0.07, 0.15, meshes.DARK, 20), (0.0, 0.0, -0.39))
    lamp = meshes.moved(meshes.cylinder(0.07, 0.06, meshes.RED, 16), (0.0, 0.33, 0.0), TO_Y)
    return meshes.join(body, *wings, dish, nozzle, lamp)


@functools.cache
def graticule() -> meshes.Mesh:
    """Equator and two meridians of the unit sphere, thin."""
    hoop = meshes.loop(meshes.circle(61)[:-1], 0.004, meshes.LIGHT, 3)
    return meshes.join(hoop, meshes.moved(hoop, rotation=TO_X), meshes.moved(hoop, rotation=TO_Y))


@functools.cache
def spin_arrow() -> meshes.Mesh:
    """Arrow of length 1 along z: an angular velocity that is to be reached."""
    profile = [(0.0, 0.0), (0.035, 0.0), (0.035, 0.84), (0.085, 0.84), (0.0, 1.0)]
    return meshes.lathe(profile, meshes.GREEN, 20)


def _rod(length: float, radius: float, color: meshes.Color) -> meshes.Mesh:
    """Round bar from the origin along z, its end rounded."""
    edge = 0.25 * radius
    profile = [(0.0, 0.0), (radius, 0.0), (radius, length - edge), (radius - edge, length)]
    return meshes.lathe([*profile, (0.0, length)], color, 24)


def _strings() -> list[meshes.Mesh]:
    """Strings of the racket, in the ellipse of its head."""
    lines = []
    for x in (0.1 * k for k in range(-4, 5)):
        y = 0.4 * math.sqrt(1.0 - (x / 0.5) ** 2)
        lines.append([(0.45 + x, -y, 0.0), (0.45 + x, y, 0.0)])
    for y in (0.1 * k for k in range(-3, 4)):
        x = 0.5 * math.sqrt(1.0 - (y / 0.4) ** 2)
        lines.append([(0.45 - x, y, 0.0), (0.45 + x, y, 0.0)])
    return [meshes.tube(line, 0.008, meshes.STEEL, 3) for line in lines]


# Views of free bodies: they float inside a faint sphere, on which the tip of an axis writes.

SPHERE = 1.5  # radius of the sphere, and length of omega at its reference rate [m]
LONGEST = 2.1  # arrow that is still in the picture [m]
OUTSIDE = 0.25  # distance of the arrow of the input from the middle [m]
LARGER = 1.3  # ghost of a body, which it hides where they coincide


def sides(moments: npt.ArrayLike) -> Array:
    """Sides of the box of these principal moments, its diagonal 2.1; none below a tenth.

    Side k is as sqrt(S_k), where S_k = (I1 + I2 + I3) / 2 - I_k is the second moment along e_k.

    Args:
        moments: (I1, I2, I3) [kg m^2], shape (3,).
    """
    rows = np.asarray(moments, dtype=np.float64)
    second = np.maximum(0.5 * rows.sum() - rows, 0.0)
    shape = np.sqrt(np.maximum(second, 0.01 * second.max()))
    return np.asarray(2.1 * shape / np.linalg.norm(shape))


def panelled(
    moments: npt.ArrayLike, share: float
) -> tuple[meshes.Mesh, tuple[float, float, float]]:
    """Mesh of a satellite, a box of these principal moments with panels along e1; its scale.

    Args:
        moments: (I1, I2, I3) [kg m^2], shape (3,).
        share: of the size of the box of `sides`.
    """
    x, y, z = (share * sides(moments)).tolist()
    return meshes.panelled_box(), (x, y, z)


class FreeBodyView(views.View):
    """A box with the moments of the body, omega, L and the torque.

    Attributes:
        axis: body axis whose tip leaves a path on the sphere.
        goal: axis along which omega is to point, in body axes; None for none.
        shape: mesh that is shown where I1 <= I2 <= I3, of nominal size; None for a box.
    """

    axis: ClassVar[tuple[float, float, float]] = (1.0, 0.0, 0.0)
    goal: ClassVar[tuple[float, float, float] | None] = None
    shape: ClassVar[Callable[[], meshes.Mesh] | None] = None

    @property
    def rate(self) -> float:
        """Rate that is drawn as long as the radius of the sphere [rad/s]."""
        return float(getattr(self.task, "spin_rate", 1.0))

    @property
    def momentum(self) -> float:
        """Angular momentum that is drawn as long as the radius of the sphere [N m s]."""
        return float(self.system.moments[1]) * self.rate

    @property
    def strongest(self) -> float:
        """Input that is drawn 1.2 m long [N m]."""
        return float(getattr(self.task, "torque", 1.0))

    def body(self) -> tuple[meshes.Mesh, tuple[float, float, float]]:
        """Mesh of the body, and its scale."""
        moments, shape = self.system.moments, type(self).shape
        if shape is not None and np.all(np.diff(moments) >= 0.0):
            return shape(), (1.0, 1.0, 1.0)
        x, y, z = sides(moments).tolist()
        return meshes.brick(), (x, y, z)

    def parts(self) -> dict[str, views.Part]:
        """Body, sphere, and arrow of the goal."""
        mesh, self.scale = self.body()
        parts = {
            "body": views.Part(mesh),
            "sphere": views.Part(graticule(), shadow=False, shiny=False),
        }
        return parts if self.goal is None else parts | {"goal": views.ghost(spin_arrow(), 0.5)}

    def camera(self) -> views.Camera:
        """The whole sphere and the arrows."""
        return views.Camera(target=(0.0, 0.0, 0.25), distance=7.0, azimuth=-55.0, elevation=24.0)

    def vectors(self) -> dict[str, views.Arrow]:
        """Angular velocity, angular momentum, input."""
        return {
            "L": views.Arrow(meshes.MOMENTUM, 0.045, "L"),
            "omega": views.Arrow(meshes.OMEGA, 0.045, "omega"),
            "input": views.Arrow(meshes.INPUT, 0.07, "torque"),
        }

    def traces(self) -> dict[str, views.Trace]:
        """Path of the axis on the sphere."""
        return {"axis": views.Trace(meshes.PATH, 0.025, length=250)}

    def poses(self, moment: Moment) -> dict[str, views.Pose]:
        """The body turns about the middle of the sphere, which stays."""
        q = self.system.accessors["q"](moment.y)
        poses = {
            "body": views.Pose(q=q, scale=self.scale),
            "sphere": views.Pose(scale=(SPHERE,) * 3),
        }
        if self.goal is not None:
            turn = rotations.multiply(q, views.from_z(self.goal))
            poses["goal"] = views.Pose(q=turn, scale=(1.3, 1.3, SPHERE))
        return poses

    def arrows(self, moment: Moment) -> views.Arrows:
        """Both from the middle; the input stands out of the body."""
        read, centre = self.system.accessors, (0.0, 0.0, 0.0)
        torque = rotations.rotate(read["q"](moment.y), self.torque(moment))
        push = views.scaled(torque, 1.2 / self.strongest, LONGEST)
        outside = OUTSIDE * push / max(float(np.linalg.norm(push)), 1e-12)
        return {
            "L": (centre, views.scaled(read["L_world"](moment.y), SPHERE / self.momentum, LONGEST)),
            "omega": (
                centre,
                views.scaled(read["omega_world"](moment.y), SPHERE / self.rate, LONGEST),
            ),
            "input": (outside, push),
        }

    def torque(self, moment: Moment) -> Array:
        """Torque on the body in body axes [N m], shape (3,)."""
        return moment.u[:3]  # then comes a force

    def points(self, moment: Moment) -> dict[str, npt.ArrayLike]:
        """Tip of the axis."""
        return {"axis": SPHERE * rotations.rotate(self.system.accessors["q"](moment.y), self.axis)}

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """Angular velocity in body axes."""
        a, b, c = np.round(self.system.accessors["omega_body"](moment.y), 2) + 0.0
        return (f"omega ({a:.2f}, {b:.2f}, {c:.2f}) rad/s in body axes",)

    @staticmethod
    def insets(system: Any, y: Array, times: Array, driven: bool) -> list[views.Panel]:
        """The polhode; of a free motion Poinsot's construction."""
        if driven or np.linalg.norm(system.omega_body(y), axis=-1).min() < _REST:
            return [_polhode(system, y, times)]
        return [_poinsot(system, y, times)]


class IntermediateAxisRandomView(FreeBodyView):
    """A box of the drawn moments whose spin is to be about e2."""

    axis = (0.0, 1.0, 0.0)
    goal = (0.0, 1.0, 0.0)


class IntermediateAxisView(IntermediateAxisRandomView):
    """A tennis racket whose spin is to be about e2."""

    shape = staticmethod(tennis_racket)


class IntermediateAxisSingleView(IntermediateAxisView):
    """A book whose spin is to be about e2."""

    shape = staticmethod(book)


class SpinCaptureView(IntermediateAxisView):
    """A T-handle whose spin is to be about e2."""

    shape = staticmethod(t_handle)


class AxisFlipView(SpinCaptureView):
    """A T-handle whose spin is to be about -e2 by a commanded time."""

    goal = (0.0, -1.0, 0.0)

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """Also the time left."""
        left = max(moment.aux["time_left"], 0.0)
        return (*super().readings(moment), f"{left:.1f} s left to turn over")


class DetumbleView(FreeBodyView):
    """A tumbling satellite; L begins within the sphere and is to become 0."""

    shape = staticmethod(satellite)

    @property
    def rate(self) -> float:
        """Rate of the largest momentum about e2 [rad/s]."""
        return self.momentum / float(self.system.moments[1])

    @property
    def momentum(self) -> float:
        """Largest angular momentum at the start [N m s]."""
        return float(self.task.start_momentum)

    @property
    def strongest(self) -> float:
        """Largest impulse [N m s]."""
        return float(self.task.impulse)

    def traces(self) -> dict[str, views.Trace]:
        """Path of the tip of L."""
        return {"L": views.Trace(meshes.MOMENTUM, 0.025)}

    def points(self, moment: Moment) -> dict[str, npt.ArrayLike]:
        """Tip of L."""
        L = self.system.accessors["L_world"](moment.y)
        return {"L": views.scaled(L, SPHERE / self.momentum, LONGEST)}

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """Angular momentum."""
        size = float(np.linalg.norm(self.system.accessors["L_body"](moment.y)))
        goal = self.task.tolerance * self.task.start_momentum
        return (f"|L| {size:.3f} N m s, to be below {goal:.2g}",)


class ReorientView(FreeBodyView):
    """A satellite, and its goal attitude as a larger ghost."""

    axis = (0.0, 0.0, 1.0)

    shape = staticmethod(satellite)

    @property
    def rate(self) -> float:
        """Rate that full torque about e2 gives in 5 s [rad/s]."""
        return 5.0 * self.strongest / float(self.system.moments[1])

    def parts(self) -> dict[str, views.Part]:
        """Also the ghost."""
        return super().parts() | {"goal": views.ghost(self.body()[0])}

    def goal_attitude(self, moment: Moment) -> Array:
        """Quaternion of the goal."""
        return np.array([moment.aux[f"goal_{k}"] for k in "wxyz"])

    def poses(self, moment: Moment) -> dict[str, views.Pose]:
        """Also the ghost."""
        q = self.goal_attitude(moment)
        x, y, z = self.scale
        size = (LARGER * x, LARGER * y, LARGER * z)
        return super().poses(moment) | {"goal": views.Pose(q=q, scale=size)}

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """Angle to the goal, and rate."""
        read = self.system.accessors
        off = float(rotations.distance(read["q"](moment.y), self.goal_attitude(moment)))
        rate = float(np.linalg.norm(read["omega_body"](moment.y)))
        return (f"{np.degrees(off):.1f} deg from the goal   {rate:.2f} rad/s",)


# Insets of a replay page: Poinsot's construction of a free body, the axis of a top on a sphere.

_REST = 1e-9  # rad/s; a body that turns more slowly has no axis of rotation


def _poinsot(body: FreeBody, y: Array, times: Array) -> views.Panel:
    """The inertia ellipsoid rolls on the invariable plane: polhode on it, herpolhode below.

    ``rho = omega / sqrt(2 T)`` is on the ellipsoid ``rho . I rho = 1``, whose tangent plane
    there is normal to L at the distance ``sqrt(2 T) / |L|`` from the centre. The world is turned
    so that L points down. Lengths are in units of the largest semi-axis.

    Source: Goldstein, Poole & Safko, *Classical Mechanics*, section 5.6.
    """
    size = float(np.sqrt(body.moments.min()))
    root = np.sqrt(2.0 * body.kinetic_energy(y))
    L = body.L_world(y[0])
    q = rotations.multiply(_turn_down(L), rotations.normalize(y[:, :4]))
    rho = size * body.omega_body(y) / root[:, None]
    contact = rotations.rotate(q, rho)
    height = -size * float(root[0] / np.linalg.norm(L))
    scene = views.Scene(
        parts={"ellipsoid": views.Part(meshes.chequered_ball(), opacity=0.34)},
        camera=views.Camera((0.0, 0.0, 0.4 * height), 4.8, -60.0, 24.0, 32.0),
        arrows={"omega": views.Arrow(views.INSET_GREEN, 0.035, "\u03c9")},
        traces={
            "separatrices": views.Trace(views.INSET_INK, 0.012, "ellipsoid"),
            "polhode": views.Trace(views.INSET_BLUE, 0.05, "ellipsoid"),
            "herpolhode": views.Trace(views.INSET_RED, 0.05),
        },
        floor=views.Floor(height, 4.4, 0.4),
    )
    semi = _semi_axes(body)
    frames = [
        views.SceneFrame(
            {"ellipsoid": views.Pose(q=attitude, scale=semi)},
            {"omega": ((0.0, 0.0, 0.0), point)},
            {"polhode": inside / semi * views.LIFT, "herpolhode": (*point[:2], height + 0.012)},
        )
        for attitude, point, inside in zip(q, contact, rho, strict=True)
    ]
    title = "Polhode and herpolhode"
    return views.Panel(title, scene, frames, times, {"separatrices": _separatrices(body)})


def _polhode(body: FreeBody, y: Array, times: Array) -> views.Panel:
    """Path of the axis of rotation on the inertia ellipsoid, in body axes."""
    semi = _semi_axes(body)
    omega = body.omega_body(y)
    rate = np.linalg.norm(omega, axis=-1)
    root = np.sqrt(2.0 * body.kinetic_energy(y))
    turning = rate > _REST
    rho = np.full_like(omega, np.nan)
    rho[turning] = omega[turning] / root[turning, None] * np.sqrt(body.moments.min())
    scene = views.Scene(
        parts={"ellipsoid": views.Part(meshes.chequered_ball(), opacity=0.45)},
        camera=views.Camera((0.0, 0.0, 0.12), 5.0, 40.0, 22.0, 32.0),
        arrows={"omega": views.Arrow(views.INSET_GREEN, 0.035, "\u03c9"), **views.body_axes()},
        traces={
            "separatrices": views.Trace(views.INSET_INK, 0.012, "ellipsoid"),
            "polhode": views.Trace(views.INSET_BLUE, 0.05, "ellipsoid"),
        },
    )
    axes = {f"e{k + 1}": (semi[k] * e, 0.28 * e) for k, e in enumerate(np.eye(3))}
    pose = {"ellipsoid": views.Pose(scale=semi)}
    frames = [
        views.SceneFrame(
            pose, {**axes, "omega": ((0.0, 0.0, 0.0), 1.25 * point)}, {"polhode": point / semi}
        )
        for point in views.LIFT * rho
    ]
    title = "\u03c9 on the inertia ellipsoid"
    return views.Panel(title, scene, frames, times, {"separatrices": _separatrices(body)})


def _semi_axes(body: FreeBody) -> tuple[float, float, float]:
    """Semi-axes of the inertia ellipsoid, in units of the largest."""
    a, b, c = np.sqrt(body.moments.min() / body.moments)
    return float(a), float(b), float(c)


def _separatrices(body: FreeBody) -> Array:
    """Both separatrices on the unit sphere that the ellipsoid is made from, (n, 3); broken by NaN.

    Polhodes of ``L^2 / (2 T) = I_2``, the middle moment: two ellipses through the middle axis, in
    the planes ``rho_1 sqrt(I_1 (I_2 - I_1)) = +- rho_3 sqrt(I_3 (I_3 - I_2))``. None where two
    moments are equal.
    """
    order = np.argsort(body.moments)
    low, middle, high = body.moments[order]
    if low == middle or middle == high:
        return np.zeros((0, 3))
    across = np.array([np.sqrt(high - middle), np.sqrt(middle - low)])  # in sphere coordinates
    across /= np.linalg.norm(across)
    angle = np.linspace(0.0, 2.0 * np.pi, 121)
    lines = np.full((2, 122, 3), np.nan)
    for line, sign in zip(lines, (1.0, -1.0), strict=True):
        line[:-1, order[0]] = across[0] * np.sin(angle)
        line[:-1, order[1]] = np.cos(angle)
        line[:-1, order[2]] = sign * across[1] * np.sin(angle)
    return (views.LIFT - 0.004) * lines.reshape(-1, 3)


def _turn_down(direction: Array) -> Array:
    """Quaternion of the shortest turn of a direction to straight down; about x if it points up."""
    x, y, z = direction / np.linalg.norm(direction)
    q = np.array([1.0 - z, -y, x, 0.0])
    return rotations.normalize(q) if np.linalg.norm(q) > 1e-6 else np.array([0.0, 1.0, 0.0, 0.0])
