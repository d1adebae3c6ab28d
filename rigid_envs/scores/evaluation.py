"""Evaluation of a policy from the fixed starts, and of published ones again."""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from rigid_envs.base.checks import Array, ConfigError, integer, printable, require, safe_repr
from rigid_envs.base.files import file_digest
from rigid_envs.engine.provenance import provenance
from rigid_envs.envs.lookup import changed, checked_id, full_id, task_of
from rigid_envs.envs.shells import RigidVectorEnv
from rigid_envs.scores import starts
from rigid_envs.scores.policies import PolicyFactory, policy_of, untrained_policies
from rigid_envs.scores.proof import Witness, difference, objection, play_again, up_to_date
from rigid_envs.scores.records import Record, read_evaluation, read_record
from rigid_envs.scores.result import Evaluation
from rigid_envs.scores.starts import TEST_SEED
from rigid_envs.scores.trained import FOLDER, file_of, is_trained, load, published
from rigid_envs.tasks.registry import ENVIRONMENTS, ErrorTerm

# Evaluation of a policy from the fixed starts.


def evaluate(
    env_id: str,
    policy: Any,
    *,
    n: int = starts.N_STARTS,
    seed: int = starts.TEST_SEED,
    config: Mapping[str, Any] | None = None,
    env: Any = None,
    name: str | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Evaluation:
    """Play one episode from each of the first n starts, and measure success and efficiency.

    Args:
        env_id: Gymnasium's id.
        policy: A model with `predict`, as Stable-Baselines3 has it; a function from the
            observations of all rows to their actions; the name of a reference controller, or
            "reference", "sampling", "zero", "random"; a controller, as `from_controller(factory)`;
            a trained policy by its file or id, see `rigid_envs.load`.
        n: Number of starts.
        seed: Seed that the starts are drawn from; that of the evaluation set by default.
        config: Hyperparameters of the task; None takes the `env_kwargs` of a policy that has some,
            as published policies do.
        env: Environment to play in, single or vector, with its wrappers; None makes native rows.
            It stays open.
        name: Who acts, for tables; None for the name that the policy has.
        progress: Called with a few words in every step.

    Raises:
        ValueError: An id, policy, environment or number that cannot be; names what can.
    """
    n, seed = integer(n, "n", 1), integer(seed, "seed", 0)
    require(name is None or isinstance(name, str), name, "name", "None or a text")
    require(callable(progress), progress, "progress", "a function of a text")
    env_id = _id_of(env_id, env)
    policy = load(policy) if isinstance(policy, str) and is_trained(policy) else policy
    chosen = policy_of(env_id, policy)
    printable(chosen.name if name is None else name, "name")
    if config is None and env is None:
        config = getattr(policy, "env_kwargs", None)
    if env is None:
        task_of(env_id, config)  # refuses what is no setting of the task
    envs = make_rows(env_id, n, config) if env is None else _rows_of(env_id, env, config)
    try:
        _refuse_others(policy, env_id, envs)
        found = _evaluation(env_id, chosen, envs, n, seed, progress)
    finally:
        if env is None:
            envs.close()
    return found if name is None else replace(found, policy=name)


def _id_of(env_id: Any, env: Any) -> str:
    """The id in full; one that is not registered needs an environment."""
    require(isinstance(env_id, str), env_id, "env_id", "the id of an environment, a text")
    if env is None or full_id(env_id.rpartition(":")[2]) in ENVIRONMENTS:
        return checked_id(env_id)
    return str(env_id)


def _evaluation(
    env_id: str,
    policy: PolicyFactory,
    envs: Any,
    n: int,
    seed: int,
    progress: Callable[[str], None],
) -> Evaluation:
    """Play the episodes, and again what was done in them, if they may be ranked."""
    witness = Witness(envs)
    settings, limit = _settings(env_id, envs, witness), _limit(env_id, envs, witness)
    unranked = objection(env_id, settings, seed, n) or _objection(env_id, witness, limit)
    episodes = _play(policy, envs, n, seed, env_id, limit, witness, progress)
    returns = episodes.returns  # in which the rewards of wrappers count
    actions = None
    if unranked is None:
        given, applied = witness.actions(n)
        again = play_again(env_id, given, seed, settings)
        unranked = difference(episodes, again)
        if unranked is None:
            episodes, longest = again, again.lengths.max()
            going = np.arange(longest)[:, None] < again.lengths
            actions = np.where(going[..., None], applied[:longest], np.float32(0.0))
    found = Evaluation(
        env_id=env_id,
        policy=policy.name,
        config=settings,
        seed=seed,
        cost=starts.cost_of(env_id, task_of(env_id, settings)) if env_id in ENVIRONMENTS else None,
        values={**_values(env_id, episodes, settings), "return": returns},
        provenance=provenance(),
        unranked=unranked,
        actions=actions,
    )
    return up_to_date(found)


def _values(
    env_id: str, episodes: starts.Episodes, settings: Mapping[str, Any]
) -> dict[str, Array]:
    """What is known of episodes in any environment, and the metrics of the id."""
    values = {
        "success": episodes.successes.astype(np.float64),
        "return": episodes.returns,
        "length": episodes.lengths.astype(np.float64),
        "cost": episodes.costs,
    }
    if env_id not in ENVIRONMENTS:
        return values
    task = task_of(env_id, settings)
    return values | {each.name: each.values(episodes, task) for each in starts.metrics_of(env_id)}


def make_rows(env_id: str, n: int, config: Mapping[str, Any] | None = None) -> RigidVectorEnv:
    """N rows of an id that reset in the step that ends their episode.

    Args:
        env_id: Gymnasium's id.
        n: Number of rows.
        config: Hyperparameters of the task.
    """
    envs = gym.make_vec(
        env_id,
        num_envs=n,
        vectorization_mode="vector_entry_point",
        autoreset_mode="SameStep",
        **(config or {}),
    )
    assert isinstance(envs, RigidVectorEnv)
    return envs


def _rows_of(env_id: str, env: Any, config: Mapping[str, Any] | None) -> Any:
    """A given environment as a vector environment whose rows start anew by themselves."""
    if config:
        expected = "none beside env, which has its own"
        raise ConfigError(f"config = {safe_repr(config)}; expected {expected}")
    if not isinstance(env, gym.Env | gym.vector.VectorEnv):
        raise ConfigError(f"env = {safe_repr(env)}; expected an environment of Gymnasium")
    envs = gym.vector.SyncVectorEnv([lambda: env]) if isinstance(env, gym.Env) else env
    spec, name = _spec(envs), env_id.rpartition(":")[2]
    if spec is not None and spec.id != name:
        raise ConfigError(f"env = {spec.id}; expected one of {env_id}")
    if envs.metadata.get("autoreset_mode") == gym.vector.AutoresetMode.DISABLED:
        raise ConfigError("env: autoreset_mode = Disabled; expected rows that start anew: SameStep")
    return envs


def _refuse_others(policy: Any, env_id: str, envs: Any) -> None:
    """Refuse a policy that says that it takes other observations than those of the environment."""
    takes, gives = getattr(policy, "observation_space", None), envs.single_observation_space
    shapes = [getattr(space, "shape", None) for space in (takes, gives)]
    if None not in shapes and shapes[0] != shapes[1]:
        raise ConfigError(
            f"policy: its observations have shape {shapes[0]}, those of {env_id} {shapes[1]}; "
            "expected the settings that it was trained with: config={'frame': 'reduced'} or others"
        )


def _spec(envs: Any) -> Any:
    """Of an environment, or of the first that a vector is made of; None if there is none."""
    rows = getattr(envs.unwrapped, "envs", [envs])
    return rows[0].spec


def _settings(env_id: str, envs: Any, witness: Witness) -> dict[str, Any]:
    """Hyperparameters of an environment: those of its rows themselves, where they are in reach."""
    if env_id not in ENVIRONMENTS:
        return {}
    registered = task_of(env_id)
    if not witness.cores:
        known, spec = asdict(registered), _spec(envs)
        given = {} if spec is None else spec.kwargs
        return {key: value for key, value in given.items() if key in known}
    task = witness.cores[0].task
    if type(task) is not type(registered):
        raise ConfigError(f"env = {type(task).__name__}; expected one of {env_id}")
    return changed(env_id, task)


def _limit(env_id: str, envs: Any, witness: Witness) -> int | None:
    """Steps after which episodes are cut off: of the environment, or else of the registered id."""
    if env_id not in ENVIRONMENTS or not witness.cores:
        return None
    own = witness.cores[0].max_steps
    if np.isfinite(own):
        return int(own)
    given = getattr(_spec(envs), "max_episode_steps", None)
    return given if given and given > 0 else ENVIRONMENTS[env_id].max_episode_steps


def _objection(env_id: str, witness: Witness, limit: int | None) -> str | None:
    """Why the episodes of an environment are not ranked, whatever is done in them."""
    if not witness.cores:
        return "env: no rows in reach; expected native ones, whose actions can be played again"
    registered = ENVIRONMENTS[env_id].max_episode_steps
    if limit != registered:
        return f"max_episode_steps = {limit}; expected {registered}, as registered"
    return None


def _play(
    policy: PolicyFactory,
    envs: Any,
    n: int,
    seed: int,
    env_id: str,
    limit: int | None,
    witness: Witness,
    progress: Callable[[str], None],
) -> starts.Episodes:
    """One episode from each of n starts, as many at a time as there are rows."""
    record = ENVIRONMENTS.get(env_id)
    error: ErrorTerm | None = None if record is None else record.error
    rows, parts = envs.num_envs, []
    seeds = starts.row_seeds(seed, -(-n // rows) * rows, "test")
    for k in range(0, len(seeds), rows):
        own = seeds[k : k + rows]
        with witness.watching():
            act, told = policy(envs), witness.told
            parts.append(starts.play(act, envs, own, error, progress, limit, told))
    return starts.joined(parts, n)


# Published policies evaluated again: every figure must be hit to the last digit.


@dataclass(frozen=True, eq=False)
class Repeat:
    """Episodes that were played again.

    Attributes:
        then: What a file says of them, or what is published.
        now: What came of it now; of `recheck` with a seed, from other starts.
        differences: Which numbers of which starts differ; empty if none does.
    """

    then: Evaluation
    now: Evaluation
    differences: tuple[str, ...]


def published_record(name: str, folder: Path = FOLDER) -> Record:
    """The record of a published policy.

    Args:
        name: See `rigid_envs.load`.
        folder: Where the policies are.
    """
    return read_record(file_of(name, folder).with_suffix(".json"))


def published_evaluation(name: str, folder: Path = FOLDER) -> Evaluation:
    """The record of a published policy as an evaluation, beside what is best known now.

    It has success and cost of each start, and neither returns nor other metrics.

    Args:
        name: See `rigid_envs.load`.
        folder: Where the policies are.
    """
    return up_to_date(published_record(name, folder).evaluation)


def recheck(name: str, seed: int | None = None, folder: Path = FOLDER) -> Repeat:
    """Evaluate a published policy again.

    From the published starts, success and cost of each must be the same, to the last digit. From
    other ones, the rate of success must lie within the 95 % interval of the published rate.

    Args:
        name: See `rigid_envs.load`.
        seed: Seed of other starts; None takes the published ones.
        folder: Where the policies are.
    """
    file, record = file_of(name, folder), published_record(name, folder)
    then = published_evaluation(name, folder)
    starts = TEST_SEED if seed is None else seed
    now = evaluate(then.env_id, load(file), n=then.n, config=then.config, seed=starts)
    if seed is None:
        wrong = _differences(then.values, {key: now.values[key] for key in then.values})
    else:
        (_, low, high), rate = then.success, now.success.mean
        expected = f"expected {low:.3f} to {high:.3f}"
        wrong = [] if low <= rate <= high else [f"success {rate:.3f} of other starts; {expected}"]
    if file_digest(file) != record.policy_sha256:
        wrong.append("the record is of another file")
    return Repeat(then, now, tuple(wrong))


# Results in files, played again: every number must be hit to the last digit.


def repeat(file: str | Path, policy: str | None = None) -> Repeat:
    """Play the episodes of a result again: same task, same starts.

    Args:
        file: From `Evaluation.save` or ``rigid-envs evaluate --out``.
        policy: Which one to play, see `evaluate`; by default the one that the result names, if
            it is a controller or published.

    Raises:
        DamagedFileError: The file is damaged, or its figures do not follow from its starts.
        FileNotFoundError: No such file.
        ValueError: The result does not say which policy it is of.
    """
    then = read_evaluation(file)
    chosen = _policy_of(then) if policy is None else policy
    now = evaluate(then.env_id, chosen, n=then.n, config=dict(then.config), seed=then.seed)
    return Repeat(then, now, tuple(_differences(then.values, now.values)))


def _policy_of(found: Evaluation) -> Any:
    """The policy that a result names."""
    if found.policy in untrained_policies(found.env_id):
        return found.policy
    for name in published():
        record = published_record(name)
        if (record.env_id, record.policy) == (found.env_id, found.policy):
            return load(name)
    raise ValueError(
        f"algo = {found.policy!r}; expected a controller of {found.env_id} or a published policy: "
        "name the policy, or its file"
    )


def _differences(then: Mapping[str, Array], now: Mapping[str, Array]) -> list[str]:
    """One line for every quantity that is not the same from every start."""
    lines = []
    for name in sorted(then.keys() | now.keys()):
        old, new = then.get(name), now.get(name)
        if old is None or new is None:
            lines.append(f"{name}: only {'now' if old is None else 'then'}")
        elif not np.array_equal(old, new, equal_nan=True):
            other = np.flatnonzero((old != new) & ~(np.isnan(old) & np.isnan(new)))
            first = other[0]
            lines.append(
                f"{name}: {len(other)} of {len(old)} starts differ, start {first} first: "
                f"{old[first]!r} then, {new[first]!r} now"
            )
    return lines
