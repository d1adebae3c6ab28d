"""What views share, and the view of every task."""

from __future__ import annotations

import abc
import functools
import itertools
import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import rotations
from rigid_envs.tasks.core import Moment
from rigid_envs.tasks.registry import load
from rigid_envs.watch import meshes as look
from rigid_envs.watch import meshes as solids
from rigid_envs.watch.meshes import GHOST, box, cylinder, frustum, join, lathe, loop, moved, tube
from rigid_envs.watch.scene import (
    Arrow,
    Camera,
    Color,
    Floor,
    Frame,
    Mesh,
    Part,
    Pose,
    Scene,
    Trace,
    View,
)

# What the views of all systems share: a scene in pieces, lines of text, lengths of arrows.

Arrows = dict[str, tuple[npt.ArrayLike, npt.ArrayLike]]


class SystemView(View):
    """A view in pieces, which subclasses override one by one.

    Attributes:
        system: the physical system, with the parameters of the episode: its accessors read states.
    """

    def __init__(self, task: Any, parameters: Mapping[str, float]) -> None:
        """Make the system and the scene."""
        self.system = task.system(parameters)
        super().__init__(task, dict(parameters))

    @abc.abstractmethod
    def parts(self) -> dict[str, Part]:
        """Rigid pieces by name."""

    @abc.abstractmethod
    def camera(self) -> Camera:
        """Point of view at first."""

    @abc.abstractmethod
    def poses(self, moment: Moment) -> dict[str, Pose]:
        """Where the pieces are."""

    def vectors(self) -> dict[str, Arrow]:
        """Look of the arrows; none."""
        return {}

    def traces(self) -> dict[str, Trace]:
        """Look of the paths; none."""
        return {}

    def floor(self) -> Floor | None:
        """The floor; none."""
        return None

    def arrows(self, moment: Moment) -> Arrows:
        """Start and vector of the arrows [m]; none."""
        return {}

    def points(self, moment: Moment) -> dict[str, npt.ArrayLike]:
        """Newest points of the paths; none."""
        return {}

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """What else is to be read, beside time, reward and cost; nothing."""
        return ()

    def make_scene(self) -> Scene:
        """Put the pieces together."""
        return Scene(self.parts(), self.camera(), self.vectors(), self.traces(), self.floor())

    def frame(self, moment: Moment) -> Frame:
        """Where everything is at this moment."""
        return Frame(
            self.poses(moment), self.arrows(moment), self.points(moment), self.text(moment)
        )

    def text(self, moment: Moment) -> tuple[str, ...]:
        """Time and reward, cost with its unit, the readings, and success."""
        quantity, _, unit = self.task.cost_unit.rstrip("]").partition(" [")
        lines = (
            f"time {moment.time:.1f} s   reward {moment.reward:.3f}",
            f"cost {moment.cost:.3g} {unit} ({quantity})",
            *self.readings(moment),
        )
        return (*lines, "success") if moment.success else lines


def scaled(vector: npt.ArrayLike, scale: float, longest: float = math.inf) -> Array:
    """A vector as the length of an arrow, which is limited.

    Args:
        vector: shape (3,).
        scale: metres for a unit of the vector.
        longest: limit [m].
    """
    arrow = scale * np.asarray(vector, dtype=np.float64)
    length = float(np.linalg.norm(arrow))
    return arrow * (longest / length) if length > longest else arrow


def above(point: npt.ArrayLike, height: float) -> Array:
    """The point that is higher by this [m], shape (3,)."""
    return np.add(point, (0.0, 0.0, height), dtype=np.float64)


def ghost(mesh: Mesh, opacity: float = GHOST) -> Part:
    """A goal: translucent, without shadow."""
    return Part(mesh, opacity=opacity, shadow=False, shiny=False)


# Meshes of bodies in free space, about 2 m long, nominal: e1 is their long axis, e3 the short one.
#
# Each is made once in a process.

TO_X = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])  # rotation of z to x
TO_Y = TO_X @ TO_X  # of z to y
HALF_TURN = np.diag([-1.0, -1.0, 1.0])  # about z


@functools.cache
def brick() -> Mesh:
    """Cube of side 1 with six colours."""
    return box(
        (1.0, 1.0, 1.0),
        (look.ORANGE, look.YELLOW, look.SKY, look.BLUE, look.GREEN, look.PURPLE),
    )


@functools.cache
def book() -> Mesh:
    """Book, its spine at -y, the title on +z."""
    cover = [look.BLUE] * 4
    boards = [
        moved(box((1.7, 1.16, 0.05), [*cover, color, color]), (0.0, 0.0, z))
        for z, color in ((0.15, look.BLUE), (-0.15, look.ORANGE))
    ]
    pages = moved(box((1.6, 1.08, 0.25), [look.CREAM]), (0.0, -0.01, 0.0))
    spine = moved(box((1.7, 0.05, 0.25), [look.BLUE]), (0.0, -0.555, 0.0))
    title = moved(box((0.9, 0.22, 0.02), [look.YELLOW]), (0.0, 0.25, 0.18))
    author = moved(box((0.5, 0.1, 0.02), [look.CREAM]), (0.0, -0.2, 0.18))
    back = moved(box((0.4, 0.4, 0.02), [look.CREAM]), (-0.5, -0.25, -0.18))
    return join(*boards, pages, spine, title, author, back)


@functools.cache
def t_handle() -> Mesh:
    """T-handle: crossbar along x, stem along y, its ends of different colours."""
    red = moved(_rod(0.85, 0.13, look.RED), rotation=TO_X)
    blue = moved(_rod(0.85, 0.13, look.SKY), rotation=HALF_TURN @ TO_X)
    stem = moved(_rod(1.0, 0.13, look.GREY), rotation=TO_Y)
    band = moved(cylinder(0.145, 0.16, look.YELLOW, 24), (0.0, 0.72, 0.0), TO_Y)
    return moved(join(red, blue, stem, band), (0.0, -0.2, 0.0))


@functools.cache
def tennis_racket() -> Mesh:
    """Tennis racket: handle towards -x, face across z, the sides of its head in two colours."""
    angle = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 25)
    half = np.stack([0.5 * np.sin(angle) + 0.45, 0.4 * np.cos(angle), 0.0 * angle], axis=-1)
    right = tube(half, 0.045, look.RED, 10)
    left = tube(half * (1.0, -1.0, 1.0), 0.045, look.BLUE, 10)
    shaft = moved(frustum(0.04, 0.05, 0.35, look.DARK, 12), (-0.35, 0.0, 0.0), TO_X)
    throat = [
        tube([(-0.06, 0.0, 0.0), (0.12, 0.3 * side, 0.0)], 0.035, look.DARK, 8) for side in (-1, 1)
    ]
    grip = moved(cylinder(0.075, 0.62, look.YELLOW, 16), (-0.62, 0.0, 0.0), TO_X)
    return join(right, left, shaft, *throat, grip, *_strings())


@functools.cache
def satellite() -> Mesh:
    """Satellite: golden body, panels along x, a dish at +z, a nozzle at -z, a red lamp at +y."""
    body = box((0.5, 0.6, 0.5), [look.ORANGE, look.ORANGE, look.YELLOW, look.YELLOW, *_ENDS])
    wings = []
    for side in (-1.0, 1.0):
        arm = moved(cylinder(0.03, 0.2, look.GREY, 10), (0.34 * side, 0.0, 0.0), TO_X)
        cells = [
            moved(box((0.2, 0.62, 0.03), [look.BLUE]), (side * (0.53 + 0.22 * k), 0.0, 0.0))
            for k in range(3)
        ]
        frame = moved(box((0.68, 0.66, 0.02), [look.LIGHT]), (side * 0.75, 0.0, 0.0))
        wings += [arm, frame, *cells]
    dish = moved(lathe(_DISH, look.CREAM, 24), (0.0, 0.0, 0.25))
    nozzle = moved(frustum(0.14, 0.07, 0.15, look.DARK, 20), (0.0, 0.0, -0.39))
    lamp = moved(cylinder(0.07, 0.06, look.RED, 16), (0.0, 0.33, 0.0), TO_Y)
    return join(body, *wings, dish, nozzle, lamp)


@functools.cache
def graticule() -> Mesh:
    """Equator and two meridians of the unit sphere, thin."""
    angle = np.linspace(0.0, 2.0 * math.pi, 60, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=-1)
    hoop = loop(circle, 0.004, look.LIGHT, 3)
    return join(hoop, moved(hoop, rotation=TO_X), moved(hoop, rotation=TO_Y))


@functools.cache
def spin_arrow() -> Mesh:
    """Arrow of length 1 along z: an angular velocity that is to be reached."""
    profile = [(0.0, 0.0), (0.035, 0.0), (0.035, 0.84), (0.085, 0.84), (0.0, 1.0)]
    return lathe(profile, look.GREEN, 20)


_ENDS = [look.LIGHT, look.STEEL]
_DISH = [(0.0, 0.0), (0.03, 0.0), (0.05, 0.08), (0.22, 0.18), (0.21, 0.19), (0.0, 0.09)]


def _rod(length: float, radius: float, color: Color) -> Mesh:
    """Round bar from the origin along z, its end rounded."""
    edge = 0.25 * radius
    profile = [(0.0, 0.0), (radius, 0.0), (radius, length - edge), (radius - edge, length)]
    return lathe([*profile, (0.0, length)], color, 24)


def _strings() -> list[Mesh]:
    """Strings of the racket, in the ellipse of its head."""
    strings = []
    for k in range(-4, 5):
        x = 0.1 * k
        y = 0.4 * math.sqrt(1.0 - (x / 0.5) ** 2)
        strings.append(tube([(0.45 + x, -y, 0.0), (0.45 + x, y, 0.0)], 0.008, look.STEEL, 3))
    for k in range(-3, 4):
        y = 0.1 * k
        x = 0.5 * math.sqrt(1.0 - (y / 0.4) ** 2)
        strings.append(tube([(0.45 - x, y, 0.0), (0.45 + x, y, 0.0)], 0.008, look.STEEL, 3))
    return strings


# View of a system that has none of its own.

_MOST = 8  # lines of state


class GenericView(SystemView):
    """A box with the attitude of a state that has one, and the state in words."""

    def parts(self) -> dict[str, Part]:
        """A box, where there is an attitude."""
        return {"body": Part(brick())} if "q" in self.system.components else {}

    def camera(self) -> Camera:
        """The box."""
        return Camera(distance=5.0)

    def poses(self, moment: Moment) -> dict[str, Pose]:
        """The box, with three different sides."""
        part = self.system.components.get("q")
        return {} if part is None else {"body": Pose(q=moment.y[part], scale=(1.6, 1.1, 0.6))}

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """The entries of the state."""
        part = self.system.components.get("q", slice(0, 0))
        entries = list(zip(self.system.state_entries, moment.y, strict=True))
        del entries[part]
        return tuple(f"{name} {value:.3f}" for name, value in entries[:_MOST])


# What the views of rolling balls share: ball, its path on the plane and on the ball itself.

OUTSIDE = 1.02  # distance of the path on the ball from its centre [radii]: chords stay outside


class BallView(SystemView):
    """A ball with octants in eight colours, the path of its contact, and the input."""

    @property
    def radius(self) -> float:
        """Radius of the ball [m]."""
        return float(self.system.radius)

    @property
    def strongest(self) -> float:
        """Input that is drawn 1.2 radii long."""
        return 1.0

    def centre(self, moment: Moment) -> Array:
        """Centre of the ball in the world [m], shape (3,)."""
        return np.append(self.system.accessors["position"](moment.y), self.radius)

    def normal(self, moment: Moment) -> Array:
        """Normal of the plane in the world, shape (3,)."""
        return np.array([0.0, 0.0, 1.0])

    def push(self, moment: Moment) -> Array:
        """Input in world axes, shape (3,)."""
        return np.append(moment.u[:2], 0.0)

    def parts(self) -> dict[str, Part]:
        """The ball."""
        return {"ball": Part(solids.octant_ball())}

    def vectors(self) -> dict[str, Arrow]:
        """The input."""
        return {"input": Arrow(look.INPUT, 0.12 * self.radius, "velocity")}

    def traces(self) -> dict[str, Trace]:
        """Path of the contact on the plane, and on the ball (in radii, as its mesh)."""
        return {
            "path": Trace(look.PATH, 0.06 * self.radius),
            "on_ball": Trace(look.PATH, 0.05, part="ball"),
        }

    def floor(self) -> Floor | None:
        """Chequered, a metre a cell."""
        return Floor(0.0, 40.0, 1.0)

    def ball_pose(self, moment: Moment) -> Pose:
        """Pose of the ball."""
        q = self.system.accessors["q"](moment.y)
        return Pose(self.centre(moment), q, (self.radius,) * 3)

    def poses(self, moment: Moment) -> dict[str, Pose]:
        """The ball."""
        return {"ball": self.ball_pose(moment)}

    def arrows(self, moment: Moment) -> Arrows:
        """The input, from the side of the ball to which it points."""
        push = self.push(moment)
        arrow = scaled(push, 1.2 * self.radius / self.strongest, 1.5 * self.radius)
        length = float(np.linalg.norm(push))
        side = push / length if length > 0.0 else push
        return {"input": (self.centre(moment) + self.radius * side, arrow)}

    def points(self, moment: Moment) -> dict[str, npt.ArrayLike]:
        """Point of contact on the plane, and on the ball in radii."""
        down, q = -self.normal(moment), self.system.accessors["q"](moment.y)
        foot = self.centre(moment) + 0.985 * self.radius * down
        return {"path": foot, "on_ball": OUTSIDE * rotations.rotate_inverse(q, down)}

    def upright_goal(self) -> dict[str, Part]:
        """Ghost of the ball."""
        return {"goal": ghost(solids.octant_ball())}

    def off_goal(self, moment: Moment, position: npt.ArrayLike, q: npt.ArrayLike) -> str:
        """Distance and angle from a goal, as a reading."""
        read = self.system.accessors
        away = float(np.linalg.norm(read["position"](moment.y) - np.asarray(position)))
        angle = float(np.degrees(rotations.distance(read["q"](moment.y), q)))
        return f"{away:.2f} m and {angle:.0f} deg from the goal"


# Which view shows which task or system, by name: what is not shown is not imported.

_ROOM = "rigid_envs.systems."
_SYSTEMS = {
    "FreeBody": "free_body.view:FreeBodyView",
    "HeavyTop": "heavy_top.view:HeavyTopView",
    "RollingBall": "rolling_ball.view:RollingBallView",
    "DynamicBall": "dynamic_ball.view:DynamicBallView",
    "RollingDisk": "rolling_disk.view:RollingDiskView",
    "UprightCoin": "upright_coin.view:UprightCoinView",
    "Roller": "roller.view:RollerView",
}
_TASKS = {
    "IntermediateAxis": "free_body.view:IntermediateAxisView",
    "IntermediateAxisRandom": "free_body.view:IntermediateAxisRandomView",
    "IntermediateAxisSingle": "free_body.view:IntermediateAxisSingleView",
    "SpinCapture": "free_body.view:SpinCaptureView",
    "AxisFlip": "free_body.view:AxisFlipView",
    "Detumble": "free_body.view:DetumbleView",
    "Reorient": "free_body.view:ReorientView",
    "SleepingTop": "heavy_top.view:UprightTopView",
    "TopRandom": "heavy_top.view:UprightTopView",
    "PivotTop": "heavy_top.view:PivotTopView",
    "TopPrecession": "heavy_top.view:TopPrecessionView",
    "BallPark": "rolling_ball.view:BallParkView",
    "BallParkGoal": "rolling_ball.view:BallParkGoalView",
    "BallSteer": "rolling_ball.view:BallSteerView",
    "BallGrid": "rolling_ball.view:BallGridView",
    "BallParkDynamic": "dynamic_ball.view:BallParkDynamicView",
    "BallPlate": "dynamic_ball.view:BallPlateView",
    "DiskRoll": "rolling_disk.view:DiskRollView",
    "CoinPark": "upright_coin.view:CoinParkView",
    "RollPump": "roller.view:RollPumpView",
}
_VIEWS: dict[str, str | type[View]] = {
    **{f"rigid_envs.systems:{name}": _ROOM + view for name, view in _SYSTEMS.items()},
    **{f"rigid_envs.systems:{name}": _ROOM + view for name, view in _TASKS.items()},
}


def add_view(owner: str | type, view: str | type[View]) -> None:
    """Show a task, or every task of a system that has no view of its own, by a view.

    Args:
        owner: subclass of `Task` or of `System`, or its name "module:Class", where the module may
            also be a package that holds it. Its subclasses are shown likewise.
        view: subclass of `View`, or its name "module:Class". It replaces an earlier one.

    Raises:
        TypeError: a view that is no subclass of `View`.
        ValueError: a name without a colon.
    """
    for name, value in (("owner", owner), ("view", view)):
        if isinstance(value, str) and value.count(":") != 1:
            raise ValueError(f"{name} = {value!r}; expected 'module:Class'")
    if not isinstance(view, str) and not issubclass(view, View):
        raise TypeError(f"view = {view!r}; expected a subclass of rigid_envs.watch.scene.View")
    _VIEWS[owner if isinstance(owner, str) else next(_names(owner))] = view


def view_class(owner: type) -> type[View]:
    """The class of the view of a task or a system: its own, else of its system, else a generic one.

    Raises:
        ConfigError: a view was added by a name that does not exist.
    """
    for kind in (*owner.__mro__, *getattr(owner, "system_type", object).__mro__):
        for name in _names(kind):
            if name in _VIEWS:
                return _loaded(_VIEWS[name])
    return GenericView


def view_of(task: Any, parameters: Mapping[str, float]) -> View:
    """The view of an episode.

    Args:
        task: the task.
        parameters: parameters of the system by name, of the episode.
    """
    return view_class(type(task))(task, dict(parameters))


def _names(kind: type) -> Iterator[str]:
    """Names of a class, "module:Class", from its own module to the outermost package."""
    modules = [*itertools.accumulate(kind.__module__.split("."), "{}.{}".format)]
    return (f"{module}:{kind.__qualname__}" for module in reversed(modules))


def _loaded(view: str | type[View]) -> type[View]:
    found: type[View] = load(view) if isinstance(view, str) else view
    return found
