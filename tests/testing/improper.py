"""Planted bugs by which results are of the wrong kind, or not the caller's, or end wrongly."""

import gymnasium as gym
import numpy as np
from gymnasium import spaces

from tests.testing.slider import LIMIT, Slider, planted


@planted("observations_are_in_their_space")
class DoubleObservations(Slider):
    def observation(self):
        return np.array([self.x, self.v])


@planted("observations_are_in_their_space")
class DoubleObservationsAfterSteps(Slider):
    def step(self, action):
        observation, *rest = super().step(action)
        return observation.astype(np.float64), *rest


@planted("observations_are_in_their_space")
class Lists(Slider):
    def observation(self):
        return [self.x, self.v]


@planted("observations_are_in_their_space")
class Columns(Slider):
    def observation(self):
        return super().observation()[:, None]


@planted("observations_are_in_their_space")
class OutsideByRounding(Slider):
    def observation(self):
        return np.array([self.x, np.nextafter(np.float32(2), np.float32(3))], dtype=np.float32)


@planted("observations_are_in_their_space")
class NaNInTheMiddle(Slider):
    def observation(self):
        # 0 / 0 for a mass that moves to the left
        speed = self.v if self.v > -0.015 else np.nan
        return np.array([self.x, speed], dtype=np.float32)


@planted("observations_are_in_their_space")
class TooNarrowSpace(Slider):
    def __init__(self, render_mode=None):
        super().__init__(render_mode)
        self.observation_space = spaces.Box(-0.05, 0.05, (2,), np.float32)


@planted("observations_are_in_their_space")
class MissingKey(Slider):
    def __init__(self, render_mode=None):
        super().__init__(render_mode)
        box = self.observation_space
        self.observation_space = spaces.Dict({"state": box, "goal": box})

    def observation(self):
        return {"state": super().observation()}


@planted("observations_are_in_their_space")
class ChoiceTooHigh(Slider):
    def __init__(self, render_mode=None):
        super().__init__(render_mode)
        self.observation_space = spaces.Discrete(4)

    def observation(self):
        return 4


@planted("rewards_are_finite_numbers")
class RewardsInArrays(Slider):
    def step(self, action):
        observation, reward, *rest = super().step(action)
        return observation, np.array([reward]), *rest


@planted("rewards_are_finite_numbers")
class ComplexRewards(Slider):
    def step(self, action):
        observation, reward, *rest = super().step(action)
        return observation, complex(reward), *rest


@planted("rewards_are_finite_numbers")
class InfiniteRewards(Slider):
    def step(self, action):
        observation, _, *rest = super().step(action)
        return observation, float("-inf") if self.v < 0 else 0.0, *rest


@planted("flags_are_bools")
class NumbersForFlags(Slider):
    def step(self, action):
        observation, reward, terminated, *rest = super().step(action)
        return observation, reward, int(terminated), *rest


@planted("flags_are_bools")
class NoneForTruncated(gym.Wrapper):
    def step(self, action):
        *rest, truncated, info = self.env.step(action)
        return *rest, truncated or None, info


@planted("infos_are_dictionaries_with_strings_as_keys")
class NumbersForKeys(Slider):
    def step(self, action):
        *rest, _ = super().step(action)
        return *rest, {0: self.x}


@planted("infos_are_dictionaries_with_strings_as_keys")
class NoInfoAtReset(Slider):
    def reset(self, *, seed=None, options=None):
        return super().reset(seed=seed)[0], None


@planted("first_episode")
class ResetWithoutInfo(Slider):
    def reset(self, *, seed=None, options=None):
        return super().reset(seed=seed)[0]


@planted("first_episode")
class FourResults(Slider):
    def step(self, action):
        observation, reward, terminated, _, info = super().step(action)
        return observation, reward, terminated, info


@planted("kept_observations_do_not_change")
class OneBuffer(Slider):
    def __init__(self, render_mode=None):
        super().__init__(render_mode)
        self.buffer = np.zeros(2, dtype=np.float32)

    def observation(self):
        self.buffer[:] = self.x, self.v
        return self.buffer


@planted("kept_observations_do_not_change")
class ViewsOfOneBuffer(OneBuffer):
    def observation(self):
        return super().observation()[:]


@planted("kept_observations_do_not_change")
class OneDictionary(Slider):
    def __init__(self, render_mode=None):
        super().__init__(render_mode)
        box = self.observation_space
        self.observation_space = spaces.Dict({"state": box})
        self.buffer = {"state": np.zeros(2, dtype=np.float32)}

    def observation(self):
        self.buffer["state"] = super().observation()
        return self.buffer


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


@planted("a_time_limit_of_another_length_truncates")
class LimitOfItsOwn(gym.Wrapper):
    def reset(self, **options):
        self.steps = 0
        return self.env.reset(**options)

    def step(self, action):
        self.steps += 1
        *rest, _, info = self.env.step(action)
        return *rest, self.steps >= LIMIT, info


@planted("closing_twice_is_harmless")
class ClosesOnce(Slider):
    def close(self):
        del self.x


@planted("the_metadata_says_how_it_renders")
class NoModes(Slider):
    metadata = {"render_fps": 10}  # noqa: RUF012


@planted("the_metadata_says_how_it_renders")
class NoRate(Slider):
    metadata = {"render_modes": ["rgb_array"]}  # noqa: RUF012


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
