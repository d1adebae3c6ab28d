"""Episodes that somebody plays in a window, beside the reference from the same start."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, Image, integer
from rigid_envs.envs.lookup import checked_id, task_of
from rigid_envs.scores.best import limit_of
from rigid_envs.scores.evaluation import make_rows
from rigid_envs.scores.policies import untrained_policy
from rigid_envs.scores.starts import Tally, metrics_of
from rigid_envs.tasks.core import Moment
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tasks.task import Task
from rigid_envs.watch.drawing import Drawing, Look, drawing_of
from rigid_envs.watch.films import figure, play_episode
from rigid_envs.watch.pictures import Window, check_display, font, load_pygame, pillow
from rigid_envs.watch.play.steering import Hands, help_lines, keys_of
from rigid_envs.watch.replays.recording import RecordReplay
from rigid_envs.watch.replays.replay import PastEpisode, Replay
from rigid_envs.watch.views import Interpolation, view_class

# Episodes that somebody plays, in real time, beside the reference from the same start.

_ROUNDING = 1e-9  # share of a step that is none
_TURN = 0.35  # time in which a move on the grid is shown [s]


class Rival(NamedTuple):
    """What theory and the reference controller make of the same start.

    Attributes:
        name: of the reference controller; empty if the id has none.
        text: its result in words.
        bound: what nothing can beat, in words; empty where nothing is known.
    """

    name: str
    text: str
    bound: str


class Game:
    """One environment, steered from outside.

    Args:
        env_id: Gymnasium's id.
        seed: of the first start; the next ones follow.
        config: hyperparameters of the task.

    Attributes:
        task: the task.
        seed: of the present start.
        rival: what others make of it.
        over: whether the episode has ended.
        tally: figures of the episode.
    """

    def __init__(self, env_id: str, seed: int = 0, config: Mapping[str, Any] | None = None) -> None:
        """Begin the first episode."""
        self.env_id, self._config = checked_id(env_id), dict(config or {})
        self.task: Task = task_of(self.env_id, self._config)  # refuses what is no setting
        env = gym.make(self.env_id, disable_env_checker=True, **self._config)
        self._env: Any = RecordReplay(env, label="you")
        self.begin(seed)

    @property
    def period(self) -> float:
        """Time in which a step is shown [s]: real time, but for moves on a grid."""
        return min(self.task.dt, _TURN) if self.task.n_choices else self.task.dt

    def begin(self, seed: int) -> None:
        """Begin an episode from the start that `reset(seed=seed)` gives."""
        self.seed = seed
        self.rival = rival_of(self.env_id, seed, self._config)
        self._env.reset(seed=seed)
        self._failed = self.over = False
        record = ENVIRONMENTS[self.env_id]
        limit = self._env.spec.max_episode_steps or record.max_episode_steps
        self.tally = Tally([seed], record.error, limit)
        moment = self._inner.moment()
        self._motion = Interpolation(self._inner.system, moment, moment)
        self._share = 1.0  # of the step that is shown; 1: the next one can be made

    @property
    def waiting(self) -> bool:
        """Whether the step is shown to its end, and the next one can be made."""
        return self._share >= 1.0 and not self.over

    @property
    def left(self) -> float:
        """Time for which the step is still shown [s]."""
        return (1.0 - self._share) * self.period

    def step(self, action: Any) -> None:
        """Make a step, which `advance` then shows.

        Args:
            action: as the environment takes it.
        """
        _, reward, terminated, truncated, info = self._env.step(action)
        self.tally.add(reward, terminated, truncated, info)
        self._failed, self.over = terminated, terminated or truncated
        inner = self._inner
        self._motion = Interpolation(inner.system, self._motion.at(1.0), inner.moment())
        self._share = 0.0

    def advance(self, seconds: float) -> None:
        """Let time [s] pass in what is shown, to the end of the step at most."""
        share = self._share + seconds / self.period
        self._share = 1.0 if share > 1.0 - _ROUNDING else share

    @property
    def moment(self) -> Moment:
        """What is to be seen now."""
        past = self.tally.episodes()
        totals = float(past.returns[0]), float(past.costs[0])
        return replace(self._motion.at(self._share), totals=totals)

    @property
    def score(self) -> str:
        """Own result so far, in words."""
        value = self.tally.value(metrics_of(self.env_id)[0], self.task)
        return figure(self.env_id, self.task, value) if self.tally.lengths[0] else "-"

    @property
    def verdict(self) -> str:
        """How the episode ended; empty while it runs."""
        if not self.over:
            return ""
        if self.tally.success:
            return "success"
        return "failed" if self._failed else "time is over"

    @property
    def _inner(self) -> Any:
        return self._env.unwrapped

    @property
    def episodes(self) -> tuple[PastEpisode, ...]:
        """All that was played and had a step."""
        found: tuple[PastEpisode, ...] = self._env.episodes()
        return found

    def close(self) -> None:
        """Close the environment."""
        self._env.close()


def rival_of(env_id: str, seed: int, config: Mapping[str, Any]) -> Rival:
    """Result of the best reference controller from a start, and what theory knows of it.

    Args:
        env_id: Gymnasium's id.
        seed: of the start.
        config: hyperparameters of the task.
    """
    metric = metrics_of(env_id)[0]
    name, text = "", ""
    if ENVIRONMENTS[env_id].controllers:
        policy = untrained_policy(env_id, "reference")
        name, played = policy.name, play_episode(policy, env_id, seed, config, policy.name)
        text = figure(env_id, played.task, played.value) if played.tally.success else "no success"
    limit, bound = limit_of(env_id, metric.name), ""
    if limit is not None:
        envs = make_rows(env_id, 1, config)
        envs.reset(seed=[seed])
        side = "at most" if metric.higher_is_better else "at least"
        value, unit = float(limit.values(envs)[0]), metric.unit(envs.task)
        bound = f"{side} {value:.3g} {unit}".rstrip()
        envs.close()
    return Rival(name, text, bound)


# What a player sees: the picture, and below it results, the action and the keys.

_PAPER, _INK, _MUTED = (255, 255, 255), (38, 44, 54), (110, 118, 130)
_RULE, _BAR, _GOOD, _BAD = (208, 213, 221), (0, 114, 178), (0, 130, 95), (190, 80, 0)


class Status(NamedTuple):
    """What is written.

    Attributes:
        title: environment, seed, speed.
        own: own result so far.
        others: results of others from the same start.
        verdict: how the episode ended; empty while it runs.
        success: whether that was a success.
        gauges: name and value of every entry of the action.
        note: what can be done now.
        help: lines of text over the picture; none to see the picture.
    """

    title: str
    own: str
    others: str
    verdict: str
    success: bool
    gauges: tuple[tuple[str, float], ...]
    note: str
    help: tuple[str, ...] = ()


def board_height(width: int) -> int:
    """Height of the part below a picture, in pixels."""
    return round(7.6 * _size(width))


def page(picture: Image, status: Status) -> Image:
    """The picture with the board below it, and help over it.

    Args:
        picture: RGB, shape (height, width, 3).
        status: what is written.
    """
    if status.help:
        picture = _covered(picture, status.help)
    return np.concatenate([picture, _board(picture.shape[1], status)])


@functools.lru_cache(8)
def _board(width: int, status: Status) -> Image:
    pictures, _, pens = pillow()
    image = pictures.new("RGB", (width, board_height(width)), _PAPER)
    draw, size = pens.Draw(image), _size(width)
    left, right = size, width - size
    draw.line([(0, 0), (width, 0)], fill=_RULE)
    _text(draw, (left, 1.3 * size), status.title, size, _MUTED)
    _text(draw, (right, 1.3 * size), status.note, size, _MUTED, "rm")
    _text(draw, (left, 3.2 * size), f"you: {status.own}", round(1.3 * size), _INK)
    colour = _GOOD if status.success else _BAD
    _text(draw, (right, 3.2 * size), status.verdict, round(1.3 * size), colour, "rm")
    _text(draw, (left, 4.8 * size), status.others, size, _INK)
    _gauges(draw, status.gauges, (left, right), 6.2 * size, size)
    return np.array(image)


def _gauges(
    draw: Any, gauges: Sequence[tuple[str, float]], ends: tuple[int, int], middle: float, size: int
) -> None:
    """Bars from the middle to the value of every entry."""
    step = (ends[1] - ends[0]) / max(len(gauges), 1)
    for k, (name, value) in enumerate(gauges):
        left = ends[0] + k * step
        _text(draw, (left, middle), name, size, _MUTED)
        begin, end = left + max(4.5 * size, 0.3 * step), left + step - 1.2 * size
        zero, low, high = 0.5 * (begin + end), middle - 0.22 * size, middle + 0.22 * size
        draw.rectangle([begin, low, end, high], fill=(236, 239, 243))
        tip = zero + 0.5 * (end - begin) * value
        draw.rectangle([min(zero, tip), low, max(zero, tip), high], fill=_BAR)
        draw.line([(zero, low - 2), (zero, high + 2)], fill=_MUTED)


def _covered(picture: Image, lines: Sequence[str]) -> Image:
    """The picture, paler, with lines of text in two columns that a tabulator parts."""
    height, width, _ = picture.shape
    size = _size(width)
    pale = (0.14 * picture + 0.86 * 255.0).astype(np.uint8)
    pictures, _, pens = pillow()
    image = pictures.fromarray(pale)
    draw = pens.Draw(image)
    top = 0.5 * (height - 1.7 * size * len(lines))
    for k, line in enumerate(lines):
        first, _, second = line.partition("\t")
        row = top + 1.7 * size * (k + 0.5)
        _text(draw, (1.5 * size, row), first, size, _INK)
        _text(draw, (0.34 * width, row), second, size, _INK)
    return np.array(image)


def _size(width: int) -> int:
    """Height of a letter."""
    return max(10, width // 38)


def _text(
    draw: Any, place: tuple[float, float], text: str, size: int, fill: Any, anchor: str = "lm"
) -> None:
    draw.text(place, text, fill=fill, font=font(size), anchor=anchor)


# The loop of a game: events, time, pictures.

_SPEEDS = (1.0, 0.5, 0.25)
_FPS = 60.0
_LONGEST = 0.1  # time that passes between two pictures at most, whatever the machine does [s]
_EDGE = 0.93  # place of an arrow to what is outside, in halves of the picture
_TRACE = 1.0 / 30.0  # time between points of a trace [s]


def play(
    env_id: str,
    seed: int = 0,
    config: Mapping[str, Any] | None = None,
    size: int = 640,
    save: str | Path | None = None,
) -> Path | None:
    """Open a window in which an environment is steered by hand.

    Args:
        env_id: Gymnasium's id.
        seed: of the first start.
        config: hyperparameters of the task.
        size: width and height of the picture, in pixels.
        save: file of a replay of all that was played; None for none.

    Returns:
        The replay; None if none was asked for or nothing was played.

    Raises:
        ValueError: an unknown id, a wrong hyperparameter, or no display.
        DependencyNotInstalled: a package that draws is not installed.
    """
    checked_id(env_id)
    integer(size, "size", 240)
    pygame = load_pygame()
    check_display()
    game = Game(env_id, seed, config)
    try:
        with GameWindow(game, pygame, size) as window:
            window.run()
    finally:
        game.close()
    if save is None or not game.episodes:
        return None
    return Replay(game.env_id, game.task, game.episodes).save(save)


class GameWindow:
    """A game in a window; a context, which opens and closes it.

    Args:
        game: what is played.
        pygame: the module.
        size: width and height of the picture, in pixels.
        clock: time [s].
        sleep: waits for a time [s].
    """

    def __init__(
        self,
        game: Game,
        pygame: Any,
        size: int,
        clock: Callable[[], float] = time.perf_counter,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        """The window opens with the context."""
        self.game, self._pygame, self._size = game, pygame, size
        self._clock, self._sleep = clock, sleep
        self.steering = keys_of(game.task, game.moment.parameters)
        self.hands = Hands(pygame, (size, size))
        self.paused, self.speed, self.help = False, 0, True
        self.running = True
        self._drawing: Drawing | None = None
        self._traced = 0.0
        self._window = Window(game.env_id)
        self._pads: list[Any] = []

    def __enter__(self) -> GameWindow:
        """Open the window."""
        self._window.show(self.picture(np.zeros(3)), fps=0.0)
        self._open_pads()
        return self

    def __exit__(self, *_: object) -> None:
        """Close the window."""
        if self._drawing is not None:
            self._drawing.close()
        self._window.close()

    def run(self) -> None:
        """Play until it is left."""
        last = self._clock()
        while self.running:
            due = last + 1.0 / _FPS
            while (now := self._clock()) < due:
                self._sleep(due - now)
            self.turn(min(now - last, _LONGEST))
            last = now

    def turn(self, seconds: float) -> None:
        """Take what happened, let time pass, show the picture.

        Args:
            seconds: of real time since the last turn.
        """
        pygame = self._pygame
        pressed = (pygame.KEYDOWN, pygame.MOUSEBUTTONDOWN, pygame.CONTROLLERBUTTONDOWN)
        for event in pygame.event.get():
            if event.type == pygame.CONTROLLERDEVICEADDED:
                self._open_pads()
            command = self.hands.take(event)
            if self.help and event.type in pressed and command != "quit":
                self.help = False
                self.hands.directions.clear()
            elif command is not None:
                self._obey(command)
        stick = self.hands.stick(seconds)
        if not (self.paused or self.help):
            self._pass(seconds * _SPEEDS[self.speed], stick)
        self._window.show(self.picture(stick), fps=0.0)

    def picture(self, stick: npt.NDArray[np.float64]) -> Image:
        """The page of now.

        Args:
            stick: right, up and twist.
        """
        game = self.game
        if self._drawing is None:
            steered = view_class(type(game.task)).steered
            look = Look(self._size, self._size, {"follow": steered} if steered else {})
            self._drawing = drawing_of(game.task, game.moment.parameters, look)
            self._traced = -1.0
        moment = game.moment
        extend = moment.time >= self._traced + _TRACE or moment.time < self._traced
        self._traced = moment.time if extend else self._traced
        picture, view = self._drawing.picture(moment, extend), self._drawing.view
        if view.steered:
            place = self._drawing.place_of(view.frame(moment).poses["goal"].position)
            picture = pointed(picture, place)
        return page(picture, self._status(stick))

    def _pass(self, seconds: float, stick: npt.NDArray[np.float64]) -> None:
        """Let time pass: a new step where the last one has been shown."""
        game, task = self.game, self.game.task
        while seconds > 0.0:
            if game.waiting:
                if not task.n_choices:
                    game.step(self.steering.action(stick))
                elif self.hands.directions:
                    choice = self.steering.choice(*self.hands.directions.popleft())
                    if choice is not None:
                        game.step(choice)
                else:
                    return
            part = min(seconds, game.left)
            if part <= 0.0:  # the end stays
                return
            game.advance(part)
            seconds -= part

    def _obey(self, command: str) -> None:
        game = self.game
        if command == "quit":
            self.running = False
        elif command == "help":
            self.help = True
        elif command == "pause":
            self.paused = not self.paused
        elif command == "slow":
            self.speed = (self.speed + 1) % len(_SPEEDS)
        elif command in ("again", "next"):
            game.begin(game.seed + (command == "next"))
            self.paused = False
            self.hands.release()
            if self._drawing is not None:
                self._drawing.close()
            self._drawing = None

    def _status(self, stick: npt.NDArray[np.float64]) -> Status:
        game, rival = self.game, self.game.rival
        others = [f"{rival.name}: {rival.text}"] if rival.name else []
        if rival.bound:
            others.append(f"anybody: {rival.bound}")
        rate = "" if self.speed == 0 else f"   speed 1/{round(1 / _SPEEDS[self.speed])}"
        name = game.env_id.rpartition("/")[2].rpartition("-")[0]
        note = "R again   N next" if game.over else "paused" if self.paused else "H keys"
        entries = () if game.task.n_choices else game.task.actions()
        values = self.steering.action(stick)
        return Status(
            title=f"{name}   start {game.seed}{rate}",
            own=game.score,
            others="     ".join(others),
            verdict=game.verdict,
            success=game.tally.success,
            gauges=tuple(
                (entry.symbol, round(float(value), 2))
                for entry, value in zip(entries, values, strict=bool(entries))
            ),
            note=note,
            help=(*help_lines(self.steering), "", "any key\tbegins") if self.help else (),
        )

    def _open_pads(self) -> None:
        """Listen to all gamepads; without the module for them there are none."""
        try:
            from pygame._sdl2 import controller
        except ImportError:
            return
        controller.init()
        self._pads = [
            controller.Controller(k)
            for k in range(controller.get_count())
            if controller.is_controller(k)
        ]


def pointed(picture: Image, place: Array) -> Image:
    """The picture with an arrow at its edge to what is outside.

    Args:
        picture: RGB, shape (height, width, 3).
        place: where that is, right and up of the middle, in halves of the picture.
    """
    away = float(np.abs(place).max())
    if away <= 1.0:
        return picture
    pictures, _, pens = pillow()
    image, half = pictures.fromarray(picture), 0.5 * np.array(picture.shape[1::-1])
    tip = half + half * np.clip(place / away, -_EDGE, _EDGE) * (1.0, -1.0)
    back = 0.1 * half.min() * place / np.linalg.norm(place) * (-1.0, 1.0)
    side = 0.5 * back[::-1] * (-1.0, 1.0)
    corners = (tip, tip + back + side, tip + 0.7 * back, tip + back - side)
    pens.Draw(image).polygon([tuple(corner) for corner in corners], fill=_GOOD)
    return np.array(image)
