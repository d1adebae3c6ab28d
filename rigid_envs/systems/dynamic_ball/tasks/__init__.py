"""Tasks of the ball with inertia."""

from rigid_envs.systems.dynamic_ball.tasks.ball_park_dynamic import BallParkDynamic
from rigid_envs.systems.dynamic_ball.tasks.ball_plate import BallPlate

__all__ = ["BallParkDynamic", "BallPlate"]
