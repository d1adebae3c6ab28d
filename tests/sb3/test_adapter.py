"""The adapter says what SB3 expects, to the bit, at the cost of microseconds."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

from rigid_envs.sb3.adapter import GymnasiumVecEnv, NonFiniteError, make_vec_env, split
from rigid_envs.scores.policies import RandomPolicy
from tests.agents.drift import Drift
from tests.refusals import refuses
from tests.sb3.script import Script, steps


def test_the_trace_is_the_one_written_by_hand():
    env = GymnasiumVecEnv(Script())
    assert env.reset().ravel().tolist() == [0, 10, 20]
    first, second, third = steps(env, 3)

    obs, rewards, dones, infos = first
    assert obs.ravel().tolist() == [1, 11, 21]
    assert rewards.tolist() == [1, 11, 21] and rewards.dtype == np.float32
    assert dones.tolist() == [False, False, False]
    assert infos == [{}, {}, {}]

    obs, rewards, dones, infos = second
    assert obs.ravel().tolist() == [0, 12, 22]
    assert rewards.tolist() == [2, 12, 22]
    assert dones.tolist() == [True, False, False]
    assert infos[1:] == [{}, {}]
    last = infos[0].pop("terminal_observation")
    assert last.tolist() == [2.0] and last.dtype == np.float32
    assert infos[0].pop("pose").tolist() == [2.0, 4.0]
    told = {"elapsed": 2, "is_success": True, "only_row_0": 7, "TimeLimit.truncated": False}
    assert infos[0] == told | {"episode": {"r": 3.0, "l": 2}}

    obs, rewards, dones, infos = third
    assert obs.ravel().tolist() == [1, 10, 20]
    assert dones.tolist() == [False, True, True]
    assert infos[0] == {}
    assert infos[1]["TimeLimit.truncated"] is True and infos[1]["is_success"] is False
    # Row 2 ends by itself at the very step of the limit: not a truncation.
    assert infos[2]["TimeLimit.truncated"] is False and infos[2]["is_success"] is True
    assert infos[1]["episode"] == {"r": 36.0, "l": 3}
    assert infos[2]["episode"] == {"r": 66.0, "l": 3}
    assert "only_row_0" not in infos[1]


def test_rows_never_share_an_info():
    env = GymnasiumVecEnv(Drift(8))
    env.reset()
    for _, _, _, infos in steps(env, 30):
        assert len({id(info) for info in infos}) == 8


def test_consecutive_seeds_go_as_one_integer_and_others_as_a_list():
    script = Script()
    env = GymnasiumVecEnv(script)
    env.seed(5)
    env.reset()
    assert script.seen_seed == 5
    env.seed([9, 2, 4])
    env.reset()
    assert script.seen_seed == [9, 2, 4]
    env.reset()
    assert script.seen_seed is None
    with pytest.raises(ValueError, match="seed has 2 entries; expected 3"):
        env.seed([1, 2])
    for seed in (5, np.int64(5)):
        assert env.seed(seed) == [5, 6, 7]


def test_no_seed_is_one_of_the_global_generator_as_in_sb3():
    seeds = []
    for env in (GymnasiumVecEnv(Script()), DummyVecEnv([lambda: gym.make("CartPole-v1")] * 3)):
        np.random.seed(3)  # noqa: NPY002
        seeds.append([int(seed) for seed in env.seed()])
    assert seeds[0] == seeds[1]


def test_options_go_to_the_next_reset_only():
    script = Script()
    env = GymnasiumVecEnv(script)
    env.set_options({"tilt": 1})
    env.reset()
    assert script.seen_options == {"tilt": 1}
    env.reset()
    assert script.seen_options is None
    env.set_options([{"tilt": 1}, {"tilt": 2}, {"tilt": 3}])
    refuses("expected the same for all rows", env.reset)
    env.set_options(None)
    env.reset()
    assert script.seen_options is None
    for bad in (3, [{}] * 2, [{}, 3, {}], [3, {}, {}], [None] * 3):
        refuses(r"^options = .*; expected a dictionary, or a list of 3", env.set_options, bad)


def test_pictures_are_one_for_each_row_or_none(monkeypatch):
    env, pictures = GymnasiumVecEnv(Script()), tuple(np.zeros((3, 2, 2, 3), np.uint8))
    monkeypatch.setattr(env.venv, "render", lambda: pictures)
    assert [*map(id, env.get_images())] == [*map(id, pictures)]
    monkeypatch.setattr(env.venv, "render", lambda: None)
    assert env.get_images() == [None] * 3


def test_rows_that_there_are_not_are_refused():
    env = GymnasiumVecEnv(Drift(3))
    assert env.get_attr("limit", np.array([0, 2])) == [20, 20] and env.get_attr("limit", []) == []
    bads = [3, -1, [0, 3], [-1, 0], [0.0, 1.0], 1.0, [True, False], "a", [[0, 1]]]
    for bad in bads:
        refuses(r"^indices = .*; expected integers from 0 to 2", env.get_attr, "limit", bad)


def test_attributes_and_methods_reach_the_environment():
    env = GymnasiumVecEnv(Drift(3))
    assert env.get_attr("limit") == [20, 20, 20]
    assert env.get_attr("limit", [0, 1]) == [20, 20]
    env.set_attr("limit", 7)
    assert env.venv.limit == 7
    refuses("share one object", env.set_attr, "limit", 8, indices=[1])
    with pytest.raises(AttributeError, match="nonsense"):
        env.get_attr("nonsense")
    no_name = 3
    for ask in (env.get_attr, env.env_method):
        with pytest.raises(AttributeError, match=r"^3 is no name of an attribute or a method"):
            ask(no_name)
    assert env.env_method("get_state", indices=0)[0].keys() == env.venv.state.keys()
    assert env.env_is_wrapped(Monitor) == [True] * 3
    rows = cart_poles()
    rows.set_attr("gravity", 1.5, indices=[1])
    assert rows.get_attr("gravity") == [9.8, 1.5, 9.8]
    calls = []
    env.venv.count = lambda *words: calls.append("shared") or len(calls)
    assert env.env_method("count", "a", indices=[0, 2]) == [1, 1]  # one object, one call
    for k, each in enumerate(rows.venv.envs):
        each.unwrapped.count = lambda k=k: calls.append(f"row {k}") or k
    assert rows.env_method("count") == [0, 1, 2] and rows.env_method("count", indices=[1]) == [1]
    assert calls == ["shared", "row 0", "row 1", "row 2", "row 1"]
    env.close()
    assert env.venv.closed


def test_what_wrappers_do_not_have_is_that_of_the_environment_behind_them():
    inner = Drift(3)
    env = GymnasiumVecEnv(gym.vector.VectorWrapper(inner))
    assert env.get_attr("limit") == [20, 20, 20]
    assert env.env_method("get_state", indices=0)[0].keys() == inner.state.keys()
    with pytest.raises(AttributeError, match="has no attribute or method 'nonsense'"):
        env.get_attr("nonsense")


def test_an_entry_of_some_rows_is_in_the_infos_of_those_alone():
    columns = {"a": np.array([1, 2, 3]), "_a": np.array([True, False, True]), "b": np.arange(3.0)}
    assert split(columns, np.array([0, 1, 2])) == [
        *({"a": 1, "b": 0.0}, {"b": 1.0}, {"a": 3, "b": 2.0})
    ]
    assert split(columns, np.array([2, 0])) == [{"a": 3, "b": 2.0}, {"a": 1, "b": 0.0}]
    assert split(columns, np.array([1])) == [{"b": 1.0}]
    assert split({}, np.array([0, 2])) == [{}, {}]
    # neither is a mask: an underscore alone, or a name that ends as another
    names = {"own": 7, "_hidden": 8, "down": 9}
    columns = {name: np.array([number]) for name, number in names.items()}
    assert split({**columns, "__hidden": np.array([True])}, np.array([0])) == [names]


@pytest.mark.parametrize("bad", [3, None, gym.make("CartPole-v1")])
def test_what_is_no_vector_environment_is_refused(bad):
    refuses(r"^venv = .*; expected a gymnasium\.vector\.VectorEnv", GymnasiumVecEnv, bad)


def test_another_autoreset_mode_is_refused():
    with pytest.raises(ValueError, match="SameStep"):
        GymnasiumVecEnv(Drift(2, autoreset_mode="NextStep"))


@pytest.fixture
def drift():
    """Five steps after its start; the reward of the next one is bad in row 2."""
    env = GymnasiumVecEnv(Drift(4, bad_reward_at=6))
    env.reset()
    steps(env, 5)
    return env


def overflow(env):
    env._returns[:] = np.finfo(float).max
    env.venv.bad_reward_at = -1


SPOILT = np.where(np.arange(4)[:, None] == 3, np.inf, np.zeros((4, 2)))


def spoil_observation(env, seen=SPOILT):
    env.venv.bad_reward_at = -1
    env.venv._observe = lambda: seen


def spoil_last_observation(env):
    env.venv.bad_reward_at, env.venv.limit = -1, 1
    env.venv._observe = iter([SPOILT, np.zeros((4, 2))]).__next__


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda env: None, r"reward of row 2 .* step 6 of the run.*\[0.0, 0.0\]"),
        (overflow, "sum of rewards of an episode overflowed at step 6"),
        (spoil_observation, "^observation of row 3"),
        (lambda env: spoil_observation(env, (np.ones((4, 2)), SPOILT)), "^observation of row 3"),
        (spoil_last_observation, "^last observation of row 3"),
    ],
)
def test_what_is_not_finite_stops_at_its_step_and_is_named(drift, spoil, message):
    spoil(drift)
    with pytest.raises(NonFiniteError, match=message):
        steps(drift, 1)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_an_action_that_is_not_finite_is_named_and_not_taken(drift, bad):
    actions, before = np.zeros((4, 2), np.float32), drift.venv.state["elapsed"].tolist()
    actions[1, 0] = bad
    for given in (actions, np.ma.masked_invalid(actions)):
        with pytest.raises(NonFiniteError, match=r"action of row 1 .* step 6 of the run"):
            drift.step(given)
    assert drift.venv.state["elapsed"].tolist() == before


@pytest.mark.parametrize("bad", [None, 0.5, [[0.0] * 2] * 4, np.full((4, 2), "0"), np.ones(4) * 1j])
def test_what_is_no_array_of_numbers_is_no_action(drift, bad):
    refuses(r"(?s)^actions = .*; expected an array of numbers, a row for each", drift.step, bad)


GOAL = "RigidEnvs/BallParkGoal-v0"
GRID = "RigidEnvs/BallGrid-v0"
CART = "CartPole-v1"
N = 3


def native(env_id, **kwargs):
    return make_vec_env(env_id, N, **kwargs)


def assert_same(mine, theirs):
    if isinstance(theirs, dict):
        assert set(mine) == set(theirs)
        for key in theirs:
            assert_same(mine[key], theirs[key])
    else:
        np.testing.assert_array_equal(mine, theirs)
        assert np.asarray(mine).dtype == np.asarray(theirs).dtype


def cart_poles():
    rows = [lambda: gym.make(CART)] * N
    return GymnasiumVecEnv(SyncVectorEnv(rows, autoreset_mode=AutoresetMode.SAME_STEP))


@pytest.mark.parametrize("env_id", [GOAL, GRID, CART])
def test_rows_are_single_environments_as_sb3_vectorises_them(env_id):
    ours = cart_poles() if env_id == CART else native(env_id)
    theirs = DummyVecEnv([lambda: Monitor(gym.make(env_id))] * N)
    ours.seed(7)
    theirs.seed(7)
    assert ours.observation_space == theirs.observation_space
    assert ours.action_space == theirs.action_space
    assert_same(ours.reset(), dict(theirs.reset()) if env_id == GOAL else theirs.reset())
    draw = RandomPolicy(ours.action_space, np.random.default_rng(0))
    ends = 0
    for _ in range(210):
        actions, _ = draw.predict(np.zeros((N, 1)))
        obs, *rest, infos = ours.step(actions)
        other, *others, other_infos = theirs.step(actions)
        assert_same(obs, dict(other) if env_id == GOAL else other)
        assert_same(rest, others)
        for row in np.flatnonzero(rest[1]):
            ends += 1
            mine, his = infos[row], other_infos[row]
            assert_same(mine["terminal_observation"], his["terminal_observation"])
            for key in ("TimeLimit.truncated", "is_success"):
                assert mine.get(key) == his.get(key)
            assert mine["episode"]["l"] == his["episode"]["l"]
            # SB3's Monitor rounds to six digits.
            assert mine["episode"]["r"] == pytest.approx(his["episode"]["r"], abs=5e-7)
    assert ends >= 2 * N


def test_the_last_observation_of_an_episode_is_a_dictionary_of_one_row():
    env = native(GOAL)
    env.reset()
    before = None
    for _ in range(100):
        obs, _, dones, infos = env.step(np.zeros((N, 2), np.float32))
        if not dones.any():
            before = obs
    assert dones.all()
    for row, info in enumerate(infos):
        last = info["terminal_observation"]
        assert env.observation_space.contains(last)
        for key in last:  # without action nothing moves
            np.testing.assert_array_equal(last[key], before[key][row])
            assert not np.shares_memory(last[key], obs[key])


@pytest.mark.parametrize("seen_as", [lambda cell: cell, lambda cell: {"cell": cell}])
def test_the_last_observation_may_be_a_choice_or_hold_one(seen_as):
    env = GymnasiumVecEnv(script := Script())
    script.observe = lambda: seen_as(script.elapsed.copy())
    env.reset()
    assert steps(env, 2)[-1][-1][0]["terminal_observation"] == seen_as(2)


def test_what_a_step_pays_can_be_computed_anew_through_sb3():
    env = native(GOAL, position_tolerance=1.0, angle_tolerance=2.0)
    env.seed(0)
    env.reset()
    rng = np.random.default_rng(1)
    paid = set()
    for _ in range(250):
        obs, rewards, dones, infos = env.step(rng.uniform(-1, 1, (N, 2)).astype(np.float32))
        following = {key: part.copy() for key, part in obs.items()}
        for row in np.flatnonzero(dones):
            for key, part in infos[row]["terminal_observation"].items():
                following[key][row] = part
        goals = following["achieved_goal"], following["desired_goal"]
        (anew,) = env.env_method("compute_reward", *goals, [{}] * N, indices=[0])
        assert anew.shape == (N,) and anew.dtype == np.float64
        np.testing.assert_array_equal(anew.astype(np.float32), rewards)
        paid |= set(anew.tolist())
    assert paid == {-1.0, 0.0}
    (through,) = VecNormalize(env).env_method("compute_reward", *goals, [{}] * N, indices=[0])
    np.testing.assert_array_equal(through, anew)


def test_a_part_of_a_dictionary_that_is_not_finite_is_named():
    env = native(GOAL)
    env.reset()
    step = env.venv.step

    def spoilt(actions):
        obs, *rest = step(actions)
        obs["observation"] = obs["observation"].copy()
        obs["observation"][2, 0] = np.nan
        return obs, *rest

    env.venv.step = spoilt
    with pytest.raises(NonFiniteError, match="observation of row 2"):
        env.step(np.zeros((N, 2), np.float32))


def test_a_choice_that_is_none_is_refused_and_changes_nothing():
    env = native(GRID)
    env.seed(0)
    env.reset()
    before = env.venv.get_state()
    for bad in (np.array([0, 1, 4]), np.array([0, -1, 1]), np.array([0.0, 1.0, 2.0])):
        refuses("from 0 to 3", env.step, bad)
    assert_same(env.venv.get_state(), before)
