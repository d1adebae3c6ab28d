"""Tasks of the rolling ball."""

from rigid_envs.systems.rolling_ball.tasks.ball_grid import BallGrid
from rigid_envs.systems.rolling_ball.tasks.ball_park import BallPark, BallParkRandom, BallReorient
from rigid_envs.systems.rolling_ball.tasks.ball_park_goal import BallParkGoal
from rigid_envs.systems.rolling_ball.tasks.ball_steer import BallSteer

__all__ = ["BallGrid", "BallPark", "BallParkGoal", "BallParkRandom", "BallReorient", "BallSteer"]
