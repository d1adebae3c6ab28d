"""Episodes of policies as Minari data sets, and their check."""

import contextlib
import importlib
import os
import re
import shlex
import tempfile
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
from gymnasium.error import DependencyNotInstalled

import rigid_envs
from rigid_envs.base.checks import ConfigError, integer
from rigid_envs.base.files import DamagedFileError, file_digest
from rigid_envs.engine.compiler import kernel_hash
from rigid_envs.engine.provenance import provenance
from rigid_envs.envs.lookup import SEEN, changed, checked_id, id_in_file, task_of
from rigid_envs.envs.shells import RigidVectorEnv
from rigid_envs.envs.spaces import action_space
from rigid_envs.scores import policies
from rigid_envs.scores.best import best_known
from rigid_envs.scores.evaluation import make_rows
from rigid_envs.scores.references import reference
from rigid_envs.scores.starts import N_STARTS, rollout, row_seeds
from rigid_envs.scores.trained import is_trained, load, path_of
from rigid_envs.tasks.registry import ENVIRONMENTS

# Minari, and the folder where its data sets lie.

_PLACE = "MINARI_DATASETS_PATH"


def minari_of() -> Any:
    """The module `minari`, with what it stores files by.

    Raises:
        DependencyNotInstalled: it is missing; names the command that installs it.
    """
    try:
        import h5py  # noqa: F401
        import minari
        import PIL  # noqa: F401
    except ImportError as error:
        raise DependencyNotInstalled(
            f'data sets need Minari: pip install "rigid-envs[dataset]" ({error})'
        ) from error
    return minari


@contextlib.contextmanager
def database(folder: Path | None) -> Iterator[Path]:
    """The folder of all data sets, which Minari reads from the environment of the process.

    Args:
        folder: Takes its place meanwhile; None leaves it: MINARI_DATASETS_PATH, or
            ~/.minari/datasets.
    """
    before = os.environ.get(_PLACE)
    if folder is not None:
        os.environ[_PLACE] = str(folder)
    try:
        yield Path(os.environ.get(_PLACE) or Path.home() / ".minari" / "datasets")
    finally:
        os.environ.pop(_PLACE, None)
        if before is not None:
            os.environ[_PLACE] = before


def check_name(name: str) -> None:
    """Refuse the name of a data set that Minari does not take.

    Raises:
        ConfigError: It is none.
    """
    parse = importlib.import_module("minari.dataset.minari_dataset").parse_dataset_id
    try:
        parse(name)
    except (TypeError, ValueError):
        raise ConfigError(
            f"name = {name!r}; expected NAMESPACE/NAME-vN of letters, digits, - and _"
        ) from None


# Episodes of a policy, with everything that its environment gave and was given.

INFOS = ("cost", "is_success")
"""Entries of the infos that are kept, one more than steps: the first is that of the reset."""


def collect(
    policy: policies.PolicyFactory, envs: RigidVectorEnv, seeds: Sequence[int]
) -> list[Any]:
    """One episode in each row.

    Args:
        policy: What acts.
        envs: Rows that reset in the step that ends their episode.
        seeds: Seed of each row.

    Returns:
        Minari's `EpisodeBuffer` of each. Of T steps, observations and the entries `INFOS` have
        T + 1 rows; actions, as they were given, rewards, terminations and truncations have T.
    """
    episode = minari_of().data_collector.EpisodeBuffer
    steps = list(rollout(policy(envs), envs, seeds, INFOS))
    observations = [steps[0].seen, *(step.observations for step in steps)]
    first = {key: np.zeros_like(entry) for key, entry in steps[0].infos.items()}  # of the reset
    entries = [first, *(step.infos for step in steps)]
    lengths = np.sum([step.running for step in steps], axis=0)
    actions, rewards, terminations, truncations = (
        np.stack([getattr(step, name) for step in steps])
        for name in ("actions", "rewards", "terminated", "truncated")
    )
    told = {key: np.stack([each[key] for each in entries]) for key in INFOS}
    whole = _stacked(observations)
    return [
        episode(
            seed=seed,
            observations=_of_row(whole, row, n + 1),
            actions=actions[:n, row].astype(envs.single_action_space.dtype),
            rewards=rewards[:n, row],
            terminations=terminations[:n, row],
            truncations=truncations[:n, row],
            infos=_of_row(told, row, n + 1),
        )
        for row, (seed, n) in enumerate(zip(seeds, lengths.tolist(), strict=True))
    ]


def _stacked(observations: Sequence[Any]) -> Any:
    """Observations of all rows over time, shape (T + 1, N, n)."""
    if isinstance(observations[0], Mapping):
        return {key: np.stack([each[key] for each in observations]) for key in observations[0]}
    return np.stack(observations)


def _of_row(whole: Any, row: int, n: int) -> Any:
    if isinstance(whole, Mapping):
        return {key: part[:n, row] for key, part in whole.items()}
    return whole[:n, row]


# Whose behaviour a data set holds: the random policy, a reference, or a trained policy.


class Behaviour(NamedTuple):
    """A policy, and where it acts.

    Attributes:
        policy: The policy, which acts on observations.
        settings: Of the environment.
        origin: Where the policy comes from, as JSON values: `kind` ("random", "reference",
            "trained"), `name`, and of a trained one the `sha256` of its file and its training.
    """

    policy: policies.PolicyFactory
    settings: dict[str, Any]
    origin: dict[str, Any]


def behaviour(env_id: str, policy: str, settings: Mapping[str, Any], seed: int = 0) -> Behaviour:
    """The behaviour that a name stands for.

    Args:
        env_id: A registered id.
        policy: "random"; "reference" for the best reference controller, or the name of one; the
            name of a published policy, "BallPark"; or the path of a ``policy.safetensors``.
        settings: Of the environment; of a trained policy they go over those that it knows.
        seed: Of the random policy.

    Raises:
        ConfigError: None of these; says what there is. Or settings that cannot be.
    """
    known = ("reference", *policies.reference_controllers(env_id))
    agent: Any
    if is_trained(policy):
        agent = load(file := path_of(policy))
        kind, name, settings = "trained", agent.name, {**agent.env_kwargs, **settings}
        keys = ("algo", "env_id", "seed", "timesteps")
        more = {"sha256": file_digest(file), **{key: agent.document.get(key) for key in keys}}
    elif policy == "random":
        stream = np.random.default_rng(row_seeds(seed, 1, "random policy"))
        agent = policies.RandomPolicy(action_space(task_of(env_id, settings)), stream)
        kind, name, more = "random", "random", {}
    elif policy in known:
        agent = reference(env_id, None if policy == "reference" else policy, **settings)
        kind, name, more = "reference", agent.name, {}
    else:
        raise ConfigError(
            f"policy = {policy!r}; expected 'random', {', '.join(map(repr, known))}, the name of a "
            "published policy, or a file (.safetensors)"
        )
    origin = {"kind": kind, "name": name, **more}
    return Behaviour(policies.from_predict(agent, name), dict(settings), origin)


# Data sets written: collected, described, and put in place as a whole.

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
    dataset = None
    for k in range(0, len(seeds), _ROWS):
        tell(f"{k} of {len(seeds)} episodes")
        envs = make_rows(env_id, len(seeds[k : k + _ROWS]), acting.settings)
        buffers = collect(acting.policy, envs, seeds[k : k + _ROWS])
        envs.close()
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
    """Mean returns of the random policy and of the controller with the largest one."""
    known = best_known(env_id)
    free = all(key in SEEN for key in changed(env_id, task_of(env_id, settings)))
    names = list(ENVIRONMENTS[env_id].controllers)
    if known is None or not free or not names:
        return {}
    low, *others = (known.policies[each]["return_mean"] for each in ("random", *names))
    scores = {"ref_min_score": low, "ref_max_score": max(others)}  # Minari's score is between
    return {**scores, "num_episodes_average_score": N_STARTS}


def _default_name(env_id: str, acting: Behaviour) -> str:
    """Such as "rigid-envs/BallPark/random-v0"."""
    bare = env_id.rpartition("-v")[0] or env_id
    label = re.sub(r"\W+", "-", acting.policy.name)
    return f"{bare.replace('RigidEnvs/', 'rigid-envs/')}/{label}-v0"


# Data sets played again: every number must be there, bit for bit.


class Check(NamedTuple):
    """A data set that was played again.

    Attributes:
        episodes: Number of episodes.
        steps: Number of steps.
        differences: A line for each episode in which something differs; none if all is the same.
    """

    episodes: int
    steps: int
    differences: list[str]


def check(name: str, folder: Path | None = None) -> Check:
    """Play every episode again: its actions, from its seed, in the environment that it names.

    Args:
        name: Of a data set that `write` has written.
        folder: Of all data sets; None for Minari's.

    Raises:
        DamagedFileError: It is not one of `write`.
        FileNotFoundError: There is none of the name.
        DependencyNotInstalled: The extra `dataset` is missing.
    """
    minari = minari_of()
    check_name(name)
    with database(folder):
        dataset = minari.load_dataset(name)
    origin = dataset.storage.metadata.get("rigid_envs")
    if origin is None:
        raise DamagedFileError(f"{name}: expected a data set that `rigid-envs dataset` has written")
    env = _environment(name, origin)
    told = dataset.storage.get_episode_metadata(dataset.episode_indices)
    differences = []
    for episode, about in zip(dataset.iterate_episodes(), told, strict=True):
        where = next(_differences(env, episode, about["seed"]), None)
        if where is not None:
            differences.append(f"episode {episode.id}: {where}")
    env.close()
    if differences and origin["kernel_hash"] != kernel_hash():
        differences.append(f"written with kernels {origin['kernel_hash']}; these: {kernel_hash()}")
    return Check(dataset.total_episodes, dataset.total_steps, differences)


def _environment(name: str, origin: Mapping[str, Any]) -> Any:
    """The environment of a data set, from id and settings: Minari's own entry could name any code.

    Raises:
        DamagedFileError: An id that is not registered, or what is no setting of it.
    """
    try:
        env_id, settings = checked_id(id_in_file(origin["env_id"])), dict(origin["env_kwargs"])
        task_of(env_id, settings)
    except (LookupError, TypeError, ValueError) as error:
        raise DamagedFileError(f"{name}: {error}; write it anew: rigid-envs dataset") from error
    return gym.make(env_id, **settings)


def _differences(env: Any, episode: Any, seed: int) -> Iterator[str]:
    """What differs from an episode, in the order of its steps."""
    seen, info = env.reset(seed=seed)
    yield from _apart("the start", episode.observations, 0, seen, info, episode.infos)
    for step, action in enumerate(episode.actions):
        seen, *outcome, info = env.step(action)
        names = ("rewards", "terminations", "truncations")
        for key, value in zip(names, outcome, strict=True):
            if getattr(episode, key)[step] != value:
                yield f"step {step}: {key} = {value!r}; stored {getattr(episode, key)[step]!r}"
        yield from _apart(f"step {step}", episode.observations, step + 1, seen, info, episode.infos)


def _apart(
    place: str, stored: Any, at: int, seen: Any, info: Mapping[str, Any], infos: Mapping[str, Any]
) -> Iterator[str]:
    """What differs in observation and infos."""
    parts = seen if isinstance(seen, Mapping) else {"": seen}
    for key, part in parts.items():
        then = (stored[key] if key else stored)[at]
        if then.dtype != part.dtype or not np.array_equal(then, part):
            yield f"{place}: observation {key} = {part.tolist()}; stored {then.tolist()}"
    for key in INFOS:
        if info[key] != infos[key][at]:
            yield f"{place}: info {key} = {info[key]!r}; stored {infos[key][at]!r}"
