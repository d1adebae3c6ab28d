"""Settings and arguments: all are taken, or refused by one kind of error without a trace."""

import contextlib
import datetime
import decimal
import fractions
import math
import pathlib
import re
from collections import ChainMap
from dataclasses import fields

import gymnasium as gym
import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from rigid_envs.base.checks import ConfigError
from rigid_envs.base.settings import Choice, Flag, Integer
from rigid_envs.envs.shells import RigidEnv, RigidVectorEnv
from rigid_envs.tasks.fields import span
from rigid_envs.testing.environments import (
    FULL,
    IDS,
    OF_KERNELS,
    OWN,
    assert_same_bits,
    fresh,
    rules,
    single,
    task_of,
    vector,
)

# Settings: every wrong one is refused by its name before anything is laid out, no right one is.


MANY_ROWS = 2**40  # more than any machine can lay out: what is refused, is refused before
NEVER = (None, "1.0", "", {}, {"low": 1}, object(), 1j, (), (1.0,), (1.0, 2.0, 3.0), math.nan)
RULES = {(env_id, name): rule for env_id in IDS for name, rule in rules(env_id).items()}


def examples(n):
    """N examples, the same in every run; the first compiles what it calls, so none is timed."""
    return settings(
        max_examples=n,
        deadline=None,
        derandomize=True,
        database=None,
        suppress_health_check=[HealthCheck.too_slow],
    )


def outside(rule):
    """Values that a rule does not allow."""
    if isinstance(rule, Flag):
        return st.sampled_from([*NEVER, 0, 1, 0.0, "True", [True]])
    if isinstance(rule, Choice):
        words = st.text(max_size=8).filter(lambda word: word not in rule.options)
        return st.sampled_from([*NEVER, True, 0, [rule.options[0]]]) | words
    low, high = rule.low, rule.high
    whole = isinstance(rule, Integer)
    numbers = st.integers() if whole else st.floats(allow_nan=False)
    wrong = numbers.filter(lambda x: not low <= x <= high)
    others = st.sampled_from([*NEVER, True, False, math.inf, -math.inf])
    others |= st.just(10**400) | (st.just(low + 0.5) if whole else st.nothing())
    bad = wrong | others
    if not rule.drawn:
        return bad | st.just((low, high))
    return bad | st.tuples(st.just(low), bad) | st.tuples(bad, st.just(high)) | st.just([high, low])


def inside(rule):
    """Values that a rule allows, numbers over all sizes and the ends among them."""
    if isinstance(rule, Flag):
        return st.booleans()
    if isinstance(rule, Choice):
        return st.sampled_from(rule.options)
    if isinstance(rule, Integer):
        number = st.integers(rule.low, rule.high)
    else:
        number = sized(rule.low, rule.high)
    if not rule.drawn:
        return number
    pair = st.tuples(number, number).map(sorted)
    return number | pair | pair.map(tuple)


def sized(low, high):
    """Numbers in [low, high], uniform in the logarithm of their size."""
    largest = max(abs(low), abs(high))
    least = max(low, 1e-9 * largest)
    size = st.floats(0.0, 1.0).map(lambda s: least ** (1.0 - s) * largest**s)
    signed = st.tuples(size, st.sampled_from([1.0, -1.0] if low < 0 else [1.0])).map(math.prod)
    return st.sampled_from([low, high]) | signed.map(lambda x: min(max(x, low), high))


@st.composite
def three_moments(draw):
    """Moments I1 < I2 < I3 <= I1 + I2 of any size, one of them a range."""
    size, a, b = draw(sized(1e-6, 1e5)), draw(st.floats(1.01, 3.0)), draw(st.floats(0.05, 0.95))
    I1, I2 = size, size * a
    I3 = I2 + b * I1
    ranged = draw(st.sampled_from(["I1", "I2", "I3", ""]))
    config = {"I1": I1, "I2": I2, "I3": I3}
    room = {"I1": (I1, 0.5 * (I1 + I2)), "I2": (I2, 0.5 * (I2 + I3)), "I3": (0.5 * (I2 + I3), I3)}
    return config | {ranged: room[ranged]} if ranged else config


@st.composite
def two_moments(draw, across):
    """Moments of a body of revolution, that about its axis at most twice that across it."""
    size, slim = draw(sized(1e-6, 1e5)), draw(st.floats(0.1, 1.9))
    wide = draw(st.booleans())
    return {across: (size, 1.5 * size) if wide else size, "I3": slim * size}


@st.composite
def weights(draw, moments):
    """Moments, and a weight that sets a moderate rate, not too far out for the moments."""
    config = draw(moments)
    g, share = draw(st.floats(0.1, 100.0)), draw(st.floats(0.01, 1.0))
    ell = share * min(1.0, 0.02 * g)  # 2 m ell^2 is at most 0.04 of the least moment
    m = min(span(value)[0] for value in config.values()) / (g * ell)
    return config | {"m": max(1e-9, min(1e6, m)), "g": g, "ell": ell}


@st.composite
def wheels(draw, moments):
    """Moments, and a mass and radius that leave no mass beyond the rim."""
    config = draw(moments)
    radius, heft = draw(st.floats(0.1, 10.0)), draw(st.floats(1.0, 3.0))
    m = heft * span(config["I3"])[1] / radius**2
    assume(1e-9 <= m <= 1e6)
    return config | {"m": m, "radius": radius}


@st.composite
def carriers(draw, moments, names):
    """Moments, and wheels that are part of them."""
    config = draw(moments)
    wheel = draw(st.floats(0.01, 0.99)) * min(span(value)[0] for value in config.values())
    return config | {name: wheel for name in ("J1", "J2", "J3") if name in names}


@st.composite
def tippe_tops(draw):
    """Spheres that turn over: 1 - offset / radius < I1 / I3 < 1 + offset / radius."""
    I3, radius, heft = draw(sized(1e-6, 1e5)), draw(st.floats(0.1, 10.0)), draw(st.floats(1.0, 3.0))
    share, place = draw(st.floats(0.05, 0.45)), draw(st.floats(-0.9, 0.9))
    m = heft * I3 / radius**2
    assume(1e-9 <= m <= 1e6)
    I1 = (1.0 + place * share) * I3
    return {"I1": I1, "I3": I3, "m": m, "radius": radius, "offset": share * radius}


@st.composite
def tumbling(draw):
    """A tolerance, and rates at the start that are above it."""
    tolerance = draw(sized(1e-6, 10.0))
    low, high = sorted(tolerance * draw(st.floats(1.01, 10.0)) for _ in range(2))
    return {"rate_tolerance": tolerance, "start_rate": draw(st.sampled_from([low, (low, high)]))}


@st.composite
def ordered(draw, low, high, rule):
    """Two ends of a range that are settings of their own."""
    ends = sorted(draw(st.floats(rule.low, min(rule.high, 10.0))) for _ in range(2))
    return dict(zip((low, high), ends, strict=True))


def together(env_id):
    """Settings that must fit together."""
    names, parts = rules(env_id), [st.just({})]
    across = "I_perp" if "I_perp" in names else "I1"
    if {"I1", "I3", "offset"} <= set(names):
        parts.append(tippe_tops())
    elif {"I1", "I2", "I3", "J1"} <= set(names):
        parts.append(carriers(three_moments(), names))
    elif {"I1", "I2", "I3"} <= set(names):
        parts.append(three_moments())
    elif {across, "I3"} <= set(names):
        parts.append(two_moments(across))
    if len(parts) > 1 and {"m", "g", "ell"} <= set(names):
        parts.append(weights(parts.pop()))
    elif len(parts) > 1 and {"m", "radius"} <= set(names) and "offset" not in names:
        parts.append(wheels(parts.pop()))
    for low in (name for name in names if name.endswith("_low")):
        high = low.removesuffix("low") + "high"
        if high in names:
            parts.append(ordered(low, high, names[low]))
    if {"dipole", "start_rate"} <= set(names):
        parts.append(tumbling())
    if {"bias", "capacity"} <= set(names):
        parts.append(ordered("bias", "capacity", names["capacity"]))
    return st.tuples(*parts).map(lambda configs: dict(ChainMap(*configs)))


@st.composite
def valid(draw, env_id):
    """Settings that a task must accept, but for the step that its fastest motion asks for."""
    config = draw(together(env_id))
    free = [name for other, name in RULES if other == env_id and name not in config]
    names = draw(st.lists(st.sampled_from(free), max_size=5, unique=True))
    return {**config, **{name: draw(inside(RULES[env_id, name])) for name in names}}


@examples(500)
@given(data=st.data())
def test_wrong_values_are_refused_by_key_and_range_before_anything_is_laid_out(data):
    env_id, name = data.draw(st.sampled_from(list(RULES)))
    rule = RULES[env_id, name]
    value = data.draw(outside(rule))
    for make in (single, lambda env_id, **config: vector(env_id, MANY_ROWS, **config)):
        with pytest.raises(ConfigError) as refusal:
            make(env_id, **{name: value})
        message = str(refusal.value)
        assert message.startswith(f"config.{name}: ")
        if isinstance(rule, Choice):
            assert all(repr(option) in message for option in rule.options)
        elif isinstance(rule, Flag):
            assert "True or False" in message
        else:
            assert f"{rule.low:g}" in message
            assert f"{rule.high:g}" in message


@examples(300)
@given(data=st.data())
def test_misspelt_keys_are_refused_with_the_key_that_was_meant(data):
    env_id, name = data.draw(st.sampled_from([key for key in RULES if len(key[1]) > 4]))
    typo = data.draw(st.sampled_from(typos(name)))
    if (env_id, typo) in RULES:
        return
    meant = [other for env, other in RULES if env == env_id and typo in typos(other)]
    with pytest.raises(ConfigError) as refusal:
        vector(env_id, MANY_ROWS, **{typo: getattr(task_of(env_id), name)})
    message = str(refusal.value)
    assert message.startswith(f"config.{typo}: unknown key")
    assert any(f"did you mean {other!r}?" in message for other in meant)


def typos(name: str) -> list[str]:
    """Two letters swapped, one left out, one typed twice."""
    found = []
    for k in range(len(name) - 1):
        found.append(name[:k] + name[k + 1] + name[k] + name[k + 2 :])
        found += [name[:k] + name[k + 1 :], name[: k + 1] + name[k:]]
    return found


def test_keys_that_are_like_no_other_are_refused_with_all_there_are(env_id):
    with pytest.raises(ConfigError) as refusal:
        single(env_id, xyzzy=1)
    assert str(refusal.value).startswith("config.xyzzy: unknown key")
    assert all(name in str(refusal.value) for other, name in RULES if other == env_id)


@examples(500)
@given(data=st.data())
def test_right_values_are_accepted_and_kept(data):
    env_id = data.draw(st.sampled_from(IDS))
    config = data.draw(valid(env_id))
    try:
        task = type(task_of(env_id))(**config)
    except ConfigError as refusal:  # the step is too long: as the message says, take shorter ones
        message = str(refusal)
        if env_id not in OWN and not message.startswith("config.dt: "):
            assert_names_a_key(env_id, message)
            return  # a rule of that task for settings together, which is not known here
        assert message.startswith("config.dt: ")
        needed = int(message.split("n_substeps >= ")[1])
        if needed > RULES[env_id, "n_substeps"].high:
            return
        config["n_substeps"] = needed
        task = type(task_of(env_id))(**config)
    for name, value in config.items():
        kept = getattr(task, name)
        assert kept == (tuple(value) if isinstance(value, list) else value)
    if data.draw(st.integers(0, 9)) == 0 and (env_id in FULL or not OF_KERNELS & {*config}):
        env = single(env_id, **config)
        assert env.observation_space.contains(env.reset(seed=0)[0])


def assert_names_a_key(env_id, message):
    key, _, rest = message.removeprefix("config.").partition(": ")
    assert (env_id, key) in RULES, message
    assert "expected" in rest, message


def test_physical_parameters_alone_may_have_any_size_that_the_others_allow(env_id):
    for share in [0.0, 1.0]:
        for name in task_of(env_id).physical_parameters():
            rule = RULES[env_id, name]
            try:
                env = single(env_id, **{name: rule.high if share else rule.low}, n_substeps=1000)
            except ConfigError as refusal:
                assert_names_a_key(env_id, str(refusal))
            else:
                assert env.observation_space.contains(env.reset(seed=0)[0])


def test_a_step_too_long_is_refused_with_the_least_number_of_substeps_that_will_do(env_id):
    task = type(task_of(env_id))
    longest = {"dt": RULES[env_id, "dt"].high}
    with contextlib.suppress(ConfigError):
        task(**longest)
        return  # the step is exact, however long
    with pytest.raises(ConfigError, match=r"^config\.dt: .*stability envelope") as refusal:
        task(**longest)
    needed = int(str(refusal.value).split("n_substeps >= ")[1])
    if needed > RULES[env_id, "n_substeps"].high:
        return  # no number will do
    task(**longest, n_substeps=needed)
    with pytest.raises(ConfigError, match=f"n_substeps >= {needed}$"):
        task(**longest, n_substeps=needed - 1)


@pytest.mark.parametrize("env_id", [i for i in IDS if hasattr(task_of(i), "lower_bound")])
def test_the_least_cost_is_known_from_the_state_alone(env_id):
    envs = fresh(vector(env_id, 50))
    bounds = task_of(env_id).lower_bound(envs.y)
    assert bounds.shape == (50,)
    assert (bounds >= 0.0).all()


def test_fields_are_documented_with_text_unit_and_rule(env_id):
    task = task_of(env_id)
    for field in fields(task):
        rule = field.metadata["rule"]
        assert rule.text
        assert rule.check(getattr(task, field.name)) == getattr(task, field.name)


# Whatever is given, it is taken or refused by one kind of error, and a refusal changes nothing.


REFUSALS = (ValueError, gym.error.Error)  # the latter where Gymnasium prescribes it
N = 3


class Hostile:
    """An object all of whose own code fails."""

    def _fail(self, *_, **__):
        raise RuntimeError

    __repr__ = __eq__ = __hash__ = __bool__ = __index__ = __float__ = __array__ = _fail


class NoMapping(dict):
    """What it holds cannot be unpacked, which is refused without its name."""

    def items(self):
        return [(1, 2, 3)]


def things():
    """One of each kind, made anew: some can be used only once."""
    numbers = [7, -1, True, 1.5, np.nan, np.inf, 10**400, -(10**400), 2**63, 2**64, 1j]
    kinds = [np.float64(2.5), np.int8(3), np.uint64(2**64 - 1), np.bool_(True), np.longdouble(1)]
    dates = [np.datetime64("2020-01-01"), datetime.date(2020, 1, 1), np.array([1], dtype="M8[s]")]
    texts = ["text", "7", "", "\u00e9\x00", "a" * 10_000, b"bytes", bytearray(b"x"), "os:path"]
    folders = [{}, {"a": 1}, {1: 2}, {None: 1}, {"state": None}, NoMapping()]
    sets = [set(), {1}, frozenset({2}), slice(1), memoryview(b"ab"), range(3), iter([1])]
    rows = [[], [[]], [1, [2, 3]], [None], ["a"], (), (1, 2), (x for x in [1]), [1, 2, True]]
    arrays = [np.array(x) for x in (3, [], [1, 2], ["x"], [None], [1j], [True], [np.nan])]
    odd = [np.zeros((3, 0)), np.zeros(10**6), np.array([(1,)], dtype=[("x", int)])]
    masked = [np.ma.array([1.0], mask=[True]), np.recarray((1,), dtype=[("x", float)])]
    objects = [None, object(), Hostile(), [Hostile()], type, np, Ellipsis, NotImplemented]
    more = [lambda: 1, np.random.default_rng(0), pathlib.Path(), fractions.Fraction(1, 2)]
    few = [decimal.Decimal("1.5")]
    return [
        *(*numbers, *kinds, *dates, *texts, *folders, *sets, *rows, *arrays, *odd, *masked),
        *(*objects, *more, *few),
    ]


N_THINGS = len(things())


def hashable(thing):
    """The thing, as a key; a name that nothing has where it cannot be one."""
    try:
        hash(thing)
    except (TypeError, RuntimeError):
        return "unhashable"
    return thing


def calls(env):
    """Everything that takes an argument, by name, with the words that a refusal has for it."""
    component = next(iter(env.task.system_type.components))
    parameter = next(iter(env.task.physical_parameters()), "params")
    found = {
        "seed": ("eed", lambda x: env.reset(seed=x)),  # Seed, as Gymnasium says it
        "options": ("options", lambda x: env.reset(options=x)),
        "option": ("option", lambda x: env.reset(options={hashable(x): 1.0})),
        "mask": ("reset_mask", lambda x: env.reset(seed=1, options={"reset_mask": x})),
        "state": ("state", lambda x: env.reset(seed=1, options={"state": x})),
        "component": (f"{component}|state", lambda x: env.reset(options={"state": {component: x}})),
        "component name": ("component", lambda x: env.reset(options={"state": {hashable(x): 1.0}})),
        "params": ("params", lambda x: env.reset(seed=1, options={"params": x})),
        "parameter": (
            f"{parameter}|config.dt",
            lambda x: env.reset(options={"params": {parameter: x}}),
        ),
        "step": ("action|first reset", env.step),
        "set_state": ("state", env.set_state),
        "part": ("clock", lambda x: env.set_state({**env.get_state(), "clock": x})),
        "auxiliary": ("name", env.auxiliary),
    }
    if env.task.n_goal:
        goal = np.zeros(env.task.n_goal)
        found["achieved"] = ("goal", lambda x: env.compute_reward(x, goal, {}))
        found["desired"] = ("goal", lambda x: env.compute_reward(goal, x, {}))
    if hasattr(env, "num_envs"):
        found["row"] = ("row", env.moment)
    return found


def generator_of(env):
    """The generator of an environment and its state, None before there is one."""
    generator = env._np_random
    return generator, None if generator is None else generator.bit_generator.state


def check_calls(make, chosen, begun):
    """Give things to every call: it takes them, or refuses them and changes nothing."""
    env, given = make(), things()
    for name in calls(env):
        for k in chosen:
            env = make() if env is None else env
            if begun:
                env.reset(seed=0)
            before, (generator, drawn) = env.get_state(), generator_of(env)
            words, call = calls(env)[name]
            try:
                call(given[k])
            except REFUSALS as error:
                assert re.search(words, str(error)) or isinstance(given[k], NoMapping), error
                assert_same_bits(env.get_state(), before, f"{name} {k}")
                assert generator_of(env)[0] is generator
                assert generator_of(env)[1] == drawn
            else:
                env = None  # taken: the next one begins anew


@pytest.mark.parametrize("begun", [False, True], ids=["fresh", "begun"])
def test_a_sample_of_things_is_taken_or_refused_without_a_trace(env_id, begun):
    chosen = range(IDS.index(env_id), N_THINGS, len(IDS))
    for make in (lambda: single(env_id), lambda: vector(env_id, N)):
        check_calls(make, chosen, begun)


@pytest.mark.long
@pytest.mark.parametrize("begun", [False, True], ids=["fresh", "begun"])
def test_everything_is_taken_or_refused_without_a_trace(env_id, begun):
    for make in (lambda: single(env_id), lambda: vector(env_id, N)):
        check_calls(make, range(N_THINGS), begun)


OF_ROWS = (
    *("num_envs", "num_threads", "max_episode_steps", "autoreset_mode"),
    *("render_rows", "infos_on_request"),
)
OF_BOTH = ("task", "render_mode", "width", "camera", "frame", "rotation", "dt", "action_delay")


def test_arguments_of_the_wrong_kind_are_refused_as_values():
    for name in [*OF_ROWS, *OF_BOTH]:
        for kind in (RigidVectorEnv,) if name in OF_ROWS else (RigidVectorEnv, RigidEnv):
            for thing in things():
                try:
                    kind(**{"task": "rigid_envs.systems.rolling_ball.tasks:BallPark", name: thing})
                except ValueError as error:
                    assert name in str(error) or isinstance(thing, NoMapping)
                    continue
                assert name != "task"
