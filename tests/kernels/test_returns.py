"""A function that returns something else than the loops take is refused before it is compiled."""

import re
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

from rigid_envs.engine.compiler import scalar
from rigid_envs.systems import Roller
from rigid_envs.systems.roller.dynamics import State
from rigid_envs.systems.roller.tasks import RollPump
from rigid_envs.systems.roller.tasks.roll_pump import Auxiliary, Terms
from rigid_envs.tasks.core import Core


@scalar
def swapped(stream, p, c):
    return Auxiliary(0.0), State(0.1, 0.0)


@scalar
def three(stream, p, c):
    return State(0.1, 0.0), Auxiliary(0.0), 1.0


@scalar
def alone(stream, p, c):
    return State(0.1, 0.0)


@scalar
def longer(stream, p, c):
    return (0.1, 0.0, 0.0), (0.0,)


@scalar
def input_first(a, y, aux, p, c):
    return (0.0, 0.0), Auxiliary(0.0)


@scalar
def no_cost(y, u, aux, p, c, dt):
    return aux, Terms(0.0, 0.0), True, True


@scalar
def share_as_success(y, u, aux, p, c, dt):
    return aux, Terms(0.0, 0.0), 0.0, 0.5 * y.s, True


@scalar
def two_actions(action):
    return (action[0], action[0]), False


@scalar
def short(y, u, p, h=0.0):
    return (y.s,)


@scalar
def one_too_many(y, p):
    return y.s, y.v


def begun(task):
    """A row at its start."""
    core = Core(task, 1)
    core.seed(np.zeros(1, np.int64), np.zeros(1, np.uint64))
    core.reset_unseen(np.zeros(1, np.int64))
    return core


STATE = "State(s, v)"


@pytest.mark.parametrize(
    ("name", "function", "found", "expected"),
    [
        ("start", swapped, "(Auxiliary, State)", f"({STATE}, Auxiliary(beta_change))"),
        ("start", three, "(State, Auxiliary, number)", f"({STATE}, Auxiliary(beta_change))"),
        ("start", alone, "State", f"({STATE}, Auxiliary(beta_change))"),
        ("start", longer, "((number, number, number), (number))", f"({STATE}, Auxiliary"),
        ("actuate", input_first, "((number, number), Auxiliary)", f"({STATE}, Input("),
        ("outcome", no_cost, "(Auxiliary, Terms, bool, bool)", "(Auxiliary(beta_change), Terms("),
        ("outcome", share_as_success, "(Auxiliary, Terms, number, number, bool)", "(Auxiliary(b"),
        ("clip", two_actions, "((number, number), bool)", "(Action(beta_change), bool)"),
    ],
)
def test_a_task_is_refused_whose_function_returns_something_else(name, function, found, expected):
    @dataclass(frozen=True)
    class Other(RollPump):
        episode: ClassVar = replace(RollPump.episode, **{name: function})

    told = f"{name} = {__name__}.{function.__name__}, which returns {found}; expected a function "
    told = rf"^{re.escape(f'{told}that returns {expected}')}.*: return exactly these, in this order"
    with pytest.raises(TypeError, match=told):
        begun(Other()).step()


@pytest.mark.parametrize(
    ("name", "function", "call"),
    [
        ("rhs", short, lambda system: system.rhs(system.state(), np.zeros(2))),
        ("step", short, lambda system: system.advance(system.state(), np.zeros(2), 0.1)),
        ("invariants", one_too_many, lambda system: system.invariants(system.state())),
    ],
)
def test_a_system_is_refused_whose_function_returns_something_else(
    monkeypatch, name, function, call
):
    system = Roller()
    monkeypatch.setattr(Roller, "dynamics", replace(Roller.dynamics, **{name: function}))
    told = rf"^{name} = {__name__}\.{function.__name__}, which returns \(number.*\); expected "
    with pytest.raises(TypeError, match=told):
        call(system)


def test_a_row_may_be_a_plain_tuple_of_as_many_numbers():
    @scalar
    def plain(stream, p, c):
        return (0.1, 0), (0.0,)

    @dataclass(frozen=True)
    class Other(RollPump):
        episode: ClassVar = replace(RollPump.episode, start=plain)

    assert begun(Other()).y.tolist() == [[0.1, 0.0]]
