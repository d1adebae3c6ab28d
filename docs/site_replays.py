"""Interactive replays for the pages of the site: `python docs/site_replays.py FOLDER`.

Of every film of an environment and of every figure that moves, as FOLDER/NAME.html. They are made
anew where the library has changed.
"""

import sys
from pathlib import Path

from rigid_envs.base.files import write_atomic
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools.gallery import FIGURES
from rigid_envs.tools.motions import MOTIONS, motion_of
from rigid_envs.tools.pages.films import filmed, sources_hash
from rigid_envs.tools.pages.writing import film_of
from rigid_envs.watch.replays.page import write_html


def write_replays(folder: Path) -> None:
    """Write the replay of every film of our own, and of every figure that moves."""
    for env_id in ENVIRONMENTS:
        if env_id.startswith("RigidEnvs/"):
            file = folder / Path(film_of(env_id)).with_suffix(".html")
            write_html(file, [(replay, 0) for replay in filmed(env_id)])
    for name in MOTIONS:
        replay = motion_of(name)
        shown = [(replay, k) for k in range(len(replay.episodes))]
        write_html(folder / f"{name}.html", shown, FIGURES[name].title)


if __name__ == "__main__":
    target = Path(sys.argv[1])
    made_of, sources = target / "sources", sources_hash("**/*.py", "**/*.html", "**/*.safetensors")
    if not made_of.is_file() or made_of.read_text() != sources:
        write_replays(target)
        write_atomic(made_of, sources)
