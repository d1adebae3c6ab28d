"""Steer a body by hand, from the start that the reference controller is shown for beside it."""

from rigid_envs.play.game import Game, Rival
from rigid_envs.play.loop import play
from rigid_envs.play.manual import keys
from rigid_envs.play.steering import Steering, blended, steering_of

__all__ = ["Game", "Rival", "Steering", "blended", "keys", "play", "steering_of"]
