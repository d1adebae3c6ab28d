"""Roll a ball home by quarter turns."""

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from rigid_envs.base.settings import Integer, Number, setting
from rigid_envs.engine import randoms
from rigid_envs.engine.algebra import Quaternion, Row, attitude, compose, matrix
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import fma, select, sincos
from rigid_envs.engine.episode import Episode, NoAuxiliary, keep
from rigid_envs.systems.rolling_ball.dynamics import ROLLING_BALL, Input, Parameters, State
from rigid_envs.systems.rolling_ball.symmetry import GRID_REFLECTION, QUARTER_TURN
from rigid_envs.systems.rolling_ball.system import RollingBall
from rigid_envs.tasks.fields import Entry, Range, physical
from rigid_envs.tasks.parts import limited_pair
from rigid_envs.tasks.reduction import Reduction
from rigid_envs.tasks.task import Task

# Reduced coordinates of a ball on a grid: its cell in one eighth of the plane.

_FAR = 100.0  # cells; bound of the observed position
# Half the number of a pose: the entries of R are digits to the base 3, above them the coordinates.
_J = 0.5 * 3.0**9
_I = _J * (2.0 * _FAR + 1.0)


class Image(NamedTuple):
    """An element of D4: signs of x and y, then whether they are exchanged."""

    sign_x: float
    sign_y: float
    swapped: float


class Sides(NamedTuple):
    """Sides 0 (+x), 1 (+y), 2, 3 of an image: the first one in the world, and their sense there."""

    first: float
    sense: float


@scalar
def whole(x: float) -> float:
    """The nearest whole number: on the grid, what is seen then is exact."""
    return float(np.floor(x + 0.5))


@scalar
def cell(y: Any, p: Any) -> tuple[float, float]:
    """Position in cells."""
    scale = p.inverse_radius * (2.0 / math.pi)
    return scale * y.X, scale * y.Y


@scalar
def largest(one: float, x: float, y: float, xy: float) -> tuple[float, float, float]:
    """Largest ``one + sign_x x + sign_y y + sign_x sign_y xy``, and these signs."""
    with_x, without = y + xy, y - xy  # what sign_y multiplies
    here, there = x + abs(with_x), abs(without) - x
    flipped = there > here
    sign_y = select(select(flipped, without, with_x) < 0.0, -1.0, 1.0)
    return one + max(here, there), select(flipped, -1.0, 1.0), sign_y


@scalar
def image_of(i: float, j: float, q: Quaternion) -> Image:
    """The image with the largest number: i >= j >= 0, then that of R.

    R11 ... R33 have the weights 2187, 6561, 81; 1, 729, 9; 27, 3, 243. What no symmetry changes
    is left out: R33 and R11 + R22. On the grid numbers differ by 1 or more, so that roundings of
    the pose do not matter, except where a symmetry leaves the pose unchanged: then there are
    several such images, which look the same.
    """
    w, x, y, z = q
    xz, yz = 6.0 * fma(2.0 * x, z, w * y), 6.0 * fma(2.0 * y, z, -w * x)
    xy, wz, unlike = 6562.0 * x * y, 6560.0 * w * z, 729.0 * fma(x, x, -y * y)
    as_is, ax, ay = largest(unlike, fma(9.0, xz, _I * i), fma(_J, j, yz), xy - wz)
    # signs of the exchanged coordinates, those of y and x
    swapped, by, bx = largest(-unlike, fma(9.0, yz, _I * j), fma(_J, i, xz), xy + wz)
    better = swapped > as_is
    return Image(
        sign_x=select(better, bx, ax),
        sign_y=select(better, by, ay),
        swapped=select(better, 1.0, 0.0),
    )


@scalar
def turned(q: Quaternion, image: Image) -> Quaternion:
    """Attitude of the image, S R S^T: the axis turns as an axial vector."""
    w, x, y, z = q
    swap = image.swapped > 0.0
    # S times its determinant
    sx, sy = image.sign_x, select(swap, -image.sign_y, image.sign_y)
    x, y = sy * x, select(swap, -sx, sx) * y
    return w, select(swap, y, x), select(swap, x, y), sx * sy * z


@scalar
def observe_reduced(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Cell and attitude of the image with 0 <= j <= i, in whole numbers."""
    (i, j), q = cell(y, p), attitude(y)
    r11, r12, r13, r21, r22, r23, r31, r32, r33 = matrix(turned(q, image_of(i, j, q)))
    i, j = whole(min(abs(i), _FAR)), whole(min(abs(j), _FAR))
    return (
        max(i, j),
        min(i, j),
        whole(r11),
        whole(r12),
        whole(r13),
        whole(r21),
        whole(r22),
        whole(r23),
        whole(r31),
        whole(r32),
        whole(r33),
    )


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> Sides:
    """The sides of the image that is seen."""
    i, j = cell(y, p)
    image = image_of(i, j, attitude(y))
    swap = image.swapped > 0.0
    sense = image.sign_x * image.sign_y
    return Sides(
        first=select(swap, 2.0 - image.sign_y, 1.0 - image.sign_x),
        sense=select(swap, -sense, sense),
    )


@scalar
def turn(a: Any, frame: Any) -> tuple[float]:
    """The side of the world that a side of the image is."""
    side = fma(frame.sense, a[0], frame.first)
    return (fma(-4.0, float(np.floor(0.25 * side)), side),)


CELL = Reduction(
    group="D4",
    frame=(
        "the one of eight images in which the cell has $0 <= j <= i$, and on its edges the one "
        "with the largest entries of $R$."
    ),
    symmetries=(QUARTER_TURN, GRID_REFLECTION),
    features=(
        Entry("i", "1", "cells, the larger", 0.0, _FAR),
        Entry("j", "1", "cells, the smaller", 0.0, _FAR),
        *(Entry(f"R{m}{n}", "1", "body to reduced", -1.0, 1.0) for m in "123" for n in "123"),
    ),
    observe=observe_reduced,
    Frame=Sides,
    frame_of=frame_of,
    turn=turn,
    formulas="""
        An image is that by a symmetry $S$ of the square, one of $diag(+-1, +-1)$ with or without
        exchange of $x$ and $y$: the cell $S (i, j)$, the attitude $S R S^T$ with $S$ on the first
        two axes, and a direction $d$ of a roll becomes $S d$. The image has the largest $i$, then
        the largest $j$, then of $R$ the largest $R12$, $R11$, $R22$, $R13$, $R31$, $R23$, $R32$,
        $R21$, compared in this order. If several images are equal, any of them is taken. Cell and
        $R$ are rounded to whole numbers.
    """,
)
"""Reduction of `BallGrid`: D4, quarter turns about the vertical through home and reflections."""


# Park a ball on a grid by quarter rolls: parking with discrete actions.

_QUARTER = 0.5 * math.pi


class Action(NamedTuple):
    """Direction of the quarter roll: 0 is +x, 1 is +y, 2 is -x, 3 is -y."""

    side: float


class Terms(NamedTuple):
    """Reward terms of `BallGrid`."""

    moves: float
    home: float


class Constants(NamedTuple):
    """Rolling rate [rad/s], largest initial offset along each axis [cells]."""

    roll_rate: float
    start_cells: float


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, tuple[()]]:
    """Uniform cell of a square about the origin; uniform attitude among the 12 solvable ones.

    A quarter roll is an odd permutation of the four diagonals of a cube. So the parity of the
    attitude must equal the parity of the number of cells to the origin.
    """
    n = 2.0 * c.start_cells + 1.0
    i = float(int(n * randoms.uniform(stream, 0))) - c.start_cells
    j = float(int(n * randoms.uniform(stream, 1))) - c.start_cells
    face, turns = int(6.0 * randoms.uniform(stream, 2)), int(4.0 * randoms.uniform(stream, 3))
    # face 0 .. 3: number of quarter turns about x; faces 4 and 5: one turn about y, either sense
    oddness = turns + int(abs(i) + abs(j)) + (1 if face == 4 else face)
    sine_z, cosine_z = sincos(0.5 * _QUARTER * (turns + oddness % 2))
    sideways = face >= 4
    sine, cosine = sincos(0.5 * _QUARTER * (2.0 * face - 9.0 if sideways else float(face)))
    tipped = (cosine, 0.0 if sideways else sine, sine if sideways else 0.0, 0.0)
    q = compose((cosine_z, 0.0, 0.0, sine_z), tipped)
    return State(*q, i * _QUARTER * p.radius, j * _QUARTER * p.radius), ()


@scalar
def actuate(
    a: Action, y: State, aux: NoAuxiliary, p: Parameters, c: Constants
) -> tuple[State, Input]:
    """A quarter roll to +x, +y, -x or -y."""
    speed = c.roll_rate * p.radius * (1.0 if a.side < 1.5 else -1.0)
    along_x = (a.side == 0.0) | (a.side == 2.0)
    return y, Input(VX=select(along_x, speed, 0.0), VY=select(along_x, 0.0, speed), spin=0.0)


@scalar
def outcome(
    y: State, u: Input, aux: NoAuxiliary, p: Parameters, c: Constants, dt: float
) -> tuple[NoAuxiliary, Terms, float, bool, bool]:
    """Reward terms; the goal is the cell at the origin with the attitude upright."""
    X, Y = y.X * p.inverse_radius, y.Y * p.inverse_radius
    home = (X * X + Y * Y < 0.25) & (y.w * y.w > 0.95)
    rolled = dt * math.sqrt(u.VX * u.VX + u.VY * u.VY)
    return aux, Terms(moves=-1.0, home=select(home, 1.0, 0.0)), rolled, home, home


@scalar
def observe(y: State, aux: NoAuxiliary, p: Parameters, c: Constants) -> tuple[float, float]:
    """Position in cells."""
    scale = p.inverse_radius / _QUARTER
    return limited_pair((scale * y.X, scale * y.Y), _FAR)


@dataclass(frozen=True)
class BallGrid(Task):
    """Bring a ball to a goal cell and attitude by quarter rolls on a grid.

    The ball rolls like a die: a quarter turn in one of four directions takes it to the adjacent
    square cell, of side $pi radius / 2$. The goal, home, is the cell at the origin with the ball
    upright, $q = 1$.

    Why it is hard: it is parallel parking. The direct path leads to the right cell with the wrong
    attitude, and no move changes the attitude alone.

    With `action_delay` the first rolls of an episode are in the direction $+x$. `action_noise` is
    0: Gaussian noise is not defined for discrete actions.

    Physics:
        A quarter roll is an odd permutation of the four diagonals of a cube: after an even number
        of moves the attitude is one of the 12 even ones, after an odd number one of the 12 odd
        ones. The other 12 of the 24 attitudes cannot be reached in that cell. The opposite move
        undoes a move. A move to $+x$ turns by $pi / 2$ about $+y$, a move to $+y$ about $-x$.

    Rewards:
        `moves` = -1 in every step, `home` = 1 in the step that reaches home: the shortest path has
        the largest return.

    Starting State:
        A cell within `start_cells` of home along each axis, and one of the 12 attitudes from which
        home can be reached, all equally likely. Home itself is among them.

    Episode End:
        The episode terminates at home, which is the success (`info["is_success"]`): $|(X, Y)| <
        radius / 2$ and $w^2 > 0.95$ after a step.

    Reference:
        `breadth_first` is breadth-first search from home, which is exact. From home itself the
        shortest path has 2 moves, out and back.

        Exact: 12 of the 24 attitudes can be reached in each cell, the same 12 in all cells of one
        chessboard colour, and the other 12 in the cells of the other colour.

    Source:
        Hammersley 1983, "Oxford commemoration ball", LMS Lecture Notes 79.
    """

    dt: float = setting(1.0, Number("time of a quarter roll, without effect", "s", 1.0, 1.0))
    action_noise: float = setting(0.0, Number("no noise on discrete actions", "1", 0.0, 0.0))
    radius: Range = physical(1.0, "radius of the ball", "m")
    start_cells: int = setting(4, Integer("largest distance from home, in cells", 0, 50))
    weight_moves: float = setting(0.05, Number("weight of -1 per step", "1", -1e3, 1e3))
    weight_home: float = setting(1.0, Number("weight of reaching home", "1", -1e3, 1e3))

    system_type: ClassVar = RollingBall
    n_choices: ClassVar = 4
    episode: ClassVar = Episode(
        dynamics=ROLLING_BALL,
        Action=Action,
        Terms=Terms,
        Constants=Constants,
        start=start,
        clip=keep,
        actuate=actuate,
        outcome=outcome,
        observe=observe,
    )
    reduction: ClassVar = CELL
    cost_unit: ClassVar = "distance rolled [m]"

    @property
    def roll_rate(self) -> float:
        """Rate of a quarter roll [rad/s]."""
        return _QUARTER / self.dt

    def actions(self) -> tuple[Entry, ...]:
        """Direction of the quarter roll."""
        return (Entry("side", "1", "0: +x, 1: +y, 2: -x, 3: -y", 0.0, 3.0),)

    def features(self) -> tuple[Entry, ...]:
        """Position in cells."""
        return tuple(Entry(f"{k} / cell", "1", "world", -_FAR, _FAR) for k in "XY")

    def largest_rate(self, duration: float) -> float:
        """A quarter turn in one step."""
        return self.roll_rate
