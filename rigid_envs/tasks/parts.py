"""Compiled parts that the tasks of several systems have."""

from typing import Any, NamedTuple

from rigid_envs.engine import randoms
from rigid_envs.engine.algebra import Quaternion, Row, Vector, compose, matrix
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import select, sincos
from rigid_envs.engine.episode import single

Pair = tuple[float, float]


class Held(NamedTuple):
    """Number of steps for which the state has been within the tolerance."""

    held: float = 0.0


@scalar
def held_for(is_near: bool, aux: Any, c: Any, dt: float) -> tuple[float, bool]:
    """Steps for which the state has been within the tolerance, and whether they are enough."""
    held = select(is_near, aux.held + 1.0, 0.0)
    return held, held * dt >= c.hold * (1.0 - 1e-9)


@scalar
def limited(v: Vector, bound: float) -> Vector:
    """A vector whose entries are clipped to [-bound, bound]."""
    return (
        min(max(v[0], -bound), bound),
        min(max(v[1], -bound), bound),
        min(max(v[2], -bound), bound),
    )


@scalar
def limited_pair(v: Pair, bound: float) -> Pair:
    """Two numbers, each clipped to [-bound, bound]."""
    return min(max(v[0], -bound), bound), min(max(v[1], -bound), bound)


@scalar
def single_matrix(q: Quaternion) -> Row:
    """The nine entries of R, rounded to float32 as in the observation."""
    r = matrix(q)
    return (
        single(r[0]),
        single(r[1]),
        single(r[2]),
        single(r[3]),
        single(r[4]),
        single(r[5]),
        single(r[6]),
        single(r[7]),
        single(r[8]),
    )


@scalar
def tilted(stream: randoms.Stream, tilt: float, azimuth_at: int, phase_at: int) -> Quaternion:
    """Attitude with the given tilt [rad], azimuth and phase uniform, drawn at two places."""
    azimuth, phase = randoms.direction(stream, azimuth_at), randoms.direction(stream, phase_at)
    sine, cosine = sincos(0.5 * tilt)
    axis = (cosine, sine * azimuth[0], sine * azimuth[1], 0.0)
    return compose(axis, (phase[0], 0.0, 0.0, phase[1]))
