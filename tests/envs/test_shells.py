"""The shells of one environment and of many rows: what they show, hand out and refuse."""

import copy
import gc
import itertools
import warnings
import weakref
from dataclasses import fields

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from rigid_envs.base.checks import ConfigError
from rigid_envs.envs.shells import RigidEnv, RigidGoalEnv, RigidGoalVectorEnv, RigidVectorEnv
from rigid_envs.sb3.adapter import GymnasiumVecEnv, NonFiniteError
from rigid_envs.tasks.fields import span
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.testing import environments
from rigid_envs.testing.test_refusals import NoMapping, things
from tests.refusals import refuses

# The shell of one environment: what it shows and hands out.


PARK = "rigid_envs.systems.rolling_ball.tasks:BallPark"


@pytest.fixture(params=environments.IDS)
def env_id(request):
    return request.param


def rows(env_id, **settings):
    """Rows as their class makes them: without a spec."""
    kind = RigidGoalVectorEnv if env_id in environments.GOALS else RigidVectorEnv
    return kind(ENVIRONMENTS[env_id].task, **settings)


def row(env_id):
    """The single environment."""
    return (RigidGoalEnv if env_id in environments.GOALS else RigidEnv)(ENVIRONMENTS[env_id].task)


@pytest.fixture
def env(env_id):
    """The single environment in its first episode."""
    return environments.fresh(row(env_id))


def zero(env):
    """The action 0."""
    return np.zeros_like(env.action_space.sample())


def arrays(observation):
    """The arrays that an observation consists of."""
    return list(observation.values()) if isinstance(observation, dict) else [observation]


def input_of(env):
    """What acted on the system in the last step."""
    core = env._core
    return core._columns(core._slots.inputs, core._slots.parameters)[0]


def test_system_is_the_physical_model_with_the_parameters_of_the_task(env):
    assert type(env.system) is env.task.system_type
    fixed = {field.name: field.default for field in fields(env.system)}
    for name in env.system.parameter_names():
        low, high = span(getattr(env.task, env.task.aliases.get(name, name), fixed[name]))
        assert low <= getattr(env.system, name) <= high


def test_system_reads_and_linearises_the_state_of_the_environment(env):
    system, y = env.system, env.y
    assert set(system.invariants(y)) and all(np.isfinite(v) for v in system.invariants(y).values())
    assert system.rhs(y).shape == y.shape
    n, m = len(y), len(system.input_entries)
    assert [part.shape for part in system.linearize(y)] == [(n, n), (n, m)]
    for accessor in system.accessors.values():
        assert np.isfinite(accessor(y)).all()


def test_step_without_action_is_the_advance_of_the_system_under_its_input(env):
    y = env.y
    env.step(zero(env))
    expected = env.system.advance(y, input_of(env), env.task.dt, env.task.n_substeps)
    assert env.y.tobytes() == expected.tobytes()


def test_what_is_handed_out_is_a_copy(env):
    observation, _ = env.reset(seed=1)
    env.y[...] = 9.0
    for part in (*env.get_state().values(), *arrays(observation)):
        part[...] = 9.0
    first, *_, info = env.step(zero(env))
    kept = environments.flat(first).copy()
    for part in arrays(first):
        part[...] = 9.0
    info["cost"] = -1.0
    env.reset(seed=1)
    np.testing.assert_array_equal(environments.flat(env.step(zero(env))[0]), kept)


@pytest.mark.parametrize("env_id", environments.CONTINUOUS)
def test_action_of_the_caller_is_not_changed(env):
    action = np.full(env.action_space.shape, 3.0, dtype=np.float32)
    assert env.step(action)[4]["action_clipped"]
    assert (action == 3.0).all()


def test_every_result_is_new(env):
    results = [env.step(zero(env)) for _ in range(2)]
    for k in (0, 4):
        assert results[0][k] is not results[1][k]
    for one, other in zip(arrays(results[0][0]), arrays(results[1][0]), strict=True):
        assert not np.shares_memory(one, other)


def test_name_in_messages_without_a_spec_is_that_of_the_task(env):
    refuses(f"^{type(env.task).__name__}: ", env.step, "left")


def test_render_without_a_mode_warns_and_returns_none(env):
    env.reset(seed=0)
    with pytest.warns(UserWarning, match='render_mode="rgb_array"'):
        assert env.render() is None


OF_PICTURES = {
    "render_mode": ("x-ray",),
    "width": (0, True),
    "height": (2.5, 10**9),
    "camera": ({"zoom": 2}, "above"),
}
OF_ROWS = {
    "num_envs": (0, -1, 2.0, "2", True),
    "num_threads": (0, None, 1.5),
    "max_episode_steps": (0, -1, 2.5, True, "10", np.nan, 2**53 + 1),
    "infos_on_request": (1, "yes"),
    "autoreset_mode": ("Never", None),
}


@pytest.mark.parametrize(("key", "values"), (OF_PICTURES | OF_ROWS).items())
def test_settings_of_a_shell_are_refused_by_key(key, values):
    kinds = [RigidVectorEnv, RigidEnv] if key in OF_PICTURES else [RigidVectorEnv]
    for kind, value in itertools.product(kinds, values):
        two = {"num_envs": 2} if kind is RigidVectorEnv else {}
        with pytest.raises(ConfigError, match=rf"^config\.{key}: {key} = .*expected"):
            kind(PARK, **two | {key: value})


def test_a_limit_may_be_as_large_as_a_refusal_says():
    RigidVectorEnv(PARK, num_envs=2, max_episode_steps=2**53)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        *(("distance", 0.0), ("distance", "far"), ("azimuth", float("nan"))),
        *(("elevation", 91.0), ("elevation", -91.0), ("field_of_view", 0.0), ("follow", 3)),
        *(("target", end) for end in ((0.0, 1.0), (0.0, 1.0, 2.0, 3.0), (0.0, 1.0, float("inf")))),
    ],
)
def test_wrong_fields_of_the_camera_are_refused_by_name(field, value):
    with pytest.raises(ConfigError, match=rf"^config\.camera\.{field}: {field} = .*expected"):
        RigidEnv(PARK, camera={field: value})


@pytest.mark.parametrize("kind", [RigidEnv, RigidVectorEnv])
def test_human_mode_renders_in_each_reset_and_step_and_no_other_mode_does(kind, monkeypatch):
    for mode, counts in (("human", [1, 2, 3, 4]), ("rgb_array", [0] * 4)):
        rows = {"num_envs": 2} if kind is RigidVectorEnv else {}
        env, shown = (kind(PARK, render_mode=mode, **rows), [])
        monkeypatch.setattr(env, "render", lambda shown=shown: shown.append(True))
        found, still = [], np.zeros(env.action_space.shape, np.float32)
        for act in (env.reset, lambda: env.step(still), lambda: env.step(still), env.reset):  # noqa: B023
            act()
            found.append(len(shown))
        assert found == counts


def asked(field, value):
    """An environment whose pictures are asked for so; a target is given in all three numbers."""
    if field in ("width", "height"):
        return RigidEnv(PARK, **{field: value})
    value = [value] * 3 if field == "target" else value
    return RigidEnv(PARK, camera={field: value})


@pytest.mark.parametrize(
    ("field", "low", "high"),
    [
        ("width", 16, 8192),
        ("height", 16, 8192),
        ("target", -1e6, 1e6),
        ("distance", 5e-324, 1e6),
        ("azimuth", -360.0, 360.0),
        ("elevation", -90.0, 90.0),
        ("field_of_view", 1.0, 150.0),
    ],
)
def test_numbers_of_pictures_are_taken_up_to_their_ends_and_no_further(field, low, high):
    for number, beyond in ((low, -1), (high, 1)):
        asked(field, number)
        if isinstance(number, int):
            further = number + beyond
        else:
            further = np.nextafter(number, beyond * np.inf)
        with pytest.raises(ConfigError, match=rf"^config\.(camera\.)?{field}\S*: .*expected"):
            asked(field, further)


# The shell of many rows: spaces, modes, and what it hands out.


def test_spaces_are_those_of_the_single_environment_in_a_batch(env_id):
    envs, env = rows(env_id, num_envs=5), row(env_id)
    assert envs.single_action_space == env.action_space
    assert envs.single_observation_space == env.observation_space
    assert envs.action_space == batch_space(env.action_space, 5)
    assert envs.observation_space == batch_space(env.observation_space, 5)


def test_mode_is_given_as_a_word_or_a_member_and_told_in_the_metadata(env_id):
    for mode in AutoresetMode:
        for given in (mode, mode.value):
            envs = rows(env_id, num_envs=2, autoreset_mode=given)
            assert envs.metadata["autoreset_mode"] is mode
        assert RigidVectorEnv.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP


def test_number_of_rows_may_be_any_positive_integer(env_id):
    for n in [1, np.int64(3), 65]:
        envs = rows(env_id, num_envs=n, num_threads=np.int64(2))
        observations, _ = envs.reset(seed=0)
        assert type(envs.num_envs) is int
        assert environments.flat(observations).shape == (n, len(envs.task.observations()))
        assert envs.observation_space.contains(observations)


def test_what_is_handed_out_does_not_lead_back_into_the_rows(env_id):
    for mode in AutoresetMode:
        envs, quiet = (
            rows(env_id, num_envs=3, max_episode_steps=2, autoreset_mode=mode) for _ in range(2)
        )
        overwrite(envs.reset(seed=0)[0])
        quiet.reset(seed=0)
        batch = environments.still(env_id, 3)
        kept = batch.copy()
        for _ in range(2):
            results, expected = envs.step(batch), quiet.step(batch)
            environments.assert_same_bits(results, expected)
            overwrite(results)
            envs.y[...] = 9.0
        environments.assert_same_bits(envs.get_state(), quiet.get_state())
        environments.assert_same_bits(envs.infos(), quiet.infos())
        one = {"reset_mask": np.array([False, True, False])}
        environments.assert_same_bits(envs.reset(options=one), quiet.reset(options=one))
        environments.assert_same_bits(batch, kept)


def test_what_was_handed_out_stays_as_it_is(env_id):
    for mode in AutoresetMode:
        envs = rows(env_id, num_envs=3, max_episode_steps=2, autoreset_mode=mode)
        results = [
            envs.reset(seed=0),
            *(envs.step(environments.still(env_id, 3)) for _ in range(2)),
            envs.infos(),
        ]
        kept = copy.deepcopy(results)
        state = envs.get_state()
        envs.reset(options={"reset_mask": np.array([True, False, False])})
        envs.infos()
        envs.set_state(state)
        envs.reset()
        envs.step(environments.still(env_id, 3))
        environments.assert_same_bits(results, kept)


def overwrite(result):
    """Other values in all that is not told to be constant."""
    if isinstance(result, dict):
        for key, part in result.items():
            if not key.startswith("_"):
                overwrite(part)
    elif isinstance(result, tuple):
        for part in result:
            overwrite(part)
    else:
        result[...] = 9


def test_masks_of_infos_cannot_be_written_to(env_id):
    envs = rows(env_id, num_envs=3)
    _, infos = envs.reset(seed=0)
    with pytest.raises(ValueError, match="read-only"):
        infos["_cost"][0] = False


@pytest.mark.parametrize("env_id", environments.CONTINUOUS)
def test_batches_of_any_layout_give_the_same_bits(env_id):
    batch = environments.actions(env_id, 1, 70)[0]
    wide = np.zeros((70, 2 * batch.shape[1]), dtype=np.float32)
    wide[:, ::2] = batch
    layouts = (batch, np.asfortranarray(batch), wide[:, ::2], batch.astype(float), batch.tolist())
    results = []
    for layout in layouts:
        envs = environments.fresh(rows(env_id, num_envs=70))
        results.append(environments.flat(envs.step(layout)[0]).tobytes())
    assert set(results) == {results[0]}


def test_resetting_running_rows_ends_their_episodes_quietly(env_id):
    envs = environments.fresh(rows(env_id, num_envs=3, max_episode_steps=3))
    batch = environments.still(env_id, 3)
    envs.step(batch)
    envs.step(batch)
    envs.reset(options={"reset_mask": np.array([False, True, False])})
    assert envs.step(batch)[3].tolist() == [True, False, True]
    assert envs.step(batch)[3].tolist() == [False, False, False]
    assert envs.step(batch)[3].tolist() == [False, True, False]


def test_a_seed_is_that_of_the_generator_as_gymnasium_has_it(env_id):
    for seed in [7, np.int64(7)]:
        envs = environments.fresh(rows(env_id, num_envs=2), 3)
        envs.reset(seed=seed)
        assert envs.np_random_seed == 7 and type(envs.np_random_seed) is int
        drawn = envs.np_random.random()
        envs.reset(seed=seed)
        assert envs.np_random.random() == drawn


def test_call_gives_a_value_for_each_row_as_vectors_of_single_environments_do():
    envs = environments.fresh(rows(environments.IDS[0], num_envs=3))
    with warnings.catch_warnings(record=True):  # there is no render_mode
        warnings.simplefilter("always")
        assert envs.call("render") == (None, None, None)
    assert envs.call("render_mode") == (None, None, None)
    with pytest.raises(AttributeError, match=r"call\('get_state'\); expected 'render'"):
        envs.call("get_state")
    with pytest.raises(AttributeError, match="nothing"):
        envs.call("nothing")


# Arguments of any type are taken or refused by name, also by what is not one of the contracts.


QUICK = ("RigidEnvs/Reorient-v0", "RigidEnvs/BallGrid-v0")
REFUSALS = (ValueError, TypeError, AttributeError, gym.error.Error, NonFiniteError)


def of_others(env_id):
    """Methods and arguments of `call`, and of the adapter for Stable-Baselines3."""
    yield "attribute", environments.vector(env_id, 2).call
    envs = GymnasiumVecEnv(environments.vector(env_id, 2, autoreset_mode="SameStep"))
    envs.reset()
    yield "venv", GymnasiumVecEnv
    yield "eed", lambda v: (envs.seed(v), envs.reset())
    yield "options", lambda v: (envs.set_options(v), envs.reset())
    yield "action", envs.step
    yield "attribute", envs.get_attr
    yield "attribute", lambda v: envs.set_attr(v, 1)
    yield "method", envs.env_method
    yield "wrapper_class", envs.env_is_wrapped
    for call in (envs.get_attr, envs.env_method):
        yield "indices", lambda v, call=call: call("get_state", indices=v)
    yield "indices", lambda v: envs.env_is_wrapped(object, v)


@pytest.mark.parametrize("env_id", QUICK)
def test_what_is_wrong_is_refused_by_name(env_id):
    for name, call in of_others(env_id):
        for value in things():
            if isinstance(value, NoMapping | np.ma.MaskedArray):  # what they hold is at fault
                continue
            try:
                call(value)
            except REFUSALS as error:
                assert name in str(error), type(value)


@pytest.mark.parametrize("row", [-1, -2, 2, 8, 5000, 0.0, True, None, "0", [0]])
def test_a_moment_is_that_of_a_row(row):
    envs = environments.fresh(environments.vector(QUICK[0], 2))
    refuses(r"row = .*; expected an integer from 0 to 1", envs.moment, row)
    for good in (0, 1, np.int64(1)):
        assert (envs.moment(good).y == envs.y[good]).all()


# An environment that is dropped is freed at once, and its threads end: it holds no cycle.


@pytest.fixture(autouse=True, scope="module")
def no_collector():
    gc.collect()
    gc.disable()
    yield
    gc.enable()


@pytest.mark.parametrize("n_threads", [1, 2])
@pytest.mark.parametrize("n_rows", [1, 63, 128, 130])
def test_rows_are_freed(n_rows, n_threads):
    envs = gym.make_vec("RigidEnvs/BallPark-v0", n_rows, num_threads=n_threads)
    envs.reset(seed=0)
    envs.step(environments.actions("RigidEnvs/BallPark-v0", 1, n_rows)[0])
    envs.unwrapped.set_state(envs.unwrapped.get_state())
    rows = weakref.ref(envs.unwrapped._core)
    del envs
    assert rows() is None


@pytest.mark.parametrize("env_id", ENVIRONMENTS)
def test_a_single_environment_is_freed(env_id):
    env = environments.fresh(gym.make(env_id))
    env.step(environments.actions(env_id, 1, 1)[0, 0])
    with pytest.raises(ValueError):
        env.reset(options={"state": "none"})
    row = weakref.ref(env.unwrapped._core)
    del env
    assert row() is None
