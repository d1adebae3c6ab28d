"""The ball of `dynamic_ball` on a plate that is level and at rest: a fraction of the work."""

from rigid_envs.kernels.algebra import Vector, attitude, compose
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.contact import on_ground
from rigid_envs.kernels.dynamic_ball import Input, Parameters, State, ball_rate, moving, pushed
from rigid_envs.kernels.elementary import fma
from rigid_envs.kernels.turns import half_turn

__all__ = ["LEVEL", "level_step"]


@scalar
def level_step(y: State, u: Input, p: Parameters, h: float) -> State:
    """Same result as `dynamic_ball.step`, bit for bit.

    Tilt and gravity are ignored and the spin is constant: a quarter of the work.
    """
    half = 0.5 * h
    push = (p.share * (u.FX * p.inverse_m), p.share * (u.FY * p.inverse_m))
    kappa = p.beta * p.turntable_rate * p.share
    vx, vy = pushed((y.VX, y.VY), push, kappa, 0.5 * half)
    X, Y = fma(half, vx, y.X), fma(half, vy, y.Y)
    a, b, c = ball_rate(moving(y, X, Y, vx, vy, y.spin), (0.0, 0.0, 0.0), p)
    q = compose(half_turn((half * a, half * b, half * c)), attitude(y))
    X, Y = fma(half, vx, X), fma(half, vy, Y)
    vx, vy = pushed((vx, vy), push, kappa, 0.5 * half)
    return State(*q, X, Y, vx, vy, y.spin, y.alpha_x, y.alpha_y, y.rate_x, y.rate_y)


@scalar
def level_ground_force(y: State, u: Input, p: Parameters) -> Vector:
    """Same as `dynamic_ball.ground_force`."""
    kappa = p.beta * p.turntable_rate * p.share
    x = p.share * (u.FX * p.inverse_m) - kappa * y.VY
    y_ = p.share * (u.FY * p.inverse_m) + kappa * y.VX
    return (p.m * x - u.FX, p.m * y_ - u.FY, p.m * p.g)


LEVEL = on_ground(level_ground_force, 3)
"""Contact with the plate."""
