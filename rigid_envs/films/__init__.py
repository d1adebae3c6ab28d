"""Films: pictures of episodes, and files of them that browsers and viewers show."""

from rigid_envs.films.episodes import Look, episode_pictures, pictures_per_second
from rigid_envs.films.film import SUFFIXES, Film, checked_film, write_film
from rigid_envs.films.playing import Played, figure, play_episode

__all__ = [
    "SUFFIXES",
    "Film",
    "Look",
    "Played",
    "checked_film",
    "episode_pictures",
    "figure",
    "pictures_per_second",
    "play_episode",
    "write_film",
]
