"""Training of a model by a config."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from types import FrameType
from typing import Any, NamedTuple

import torch
from gymnasium.spaces import Box
from gymnasium.vector import VectorEnv
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.utils import safe_mean
from stable_baselines3.common.vec_env import VecEnv, VecExtractDictObs, VecNormalize

from rigid_envs.base.checks import ConfigError
from rigid_envs.base.files import DamagedFileError, sweep
from rigid_envs.base.settings import refusal
from rigid_envs.sb3.adapter import NonFiniteError
from rigid_envs.scores.starts import row_seeds

from ..config.entries import Config, config_to_dict
from ..environments import make, part_for
from ..storage.logs import flat, load_newest, save_newest, under, write_evaluations
from ..storage.runs import Run, create_run, differences, manifest, open_run
from ..storage.trackers import TRACKERS
from .algorithms import build_model, check_fit, iterate
from .recording import acting, as_saved, save_policy
from .rows import TrainingRows
from .snapshots import capture, check, check_document, restore
from .validation import Progress, Records, Stopwatch, Validation

# Signals that ask a run to stop are answered between two updates.

_STOPS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class StopSignals:
    """While in this context, the first stop signal is noted and the second ends the process.

    Attributes:
        received: The signal that came, or None.
    """

    def __init__(self) -> None:
        """Note nothing yet."""
        self.received: int | None = None
        self._before: dict[int, Any] = {}

    def __enter__(self) -> StopSignals:
        """Take the signals over, where Python allows it: in the main thread."""
        if threading.current_thread() is threading.main_thread():
            self._before = {number: signal.signal(number, self._note) for number in _STOPS}
        return self

    def __exit__(self, *_: object) -> None:
        """Give the signals back."""
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def stopping(self) -> bool:
        """Whether a signal came."""
        return self.received is not None

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self.received is not None:
            os._exit(128 + number)
        self.received = number
        if multiprocessing.parent_process() is None:  # of several processes, one says it
            name = signal.Signals(number).name
            text = f"\n{name}: finishing this update, then saving; once more ends at once\n"
            os.write(2, text.encode())


# The environment of a training: refused if it cannot be, wrapped as the model sees it.


def checked_environment(config: Config) -> VectorEnv[Any, Any, Any]:
    """The environment of a training.

    Args:
        config: Config of the run.

    Raises:
        ConfigError: The algorithm is not for it, or its spaces are not those of the evaluations.
    """
    tested = make(config.env_id, config.env_kwargs, 1)
    trained = make(config.env_id, config.training_kwargs, 1, "train_kwargs")
    check_fit(config, trained)
    for key, entry in (("cost_price", "cost"), ("success_bonus", "is_success")):
        if (value := getattr(config, key)) and entry not in trained.reset()[1]:
            raise refusal(key, value, f"0: {config.env_id} reports no {entry}")
    is_gaussian = config.algo == "ppo" and isinstance(trained.single_action_space, Box)
    if config.policy_gain != 1.0 and not is_gaussian:
        raise refusal("policy_gain", config.policy_gain, "1: not for this algorithm and id")
    one, other = ((each.single_observation_space, each.single_action_space)
                  for each in (tested, trained))  # fmt: skip
    tested.close()
    if one != other:
        why = "what leaves the spaces of observations and actions as they are with env_kwargs alone"
        raise refusal("train_kwargs", dict(config.train_kwargs), why)
    return trained


def wrapped(adapter: TrainingRows, config: Config) -> VecEnv:
    """What the model sees: the part that networks read, normalised as the config says.

    Args:
        adapter: The environment of the training.
        config: Config of the run.
    """
    part = part_for(config.env_kwargs, adapter.observation_space)
    seen = adapter if part is None else VecExtractDictObs(adapter, part)
    if not (config.normalize_observation or config.normalize_reward):
        return seen
    return VecNormalize(
        seen,
        norm_obs=config.normalize_observation,
        norm_reward=config.normalize_reward,
        gamma=config.gamma,
    )


# Training of a run: collect, learn, log, evaluate, save; resumed to the bit.

_SHARE = 0.02  # largest share of the time that goes into checkpoints
_LEAST_GAP = 2.0  # seconds between them, lest a fast disk be worn for nothing


class Session(NamedTuple):
    """What a session of a training has come to.

    Attributes:
        folder: Folder of the run.
        timesteps: Steps made, all sessions together.
        seconds: Time spent, all sessions together.
        stopped_by: The signal that ended it early; None if it is complete.
    """

    folder: Path
    timesteps: int
    seconds: float
    stopped_by: int | None


def train(what: Config | Path, overwrite: bool = False, quiet: bool = False) -> Session:
    """Train from a config, or resume a run.

    Args:
        what: Config of a new run; or the folder of one to go on with, which ends with the same bits
            as if it had never stopped, on the same machine and versions.
        overwrite: Whether a new run may delete an old one of its name.
        quiet: No progress.

    Raises:
        ConfigError: A config that cannot be.
        RunInUseError: Another process works in the folder.
        NonFiniteError: A NaN came up; nothing was learnt from it, the last checkpoint is good.
    """
    run = create_run(what, overwrite) if isinstance(what, Config) else open_run(what)
    with closing(run):
        return train_in(run, quiet)


def train_in(run: Run, quiet: bool = False, tracker: str | None = None) -> Session:
    """Train in a run folder, from where it is.

    Args:
        run: A run that this process has the lock of.
        quiet: No progress.
        tracker: One of `TRACKERS` that gets the figures too.

    Raises:
        ConfigError: The config cannot be; a new run then leaves no folder behind.
        NonFiniteError: See `train`.
    """
    config, progress = run.config(), Progress(quiet)
    asked, made = config.total_timesteps, config.steps_in_all
    more = f" ({asked:,}, rounded up to whole updates)" if made > asked else ""
    progress.say(
        f"{config.env_id}: {config.algo}, {made:,} steps{more}, then 500 unseen starts; writes to "
        f"{run.folder}"
    )
    try:
        venv = checked_environment(config)
    except ConfigError:
        run.discard()
        raise
    venv.reset()
    venv.step(venv.action_space.sample())  # compiles what is not compiled, before the clock starts
    venv.close()
    run.begin()
    with StopSignals() as signals:
        trainer = Trainer(run, config, progress)
        try:
            if tracker is not None:
                begun = TRACKERS[tracker](run.folder.name, config_to_dict(config))
                trainer.model.logger.output_formats.append(begun)
            while not (trainer.is_complete() or signals.stopping()):
                trainer.iterate()
                if trainer.checkpoint_is_due():
                    trainer.save()
            trainer.save()
        except NonFiniteError as error:
            raise NonFiniteError(
                f"{error}; seed {config.seed}. {run / 'checkpoints'} is of before, and good"
            ) from error
        finally:
            trainer.close()
    return Session(run.folder, trainer.model.num_timesteps, trainer.seconds(), signals.received)


class Trainer:
    """A run being trained.

    Attributes:
        model: SB3 model.
    """

    def __init__(self, run: Run, config: Config, progress: Progress) -> None:
        """Build everything, as it is at the start of the run or at its newest checkpoint.

        Args:
            run: Where to write; this process has its lock.
            config: Config of the run.
            progress: What it says.
        """
        torch.set_num_threads(config.torch_threads)
        sweep(run.folder)
        self._run, self._config, self._progress = run, config, progress
        self._adapter = TrainingRows(make(config.env_id, config.training_kwargs, config.n_envs))
        self._adapter.bonus = config.success_bonus
        self.model = build_model(config, wrapped(self._adapter, config))
        self._adapter.seed(row_seeds(config.seed, config.n_envs, "train"))
        self._validation = Validation(config)
        self._iterations = 0
        self._clock = Stopwatch()
        self._saved_at, self._save_took = time.perf_counter(), 0.0
        self.model.set_logger(Logger(None, []))  # a checkpoint is checked before logs are touched
        _, self._callback = self.model._setup_learn(config.total_timesteps)
        arrays, document, damaged = load_newest(run / "checkpoints", self._check) or ({}, {}, [])
        for line in damaged:
            progress.say(f"damaged, taking the one before: {line}")
        self._records = Records(run, config, document.get("logs"))
        self.model.set_logger(self._records.logger)
        if document:
            self._restore(arrays, document)
        progress.start(config.steps_in_all, self.model.num_timesteps)

    def is_complete(self) -> bool:
        """Whether all steps are made."""
        return bool(self.model.num_timesteps >= self._config.total_timesteps)

    def seconds(self) -> float:
        """Time spent on the run, all sessions together."""
        return self._clock.spent().seconds

    def iterate(self) -> None:
        """One update: collect, learn, evaluate if it is due, log."""
        before, total = self.model.num_timesteps, self._config.total_timesteps
        self._adapter.price = self._config.price_at(before)
        iterate(self.model, self._config, self._callback)
        self._iterations += 1
        figures = self._figures()
        if self._validation.is_due(before, self.model.num_timesteps, total):
            figures |= self._evaluate()
        self._records.write(
            self.model.num_timesteps, figures, self._adapter.pop_episodes(), self._clock.spent()
        )
        self._progress.show(self.model.num_timesteps, figures)

    def checkpoint_is_due(self) -> bool:
        """Whether to save now: every so many updates, or as often as is cheap."""
        if self._config.checkpoint_every is not None:
            return self._iterations % self._config.checkpoint_every == 0
        gap = time.perf_counter() - self._saved_at
        return gap > max(_LEAST_GAP, self._save_took / _SHARE)

    def save(self) -> None:
        """Write the policy of now and a checkpoint."""
        begin = time.perf_counter()
        with as_saved(self.model, self._config):
            save_policy(self.model, self._config, self._run / "last_model")
        arrays, document = self._state(self._records.sync(self.model.num_timesteps))
        save_newest(self._run / "checkpoints", self.model.num_timesteps, arrays, document)
        self._saved_at = time.perf_counter()
        self._save_took = self._saved_at - begin

    def close(self) -> None:
        """Close files and environments."""
        self._progress.close()
        self._records.close()
        self._validation.close()
        self._adapter.close()

    def _state(self, logs: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
        """Arrays and document of a checkpoint, given the positions in the logs."""
        arrays, document = capture(self.model, self._adapter)
        arrays |= flat({"validation": self._validation.found})
        document |= {
            "config": config_to_dict(self._config),
            "manifest": manifest(),
            "iterations": self._iterations,
            "spent": list(self._clock.spent()),
            "logs": logs,
        }
        return arrays, document

    def _check(self, arrays: dict[str, Any], document: dict[str, Any]) -> None:
        """Refuse what this run cannot have written; nothing has been restored yet.

        Raises:
            DamagedFileError: "member = value; expected ...".
            ConfigError: It is of another config.
        """
        before, config = document.get("config"), self._config
        if isinstance(before, dict) and (changed := differences(before, config_to_dict(config))):
            raise ConfigError(
                f"{self._run / 'config.yaml'} is not what the run was started with "
                f"({'; '.join(changed)}); put it back, or start a new run"
            )
        fresh_arrays, fresh_document = self._state(Records.START)
        try:
            check_document(document, fresh_document, config)
            ages = self._validation.ages(document["iterations"], config)
            check(self.model, fresh_arrays, arrays, document, ages)
        except ValueError as error:
            raise DamagedFileError(str(error)) from None
        Records.check(self._run, document["logs"])

    def _restore(self, arrays: dict[str, Any], document: dict[str, Any]) -> None:
        for line in differences(document["manifest"], manifest()):
            self._progress.say(f"not the machine or versions of before, so not its bits: {line}")
        restore(self.model, self._adapter, arrays, document)
        held = under("validation", arrays)
        self._validation.found = {name: held[name] for name in self._validation.found}
        self._iterations, self._clock = document["iterations"], Stopwatch(*document["spent"])

    def _figures(self) -> dict[str, Any]:
        episodes, successes = self.model.ep_info_buffer, self.model.ep_success_buffer
        figures: dict[str, Any] = {"time/iterations": self._iterations}
        if episodes:
            figures["rollout/ep_rew_mean"] = safe_mean([episode["r"] for episode in episodes])
            figures["rollout/ep_len_mean"] = safe_mean([episode["l"] for episode in episodes])
        if successes:
            figures["rollout/success_rate"] = safe_mean(successes)
        return figures

    def _evaluate(self) -> dict[str, Any]:
        with as_saved(self.model, self._config):
            episodes, better = self._validation.run(
                lambda venv: acting(self.model, venv), self.model.num_timesteps
            )
            if better:
                save_policy(self.model, self._config, self._run / "best_model")
        write_evaluations(self._run / "evaluations.npz", self._validation.found)
        return {
            "eval/success_rate": episodes.successes.mean(),
            "eval/mean_reward": episodes.returns.mean(),
            "eval/mean_ep_length": episodes.lengths.mean(),
            "eval/mean_cost": episodes.costs.mean(),
        }
