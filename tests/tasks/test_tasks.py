"""Rules of settings, and what all tasks take and refuse."""

import dataclasses
import inspect
import math
from dataclasses import dataclass, replace
from typing import Any, ClassVar, NamedTuple

import gymnasium as gym
import numpy as np
import pytest

from rigid_envs.base.checks import ConfigError
from rigid_envs.base.settings import (
    Choice,
    Flag,
    Integer,
    Number,
    check_fields,
    from_config,
    setting,
    unknown_key,
)
from rigid_envs.systems.dynamic_ball.tasks.ball_park_dynamic import DynamicBallTask
from rigid_envs.systems.dynamic_ball.tasks.ball_plate import BallPlate
from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.systems.free_body.tasks.intermediate_axis import IntermediateAxis
from rigid_envs.systems.heavy_top.tasks.sleeping_top import SleepingTop
from rigid_envs.systems.rolling_disk.system import RollingDisk
from rigid_envs.tasks.core import Core
from rigid_envs.tasks.fields import physical, span
from rigid_envs.tasks.starts import start_from
from rigid_envs.tasks.task import Task
from rigid_envs.testing.environments import fresh, single

# Rules of settings: what each kind of value is, and how a wrong one is refused.


LENGTH = Number("a length", "m", 0.5, 2.0)
DRAWN = Number("a length", "m", 0.5, 2.0, drawn=True)
SHORT = Number("a short time", "s", 0.001, 0.01)
COUNT = Integer("a count", 1, 9)
DRAWN_COUNT = Integer("a count", 1, 9, drawn=True)
COLOUR = Choice("a colour", ("red", "green"))
SWITCH = Flag("a switch")


@dataclass(frozen=True)
class Body:
    """Settings of every kind."""

    length: Any = setting(1.0, DRAWN)
    count: int = setting(3, COUNT)
    colour: str = setting("red", COLOUR)
    switch: bool = setting(False, SWITCH)

    def __post_init__(self):
        check_fields(self)


@pytest.mark.parametrize(
    ("rule", "value", "kind"),
    [
        *((LENGTH, x, float) for x in (0.5, 2.0, 1, np.float32(1.5), np.int64(2))),
        *((COUNT, x, int) for x in (1, 9, np.int32(4), np.uint8(9))),
        *((SWITCH, x, bool) for x in (True, False, np.bool_(True))),
    ],
)
def test_values_of_every_type_become_those_of_python(rule, value, kind):
    checked = rule.check(value)
    assert type(checked) is kind
    assert checked == value


def test_pairs_become_tuples_where_a_range_may_stand():
    assert DRAWN.check([1, 2.0]) == (1.0, 2.0)
    assert DRAWN.check((1.0, 1.0)) == (1.0, 1.0)
    assert DRAWN_COUNT.check([np.int64(1), 3]) == (1, 3)
    assert {type(end) for end in DRAWN.check([1, np.float32(2)])} == {float}
    assert {type(end) for end in DRAWN_COUNT.check([np.int64(1), 3])} == {int}


@pytest.mark.parametrize(
    ("rule", "value"),
    [
        *((LENGTH, x) for x in (math.nextafter(0.5, 0), math.nextafter(2, 3), math.nan, math.inf)),
        *((LENGTH, x) for x in (True, np.bool_(True), "1", None, 1j, [1.0], (1.0, 2.0), {})),
        *((DRAWN, x) for x in ((2.0, 1.0), (1.0,), (1.0, 1.5, 2.0), (0.1, 1.0), (1.0, 3.0))),
        *((DRAWN, x) for x in ((1.0, math.nan), (True, 2.0), ("1", "2"), "12", np.ones(2))),
        *((COUNT, x) for x in (0, 10, 2.0, np.float64(2.0), True, "2", None, (1, 2))),
        *((DRAWN_COUNT, x) for x in ((3, 1), (1, 10), (1, 2.0), (1,), (False, 2))),
        *((COLOUR, x) for x in ("blue", "Red", "", None, 0, ("red",), ["red"])),
        *((SWITCH, x) for x in (0, 1, "True", None, 0.0, [])),
    ],
)
def test_anything_else_is_refused(rule, value):
    with pytest.raises((ValueError, OverflowError)):
        rule.check(value)


def test_an_integer_too_large_for_a_float_is_refused():
    with pytest.raises(ConfigError, match=r"^config\.length: length = 1000"):
        Body(length=10**400)


@pytest.mark.parametrize(
    ("config", "message"),
    [
        (
            {"length": 3.0},
            "config.length: length = 3.0; expected a number in [0.5, 2] "
            "or a pair (low, high) of such numbers [m]",
        ),
        ({"count": 0}, "config.count: count = 0; expected an integer in [1, 9]"),
        ({"colour": "blue"}, "config.colour: colour = 'blue'; expected one of 'red', 'green'"),
        ({"switch": 1}, "config.switch: switch = 1; expected True or False"),
    ],
)
def test_message_names_key_value_range_and_unit(config, message):
    with pytest.raises(ConfigError) as refusal:
        from_config(Body, config)
    assert str(refusal.value) == message


def test_an_unknown_key_is_refused_with_the_nearest_and_all_known_ones():
    with pytest.raises(ConfigError) as refusal:
        from_config(Body, {"lenght": 1.0})
    assert str(refusal.value) == (
        "config.lenght: unknown key; did you mean 'length'? "
        "expected one of length, count, colour, switch "
        "(unexpected keyword argument 'lenght')"
    )
    with pytest.raises(ConfigError) as refusal:
        from_config(Body, {"xyzzy": 1.0})
    assert "did you mean" not in str(refusal.value)


def test_letters_that_were_swapped_mean_the_word_of_the_same_letters():
    keys = ["largest_goal", "least_goal"]
    for typo, meant in (("laest_goal", "least_goal"), ("larget_goal", "largest_goal")):
        assert f"did you mean {meant!r}?" in str(unknown_key(typo, keys))


def test_checked_values_take_the_place_of_the_given_ones():
    body = from_config(Body, {"length": [1, 2], "count": np.int64(4), "switch": np.bool_(True)})
    assert dataclasses.astuple(body) == ((1.0, 2.0), 4, "red", True)


def test_defaults_obey_their_own_rules():
    with pytest.raises(ConfigError, match=r"^config\.length"):
        dataclasses.replace(Body(), length=0.0)
    assert dataclasses.astuple(Body()) == (1.0, 3, "red", False)


def test_an_overridden_default_keeps_its_rule():
    @dataclass(frozen=True)
    class Large(SleepingTop):
        ell: float = 0.05
        dt: float = setting(0.01, SHORT)
        kind: ClassVar[str] = "large"

    rules = {field.name: field.metadata["rule"] for field in dataclasses.fields(Large)}
    plain = {field.name: field.metadata["rule"] for field in dataclasses.fields(SleepingTop)}
    assert rules == plain | {"dt": SHORT}
    assert Large().ell == 0.05
    with pytest.raises(ConfigError, match=r"^config\.ell: ell = -1; expected a number in"):
        Large(ell=-1)


def test_a_field_without_a_rule_is_refused_when_the_class_is_made():
    with pytest.raises(TypeError, match=r"New\.size has no rule; expected size: float = setting\("):

        class New(SleepingTop):
            size: float = 1.0

    with pytest.raises(TypeError, match=r"Made\.size has no rule; expected"):

        class Made(SleepingTop):
            size: float = dataclasses.field(default=1.0)


def test_an_override_without_annotation_is_refused_when_the_class_is_made():
    with pytest.raises(TypeError, match=r"Large\.ell = 0\.5; expected an annotation"):

        class Large(SleepingTop):
            ell = 0.5


def test_a_subclass_with_fields_that_is_not_decorated_is_refused():
    class Large(SleepingTop):
        ell: float = 0.5

    with pytest.raises(TypeError, match=r"Large is no dataclass; expected @dataclass"):
        Large()


def test_span_of_a_number_is_the_number_twice():
    assert span(1.5) == (1.5, 1.5)
    assert span((1.0, 2.0)) == (1.0, 2.0)


def test_physical_parameters_are_positive_bounded_and_may_be_drawn():
    rule = physical(1.0, "mass", "kg").metadata["rule"]
    assert rule.check((1e-9, 1e6)) == (1e-9, 1e6)
    for value in (0.0, -1.0, 5e-324, 1e300):
        with pytest.raises(ValueError):
            rule.check(value)


def test_ranges_within_which_some_body_cannot_be_are_refused():
    # both ends of the ranges are bodies, (1, 2, 3) and (1.9, 3, 4); but (1, 2, 4) is not
    with pytest.raises(ConfigError, match=r"^config\.I3: I3 = 4\.0; expected I3 <= I1 \+ I2 = 3:"):
        IntermediateAxis(I1=(1.0, 1.9), I2=(2.0, 2.9), I3=(3.0, 4.0))
    IntermediateAxis(I1=(1.0, 1.9), I2=(2.0, 2.4), I3=(2.5, 3.0))


def test_parameters_that_are_drawn_as_one_count_as_one():
    # I1 = I2 = I_perp: that I1 = 1 and I2 = 3 would break the triangle inequality is no matter
    SleepingTop(I_perp=(1.0, 3.0))


@pytest.mark.parametrize("moment", [1.0, (0.9, 1.2)])
def test_a_state_of_moments_that_differ_though_one_field_or_of_no_body_is_refused(moment):
    core = Core(SleepingTop(I_perp=moment), 1)
    core.reset(np.zeros(1, dtype=np.int64))
    state, places = core.get_state(), core.task.parameter_positions()
    for k, size, message in (
        *((k, 1.01, r"I_perp.* = .*; expected equal numbers") for k in places["I_perp"]),
        (*places["I3"], 9.0, r"I3 = .*; expected I3 <= "),
        (slice(None), -1.0, r"I_perp = -.*; expected a number in"),  # none is in its range
    ):
        wrong = state["parameters"].copy()
        wrong[0, k] *= size
        with pytest.raises(ValueError, match=message):
            core.set_state({**state, "parameters": wrong})
    state["parameters"][:, core.task.parameter_positions()["I_perp"]] *= 1.01
    core.set_state(state)  # another body than is drawn, which a reset would take


def test_what_the_compiled_functions_would_miss_is_refused_by_name():
    class Constants(NamedTuple):
        torque: float
        patience: float

    class Terms(NamedTuple):
        upright: float
        style: float

    episode = SleepingTop.episode
    for name, fields, message in (
        ("Impatient", {"episode": replace(episode, Constants=Constants)}, r" has no patience; ex"),
        ("Careless", {"episode": replace(episode, Terms=Terms)}, r" has no weight_style; ex"),
        ("Elsewhere", {"system_type": FreeBody, "episode": episode}, ": the episode is not one"),
    ):
        with pytest.raises(TypeError, match=f"^{name}{message}"):
            type(name, (SleepingTop,), fields)

    @dataclass(frozen=True)
    class Forgetful(SleepingTop):
        def actions(self):
            return super().actions()[:1]

    with pytest.raises(TypeError, match=r"^Forgetful: actions\(\) has 1 entries; expected those"):
        Forgetful()


def swapped(I2, I1, I3, m, g, ell): ...


def short(I1, I2, I3, m, g): ...


@pytest.mark.parametrize("derive", [swapped, short])
def test_parameters_that_are_derived_in_another_order_are_refused(derive):
    with pytest.raises(TypeError, match=r"has arguments .*; expected those that Parameters begins"):
        replace(SleepingTop.episode, derive=derive)


# Friction as a parameter of a task, and rewards that would be no numbers.


ID = "RigidEnvs/BallParkDynamic-v0"
NEEDED = 0.4 / 1.4 * 4.0 / 9.81  # beta / (1 + beta) F / (m g), with the largest force


def test_a_force_slips_on_floors_below_the_friction_that_newton_asks_for():
    envs = gym.make_vec(ID, num_envs=400, mu=(0.05, 0.2), observe_params=True, end_on_slip=True)
    observations, _ = envs.reset(seed=0)
    mu = observations[:, -1].astype(np.float64)
    assert mu.min() < 0.06 < 0.19 < mu.max()
    *_, terminated, _, infos = envs.step(np.tile(np.float32([1.0, 0.0]), (400, 1)))
    np.testing.assert_allclose(infos["needed_friction"], NEEDED, rtol=1e-12)
    assert (np.abs(mu - NEEDED) > 1e-6).all()  # what float32 could confuse
    np.testing.assert_array_equal(infos["slips"], mu < NEEDED)
    np.testing.assert_array_equal(terminated, mu < NEEDED)


def test_friction_can_be_given_at_a_reset():
    env = gym.make(ID, end_on_slip=True)
    for mu, slips in ((1.001 * NEEDED, False), (0.999 * NEEDED, True)):
        env.reset(seed=0, options={"params": {"mu": mu}})
        _, _, terminated, _, info = env.step(np.float32([0.0, -1.0]))
        assert info["slips"] == terminated == slips
        assert env.unwrapped.system.mu == mu


@pytest.mark.parametrize("k", [0, 1])
def test_each_number_of_a_tilt_that_the_task_holds_at_0_is_0_in_a_state(k):
    env = fresh(single(ID))
    state = env.get_state()
    state["y"][env.task.system_type.components["tilt"].start + k] = 0.1
    with pytest.raises(ValueError, match="expected tilt = 0, its constant value"):
        env.set_state(state)


def test_a_state_without_an_attitude_may_be_0():
    env = fresh(single("RigidEnvs/RollPump-v0"))
    env.set_state({**env.get_state(), "y": np.zeros(2)})  # at rest where the path is level
    assert not env.y.any()


def test_a_success_that_slips_is_none():
    tight = {"position_tolerance": 10.0, "angle_tolerance": 3.2, "speed_tolerance": 10.0}
    for mu, success in ((1.0, True), (0.01, False)):
        env = fresh(single(ID, end_on_slip=True, mu=mu, **tight))
        _, _, terminated, _, info = env.step(np.float32([1.0, 0.0]))
        assert terminated
        assert info["is_success"] == success


def without_friction():
    """`BallPlate` as a task that knows nothing of friction."""
    classes = DynamicBallTask, BallPlate  # without their base, which has the friction
    own = {name: kind for each in classes for name, kind in inspect.get_annotations(each).items()}
    rules = {field.name: field for field in dataclasses.fields(BallPlate)}
    settings = {
        name: setting(rules[name].default, rules[name].metadata["rule"])
        for name in own.keys() & rules.keys()
    }
    members = [*vars(DynamicBallTask).items(), *vars(BallPlate).items()]
    rest = {name: value for name, value in members if not name.startswith("__")}
    namespace = {**rest, **settings, "__annotations__": own, "__module__": BallPlate.__module__}
    return dataclasses.dataclass(frozen=True)(type("Plain", (Task,), namespace))


def test_a_task_need_not_name_every_parameter_of_its_system():
    task = without_friction()()
    assert task.ranges()["mu"] == (1.0, 1.0)
    assert "mu" not in task.physical_parameters()
    core = Core(task, 3)
    core.reset(np.arange(3))
    core.actions[...] = 1.0
    core.step()
    normal, needed = core.results[-3:-1]
    assert (normal > 0.0).all()
    assert (needed > 0.0).all()
    assert core.system_parameters(0)["mu"] == 1.0
    with pytest.raises(ValueError, match="mu"):
        start_from(task, 3, None, {"mu": 0.5})


def test_a_top_without_spin_has_a_goal_of_zero_and_an_error_that_is_a_number():
    env = gym.make("RigidEnvs/TopPrecession-v0", branch="fast")
    env.reset(seed=0, options={"state": {"q": [1.0, 0, 0, 0], "omega_body": [0.0, 0, 0]}})
    _, reward, terminated, _, info = env.step(np.zeros(2, dtype=np.float32))
    assert not terminated
    assert np.isfinite(reward)
    assert info["reward/rate"] == 1.0  # it does not precess, as it should not


def test_a_reward_that_is_no_number_is_a_physics_error():
    env = gym.make("RigidEnvs/DiskRoll-v0").unwrapped
    rolling = RollingDisk().state(omega_body=(0.0, 0.0, 2.0))  # straight on
    env.reset(seed=0, options={"state": {"q": rolling[:4], "omega_body": rolling[4:7]}})
    goal = env._core._slots.aux + env.task.aux_names.index("goal_curvature")
    env._core._write(np.zeros(1, dtype=np.int64), goal, 0.0)  # the error is relative: 0 / 0
    with pytest.raises(ValueError, match="goal_curvature"):  # which is why no state may have it
        env.set_state(env.get_state())
    observation, reward, terminated, _, info = env.step(np.zeros(1, dtype=np.float32))
    assert terminated
    assert info["physics_error"]
    assert reward == 0.0
    assert np.isfinite(observation).all()
    assert all(np.isfinite(value) for value in info.values())
