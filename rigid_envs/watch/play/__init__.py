"""Steer a body by hand, from the start that the reference controller is shown for beside it."""

from rigid_envs.watch.play.game import Game, Rival, play
from rigid_envs.watch.play.steering import Steering, blended, keys, steering_of

__all__ = ["Game", "Rival", "Steering", "blended", "keys", "play", "steering_of"]
