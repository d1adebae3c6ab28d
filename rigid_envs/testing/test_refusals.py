"""Whatever is given, it is taken or refused by one kind of error, and a refusal changes nothing."""

import datetime
import decimal
import fractions
import pathlib
from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from rigid_envs.envs.single import RigidEnv
from rigid_envs.envs.vector import RigidVectorEnv
from rigid_envs.testing.environments import IDS, assert_same_bits, single, vector

REFUSALS = (ValueError, gym.error.Error)  # the latter where Gymnasium prescribes it
N = 3


class Unprintable:
    def __repr__(self) -> str:
        raise RuntimeError("no repr")


class NoArray:
    def __array__(self, *_: Any, **__: Any) -> Any:
        raise RuntimeError("no array")


class NoMapping(dict[Any, Any]):
    def items(self) -> Any:
        return [(1, 2, 3)]


def things() -> list[Any]:
    """One of each kind, made anew: some can be used only once."""
    numbers = [7, -1, True, 1.5, np.nan, np.inf, 10**400, -(10**400), 2**63, 2**64, 1j]
    kinds = [np.float64(2.5), np.int8(3), np.uint64(2**64 - 1), np.bool_(True), np.longdouble(1)]
    dates = [np.datetime64("2020-01-01"), datetime.date(2020, 1, 1), np.array([1], dtype="M8[s]")]
    texts = ["text", "7", "", "\u00e9\x00", "a" * 10_000, b"bytes", bytearray(b"x"), "os:path"]
    folders: list[Any] = [{}, {"a": 1}, {1: 2}, {None: 1}, {"state": None}, NoMapping()]
    sets = [set(), {1}, frozenset({2}), slice(1), memoryview(b"ab"), range(3), iter([1])]
    rows = [[], [[]], [1, [2, 3]], [None], ["a"], (), (1, 2), (x for x in [1]), [1, 2, True]]
    arrays = [np.array(x) for x in (3, [], [1, 2], ["x"], [None], [1j], [True], [np.nan])]
    odd = [np.zeros((3, 0)), np.zeros(10**6), np.array([(1,)], dtype=[("x", int)])]
    masked = [np.ma.array([1.0], mask=[True]), np.recarray((1,), dtype=[("x", float)])]
    objects = [None, object(), Unprintable(), NoArray(), type, np, Ellipsis, NotImplemented]
    more = [lambda: 1, np.random.default_rng(0), pathlib.Path(), fractions.Fraction(1, 2)]
    few = [decimal.Decimal("1.5")]
    return [
        *(*numbers, *kinds, *dates, *texts, *folders, *sets, *rows, *arrays, *odd, *masked),
        *(*objects, *more, *few),
    ]


N_THINGS = len(things())


def hashable(thing: Any) -> Any:
    """The thing, as a key; a name that nothing has where it cannot be one."""
    try:
        hash(thing)
    except TypeError:
        return "unhashable"
    return thing


def calls(env: Any) -> dict[str, Callable[[Any], Any]]:
    """Everything that takes an argument, by name."""
    component = next(iter(env.task.system_type.components))
    parameter = next(iter(env.task.physical_parameters()), "none")
    return {
        "seed": lambda x: env.reset(seed=x),
        "options": lambda x: env.reset(options=x),
        "option": lambda x: env.reset(options={hashable(x): 1.0}),
        "mask": lambda x: env.reset(seed=1, options={"reset_mask": x}),
        "state": lambda x: env.reset(seed=1, options={"state": x}),
        "component": lambda x: env.reset(options={"state": {component: x}}),
        "component name": lambda x: env.reset(options={"state": {hashable(x): 1.0}}),
        "params": lambda x: env.reset(seed=1, options={"params": x}),
        "parameter": lambda x: env.reset(options={"params": {parameter: x}}),
        "step": env.step,
        "set_state": env.set_state,
        "part": lambda x: env.set_state({**env.get_state(), "clock": x}),
        "auxiliary": env.auxiliary,
    }


def generator_of(env: Any) -> Any:
    """The generator of an environment and its state, None before there is one."""
    generator = env._np_random
    return generator, None if generator is None else generator.bit_generator.state


def check_calls(make: Callable[[], Any], chosen: range, begun: bool) -> None:
    """Give things to every call: it takes them, or refuses them and changes nothing."""
    env, given = make(), things()
    for name in calls(env):
        for k in chosen:
            env = make() if env is None else env
            if begun:
                env.reset(seed=0)
            before, (generator, drawn) = env.get_state(), generator_of(env)
            try:
                calls(env)[name](given[k])
            except REFUSALS:
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
        kinds = [RigidVectorEnv]
        if name not in OF_ROWS:
            kinds.append(RigidEnv)
        for kind in kinds:
            for thing in things():
                keywords = {"task": "rigid_envs.systems.rolling_ball.tasks:BallPark"} | {
                    name: thing
                }
                try:
                    kind(**keywords)
                except ValueError:
                    continue
                assert name != "task"
