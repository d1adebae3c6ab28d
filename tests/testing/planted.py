"""A correct environment, as small as can be, and the bugs that are planted in it."""

import itertools
import random
import time
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
from gymnasium import spaces

LIMIT = 30
TICKS = itertools.count()
SHARED = {"v": 0.0}


class Slider(gym.Env):
    """A mass on a line that is pushed; it cannot reach the ends within the time limit."""

    metadata = {"render_modes": ["rgb_array"], "render_fps": 10}  # noqa: RUF012 - as Gymnasium's

    def __init__(self, render_mode=None):
        self.render_mode = render_mode
        self.observation_space = spaces.Box(-2.0, 2.0, (2,), np.float32)
        self.action_space = spaces.Box(-1.0, 1.0, (1,), np.float32)
        self.x, self.v = 0.0, 0.0

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.x, self.v = self.np_random.uniform(-0.1, 0.1, 2)
        return self.observation(), {"x": self.x}

    def step(self, action):
        push = float(np.clip(np.nan_to_num(action), -1.0, 1.0)[0])
        self.v = 0.5 * self.v + 0.01 * push
        self.x += self.v
        return self.observation(), -self.x * self.x, abs(self.x) > 1.0, False, {"x": self.x}

    def observation(self):
        return np.array([self.x, self.v], dtype=np.float32)

    def render(self):
        picture = np.zeros((4, 8, 3), dtype=np.uint8)
        picture[:, int(np.clip(4 + 4 * self.x, 0, 7))] = 255
        return picture


class Planted(NamedTuple):
    """A bug: the environment or wrapper that has it, and which check must name it."""

    bug: type
    found_by: str
    options: dict[str, Any]


PLANTED = []


def planted(found_by, **options):
    """Note a class as a bug that a check of this name finds."""

    def note(bug):
        PLANTED.append(Planted(bug, found_by, options))
        return bug

    return note


# Results are of the wrong kind, or not the caller's, or end wrongly.


@planted("results_are_of_their_declared_kinds")
class Lists(Slider):
    def observation(self):
        return [self.x, self.v]


@planted("results_are_of_their_declared_kinds")
class MissingKey(Slider):
    def __init__(self, render_mode=None):
        super().__init__(render_mode)
        box = self.observation_space
        self.observation_space = spaces.Dict({"state": box, "goal": box})

    def observation(self):
        return {"state": super().observation()}


@planted("first_episode")
class ResetWithoutInfo(Slider):
    def reset(self, *, seed=None, options=None):
        return super().reset(seed=seed)[0]


@planted("observations_may_be_written_into", strict=True)
class StateIsTheObservation(Slider):
    def observation(self):
        self.state = super().observation()
        return self.state

    def step(self, action):
        self.x, self.v = map(float, self.state)
        return super().step(action)


@planted("nan_in_an_action_gives_no_nan", strict=True)
class TakesNaN(Slider):
    def step(self, action):
        self.v += 0.0 * float(action[0])
        return super().step(action)


@planted("actions_are_not_changed")
class ClipsInPlace(Slider):
    def step(self, action):
        np.clip(action, -0.5, 0.5, out=action)
        return super().step(action)


@planted("options_are_not_changed", options={"x": 0.05})
class PopsOptions(Slider):
    def reset(self, *, seed=None, options=None):
        x = (options or {}).pop("x", None)
        observation, info = super().reset(seed=seed)
        self.x = self.x if x is None else x
        return observation, info


@planted("options_are_not_changed")
class AddsToOptions(Slider):
    def reset(self, *, seed=None, options=None):
        if options is not None:
            options.setdefault("x", 0.0)
        return super().reset(seed=seed)


@planted("the_time_limit_truncates")
class SwappedFlags(gym.Wrapper):
    def step(self, action):
        observation, reward, terminated, truncated, info = self.env.step(action)
        return observation, reward, truncated, terminated, info


@planted("the_time_limit_truncates")
class TerminatedAtTheLimit(Slider):
    def reset(self, *, seed=None, options=None):
        self.steps = 0
        return super().reset(seed=seed)

    def step(self, action):
        self.steps += 1
        observation, reward, _, truncated, info = super().step(action)
        return observation, reward, self.steps >= LIMIT, truncated, info


@planted("the_time_limit_truncates")
class OneStepShort(TerminatedAtTheLimit):
    def step(self, action):
        observation, reward, *_, info = super().step(action)
        return observation, reward, False, self.steps >= LIMIT - 1, info


@planted("the_time_limit_truncates")
class OneStepLong(gym.Wrapper):
    late = False

    def step(self, action):
        *rest, truncated, info = self.env.step(action)
        truncated, self.late = self.late, truncated
        return *rest, truncated, info


@planted("the_time_limit_truncates")
class NeverEnds(gym.Wrapper):
    def step(self, action):
        *rest, _, info = self.env.step(action)
        return *rest, False, info


@planted("closing_twice_is_harmless")
class ClosesOnce(Slider):
    def close(self):
        del self.x


@planted("pictures_are_rgb_arrays_and_change_nothing")
class FloatPictures(Slider):
    def render(self):
        return super().render() / 255.0


@planted("pictures_are_rgb_arrays_and_change_nothing")
class TransparentPictures(Slider):
    def render(self):
        return np.zeros((4, 8, 4), dtype=np.uint8)


@planted("pictures_are_rgb_arrays_and_change_nothing")
class NoPictures(Slider):
    def render(self):
        return None


# The same seed does not give the same episode.


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


@planted("same_seed_beside_another_instance")
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


@planted("same_seed_after_another_episode")
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


@planted("same_seed_after_another_episode")
class StaysOver(gym.Wrapper):
    over = False

    def step(self, action):
        observation, reward, terminated, truncated, info = self.env.step(action)
        terminated, self.over = terminated or self.over, truncated
        return observation, reward, terminated, truncated, info


@planted("same_seed_after_another_episode")
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


@planted("same_seed_beside_another_instance")
class CountsInstances(Slider):
    def __init__(self, render_mode=None):
        super().__init__(render_mode)
        self.drag = 0.001 * next(TICKS)

    def step(self, action):
        return super().step(action * (1 - self.drag))


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


# Copies and pictures do not leave an episode as it is.


class Body:
    """A part that its environment owns."""

    def __init__(self):
        self.v = 0.0

    def __deepcopy__(self, memo):
        return self


@planted("copies_go_on_alike")
class SharesItsBodyWithCopies(Slider):
    def __init__(self, render_mode=None):
        super().__init__(render_mode)
        self.body = Body()

    def reset(self, *, seed=None, options=None):
        self.body.v = 0.0
        return super().reset(seed=seed)

    def step(self, action):
        self.body.v += 0.01 * float(action[0])
        self.v += self.body.v
        return super().step(action)


@planted("copies_go_on_alike")
class CopiesTheShallowWay(Slider):
    def __init__(self, render_mode=None):
        super().__init__(render_mode)
        self.trail = [0.0]

    def reset(self, *, seed=None, options=None):
        self.trail[:] = [0.0]
        return super().reset(seed=seed)

    def step(self, action):
        self.trail.append(self.x)
        *rest, info = super().step(action)
        return *rest, info | {"length": len(self.trail)}

    def __deepcopy__(self, memo):
        twin = type(self)(self.render_mode)
        twin.__dict__.update(self.__dict__)
        return twin


@planted("copies_go_on_alike")
class LosesItsGeneratorInPickles(Slider):
    def __getstate__(self):
        return {name: value for name, value in vars(self).items() if name != "_np_random"}


@planted("copies_go_on_alike")
class RoundsItsStateInPickles(Slider):
    def __getstate__(self):
        return vars(self) | {"x": float(np.float32(self.x))}


@planted("copies_go_on_alike")
class CopiesBeginAnew(Slider):
    def __deepcopy__(self, memo):
        twin = type(self)(self.render_mode)
        twin.reset(seed=0)
        return twin


@planted("pictures_are_rgb_arrays_and_change_nothing")
class PicturesAdvanceTheState(Slider):
    def render(self):
        self.x += 1e-9
        return super().render()


@planted("pictures_are_rgb_arrays_and_change_nothing")
class PicturesUseTheGenerator(Slider):
    def render(self):
        self.np_random.normal()
        return super().render()

    def step(self, action):
        return super().step(action + 0.1 * self.np_random.normal())


@planted("pictures_are_rgb_arrays_and_change_nothing")
class WatchedIsAnother(Slider):
    def step(self, action):
        return super().step(action * (0.5 if self.render_mode else 1.0))


# Results of a step are others than they were; last, for some use up `TICKS`.

KINDS, AGAIN = "results_are_of_their_declared_kinds", "same_seed_again"
BESIDE = "same_seed_beside_another_instance"
RESULTS = {
    "Doubles": (KINDS, lambda env, seen, *rest: (seen.astype(np.float64), *rest)),
    "RewardsInArrays": (KINDS, lambda env, seen, paid, *rest: (seen, np.array([paid]), *rest)),
    "ComplexRewards": (KINDS, lambda env, seen, paid, *rest: (seen, complex(paid), *rest)),
    "InfiniteRewards": (
        KINDS,
        lambda env, seen, _, *rest: (seen, float("-inf") if env.v < 0 else 0.0, *rest),
    ),
    "NumbersForFlags": (KINDS, lambda env, seen, paid, end, *rest: (seen, paid, int(end), *rest)),
    "NumbersForKeys": (KINDS, lambda env, *rest: (*rest[:4], {0: env.x})),
    "FourResults": ("first_episode", lambda env, *rest: (*rest[:3], rest[4])),
    "RandomRewards": (BESIDE, lambda env, seen, paid, *rest: (seen, paid + random.random(), *rest)),
    "ShowsTheClock": (AGAIN, lambda env, *rest: (*rest[:4], {"time": time.perf_counter()})),
    "SecondFlagDiffers": (  # an info that is an int first and a bool in later episodes
        AGAIN,
        lambda env, *rest: (*rest[:4], {"inside": (int if next(TICKS) % 7 else bool)(env.x < 1.0)}),
    ),
    "OrdersByHash": (BESIDE, lambda env, *rest: (*rest[:4], {"identity": id(env)})),
}
"""What a step gives in place of its results, and which check finds it."""


def spoiled(change):
    """A step whose results are changed."""
    return lambda env, action: change(env, *Slider.step(env, action))


for _name, (_found_by, _change) in RESULTS.items():
    _bug = type(_name, (Slider,), {"step": spoiled(_change), "__module__": __name__})
    globals()[_name] = planted(_found_by)(_bug)  # by its name it is found in pickles
