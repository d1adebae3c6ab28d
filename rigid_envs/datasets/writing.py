"""Data sets written: collected, described, and put in place as a whole."""

from __future__ import annotations

import contextlib
import os
import re
import shlex
import tempfile
import warnings
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import gymnasium as gym

import rigid_envs
from rigid_envs.catalogue import SEEN, changed, checked_id, task_of
from rigid_envs.checks import integer
from rigid_envs.datasets.behaviour import Behaviour, behaviour
from rigid_envs.datasets.collecting import collect
from rigid_envs.datasets.database import check_name, database, minari_of
from rigid_envs.errors import ConfigError
from rigid_envs.provenance import provenance
from rigid_envs.registry import ENVIRONMENTS
from rigid_envs.scores import best_known
from rigid_envs.scores.evaluation import make_rows
from rigid_envs.scores.starts import N_STARTS, row_seeds

__all__ = ["write"]

_ROWS = 256  # episodes that are played together
FORMAT = "rigid-envs data set 1"


def write(
    env_id: str,
    policy: str,
    episodes: int = 100,
    *,
    seed: int = 0,
    name: str | None = None,
    folder: Path | None = None,
    overwrite: bool = False,
    config: Mapping[str, Any] | None = None,
    tell: Callable[[str], None] = lambda text: None,
) -> str:
    """Write a data set of episodes, which `minari.load_dataset` loads.

    It is put in place when it is complete: nothing of it is there before, whatever stops the work.

    Args:
        env_id: A registered id, also in short.
        policy: Who acts; see `behaviour`.
        episodes: Number of episodes. Their starts are none of the evaluation set.
        seed: Seed that the starts are spawned from.
        name: Of the data set, "namespace/name-v0"; None for "rigid-envs/BallPark/<policy>-v0".
        folder: Of all data sets; None for Minari's: MINARI_DATASETS_PATH, or ~/.minari/datasets.
        overwrite: Whether a data set of the name may be replaced.
        config: Settings of the environment.
        tell: Called with a line about how far it is.

    Returns:
        The name.

    Raises:
        ConfigError: What cannot be, or a data set that is there already.
        DependencyNotInstalled: The extra `dataset` is missing.
    """
    minari_of()
    env_id, seed = checked_id(env_id), integer(seed, "seed", 0)
    seeds = row_seeds(seed, integer(episodes, "episodes", 1), "train")
    acting = behaviour(env_id, policy, config or {}, seed)
    chosen = _default_name(env_id, acting) if name is None else name
    words = ["rigid-envs", "dataset", env_id, "--policy", policy, "--name", chosen]
    words += ["--episodes", str(episodes), "--seed", str(seed)]
    words += [word for key, value in (config or {}).items() for word in (f"--{key}", str(value))]
    origin = {"seed": seed, "command": shlex.join(words)}
    with database(folder) as root, _in_place(root, chosen, overwrite):
        _fill(chosen, env_id, acting, seeds, origin, tell)
    return chosen


@contextlib.contextmanager
def _in_place(root: Path, name: str, overwrite: bool) -> Iterator[None]:
    """Let a data set be made in a hidden folder, and move it to where it belongs."""
    check_name(name)
    target = root / name
    if target.exists() and not (overwrite and (target / "data").is_dir()):
        raise ConfigError(f"name = {name!r}; expected a new one, or --overwrite: {target} is there")
    root.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".draft-", dir=root) as draft:
        with database(Path(draft)):
            yield
        target.parent.mkdir(parents=True, exist_ok=True)
        for file in Path(draft).rglob("namespace_metadata.json"):  # which Minari has made
            if not (known := root / file.relative_to(draft)).exists():
                os.rename(file, known)
        if target.exists():
            os.rename(target, Path(draft) / "old")
        os.rename(Path(draft) / name, target)


def _fill(
    name: str,
    env_id: str,
    acting: Behaviour,
    seeds: list[int],
    origin: Mapping[str, Any],
    tell: Callable[[str], None],
) -> None:
    """Play the episodes and give them to Minari, some at a time."""
    minari, dataset = minari_of(), None
    for k in range(0, len(seeds), _ROWS):
        tell(f"{k} of {len(seeds)} episodes")
        envs = make_rows(env_id, len(seeds[k : k + _ROWS]), acting.settings)
        played = collect(acting.policy, envs, seeds[k : k + _ROWS])
        envs.close()
        buffers = [minari.data_collector.EpisodeBuffer(**episode._asdict()) for episode in played]
        if dataset is None:
            dataset = _begun(name, env_id, acting, buffers)
        else:
            dataset.update_dataset_from_buffer(buffers)
    assert dataset is not None
    dataset.storage.update_metadata(
        {
            "rigid_envs": {
                "format": FORMAT,
                "env_id": env_id,
                "env_kwargs": acting.settings,
                "policy": acting.origin,
                **origin,
                **provenance(),
            }
        }
    )


def _begun(name: str, env_id: str, acting: Behaviour, buffers: list[Any]) -> Any:
    """A data set of its first episodes."""
    env = gym.make(env_id, **acting.settings)
    summary = (type(task_of(env_id)).__doc__ or "").partition("\n")[0]
    with warnings.catch_warnings():  # that it has no author, no e-mail, no link
        warnings.simplefilter("ignore", UserWarning)
        dataset = minari_of().create_dataset_from_buffers(
            name,
            buffers,
            env=env,
            algorithm_name=acting.policy.name,
            description=f"{env_id}, played by {acting.policy.name}: {summary}",
            requirements=[f"rigid-envs=={rigid_envs.__version__}"],
            **_scores(env_id, acting.settings),
        )
    env.close()
    return dataset


def _scores(env_id: str, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Mean returns of the random policy and of the reference, which Minari's score is between."""
    known = best_known(env_id)
    free = all(key in SEEN for key in changed(env_id, task_of(env_id, settings)))
    names = list(ENVIRONMENTS[env_id].controllers)
    if known is None or not free or not names:
        return {}
    low, high = (known.policies[each]["return_mean"] for each in ("random", names[0]))
    return {"ref_min_score": low, "ref_max_score": high, "num_episodes_average_score": N_STARTS}


def _default_name(env_id: str, acting: Behaviour) -> str:
    """Such as "rigid-envs/BallPark/random-v0"."""
    bare = env_id.rpartition("-v")[0] or env_id
    label = re.sub(r"\W+", "-", acting.policy.name)
    return f"{bare.replace('RigidEnvs/', 'rigid-envs/')}/{label}-v0"
