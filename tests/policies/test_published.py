"""Published policies: found by name, run without torch, and of the figures that were published."""

import json
import random
import re
import shutil
from dataclasses import replace
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

import rigid_envs
from rigid_envs.base.checks import ConfigError
from rigid_envs.base.files import DamagedFileError, save_tensors
from rigid_envs.engine.provenance import commit
from rigid_envs.scores import trained as loading
from rigid_envs.scores.evaluation import evaluate, published_evaluation, published_record, recheck
from rigid_envs.scores.records import (
    read_evaluation,
    read_record,
    read_records,
    record_file,
    write_record,
)
from rigid_envs.scores.trained import FOLDER, CompiledPolicy, load, published
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.testing.environments import FULL, PUSH
from rigid_envs.tools.cli import main
from tests.programs import printed
from tests.refusals import refuses

STREAM = np.random.default_rng(5)


def example(**network):
    """Document and arrays of an untrained policy for a box of two actions."""
    env = gym.make("RigidEnvs/BallPark-v0", frame="reduced")
    n_obs, n_act = env.observation_space.shape[0], env.action_space.shape[0]
    sizes = (n_obs, 16, n_act)
    arrays = {"log_std": np.zeros(n_act)}
    arrays |= {"action.low": -np.ones(n_act), "action.high": np.ones(n_act)}
    for k in range(2):
        arrays[f"layers.{k}.weight"] = STREAM.normal(size=(sizes[k + 1], sizes[k]))
        arrays[f"layers.{k}.bias"] = STREAM.normal(size=sizes[k + 1])
    document = {
        "format": loading.FORMAT,
        "algo": "ppo",
        "env_id": "RigidEnvs/BallPark-v0",
        "env_kwargs": {"frame": "reduced", "weight_parked": 3.0},
        "network": {"activation": "tanh", "distribution": "gaussian", "normalized": False}
        | network,
    }
    return document, {name: array.astype(np.float32) for name, array in arrays.items()}


def saved(folder, name="policy"):
    document, arrays = example()
    save_tensors(folder / f"{name}.safetensors", arrays, document)
    return folder / f"{name}.safetensors"


@pytest.fixture
def shelf(tmp_path, monkeypatch):
    """A folder in the place of that of the published policies, with one policy."""
    saved(tmp_path, "BallPark-v0")
    monkeypatch.setattr(loading.published, "__defaults__", (tmp_path,))
    monkeypatch.setattr(loading.file_of, "__defaults__", (tmp_path,))
    return tmp_path


@pytest.mark.parametrize("name", ["BallPark", "BallPark-v0", "RigidEnvs/BallPark-v0"])
def test_a_published_policy_has_the_name_of_its_environment(shelf, name):
    policy = rigid_envs.load(name)
    assert policy.env_id == "RigidEnvs/BallPark-v0" and policy.name == "ppo reduced"
    assert policy.env_kwargs == {"frame": "reduced"}  # what pays is no matter of acting


@pytest.mark.parametrize("name", ["Nothing", "RigidEnvs/CoinPark-v0", "../secret", ""])
def test_another_name_is_refused_and_those_that_there_are_are_told(shelf, name):
    with pytest.raises(ConfigError, match=r"expected the path .*: BallPark-v0$"):
        rigid_envs.load(name)


def test_a_policy_is_loaded_from_its_file_or_its_folder(tmp_path):
    file = saved(tmp_path)
    for place in (file, str(file), tmp_path):
        assert isinstance(rigid_envs.load(place), CompiledPolicy)
    file.write_bytes(file.read_bytes()[:-1])
    with pytest.raises(DamagedFileError, match=r"policy\.safetensors"):
        rigid_envs.load(file)


def layers(numbers, weight, **more):
    """Arrays of so many layers, all the same."""
    parts = {"weight": weight, **more}
    return {f"layers.{k}.{name}": each for k in numbers for name, each in parts.items()}


def other(name, change):
    """Another array in the place of one."""
    return lambda arrays, document: arrays.update({name: change(arrays[name])})


CHANGES = {
    "another format": lambda arrays, document: document.update(format="policy 9"),
    "no format": lambda arrays, document: document.pop("format"),
    "no network": lambda arrays, document: document.pop("network"),
    "network is a list": lambda arrays, document: document.update(network=[]),
    "no layers": lambda arrays, document: [arrays.pop(k) for k in [*arrays] if "layers" in k],
    "a gap": lambda arrays, document: arrays.update(
        {"layers.7.weight": arrays.pop("layers.1.weight")}
    ),
    "too many layers": lambda arrays, document: arrays.update(
        layers(range(3, 200), np.zeros((1, 1), "f"))
    ),
    "65 layers": lambda arrays, document: arrays.update(
        layers(range(2, 65), np.eye(2, dtype="f"), bias=np.zeros(2, "f"))
    ),
    "not finite": lambda arrays, document: arrays["layers.0.weight"].fill(np.nan),
    "double": other("layers.0.weight", lambda weight: weight.astype(np.float64)),
    "a vector": other("layers.1.weight", lambda weight: weight[0]),
    "layers that do not fit": other("layers.1.weight", lambda weight: weight[:, :-1]),
    "bias that does not fit": other("layers.1.bias", lambda bias: bias[:-1]),
    "no spread": lambda arrays, document: arrays.pop("log_std"),
    "statistics without use": lambda arrays, _: arrays.update({"observation.mean": np.zeros(2)}),
    "bounds that do not fit": other("action.low", lambda low: np.zeros(3, "f")),
}
NETWORKS = {
    "statistics missing": {"normalized": True},
    "spread of another kind": {"distribution": "squashed gaussian"},
    "bounds of no box": {"distribution": "greedy"},
    "inputs that do not fit": {"inputs": [["achieved_goal", 11]]},
    "attitudes that do not fit": {"attitudes": [0, 9]},
}
"""Contents that are wrong, of files whose checksum is right."""


@pytest.mark.parametrize("how", [*CHANGES, *NETWORKS])
def test_a_malformed_policy_is_refused_by_name(tmp_path, how):
    document, arrays = example(**NETWORKS.get(how, {}))
    CHANGES.get(how, lambda *_: None)(arrays, document)
    save_tensors(tmp_path / "policy.safetensors", arrays, document)
    with pytest.raises(DamagedFileError, match=r"policy\.safetensors: "):
        rigid_envs.load(tmp_path)


@pytest.mark.parametrize("what", ["activation", "distribution"])
def test_a_network_of_an_unknown_kind_is_refused_with_the_kinds_there_are(what):
    document, arrays = example(**{what: "os.system"})
    with pytest.raises(ValueError, match=rf"^{what} = 'os.system'; expected one of \['[a-z]+', "):
        CompiledPolicy(document, arrays)


@pytest.mark.parametrize("n_layers", [1, 2, 64])
def test_a_policy_has_1_to_64_layers(n_layers):
    document, arrays = example()
    weight, bias = arrays["layers.1.weight"], arrays["layers.1.bias"]
    if n_layers == 1:
        arrays["layers.0.weight"] = weight @ arrays["layers.0.weight"]
        arrays["layers.0.bias"] = bias
        del arrays["layers.1.weight"], arrays["layers.1.bias"]
    for k in range(2, n_layers):
        arrays[f"layers.{k}.weight"], arrays[f"layers.{k}.bias"] = np.eye(2, dtype="f"), bias
    policy = CompiledPolicy(document, arrays)
    assert policy.predict(np.zeros(policy.n_obs))[0].shape == (2,)


def test_relative_rotations_are_taken_from_observations_as_they_are():
    n_obs = 20
    document, arrays = example(attitudes=[0, n_obs - 9])
    arrays["layers.0.weight"] = 0.1 * STREAM.normal(size=(16, n_obs + 18)).astype(np.float32)
    policy = CompiledPolicy(document, arrays)
    assert policy.n_obs == n_obs
    obs = STREAM.normal(size=(5, n_obs)).astype(np.float32)
    R, S = obs[:, :9].reshape(-1, 3, 3), obs[:, -9:].reshape(-1, 3, 3)
    back = R.transpose(0, 2, 1)
    x = np.concatenate([obs, (back @ S).reshape(5, 9), (S @ back).reshape(5, 9)], axis=1)
    hidden = np.tanh(x @ arrays["layers.0.weight"].T + arrays["layers.0.bias"])
    expected = hidden @ arrays["layers.1.weight"].T + arrays["layers.1.bias"]
    np.testing.assert_allclose(policy.predict(obs)[0], np.clip(expected, -1.0, 1.0), atol=1e-5)
    for outside in (n_obs - 8, -1, 0.0, True):
        for places in ([outside, 0], [0, outside]):
            document["network"]["attitudes"] = places
            refuses("expected where matrices are in the input", CompiledPolicy, document, arrays)


@pytest.mark.parametrize("head", ["gaussian", "squashed gaussian"])
def test_actions_are_in_the_box_of_the_policy_and_squashed_ones_fill_it(head):
    document, arrays = example(distribution=head)
    low, high = np.array([-3.0, 0.5], np.float32), np.array([1.0, 2.0], np.float32)
    arrays |= {"action.low": low, "action.high": high}
    if head == "squashed gaussian":
        del arrays["log_std"]
        arrays |= {"log_std.weight": np.zeros((2, 16), "f"), "log_std.bias": np.zeros(2, "f")}
    policy = CompiledPolicy(document, arrays)
    obs = STREAM.normal(size=(20, policy.n_obs)).astype(np.float32)
    hidden = np.tanh(obs @ arrays["layers.0.weight"].T + arrays["layers.0.bias"])
    out = hidden @ arrays["layers.1.weight"].T + arrays["layers.1.bias"]
    squashed = 0.5 * ((high + low) + (high - low) * np.tanh(out))
    expected = np.clip(out, low, high) if head == "gaussian" else squashed
    np.testing.assert_allclose(policy.predict(obs)[0], expected, atol=1e-4)


def test_one_observation_is_acted_on_as_among_others():
    policy = CompiledPolicy(*example())
    obs = STREAM.normal(size=(40, policy.n_obs)).astype(np.float32)
    actions, state = policy.predict(obs, state="kept")
    assert state == "kept" and actions.dtype == np.float32 and np.abs(actions).max() <= 1.0
    for row, action in zip(obs, actions, strict=True):
        np.testing.assert_array_equal(policy.predict(row)[0], action)


@pytest.mark.parametrize("shape", [(1,), (1, 1), (1, 1, 0), (0,)])
def test_an_observation_of_another_shape_or_not_finite_is_refused(shape):
    policy = CompiledPolicy(*example())
    one_bad = np.where(np.arange(policy.n_obs) == 1, np.nan, 0.0)
    part = {"achieved_goal": np.zeros(policy.n_obs)}
    for obs in (np.zeros(shape), np.zeros((2, 1, policy.n_obs)), one_bad, part):
        with pytest.raises(ValueError, match="every entry finite"):
            policy.predict(obs)
    parted = CompiledPolicy(*example(inputs=[["a", 2], ["b", policy.n_obs - 2]]))
    with pytest.raises(ValueError, match=r"^observation\[.a.\]: shape .*, expected 2 last"):
        parted.predict({"a": np.zeros(policy.n_obs - 2), "b": np.zeros(2)})


def test_it_does_not_draw_at_random():
    policy = CompiledPolicy(*example())
    with pytest.raises(ValueError, match="deterministic = False; expected True"):
        policy.predict(np.zeros(policy.n_obs), deterministic=False)


def test_it_is_played_in_its_own_frame_also_on_another_id():
    policy = CompiledPolicy(*example())
    for name in ("BallPark", "BallReorient", "BallParkGoal"):
        found = rigid_envs.evaluate(f"RigidEnvs/{name}-v0", policy, n=3)
        assert found.config == {"frame": "reduced"} and found.policy == "ppo reduced"
        assert found.efficiency is not None
    with pytest.raises(ValueError, match="observation of shape"):
        rigid_envs.evaluate("RigidEnvs/BallPark-v0", policy, n=3, config={})


def test_it_needs_neither_torch_nor_safetensors(tmp_path):
    file = saved(tmp_path)
    code = f"""
import sys
for name in ("torch", "safetensors", "stable_baselines3", "agents"):
    sys.modules[name] = None
import numpy as np, rigid_envs
policy = rigid_envs.load({str(file)!r})
print(policy.predict(np.zeros(policy.n_obs))[0].tolist())
"""
    policy = rigid_envs.load(file)
    assert json.loads(printed("-c", code)) == policy.predict(np.zeros(policy.n_obs))[0].tolist()


STEERING = "PPO\x1b]0;owned\x07"


@pytest.mark.parametrize(
    "says",
    [
        {"algo": STEERING},
        {"env_id": STEERING},
        {"env_kwargs": {"frame": STEERING}},
        {"versions": {STEERING: "1"}},
        {"git_commit": "a\n| forged | row |"},
    ],
)
def test_text_of_a_policy_that_would_steer_a_terminal_is_refused(tmp_path, says):
    document, arrays = example()
    save_tensors(tmp_path / "policy.safetensors", arrays, document | says)
    with pytest.raises(DamagedFileError, match="can be printed") as refused:
        rigid_envs.load(tmp_path)
    assert str(refused.value).isprintable()


def test_the_id_of_a_policy_is_one_that_is_registered_already(tmp_path):
    document, arrays = example()
    document["env_id"] = f"trap:{document['env_id']}"
    save_tensors(tmp_path / "policy.safetensors", arrays, document)
    assert rigid_envs.load(tmp_path).env_id == "RigidEnvs/BallPark-v0"


ROOT = Path(__file__).parents[2]
NAMES = published()
AT_A_PUSH = 4  # of 24, beside those whose kernels other tests need
OTHER_SEED = 161803  # of starts that nobody has published figures of


def sample():
    """Policies drawn by the commit: the same within a push, others at the next one."""
    head = commit()["git_commit"] or ""
    return random.Random(head).sample(NAMES, min(AT_A_PUSH, len(NAMES)))


def test_there_are_published_policies_each_named_by_its_environment():
    assert NAMES
    for name in NAMES:
        policy, record = load(name), published_record(name)
        assert policy.env_id in ENVIRONMENTS
        assert policy.env_id == record.env_id == f"RigidEnvs/{name}"
        assert policy.name == record.policy and policy.document["seed"] == record.seed


SAMPLE = sample()


def marks(name):
    """Seconds go into compiling a frame that no other test has."""
    if f"RigidEnvs/{name}" in FULL:
        return ()
    return PUSH if name in SAMPLE else pytest.mark.long


@pytest.mark.parametrize("name", [pytest.param(name, marks=marks(name)) for name in NAMES])
def test_all_hit_every_published_figure(name):
    assert recheck(name).differences == ()


@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_success_from_other_starts_is_within_the_published_interval(name):
    assert recheck(name, OTHER_SEED).differences == ()


def test_records_of_the_same_policy_among_the_baselines_have_the_same_figures():
    for name in NAMES:
        mine = published_record(name)
        file = record_file(ROOT / "docs/baselines", mine.env_id, mine.algo, mine.frame, mine.seed)
        if file.is_file() and (other := read_record(file)).policy_sha256 == mine.policy_sha256:
            n = len(other.costs)  # a record of version 1 has the first ones alone
            np.testing.assert_array_equal(mine.successes[:n], other.successes)
            np.testing.assert_array_equal(mine.costs[:n], other.costs)


def test_a_record_of_an_easier_task_has_no_efficiency():
    record = published_record(NAMES[0])
    assert record.evaluation.efficiency is not None
    easier = replace(record, settings={"frame": "reduced", "dt": 0.07})
    assert easier.evaluation.efficiency is None


def test_records_of_other_tasks_and_of_a_part_of_the_starts_are_passed_over(tmp_path):
    record = published_record(NAMES[0])
    few = replace(record, successes=record.successes[:9], costs=record.costs[:9])
    elsewhere = replace(record, env_id="Mine/Top-v0")
    easier = replace(record, settings={"dt": 0.07})
    for name, each in (("a", record), ("b", few), ("c", elsewhere), ("d", easier)):
        write_record(tmp_path / "folder" / f"{name}.json", each)
    (found,) = read_records(tmp_path)
    assert (found.env_id, len(found.costs)) == (record.env_id, 500)


def test_a_rate_at_the_end_of_its_interval_holds_and_another_file_is_told(tmp_path, monkeypatch):
    name = NAMES[0]
    for file in FOLDER.glob(f"{name}.*"):
        shutil.copy(file, tmp_path)
    won = np.ones(500, dtype=bool)  # the interval of a rate of 1 ends there
    write_record(tmp_path / f"{name}.json", replace(published_record(name), successes=won))
    like = published_evaluation(name)
    for rate, held in ((1.0, True), (0.9, False)):
        success = (np.arange(500) < 500 * rate).astype(np.float64)
        found = replace(like, values={"success": success, like.cost.name: 2.0 * like.costs})
        monkeypatch.setattr(
            "rigid_envs.scores.evaluation.evaluate",
            lambda *a, seed, f=found, **k: replace(f, seed=seed),
        )
        again = recheck(name, OTHER_SEED, tmp_path)
        assert (again.differences == ()) == held and again.now.seed == OTHER_SEED
    other = replace(published_record(name), policy_sha256=64 * "0")
    write_record(tmp_path / f"{name}.json", other)
    assert recheck(name, OTHER_SEED, tmp_path).differences[-1] == "the record is of another file"


def test_a_policy_file_is_evaluated_by_the_command(tmp_path, capsys):
    name = NAMES[0]
    words = ["evaluate", f"RigidEnvs/{name}", "--policy", str(FOLDER / f"{name}.safetensors")]
    assert main([*words, "--starts", "20", "--out", str(tmp_path / "row.json")]) == 0
    found, record = read_evaluation(tmp_path / "row.json"), published_record(name)
    np.testing.assert_array_equal(found.costs, record.costs[:20])
    assert found.policy == record.policy
    assert main([*words, "--starts", "2", "--name", "mine", "--out", str(tmp_path / "b.json")]) == 0
    assert read_evaluation(tmp_path / "b.json").policy == "mine"
    short = name.removesuffix("-v0")
    words = ["evaluate", short, "--policy", short, "--starts", "20"]
    assert main([*words, "--out", str(tmp_path / "c.json")]) == 0
    np.testing.assert_array_equal(read_evaluation(tmp_path / "c.json").costs, found.costs)


def test_a_record_is_as_good_as_the_evaluation_that_it_is_of():
    name = NAMES[0]
    told, found = published_evaluation(name), evaluate(f"RigidEnvs/{name}", load(name))
    assert (told.success, told.efficiency, told.gap) == (found.success, found.efficiency, found.gap)
    assert told.mean(told.costs) == found.mean(found.costs)


def test_the_example_of_the_page_loads_acts_and_evaluates(capsys):
    text = (ROOT / "docs" / "policies.md").read_text(encoding="utf-8")
    (code, *_) = re.findall(r"```python\n(.+?)```", text, flags=re.DOTALL)
    names = {}
    exec(code, names)
    assert names["env"].action_space.contains(names["action"])
    out = capsys.readouterr().out
    assert out.count("efficiency") == 2 and "RigidEnvs/BallReorient-v0 frame='reduced': ppo" in out
