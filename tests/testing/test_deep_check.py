"""`deep_check` finds what is wrong with an environment, and nothing wrong with a correct one."""

import random

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import WrapperSpec
from gymnasium.utils import EzPickle
from gymnasium.wrappers import RecordEpisodeStatistics, TimeLimit

from rigid_envs.base.checks import ConfigError
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.testing.deep import DeepCheckError, deep_check
from tests.programs import printed
from tests.testing import planted
from tests.testing.planted import LIMIT, PLANTED, Slider

STOCK = (
    *("CartPole-v1", "Pendulum-v1", "Acrobot-v1", "MountainCar-v0", "MountainCarContinuous-v0"),
    *("Blackjack-v1", "Taxi-v4", "FrozenLake-v1", "CliffWalking-v1"),
)


def registered(entry, name, **more):
    env_id = f"Planted/{name}-v0"
    gym.register(env_id, entry, max_episode_steps=LIMIT, **more)
    return env_id


def id_of(bug):
    """The environment; around a correct one, and its time limit, if the bug is a wrapper."""
    if not issubclass(bug, gym.Wrapper):
        return registered(bug, bug.__name__)
    wrapper = WrapperSpec(bug.__name__, f"{bug.__module__}:{bug.__name__}", {})
    return registered(Slider, bug.__name__, additional_wrappers=(wrapper,))


@pytest.fixture(autouse=True)
def registry_kept(monkeypatch):
    monkeypatch.setattr(gym.envs.registration, "registry", dict(gym.registry))


def findings(source, **options):
    with pytest.raises(DeepCheckError) as raised:
        deep_check(source, **options)
    assert all(finding in str(raised.value) for finding in raised.value.findings)
    return raised.value.findings


@pytest.mark.parametrize("case", PLANTED[::2], ids=lambda case: case.bug.__name__)
def test_planted_bugs_are_found_by_their_names(case):
    found = findings(id_of(case.bug), **case.options)
    assert any(finding.startswith(f"{case.found_by}: ") for finding in found), found


def test_there_are_enough_bugs_for_the_claim():
    assert len({case.bug.__name__ for case in PLANTED}) == len(PLANTED) >= 55


class VanishingInfo(Slider):
    """Keys of info may come and go."""

    def step(self, action):
        *rest, info = super().step(action)
        return *rest, info if self.x > 0.0 else {}


class FixedStart(Slider):
    """Every episode may start at the same place."""

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.x = self.v = 0.0
        return self.observation(), {}


class RebuiltFromArguments(Slider, EzPickle):
    """Pickles may be made anew from the arguments, as those of engines are."""

    def __init__(self, render_mode=None):
        EzPickle.__init__(self, render_mode)
        super().__init__(render_mode)


class NotToBeCopied(Slider):
    """An environment need not be copied at all."""

    def __getstate__(self):
        raise TypeError("it holds a window")


class BoundsThatTruncate(Slider):
    """An episode may be truncated before its limit."""

    def step(self, action):
        observation, reward, _, _, info = super().step(action)
        return observation, reward, False, abs(self.x) > 0.08, info


class NoDriver(Slider):
    """A machine need not be able to draw."""

    def render(self):
        raise OSError("no display")


@pytest.mark.parametrize(
    "correct",
    [
        *(Slider, VanishingInfo, FixedStart, RebuiltFromArguments, NotToBeCopied, NoDriver),
        BoundsThatTruncate,
    ],
)
def test_a_correct_environment_has_no_findings(correct):
    deep_check(id_of(correct), strict=True)
    deep_check(correct, strict=True)


def test_a_callable_with_wrappers_has_no_findings():
    deep_check(lambda: RecordEpisodeStatistics(TimeLimit(Slider(), 9)), strict=True)


def test_a_nondeterministic_environment_is_not_asked_for_the_same_bits():
    bug = planted.IgnoresTheSeed
    deep_check(registered(bug, "Random", nondeterministic=True))
    assert findings(registered(bug, "Honest"))


@pytest.mark.parametrize("env_id", STOCK[::2])
def test_environments_of_gymnasium_have_no_findings(env_id):
    deep_check(env_id)


@pytest.mark.parametrize("env_id", list(ENVIRONMENTS)[::6])
def test_environments_of_this_package_have_no_findings(env_id):
    deep_check(env_id, strict=True)


@pytest.mark.long
@pytest.mark.parametrize("env_id", [*STOCK, *ENVIRONMENTS])
def test_no_environment_has_findings_for_any_of_100_seeds(env_id):
    for seed in range(100):
        deep_check(env_id, seed=seed, strict=env_id in ENVIRONMENTS)


@pytest.mark.long
@pytest.mark.parametrize("case", PLANTED, ids=lambda case: case.bug.__name__)
def test_every_planted_bug_is_found_for_any_of_20_seeds(case):
    env_id = id_of(case.bug)
    for seed in range(20):
        found = findings(env_id, seed=seed, **case.options)
        assert any(finding.startswith(f"{case.found_by}: ") for finding in found), seed


@pytest.mark.parametrize(
    ("env_id", "names"),
    [
        ("Pendulum-v1", {"nan_in_an_action_gives_no_nan"}),
        (
            "MountainCarContinuous-v0",
            {"nan_in_an_action_gives_no_nan", "observations_may_be_written_into"},
        ),
    ],
)
def test_what_gymnasium_leaves_open_is_asked_for_on_request(env_id, names):
    assert {finding.partition(":")[0] for finding in findings(env_id, strict=True)} == names


def test_a_finding_says_what_where_and_what_was_expected():
    assert findings(planted.NumbersForFlags) == (
        "results_are_of_their_declared_kinds: result 1 (0 is the first reset): terminated is 0, "
        "expected a bool",
    )


def test_the_global_generators_are_left_as_they_were():
    before = random.getstate(), np.random.get_state()[1].tolist()  # noqa: NPY002
    findings(planted.SeedsTheGlobalGenerator)
    assert (random.getstate(), np.random.get_state()[1].tolist()) == before  # noqa: NPY002


def test_arguments_reach_the_environment():
    deep_check("RigidEnvs/BallPark-v0", frame="reduced", strict=True)
    with pytest.raises(ConfigError, match="frame = 'upside down'"):
        deep_check("RigidEnvs/BallPark-v0", frame="upside down")


def test_it_needs_no_package_of_the_tests():
    code = (
        "import sys; sys.modules['pytest'] = sys.modules['hypothesis'] = None; "
        "from rigid_envs.testing import deep_check; deep_check('CartPole-v1')"
    )
    printed("-c", code)
