"""Planted bugs by which the same seed does not give the same episode."""

import itertools
import random
import time

import gymnasium as gym
import numpy as np

from tests.testing.slider import Slider, planted

TICKS = itertools.count()
SHARED: dict[str, float] = {"v": 0.0}


@planted("same_seed_in_another_instance")
class RewardsOfTheGlobalGenerator(Slider):
    def step(self, action):
        observation, reward, *rest = super().step(action)
        return observation, reward + random.random(), *rest


@planted("global_generators_are_not_used")
class StartsOfTheGlobalGenerator(Slider):
    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.x = np.random.uniform(-0.1, 0.1)  # noqa: NPY002
        return self.observation(), {"x": self.x}


@planted("global_generators_are_not_touched")
class SeedsTheGlobalGenerator(Slider):
    def reset(self, *, seed=None, options=None):
        np.random.seed(seed)  # noqa: NPY002
        return super().reset(seed=seed)


@planted("global_generators_are_not_touched")
class SeedsPython(Slider):
    def reset(self, *, seed=None, options=None):
        if seed is not None:
            random.seed(seed)
        return super().reset(seed=seed)


@planted("global_generators_are_not_touched")
class WastesOfTheGlobalGenerator(Slider):
    def step(self, action):
        random.random()
        return super().step(action)


@planted("same_seed_in_another_instance")
class IgnoresTheSeed(Slider):
    def reset(self, *, seed=None, options=None):
        return super().reset()


@planted("same_seed_again")
class TakesTheFirstSeedOnly(Slider):
    seeded = False

    def reset(self, *, seed=None, options=None):
        seed, self.seeded = None if self.seeded else seed, True
        return super().reset(seed=seed)


@planted("another_seed_starts_elsewhere")
class TakesEverySeedForZero(Slider):
    def reset(self, *, seed=None, options=None):
        return super().reset(seed=None if seed is None else 0)


@planted("another_seed_starts_elsewhere")
class TakesHalfOfTheSeed(Slider):
    def reset(self, *, seed=None, options=None):
        return super().reset(seed=None if seed is None else seed // 2)


@planted("same_seed_again")
class KeepsItsSpeed(Slider):
    def reset(self, *, seed=None, options=None):
        v = self.v
        super().reset(seed=seed)
        self.v = v
        return self.observation(), {"x": self.x}


@planted("same_seed_again")
class GrowsTired(Slider):
    steps = 0

    def step(self, action):
        self.steps += 1
        return super().step(action / (1 + 0.001 * self.steps))


@planted("same_seed_after_a_broken_episode")
class ForgetsOnlyAtAnEnd(gym.Wrapper):
    over, steps = True, 0

    def reset(self, **options):
        self.steps = 0 if self.over else self.steps
        observation, info = self.env.reset(**options)
        return observation, info | {"steps": self.steps}

    def step(self, action):
        self.steps += 1
        *rest, truncated, info = self.env.step(action)
        self.over = truncated
        return *rest, truncated, info


@planted("same_seed_after_an_end")
class StaysOver(gym.Wrapper):
    over = False

    def step(self, action):
        observation, reward, terminated, truncated, info = self.env.step(action)
        terminated, self.over = terminated or self.over, truncated
        return observation, reward, terminated, truncated, info


@planted("same_seed_after_an_end")
class BeginsLaterAfterALongEpisode(Slider):
    steps = 0

    def reset(self, *, seed=None, options=None):
        result = super().reset(seed=seed)
        late, self.steps = self.steps > 2, 0
        if late:
            self.step([0.0])
        return result

    def step(self, action):
        self.steps += 1
        return super().step(action)


@planted("same_seed_again")
class CountsItsEpisodes(Slider):
    episodes = 0

    def reset(self, *, seed=None, options=None):
        self.episodes += 1
        observation, info = super().reset(seed=seed)
        return observation, info | {"episode": self.episodes}


@planted("same_seed_beside_another_instance")
class SharesItsSpeed(Slider):
    def reset(self, *, seed=None, options=None):
        result = super().reset(seed=seed)
        SHARED["v"] = self.v
        return result

    def step(self, action):
        self.v = SHARED["v"]
        result = super().step(action)
        SHARED["v"] = self.v
        return result


@planted("same_seed_beside_another_instance")
class SharesItsGenerator(Slider):
    stream = np.random.default_rng(0)

    def reset(self, *, seed=None, options=None):
        if seed is not None:
            type(self).stream = np.random.default_rng(seed)
        return super().reset(seed=seed)

    def step(self, action):
        return super().step(action + 0.1 * self.stream.normal())


@planted("same_seed_in_another_instance")
class CountsInstances(Slider):
    def __init__(self, render_mode=None):
        super().__init__(render_mode)
        self.drag = 0.001 * next(TICKS)

    def step(self, action):
        return super().step(action * (1 - self.drag))


@planted("same_seed_again")
class ShowsTheClock(Slider):
    def step(self, action):
        *rest, info = super().step(action)
        return *rest, info | {"time": time.perf_counter()}


@planted("same_seed_again")
class SecondFlagDiffers(Slider):
    # an info that is an int first and a bool in later episodes
    def step(self, action):
        *rest, info = super().step(action)
        kind = int if next(TICKS) % 7 else bool
        return *rest, info | {"inside": kind(abs(self.x) < 1.0)}


@planted("same_seed_in_another_instance")
class OrdersByHash(Slider):
    def step(self, action):
        *rest, info = super().step(action)
        return *rest, info | {"identity": id(self)}


@planted("the_next_episode_goes_on_in_its_stream")
class FreshStreamWithoutASeed(Slider):
    def reset(self, *, seed=None, options=None):
        if seed is None:
            self._np_random = np.random.default_rng()
        return super().reset(seed=seed)


@planted("seed_alone_decides_when_the_action_space_is_seeded")
class DrawsFromItsActionSpace(Slider):
    def step(self, action):
        self.action_space.sample()
        return super().step(action)


@planted("seed_alone_decides_when_the_action_space_is_seeded")
class SeedsItsActionSpace(Slider):
    def reset(self, *, seed=None, options=None):
        if seed is not None:
            self.action_space.seed(seed)
        return super().reset(seed=seed)


@planted("first_episode")
class CannotBeginAfterAnEnd(gym.Wrapper):
    over = False

    def reset(self, **options):
        if self.over:
            raise RuntimeError("the episode is over")
        return self.env.reset(**options)

    def step(self, action):
        result = self.env.step(action)
        self.over = result[3]
        return result
