"""Efficiency: what does not succeed has none, whatever it spends, and nobody has more than 1."""

import numpy as np
import pytest

from rigid_envs.envs.lookup import task_of
from rigid_envs.scores.best import best_known
from rigid_envs.scores.evaluation import evaluate
from rigid_envs.scores.policies import PolicyFactory, reference_controllers, untrained_policy
from rigid_envs.scores.starts import cost_of, efficiencies
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.testing.environments import in_full

N = 20
each_id = pytest.mark.parametrize("env_id", list(ENVIRONMENTS))
one_of_each_system = in_full(ENVIRONMENTS)


def test_efficiency_is_the_share_of_the_best_cost_in_the_own_one_of_a_success() -> None:
    won = [True, True, True, False, False]
    costs, best = [2.0, 4.0, 1.0, 1.0, 0.0], [2.0, 2.0, 2.0, 2.0, 2.0]
    np.testing.assert_array_equal(efficiencies(won, costs, best, 0.01), [1.0, 0.5, 1.0, 0.0, 0.0])


def test_the_first_to_succeed_has_all_and_who_fails_has_none_where_nobody_has() -> None:
    found = efficiencies([True, False], [7.0, 0.0], [np.nan, np.nan], 0.01)
    np.testing.assert_array_equal(found, [1.0, 0.0])


def test_costs_below_the_floor_count_as_it() -> None:
    found = efficiencies([True] * 3, [0.0, 0.005, 0.04], [0.0, 0.0, 0.0], 0.01)
    np.testing.assert_allclose(found, [1.0, 1.0, 0.25])


@each_id
def test_every_id_has_a_cost_with_a_floor_far_below_what_is_known(env_id: str) -> None:
    cost, known = cost_of(env_id, task_of(env_id)), best_known(env_id)
    assert known is not None and known.cost == cost.name
    assert 0.0 < cost.floor <= 0.15 * np.nanmedian(known.costs)


def constant(value: float) -> PolicyFactory:
    def make(envs):
        space = envs.action_space
        fixed = np.full(space.shape, value, dtype=space.dtype)
        if envs.task.n_choices:
            fixed = np.full(space.shape, envs.task.n_choices - 1 if value > 0 else 1)
        return lambda _: fixed.copy()

    return PolicyFactory(make, f"constant {value}")


def fails_late(env_id: str) -> PolicyFactory:
    """The quickest controller to compute, until shortly before it would succeed."""
    quick = list(reference_controllers(env_id))[-1]
    good = untrained_policy(env_id, quick)
    steps = evaluate(env_id, good, n=N).values["length"]

    def make(envs):
        act, step, n_choices = good(envs), 0, envs.task.n_choices

        def actions(obs):
            nonlocal step
            step += 1
            late = step > 0.7 * steps
            rows = late.reshape(-1, *[1] * (len(envs.action_space.shape) - 1))
            right = act(obs)  # then the opposite choice, or all of everything
            return np.where(rows, (right + 2) % 4 if n_choices else np.ones_like(right), right)

        return actions

    return PolicyFactory(make, "fails late")


@one_of_each_system
def test_nothing_that_fails_is_efficient_and_no_best_known_is_below_the_bound(env_id: str) -> None:
    policies = ["zero", "random", constant(1.0), constant(-0.5), fails_late(env_id)]
    for policy in policies:
        found = evaluate(env_id, policy, n=N)
        assert found.efficiencies.mean() <= 0.05, found.policy
    if found.bounds is not None:
        # float32 actions and what the finite horizon leaves change a loss by less than this
        assert (found.best >= found.bounds * (1.0 - 1e-6)).all()


@one_of_each_system
def test_no_reference_controller_is_better_than_the_data_say(env_id: str) -> None:
    known = best_known(env_id)
    name = next(iter(reference_controllers(env_id)))
    found = evaluate(env_id, name, n=4)  # a shortest path takes half a second
    own = np.array([finder == name for finder in known.finders[:4]])
    assert found.successes.all()
    # LAPACK rounds differently on other machines
    assert (found.costs >= known.costs[:4] * (1.0 - 1e-3)).all()
    np.testing.assert_allclose(found.efficiencies[own], 1.0, rtol=1e-3)
    assert known.policies[name]["success_rate"] == 1.0
