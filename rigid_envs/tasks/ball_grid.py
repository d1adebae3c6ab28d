"""Park a ball on a grid by quarter rolls: parallel parking in the discrete."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from rigid_envs.kernels import episode, randoms, rolling_ball
from rigid_envs.kernels.actions import keep
from rigid_envs.kernels.algebra import Row, compose
from rigid_envs.kernels.compiler import kernel, scalar
from rigid_envs.kernels.elementary import select, sincos
from rigid_envs.kernels.layout import Memory, Shapes
from rigid_envs.systems import RollingBall
from rigid_envs.tasks.base import Array, Entry, Task
from rigid_envs.tasks.fields import Integer, Number, Range, physical, setting

__all__ = ["BallGrid"]

_QUARTER = 0.5 * math.pi
_FAR = 100.0  # cells; observed no further than this
_RATE, _CELLS = range(2, 4)  # constants after the two weights


@scalar
def start(stream: randoms.Stream, p: Row, c: Row) -> tuple[Row, Row]:
    """A cell of the square around home, and one of the 12 attitudes that can go home from there.

    A quarter roll is an odd permutation of the four diagonals of a cube, so the attitude is as odd
    as the number of cells to go.
    """
    n = 2.0 * c[_CELLS] + 1.0
    i = float(int(n * randoms.uniform(stream, 0))) - c[_CELLS]
    j = float(int(n * randoms.uniform(stream, 1))) - c[_CELLS]
    face, turns = int(6.0 * randoms.uniform(stream, 2)), int(4.0 * randoms.uniform(stream, 3))
    # Faces 0 .. 3 come to the top by so many quarter turns about x, 4 and 5 by one about y.
    oddness = turns + int(abs(i) + abs(j)) + (1 if face == 4 else face)
    sine_z, cosine_z = sincos(0.5 * _QUARTER * (turns + oddness % 2))
    sideways = face >= 4
    sine, cosine = sincos(0.5 * _QUARTER * (2.0 * face - 9.0 if sideways else float(face)))
    tipped = (cosine, 0.0 if sideways else sine, sine if sideways else 0.0, 0.0)
    q = compose((cosine_z, 0.0, 0.0, sine_z), tipped)
    return (*q, i * _QUARTER * p[0], j * _QUARTER * p[0]), ()


@scalar
def actuate(a: Row, y: Row, memo: Row, p: Row, c: Row) -> tuple[Row, Row]:
    """A quarter roll to +x, +y, -x or -y."""
    speed = c[_RATE] * p[0] * (1.0 if a[0] < 1.5 else -1.0)
    along_x = (a[0] == 0.0) | (a[0] == 2.0)
    return y, (select(along_x, speed, 0.0), select(along_x, 0.0, speed), 0.0)


@scalar
def judge(
    y: Row, u: Row, memo: Row, p: Row, c: Row, dt: float
) -> tuple[Row, Row, float, bool, bool]:
    """Home is the cell at the origin with the attitude upright: far from every other pose."""
    x, y_ = y[4] * p[1], y[5] * p[1]
    home = (x * x + y_ * y_ < 0.25) & (y[0] * y[0] > 0.95)
    rolled = dt * math.sqrt(u[0] * u[0] + u[1] * u[1])
    return memo, (-1.0, select(home, 1.0, 0.0)), rolled, home, home


@scalar
def observe(y: Row, memo: Row, p: Row, c: Row) -> Row:
    """Position in cells."""
    scale = p[1] / _QUARTER
    return (min(max(scale * y[4], -_FAR), _FAR), min(max(scale * y[5], -_FAR), _FAR))


SHAPES = Shapes(*rolling_ball.SHAPES, (1.0,), (), (0.0,), (0.0,) * 4)


@kernel
def step(memory: Memory, first_block: int, last_block: int) -> int:
    """`episode.step` of this task."""
    return episode.step(
        rolling_ball.step,
        rolling_ball.restore,
        rolling_ball.WEIGHTS,
        keep,
        actuate,
        judge,
        observe,
        SHAPES,
        memory,
        first_block,
        last_block,
    )


@kernel
def reset(memory: Memory, rows: Array, mode: int) -> None:
    """`episode.reset` of this task."""
    episode.reset(rolling_ball.derive, start, observe, SHAPES, memory, rows, mode)


@dataclass(frozen=True)
class BallGrid(Task):
    """Bring a ball home by quarter rolls on a grid: cell and attitude.

    The ball rolls like a die, a quarter turn to one of four sides, onto the next of the square
    cells of side pi radius / 2. Home is the cell at the origin, the ball upright, q = 1.

    Why it is hard: it is parallel parking. The straight way leads to the right cell with the wrong
    side up, and no move changes the attitude alone.

    With `action_delay` the first rolls of an episode are those to +x. There is no `action_noise`:
    a choice with noise on it is no choice.

    Physics:
        A quarter roll, ``v = omega x radius e_z`` held for a quarter turn, is an odd permutation of
        the four diagonals of a cube: after an even number of cells the attitude is one of the 12
        even ones, after an odd number one of the 12 odd ones, and the other 12 of the 24 cannot be
        reached there. A move is undone by the opposite one.

    Rewards:
        ``moves`` = -1 in every step, ``home`` = 1 in the step that comes home: the shortest way
        pays best.

    Starting State:
        A cell of the square within `start_cells` of home along each axis, and one of the 12
        attitudes that can go home from there, all equally likely; home itself is among them.

    Episode End:
        The episode terminates at home, which is the success (`info["is_success"]`).

    Reference:
        `breadth_first` is breadth-first search from home, which is exact: from home itself the
        shortest way is 2 moves, out and back.

        Exact: 12 of the 24 attitudes can be reached in each cell, the same in all cells of one
        colour of a chessboard, and the other 12 in those of the other.

    Version History:
        v0: first version.

    Source:
        Hammersley 1983, "Oxford commemoration ball", LMS Lecture Notes 79.
    """

    dt: float = setting(1.0, Number("time of a quarter roll, without effect", "s", 1.0, 1.0))
    action_noise: float = setting(0.0, Number("choices take no noise", "1", 0.0, 0.0))
    radius: Range = physical(1.0, "radius of the ball", "m")
    start_cells: int = setting(4, Integer("largest distance from home, in cells", 0, 50))
    weight_moves: float = setting(0.05, Number("weight of -1 per step", "1", -1e3, 1e3))
    weight_home: float = setting(1.0, Number("weight of coming home", "1", -1e3, 1e3))

    system_type: ClassVar = RollingBall
    shapes: ClassVar = SHAPES
    step: ClassVar = staticmethod(step)
    reset: ClassVar = staticmethod(reset)
    n_choices: ClassVar = 4
    terms: ClassVar = ("moves", "home")
    cost_unit: ClassVar = "distance rolled [m]"

    def constants(self) -> tuple[float, ...]:
        """Weights, rolling rate, start square."""
        return (self.weight_moves, self.weight_home, _QUARTER / self.dt, float(self.start_cells))

    def actions(self) -> tuple[Entry, ...]:
        """The side to roll to."""
        return (Entry("side", "1", "0: +x, 1: +y, 2: -x, 3: -y", 0.0, 3.0),)

    def features(self) -> tuple[Entry, ...]:
        """Position in cells."""
        return (
            Entry("X / cell", "1", "world", -_FAR, _FAR),
            Entry("Y / cell", "1", "world", -_FAR, _FAR),
        )

    def largest_rate(self) -> float:
        """A quarter turn in one step."""
        return _QUARTER / self.dt
