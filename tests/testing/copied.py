"""Planted bugs by which copies and pictures do not leave an episode as it is."""

from typing import Any

import numpy as np

from tests.testing.slider import Slider, planted


class Body:
    """A part that its environment owns."""

    def __init__(self) -> None:
        self.v = 0.0

    def __deepcopy__(self, memo: Any) -> Any:
        return self


@planted("deep_copies_go_on_alike")
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


@planted("deep_copies_go_on_alike")
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


@planted("pickles_go_on_alike")
class LosesItsGeneratorInPickles(Slider):
    def __getstate__(self):
        return {name: value for name, value in vars(self).items() if name != "_np_random"}


@planted("pickles_go_on_alike")
class RoundsItsStateInPickles(Slider):
    def __getstate__(self):
        return vars(self) | {"x": float(np.float32(self.x))}


@planted("deep_copies_go_on_alike")
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
