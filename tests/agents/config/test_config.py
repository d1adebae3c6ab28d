"""A config is refused at once, by key, with what would be right; a good one never."""

import math
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from agents.config import reading
from agents.config.entries import ALGORITHMS, config_from, config_to_dict, is_folder_name
from agents.environments import make
from agents.training.algorithms import check_fit
from agents.training.trainer import train
from rigid_envs.base.checks import ConfigError
from tests.refusals import refuses

CONFIGS = sorted((Path(__file__).parents[3] / "configs").glob("*.yaml"))

COUNTS = dict.fromkeys(  # integers from 1 on
    ("total_timesteps", "n_envs", "eval_every", "eval_episodes", "torch_threads"),
    (0, -1, 0.5, math.nan, math.inf, "x", True, None, [1]),
)
FLAGS = dict.fromkeys(
    ("normalize_observation", "normalize_reward", "goal_turn"), (0, 1, "true", "no", None)
)
KEYWORDS = dict.fromkeys(
    ("env_kwargs", "train_kwargs"), (3, "x", None, [1], {1: 2}, {"x": math.nan}, {"x": {1, 2}})
)
NO_SHARE = [-0.1, 1.1, math.nan, -math.inf, "x", True, None, [0.9]]
NO_WEIGHT = [-1, math.nan, math.inf, "x", True, None, [1]]
NO_FACTOR = [0, *NO_WEIGHT]
ALL = {
    **COUNTS,
    **FLAGS,
    **KEYWORDS,
    "env_id": ["", " ", 3, None, True, ["x"]],
    "algo": ["", "pop", 3, None, True],
    "seed": [-1, 0.5, math.nan, math.inf, "1", True, None, [1], 2**63],
    "gamma": NO_SHARE,
    "success_bonus": NO_WEIGHT,
    "policy_gain": [*NO_FACTOR, 101],
    "cost_price": [*NO_WEIGHT, [1, -1], [1, 1, 1]],
    "learning_rate": [*NO_FACTOR, 1.5, [1e-3], [1, 2], [0.1, 0.1, 0.1]],
    "net_arch": [64, [0], [1.5], ["x"], [64] * 9, None, True, {"pi": [64]}],
    "activation": ["tan", 1, None, True],
    "checkpoint_every": [0, -1, 0.5, "auto", True],
    "log_dir": ["", 3, None],
    "run_name": ["", "a/b", "..", "a b", "x" * 81, 3, True, "é"],
}
PPO = {
    **dict.fromkeys(("n_steps", "n_epochs"), COUNTS["n_envs"]),
    "batch_size": [1, 3, 10**9, None, True, 2.5],
    "gae_lambda": NO_SHARE,
    "clip_range": [*NO_FACTOR, 1.5],
    **dict.fromkeys(("ent_coef", "vf_coef"), NO_WEIGHT),
    "max_grad_norm": NO_FACTOR,
    "target_kl": [0, -1, True, math.nan, "x"],
    "log_std_init": [3, -21, None, True, math.nan],
    "action_std": [[0.5], [0.0, 0.1], [0.5, 0.1, 0.1], [1.0, math.nan], 0.5, True, "x"],
}
OFF_POLICY = {
    **dict.fromkeys(("buffer_size", "train_freq", "gradient_steps", "log_every"), COUNTS["n_envs"]),
    "learning_starts": [-1, None, 0.5, math.inf],
    "batch_size": [1, None, True, 2.5],
    "tau": [*NO_FACTOR, 1.1],
    "n_sampled_goal": [-1, 101, None, 1.5, True],
}
SAC = {**OFF_POLICY, "ent_coef": [*NO_WEIGHT, "automatic", "auto_0.1"]}
TQC = {**SAC, "n_quantiles": COUNTS["n_envs"], "n_dropped": [-1, None, 1.5, True, 25]}
DQN = {
    **OFF_POLICY,
    "target_update_interval": [0, None, 1.5, 63],  # less than the rows
    "exploration_fraction": [0, *NO_SHARE],
    **dict.fromkeys(("exploration_initial_eps", "exploration_final_eps"), NO_SHARE),
    "max_grad_norm": NO_FACTOR,
}
DAGGER = {
    **dict.fromkeys(("n_steps", "gradient_steps"), COUNTS["n_envs"]),
    "teacher": ["", 3, None, True],
    "buffer_size": [0, None, 1.5, 127],  # less than the rows
    "batch_size": [1, None, True, 2.5],
    "dead_band": [*NO_WEIGHT, 11],
    "loss_width": [*NO_FACTOR, 101],
    "normalize_observation": [True],
}
BY_ALGORITHM = {"ppo": PPO, "sac": SAC, "tqc": TQC, "dqn": DQN, "dagger": DAGGER}


@pytest.mark.parametrize("algo", ALGORITHMS)
def test_every_entry_is_tried(algo):
    known = config_to_dict(config_from({"algo": algo})).keys()
    assert ALL.keys() | BY_ALGORITHM[algo].keys() == known


@pytest.mark.parametrize(
    ("algo", "key", "values"),
    [
        (algo, key, bad)
        for algo, entries in BY_ALGORITHM.items()
        for key, bad in (entries | (ALL if algo == "ppo" else {})).items()
    ],
)
def test_bad_values_are_refused_by_key_with_what_is_expected(algo, key, values):
    for value in values:
        refuses(rf"^config\.{key}: {key} = .*; expected ", config_from, {"algo": algo, key: value})


def test_a_dead_band_is_of_relu_alone():
    entries = {"algo": "dagger", "dead_band": 0.1}
    refuses(r"^config\.dead_band: .*; expected 0", config_from, entries | {"activation": "tanh"})
    assert config_from(entries).dead_band == 0.1


@pytest.mark.parametrize(
    ("values", "rounds", "steps"),
    [
        ({"n_envs": 64, "log_every": 2000}, 32, 2048),
        ({"n_envs": 64, "log_every": 2048}, 32, 2048),
        ({"n_envs": 7, "train_freq": 3, "log_every": 1}, 1, 21),
    ],
)
def test_an_update_is_the_least_number_of_whole_rounds(values, rounds, steps):
    config = config_from({"algo": "sac", **values})
    assert (config.rounds, config.steps_per_update) == (rounds, steps)


@pytest.mark.parametrize(
    ("name", "values", "message"),
    [
        ("BallGrid", {"algo": "sac"}, r"algo: algo = 'sac'; expected .* Discrete\(4\)"),
        ("BallPark", {"algo": "dqn"}, r"algo: algo = 'dqn'; expected .* Box\("),
        (
            "BallParkGoal",
            {"algo": "sac", "n_envs": 8, "buffer_size": 807},
            "buffer_size: buffer_size = 807; expected at least 808: 101 steps of each",
        ),
        (
            "BallPark",
            {"algo": "sac", "n_envs": 8, "buffer_size": 7},
            "buffer_size: buffer_size = 7; expected at least 8",
        ),
        (
            "BallPark",
            {"goal_turn": True},
            "goal_turn: goal_turn = True; expected False: goals of .* hold no attitude",
        ),
        (
            "Reorient",
            {"goal_turn": True, "env_kwargs": {"frame": "reduced"}},
            "goal_turn: goal_turn = True; expected False: networks read no goals",
        ),
        ("BallGrid", {"action_std": [0.8, 0.1]}, "action_std: .*choices"),
        ("BallGrid", {"algo": "dagger"}, r"algo: algo = 'dagger'; expected .* Discrete"),
        (
            "SpinCapture",
            {"algo": "dagger", "teacher": "pid"},
            r"teacher: teacher = 'pid'; expected one of \['transfer', 'separatrix'\]",
        ),
        ("BallPark", {"algo": "dagger"}, "teacher: .*; expected a law of the state"),
        ("Reorient", {"algo": "dagger"}, "algo: .*; expected another one, or .*reduced"),
        *(
            (name, {"algo": algo, "policy_gain": 2.0}, "policy_gain: .*; expected 1")
            for name, algo in (("BallGrid", "ppo"), ("BallGrid", "dqn"), ("BallPark", "sac"))
        ),
        *(
            ("BallParkGoal", {"algo": "sac", key: 1.0}, f"{key}.*n_sampled")
            for key in ("cost_price", "success_bonus")
        ),
        ("SleepingTop", {"train_kwargs": {"weight_effort": "x"}}, r"train_kwargs\.weight_effort: "),
        ("SleepingTop", {"train_kwargs": {"wait_effort": 1.0}}, "train_kwargs.*wait_effort"),
        ("SleepingTop", {"train_kwargs": {"frame": "reduced"}}, "train_kwargs: .*spaces"),
    ],
)
def test_what_an_algorithm_cannot_learn_from_is_refused_before_the_run_begins(
    tmp_path, name, values, message
):
    config = config_from({"env_id": f"RigidEnvs/{name}-v0", "log_dir": str(tmp_path), **values})
    with pytest.raises(ConfigError, match=rf"^config\.{message}"):
        train(config, quiet=True)
    assert not [*tmp_path.glob("*/*")]


def test_without_goals_the_memory_need_not_hold_episodes():
    entries = {"algo": "sac", "n_envs": 8, "buffer_size": 8, "env_kwargs": {"frame": "reduced"}}
    config = config_from({"env_id": "RigidEnvs/BallParkGoal-v0", **entries})
    check_fit(config, make(config.env_id, config.env_kwargs, 8))


@pytest.mark.parametrize(
    ("algo", "key", "hint"),
    [
        ("ppo", "totl_timesteps", "did you mean 'total_timesteps'"),
        ("ppo", "n-envs", "did you mean 'n_envs'"),
        ("ppo", "buffer_size", ""),
        ("sac", "n_epochs", ""),
    ],
)
def test_a_key_that_is_unknown_is_answered_with_the_right_one(algo, key, hint):
    with pytest.raises(ValueError, match=rf"^config\.{key}: unknown key; {hint}"):
        config_from({"algo": algo, key: 1})


fine = st.fixed_dictionaries(
    {},
    optional={
        "seed": st.integers(0, 2**63 - 1),
        "total_timesteps": st.integers(1, 10**12) | st.sampled_from([3e6, 1e9]),
        "gamma": st.floats(0, 1) | st.sampled_from([0, 1]),
        "learning_rate": st.floats(1e-12, 1) | st.lists(st.floats(0, 1), min_size=2, max_size=2),
        "net_arch": st.lists(st.integers(1, 4096), max_size=8),
        "activation": st.sampled_from(["tanh", "relu", "elu", "silu"]),
        "normalize_reward": st.booleans(),
        "checkpoint_every": st.none() | st.integers(1, 1000),
        "target_kl": st.none() | st.floats(1e-9, 100),
        "action_std": st.none() | st.lists(st.floats(1e-6, 10), min_size=2, max_size=2),
        "env_kwargs": st.dictionaries(
            st.text(), st.floats(allow_nan=False, allow_infinity=False) | st.text() | st.booleans()
        ),
        "run_name": st.none() | st.from_regex(r"[A-Za-z0-9_-]{1,80}", fullmatch=True),
    },
)


@given(fine)
@example({"run_name": "0E0"})  # a text that reads like a number
def test_a_good_config_is_accepted_and_survives_its_own_yaml(values):
    config = config_from(values)
    assert config_from(reading.parse_yaml(reading.dump_yaml(config_to_dict(config)))) == config


def test_batches_must_divide_the_samples():
    why = r"^config\.batch_size: batch_size = 3000; expected a divisor of .* = 16384"
    refuses(why, config_from, {"batch_size": 3000})


@pytest.mark.parametrize(
    ("text", "value"),
    [
        # the examples of YAML 1.2.2, section 10.3.2
        ("[null, Null, NULL, ~, ]", [None] * 4),
        ("a:", {"a": None}),
        ("[true, True, TRUE, false, False, FALSE]", [True] * 3 + [False] * 3),
        ("[0, 0o7, 0x3A, -19]", [0, 7, 0x3A, -19]),
        ("[0., -0.0, .5, +12e03, -2E+05]", [0.0, -0.0, 0.5, 12e3, -2e5]),
        ("[.inf, -.Inf, +.INF]", [math.inf, -math.inf, math.inf]),
        ("[1e-3, 1E5, -2.5e-4, 1., +3e+2, 7, 4e6]", [1e-3, 1e5, -2.5e-4, 1.0, 300.0, 7, 4e6]),
        # what YAML 1.1 reads otherwise
        ("[010, 08, -010, +1]", [10, 8, -10, 1]),
        ("[1:30:45, 1:30.5, 190:20]", ["1:30:45", "1:30.5", "190:20"]),
        ("[yes, no, on, off, y, n, Yes, NO]", ["yes", "no", "on", "off", "y", "n", "Yes", "NO"]),
        ("[2020-01-01, 2001-12-14t21:59:43Z]", ["2020-01-01", "2001-12-14t21:59:43Z"]),
        ("[0b11, 0O7, -0x1, =, <<]", ["0b11", "0O7", "-0x1", "=", "<<"]),
        ("[nUll, tRue]", ["nUll", "tRue"]),
        ("[1_000_000, 1__0, _1, 1_]", [1_000_000, "1__0", "_1", "1_"]),
        ("['1', \"true\", !!str 1, !!float 1, !!int '7']", ["1", "true", "1", 1.0, 7]),
    ],
)
def test_scalars_are_those_of_the_core_schema_of_yaml_1_2(text, value):
    found = reading.parse_yaml(text)
    assert repr(found) == repr(value)
    if isinstance(found, list):
        assert repr(reading.parse_yaml(reading.dump_yaml({"again": found}))["again"]) == repr(value)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("? [1, 2]\n: 3\n", "found unhashable key"),
        ("? {a: 1}\n: 3\n", "found unhashable key"),
        ("{1: a, 0x1: b}", "key 1 is there twice"),
        ("a: !!int 1:30:45", "'1:30:45' is no"),
        ("a: !!bool yes", "'yes' is no"),
        ("a: !!int [1]", "expected a scalar"),
        ("? !!seq b\n: 1", "found unhashable key"),
        ("a: !!timestamp 2020-01-01", "timestamp"),
        ("a: !!binary aGk=", "binary"),
        ("a: !!set {x}", "set"),
        ("seed: 1\nseed: 2\n", "'seed' is there twice"),
        ("env_kwargs: {dt: 1, dt: 2}\n", "'dt' is there twice"),
        ("a: &a [1]\nb: *a\n", "aliases"),
        ("a: !!python/object/apply:os.system [echo]\n", "python"),
        ("a: !!python/name:os.system\n", "python"),
        ("[" * 20_000, "YAML"),
        ("seed: [1\n", "YAML"),
        ("- 1\n", "expected a mapping"),
        ("a: \0\n", "YAML"),
        ("x: " + "1" * 70_000, "at most 65536"),
    ],
)
def test_yaml_that_is_not_plain_data_is_refused(tmp_path, text, why):
    file = tmp_path / "bad.yaml"
    file.write_text(text)
    with pytest.raises(ValueError, match=rf"bad\.yaml: (?s:.*){why}"):
        reading.read_yaml(file)


def test_options_go_over_the_file_and_the_file_over_the_defaults(tmp_path):
    file = tmp_path / "a.yaml"
    file.write_text("seed: 3\ngamma: 0.5\nenv_kwargs: {dt: 0.1, rotation: quat}\n")
    rest = ["--env_kwargs.dt", "2e-1", "--env_kwargs.goal=3"]
    config = reading.load_config(
        reading.read_yaml(file), {"seed": "4", "learning_rate": "[1e-3, 0]"}, rest
    )
    assert (config.seed, config.gamma, config.n_envs) == (4, 0.5, 256)
    assert config.learning_rate == (1e-3, 0.0)
    assert config.env_kwargs == {"dt": 0.2, "rotation": "quat", "goal": 3}
    with pytest.raises(ValueError, match=r"^config\.seeds: unknown key; did you mean 'seed'\?"):
        reading.load_config(reading.read_yaml(file), {}, ["--seeds", "3"])
    with pytest.raises(ValueError, match=r"^config\.env_kwargs\.dt: expected a value"):
        reading.load_config(reading.read_yaml(file), {}, ["--env_kwargs.dt"])


@pytest.mark.parametrize("text", ["a=b=c", "a=", "--x=1", "{a: 'b=c'}", "1"])
def test_a_value_of_the_task_is_all_that_stands_behind_its_name(text):
    """Whatever is in it: the first "=" of a word that begins with a name is the only one."""
    more = "--env_kwargs.more"
    for rest in (["--env_kwargs.x", text, more, "2"], [f"--env_kwargs.x={text}", f"{more}=2"]):
        assert reading.env_keywords(rest) == {"x": reading.entry_value("x", text), "more": 2}


@pytest.mark.parametrize("path", CONFIGS, ids=lambda path: path.stem)
def test_a_shipped_config_is_accepted_and_so_is_its_environment(path):
    config = config_from(reading.read_yaml(path))
    venv = make(config.env_id, config.env_kwargs, 2)
    check_fit(config, venv)
    venv.close()


@pytest.mark.parametrize("name", ["a", "BallPark-v0_1", "x" * 80, "...a", "-"])
@pytest.mark.parametrize("bad", ["", ".", "..", "...", "a/b", "a\\b", "a b", "x" * 81, "a\n", "é"])
def test_a_name_that_could_leave_the_folder_is_refused(name, bad):
    assert is_folder_name(name) and not is_folder_name(bad)
