"""Park a ball on a grid by quarter rolls: parallel parking in the discrete."""

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

__all__ = ["BallGrid"]

_QUARTER = 0.5 * math.pi
_FAR = 100.0  # cells; observed no further than this


class Action(NamedTuple):
    """The side to roll to: 0 is +x, 1 is +y, 2 is -x, 3 is -y."""

    side: float


class Terms(NamedTuple):
    """Reward terms of `BallGrid`."""

    moves: float
    home: float


class Constants(NamedTuple):
    """Rolling rate [rad/s], largest distance of a start from home [cells]."""

    roll_rate: float
    start_cells: float


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, tuple[()]]:
    """A cell of the square around home, and one of the 12 attitudes that can go home from there.

    A quarter roll is an odd permutation of the four diagonals of a cube, so the attitude is as odd
    as the number of cells to go.
    """
    n = 2.0 * c.start_cells + 1.0
    i = float(int(n * randoms.uniform(stream, 0))) - c.start_cells
    j = float(int(n * randoms.uniform(stream, 1))) - c.start_cells
    face, turns = int(6.0 * randoms.uniform(stream, 2)), int(4.0 * randoms.uniform(stream, 3))
    # Faces 0 .. 3 come to the top by so many quarter turns about x, 4 and 5 by one about y.
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
    """Home is the cell at the origin with the attitude upright: far from every other pose."""
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
    cost_unit: ClassVar = "distance rolled [m]"

    @property
    def roll_rate(self) -> float:
        """Rate of a quarter roll [rad/s]."""
        return _QUARTER / self.dt

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
        return self.roll_rate
