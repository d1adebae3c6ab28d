"""The shell of one environment: what it shows and hands out."""

import numpy as np
import pytest

from rigid_envs.base.checks import ConfigError
from rigid_envs.envs.goal import RigidGoalEnv
from rigid_envs.envs.single import RigidEnv
from rigid_envs.envs.vector import RigidVectorEnv
from rigid_envs.tasks.fields import span
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.testing.environments import CONTINUOUS, GOALS, IDS, flat


@pytest.fixture(params=IDS)
def env(request):
    """An environment as its class makes it, without a spec, in its first episode."""
    kind = RigidGoalEnv if request.param in GOALS else RigidEnv
    env = kind(ENVIRONMENTS[request.param].task)
    env.reset(seed=0)
    return env


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
    for name in env.system.parameter_names():
        low, high = span(getattr(env.task, env.task.aliases.get(name, name)))
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
    kept = flat(first).copy()
    for part in arrays(first):
        part[...] = 9.0
    info["cost"] = -1.0
    env.reset(seed=1)
    np.testing.assert_array_equal(flat(env.step(zero(env))[0]), kept)


@pytest.mark.parametrize("env", CONTINUOUS, indirect=True)
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
    with pytest.raises(ValueError, match=f"^{type(env.task).__name__}: "):
        env.step("left")


def test_render_without_a_mode_warns_and_returns_none(env):
    env.reset(seed=0)
    with pytest.warns(UserWarning, match='render_mode="rgb_array"'):
        assert env.render() is None


@pytest.mark.parametrize(
    ("key", "value"),
    [
        *(("render_mode", "x-ray"), ("width", 0), ("width", True), ("height", 2.5)),
        *(("height", 10**9), ("camera", {"zoom": 2}), ("camera", "above")),
    ],
)
def test_settings_of_pictures_are_refused_by_key(key, value):
    with pytest.raises(ConfigError, match=rf"^config\.{key}: {key} = .*expected"):
        RigidEnv("rigid_envs.systems.rolling_ball.tasks:BallPark", **{key: value})


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
        RigidEnv("rigid_envs.systems.rolling_ball.tasks:BallPark", camera={field: value})


@pytest.mark.parametrize("kind", [RigidEnv, RigidVectorEnv])
def test_human_mode_renders_in_each_reset_and_step_and_no_other_mode_does(kind, monkeypatch):
    for mode, counts in (("human", [1, 2, 3, 4]), ("rgb_array", [0] * 4)):
        rows = {"num_envs": 2} if kind is RigidVectorEnv else {}
        env, shown = (
            kind("rigid_envs.systems.rolling_ball.tasks:BallPark", render_mode=mode, **rows),
            [],
        )
        monkeypatch.setattr(env, "render", lambda shown=shown: shown.append(True))
        found, still = [], np.zeros(env.action_space.shape, np.float32)
        for act in (env.reset, lambda: env.step(still), lambda: env.step(still), env.reset):  # noqa: B023
            act()
            found.append(len(shown))
        assert found == counts


def asked(field, value):
    """An environment whose pictures are asked for so; a target is given in all three numbers."""
    if field in ("width", "height"):
        return RigidEnv("rigid_envs.systems.rolling_ball.tasks:BallPark", **{field: value})
    value = [value] * 3 if field == "target" else value
    return RigidEnv("rigid_envs.systems.rolling_ball.tasks:BallPark", camera={field: value})


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
