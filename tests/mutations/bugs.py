"""Bugs to plant in `agents` and in the files it writes, and the tests that must notice them."""

from typing import NamedTuple

__all__ = ["BUGS", "Bug"]


class Bug(NamedTuple):
    """A change of the source that is a mistake.

    Attributes:
        what: The mistake in words.
        file: Source file, from the root of the checkout.
        old: Text that is there once.
        new: Text in its place.
        tests: Test files, or folders, of its subject.
        why: Why no test can notice it; empty if one must.
    """

    what: str
    file: str
    old: str
    new: str
    tests: tuple[str, ...]
    why: str = ""

    def planted(self, source: str) -> str:
        """A source with this bug.

        Raises:
            ValueError: The text to change is not there, or more than once.
        """
        if source.count(self.old) != 1:
            raise ValueError(f"{self.what}: {self.file} has {self.old!r} not once")
        return source.replace(self.old, self.new)


_T = "tests/agents/training/test_"
FILES, TENSORS = ("tests/test_files.py",), ("tests/test_tensorfile.py",)
RUNS, LOGS = ("tests/agents/storage",), ("tests/agents/storage", f"{_T}continuing.py")
RESUME = (f"{_T}continuing.py",)
EVERY_ALGORITHM = (
    f"{_T}continuing.py::test_a_run_that_goes_on_is_bitwise_the_one_that_never_stopped",
)
STREAMS = (f"{_T}random_streams.py",)
EVENTS = (f"{_T}resume.py::test_no_row_and_no_event_is_doubled_or_missing_after_a_kill",)
TRAINER = (f"{_T}trainer.py", f"{_T}in_training.py")
SIGNALS = (f"{_T}signals.py",)
VALIDATION = (f"{_T}validation.py", f"{_T}in_training.py")
MODELS = (f"{_T}models.py",)
POLICIES = (f"{_T}acting.py",)
ROWS = ("tests/agents/test_environments.py", f"{_T}in_training.py")
SWEEPS = ("tests/agents/sweeps/test_sweep.py",)
DEATHS = (f"{SWEEPS[0]}::test_a_training_that_dies_five_times_at_the_same_place_is_given_up",)
KILLED_SWEEPS = (
    f"{SWEEPS[0]}::test_a_sweep_listens_nowhere_and_killed_leaves_no_process_and_its_run_saved",
)
CONFIG = ("tests/agents/config/test_config.py",)
TRAININGS = ("tests/agents/sweeps/test_trainings.py",)

_A = "agents/training/"
BUGS = (
    # files
    Bug("no fsync before the rename", "rigid_envs/base/files.py",
        "            os.fsync(file.fileno())\n", "", FILES),
    Bug("fsync of what is not flushed", "rigid_envs/base/files.py",
        "            file.flush()\n", "", FILES),
    Bug("no fsync of the folder", "rigid_envs/base/files.py",
        "    sync_folder(path.parent)\n", "", FILES),
    Bug("a failed write leaves its temporary file", "rigid_envs/base/files.py",
        "            temporary.unlink()\n", "            pass\n", FILES),
    Bug("a checksum that forgets shapes", "rigid_envs/base/files.py",
        "\\0{array.shape}\\0", "\\0", TENSORS),
    Bug("a checksum that forgets types", "rigid_envs/base/files.py",
        "\\0{array.dtype.str}\\0", "\\0", TENSORS),
    Bug("a checksum that forgets names", "rigid_envs/base/files.py",
        'f"\\0{name}\\0', 'f"\\0\\0', TENSORS),
    Bug("a checksum of the numbers alone", "rigid_envs/base/files.py",
        "hashlib.sha256(canonical_json(document).encode())", "hashlib.sha256()", TENSORS),
    # checkpoints, logs and folders of runs
    Bug("one checkpoint is kept", "agents/storage/logs.py", "_KEPT = 2", "_KEPT = 1", RUNS),
    Bug("the oldest checkpoint is read", "agents/storage/logs.py",
        "reverse=True", "reverse=False", RUNS),
    Bug("the newest checkpoints are dropped", "agents/storage/logs.py",
        "[:-_KEPT]", "[_KEPT:]", RUNS),
    Bug("a log is not cut back", "agents/storage/logs.py",
        "        os.truncate(path, position)\n", "", LOGS),
    Bug("a log is not brought to the disk", "agents/storage/logs.py",
        "        os.fsync(self._file.fileno())\n", "", TRAINER),
    Bug("several processes share a lock", "agents/storage/runs.py",
        "fcntl.LOCK_EX", "fcntl.LOCK_SH", RUNS),
    Bug("overwrite deletes what is no run", "agents/storage/runs.py",
        "(overwrite and is_run)", "overwrite", RUNS),
    Bug("the number of a new run is that of the oldest", "agents/storage/runs.py",
        "number = max(", "number = min(", RUNS),
    Bug("overwrite deletes the lock", "agents/storage/runs.py",
        "for path in folder.iterdir() if path.name != _LOCK", "for path in folder.iterdir()", RUNS),
    Bug("overwrite deletes what links point to", "agents/storage/runs.py",
        "path.is_dir() and not path.is_symlink()", "path.resolve().is_dir()", RUNS),
    Bug("overwrite follows a link with another name", "agents/storage/runs.py",
        " and not folder.is_symlink()", "", RUNS),
    Bug("the digest of a config is of its keys", "agents/storage/runs.py",
        "canonical_json(values)", "canonical_json(dict.fromkeys(values))", RUNS),
    # a training, and that it goes on
    Bug("default checkpoints are never due", f"{_A}trainer.py",
        "return gap > max(_LEAST_GAP, self._save_took / _SHARE)", "return False", TRAINER),
    Bug("default checkpoints are always due", f"{_A}trainer.py",
        "return gap > max(_LEAST_GAP, self._save_took / _SHARE)", "return gap > 0.0", TRAINER),
    Bug("checkpoints take any share of the time", f"{_A}trainer.py",
        "max(_LEAST_GAP, self._save_took / _SHARE)", "_LEAST_GAP", TRAINER),
    Bug("a stopped run is not saved", f"{_A}trainer.py",
        "                    trainer.save()\n            trainer.save()\n",
        "                    trainer.save()\n", TRAINER),
    Bug("the price of cost is that of the end", f"{_A}trainer.py",
        "self._config.price_at(before)", "self._config.price_at(total)", TRAINER),
    Bug("no bonus is paid", f"{_A}trainer.py",
        "        self._adapter.bonus = config.success_bonus\n", "", TRAINER),
    Bug("all runs train on the same starts", f"{_A}trainer.py",
        'row_seeds(config.seed, config.n_envs, "train")', 'row_seeds(0, config.n_envs, "train")',
        VALIDATION),
    Bug("training on the starts of the validation", f"{_A}trainer.py",
        'row_seeds(config.seed, config.n_envs, "train")',
        'row_seeds(271828, config.n_envs, "validation")', VALIDATION),
    Bug("updates are counted anew", f"{_A}trainer.py",
        'document["iterations"], Clock(', "0, Clock(", RESUME),
    Bug("earlier evaluations are forgotten", f"{_A}trainer.py",
        "self._validation.found = {name: held", "_ = {name: held", RESUME),
    Bug("the last policy is kept as the best", f"{_A}trainer.py",
        "        if better:\n", "        if True:\n", TRAINER),
    Bug("costs in the log are lengths", f"{_A}trainer.py",
        '"eval/mean_cost": episodes.costs', '"eval/mean_cost": episodes.lengths', TRAINER),
    Bug("leftovers of writes are not swept", f"{_A}trainer.py",
        "        sweep(run.folder)\n", "", TRAINER),
    Bug("any number of threads", f"{_A}trainer.py",
        "        torch.set_num_threads(config.torch_threads)\n", "", TRAINER),
    Bug("another machine is not told of", f"{_A}trainer.py",
        'self._progress.say(f"not the machine', 'str(f"not the machine', TRAINER),
    Bug("time of earlier sessions is lost", f"{_A}validation.py", "b + n - a", "n - a", TRAINER),
    Bug("clock and processor are swapped", f"{_A}validation.py",
        "Spent(time.perf_counter(), time.process_time())",
        "Spent(time.process_time(), time.perf_counter())", TRAINER),
    Bug("a second signal is ignored", f"{_A}trainer.py",
        "os._exit(128 + number)", "return", SIGNALS),
    Bug("a closed terminal kills", f"{_A}trainer.py", ", signal.SIGHUP)", ")", SIGNALS),
    Bug("signals are not given back", f"{_A}trainer.py",
        "            signal.signal(number, handler)\n", "            pass\n", SIGNALS),
    Bug("validation on the starts of the test", f"{_A}validation.py",
        'row_seeds(VALIDATION_SEED, n, "validation")', 'row_seeds(314159, n, "test")', VALIDATION),
    Bug("the best policy is replaced by an equal one", f"{_A}validation.py",
        'before is None or self.best != before',
        'before is None or self.best >= before', VALIDATION),
    Bug("no evaluation at the end", f"{_A}validation.py", " or now >= total", "", VALIDATION),
    Bug("the price of cost is paid out", f"{_A}validation.py",
        'total.mean() - self._price', 'total.mean() + self._price', VALIDATION),
    Bug("return counts before success", f"{_A}validation.py",
        '(won.mean(), total.mean() - self._price * cost.mean())',
        '(total.mean() - self._price * cost.mean(), won.mean())', VALIDATION),
    Bug("starts of episodes are not restored", f"{_A}snapshots.py",
        '    model._last_episode_starts = arrays["last_episode_starts"]\n', "", RESUME,
        "of the first step of a rollout nothing reads it: advantages look at the steps behind"),
    Bug("returns of the normalisation are not restored", f"{_A}snapshots.py",
        '    normalize.returns = arrays["returns"]\n', "", RESUME),
    Bug("the last episodes are not restored", f"{_A}snapshots.py",
        '    _restore_window(model, under("window", arrays))\n', '', RESUME),
    Bug("counters are not restored", f"{_A}snapshots.py",
        "        setattr(model, name, value)\n", "        pass\n", RESUME),
    Bug("learning rates are not restored", f"{_A}snapshots.py",
        '        group["lr"] = rate\n', "        pass\n", RESUME,
        "every algorithm sets them from their schedule before its first gradient step"),
    Bug("the stream of NumPy is not restored", f"{_A}snapshots.py",
        '            streams.numpy.set_state((kind, arrays["numpy"], *numpy))\n', '', STREAMS),
    Bug("the stream of torch is not restored", f"{_A}snapshots.py",
        '            streams.torch.set_state(torch.tensor(arrays["torch"]))\n',
        '            pass\n', STREAMS),
    Bug("the stream of the actions is not restored", f"{_A}snapshots.py",
        '            streams.actions.state = document["actions"]\n', '            pass\n', STREAMS),
    Bug("the stream of Python is not restored", f"{_A}snapshots.py",
        'streams.python.setstate(', 'str(', STREAMS),
    Bug("a full replay buffer is half read", f"{_A}snapshots.py",
        "= position, bool(full)", "= position, False", EVERY_ALGORITHM),
    Bug("starts of episodes in the replay buffer are lost", f"{_A}snapshots.py",
        '        buffer._current_ep_start = arrays["current_start"]\n', "        pass\n",
        EVERY_ALGORITHM),
    Bug("the last event before a kill is hidden", f"{_A}validation.py",
        'at["timesteps"] + 1', 'at["timesteps"]', EVENTS),
    Bug("ages of episodes are of one row", "agents/environments.py",
        "self._steps * self.num_envs", "self._steps", TRAINER),
    Bug("speed is that since the start", f"{_A}validation.py",
        "        self._last = (timesteps, spent.seconds)\n", "", TRAINER),
    # what the algorithms are told
    Bug("a linear schedule is negative at the last update", f"{_A}algorithms.py",
        "max(remaining, 0.0)", "remaining", MODELS),
    Bug("a schedule runs backwards", f"{_A}algorithms.py",
        "end + (start - end)", "start + (end - start)", MODELS),
    Bug("all runs have the same weights", f"{_A}algorithms.py",
        'row_seeds(config.seed, 1, "learner")', 'row_seeds(0, 1, "learner")', MODELS),
    Bug("gamma is not told", f"{_A}algorithms.py",
        '        gamma=config.gamma,\n', '', MODELS),
    Bug("the learning rate of PPO stays", f"{_A}algorithms.py",
        "    model._update_current_progress_remaining(", "    abs(model.gamma), (", MODELS),
    Bug("a spread on a schedule is learnt too", f"{_A}algorithms.py",
        '        model.policy.log_std.requires_grad_(False)\n', '        pass\n', MODELS),
    Bug("Adam of PPO has the eps of others", f"{_A}algorithms.py",
        'eps = 1e-5 if', 'eps = 1e-8 if', MODELS),
    Bug("learning starts at once", f"{_A}algorithms.py",
        'ready and model.num_timesteps >= config.learning_starts', 'ready', MODELS),
    Bug("one gradient step in a round", f"{_A}algorithms.py",
        'model.train(config.gradient_steps, ', 'model.train(1, ', MODELS),
    Bug("one round in an update", f"{_A}algorithms.py",
        'for _ in range(config.rounds)', 'for _ in range(1)', MODELS),
    Bug("the end of the exploration is not told", "agents/config/entries.py",
        '_NOT_OF_SB3 = {', '_NOT_OF_SB3 = {"exploration_final_eps", ', MODELS),
    Bug("no quantile is left out", f"{_A}algorithms.py",
        '["top_quantiles_to_drop_per_net"] = config.n_dropped',
        '["top_quantiles_to_drop_per_net"] = 0', MODELS),
    Bug("the entropy coefficient of SAC is learnt, whatever is said", "agents/config/entries.py",
        '_NOT_OF_SB3 = {', '_NOT_OF_SB3 = {"ent_coef", ', MODELS),
    # policies and rows
    Bug("goals are evaluated on all parts in the reduced frame", f"{_A}recording.py",
        'observations["observation"] if alone else observations', 'observations', POLICIES),
    Bug("a gain stays in what is trained", f"{_A}recording.py",
        '        policy.load_state_dict(before)\n', '        pass\n', (f"{_T}gain.py",)),
    Bug("a gain widens where it should narrow", f"{_A}recording.py",
        'policy.log_std.add_(', 'policy.log_std.sub_(', (f"{_T}gain.py",)),
    Bug("a policy of a run has another seed", f"{_A}recording.py",
        '"seed": config.seed', '"seed": 0', TRAINER),
    Bug("cost is paid out", "agents/environments.py",
        "rewards - self.price", "rewards + self.price", ROWS),
    Bug("lengths of running episodes are lost", "agents/environments.py",
        '        self._lengths[:] = state["lengths"]\n', "", ROWS),
    Bug("episodes are listed twice", "agents/environments.py",
        "ends, self._ends = self._ends, []", "ends = self._ends", ROWS),
    # configs and sweeps
    Bug("a run may be named ..", "agents/config/entries.py",
        ' and text.strip(".") != ""', "", CONFIG),
    Bug("YAML may grow like 2^n", "agents/config/reading.py",
        "if self.check_event(yaml.AliasEvent):", "if False:", CONFIG),
    Bug("a batch need not divide the samples", "agents/config/entries.py",
        "if samples % self.batch_size:", "if False:", CONFIG),
    Bug("a training that dies is begun for ever", "agents/sweeps/sweep.py",
        "[ages[-1]] * _DEATHS:", "[ages[-1]] * 2 * _DEATHS:", DEATHS),
    Bug("a finished training keeps its replay buffer", "agents/sweeps/sweep.py",
        '            shutil.rmtree(run / "checkpoints", ignore_errors=True)\n', "", SWEEPS),
    Bug("a killed sweep leaves its processes", "agents/sweeps/sweep.py",
        "    threading.Thread(target=_end_with_parent, daemon=True).start()\n", "", KILLED_SWEEPS),
    Bug("a seed that is named twice is trained twice", "agents/cli/sweeping.py",
        "return list(dict.fromkeys(found))", "return found", TRAININGS),
    Bug("seeds of an empty range are none", "agents/cli/sweeping.py",
        " or numbers[0] > numbers[-1]", "", TRAININGS),
    Bug("an environment that is named twice is trained twice", "agents/cli/sweeping.py",
        "dict.fromkeys(map(full_id, options.ids))", "map(full_id, options.ids)", TRAININGS),
    Bug("a value of a task begins at its last =", "agents/config/reading.py",
        'word.partition("=")', 'word.rpartition("=")', CONFIG),
    Bug("any run that has begun is complete", f"{_A}recording.py",
        "bool(times) and int(times[_STEPS]) >= run.config().total_timesteps", "bool(times)",
        TRAININGS),
    Bug("what has not begun is complete", f"{_A}recording.py",
        "return bool(times) and int", "return not times or int", TRAININGS),
    Bug("a sweep records what is not complete", "agents/sweeps/sweep.py",
        "run.new is not None or not is_complete(run)", "run.new is not None", TRAININGS),
    Bug("a run is complete an update late", f"{_A}recording.py",
        "int(times[_STEPS]) >= run", "int(times[_STEPS]) > run", SWEEPS),
    Bug("a record has the steps of the run for those of its policy", f"{_A}recording.py",
        '"policy_timesteps": document["timesteps"]', '"policy_timesteps": int(times[_STEPS])',
        SWEEPS),
    Bug("costs of failures count in a learning curve", f"{_A}recording.py",
        "float(row[own].mean())", "float(row.mean())", SWEEPS),
)  # fmt: skip
