"""Park a ball on a grid by quarter rolls: parking with discrete actions."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from rigid_envs.kernels import randoms
from rigid_envs.kernels.actions import keep
from rigid_envs.kernels.algebra import compose
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import select, sincos
from rigid_envs.kernels.episode import Episode, NoAuxiliary
from rigid_envs.kernels.rolling_ball import ROLLING_BALL, Input, Parameters, State
from rigid_envs.systems import RollingBall
from rigid_envs.tasks.base import Entry, Task
from rigid_envs.tasks.fields import Integer, Number, Range, physical, setting
from rigid_envs.tasks.reduced.ball_grid import CELL

__all__ = ["BallGrid"]

_QUARTER = 0.5 * math.pi
_FAR = 100.0  # cells; bound of the observed position


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
    return min(max(scale * y.X, -_FAR), _FAR), min(max(scale * y.Y, -_FAR), _FAR)


@dataclass(frozen=True)
class BallGrid(Task):
    """Bring a ball to a goal cell and attitude by quarter rolls on a grid.

    The ball rolls like a die: a quarter turn in one of four directions takes it to the adjacent
    square cell, of side pi radius / 2. The goal, home, is the cell at the origin with the ball
    upright, q = 1.

    Why it is hard: it is parallel parking. The direct path leads to the right cell with the wrong
    attitude, and no move changes the attitude alone.

    With `action_delay` the first rolls of an episode are in the direction +x. `action_noise` is 0:
    Gaussian noise is not defined for discrete actions.

    Physics:
        A quarter roll, ``v = omega x radius e_z`` held for a quarter turn, is an odd permutation of
        the four diagonals of a cube: after an even number of moves the attitude is one of the 12
        even ones, after an odd number one of the 12 odd ones. The other 12 of the 24 attitudes
        cannot be reached in that cell. The opposite move undoes a move. A move to +x turns by pi /
        2 about +y, a move to +y about -x.

    Rewards:
        ``moves`` = -1 in every step, ``home`` = 1 in the step that reaches home: the shortest path
        has the largest return.

    Starting State:
        A cell within `start_cells` of home along each axis, and one of the 12 attitudes from which
        home can be reached, all equally likely. Home itself is among them.

    Episode End:
        The episode terminates at home, which is the success (`info["is_success"]`): ``|(X, Y)| <
        radius / 2`` and ``w^2 > 0.95`` after a step.

    Reference:
        `breadth_first` is breadth-first search from home, which is exact. From home itself the
        shortest path has 2 moves, out and back.

        Exact: 12 of the 24 attitudes can be reached in each cell, the same 12 in all cells of one
        chessboard colour, and the other 12 in the cells of the other colour.

    Version History:
        v0: first version.

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
        return (
            Entry("X / cell", "1", "world", -_FAR, _FAR),
            Entry("Y / cell", "1", "world", -_FAR, _FAR),
        )

    def largest_rate(self, duration: float) -> float:
        """A quarter turn in one step."""
        return self.roll_rate
