"""Tasks of the coin."""

from rigid_envs.systems.upright_coin.tasks.coin_park import CoinPark

__all__ = ["CoinPark"]
