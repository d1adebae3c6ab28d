"""Pictures of episodes show them in real time, side by side, in a film or in a window."""

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from rigid_envs.base.checks import ConfigError
from rigid_envs.mechanics import rotations
from rigid_envs.scores.policies import untrained_policy
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.watch import films
from rigid_envs.watch.drawing import Drawing, Look
from rigid_envs.watch.pictures import show, wrapped
from rigid_envs.watch.replays.replay import moment_at
from tests.refusals import refuses

pygame = pytest.importorskip("pygame")
pytest.importorskip("panda3d")
pytest.importorskip("PIL")

PARK, GRID = "RigidEnvs/BallPark-v0", "RigidEnvs/BallGrid-v0"
SMALL = Look(width=96, height=96)


@cache
def played(env_id, name="reference"):
    policy = untrained_policy(env_id, name)
    return films.play_episode(policy, env_id, 7, label=policy.name)


def pictures(found, **options):
    return list(films.episode_pictures([(f.task, f.episode) for f in found], SMALL, **options))


def test_a_film_lasts_as_long_as_the_longest_episode_and_its_end_stays():
    found = [played(PARK), played(PARK, "random")]
    fps = films.pictures_per_second(found[0].task)
    shown = pictures(found, hold=0.5)
    seconds = 0.1 * max(len(f.episode) for f in found)
    assert fps == pytest.approx(30.0)
    assert len(shown) == round(seconds * fps) + 1 + 15
    assert all(np.array_equal(shown[-1], picture) for picture in shown[-15:])


def test_players_of_the_same_seed_have_the_same_start():
    one, other = played(PARK).episode, played(PARK, "random").episode
    assert np.array_equal(one.y[0], other.y[0])
    assert not np.array_equal(one.y[1], other.y[1])


def test_speed_and_rate_change_the_number_of_pictures():
    found = [played(PARK)]
    steps = len(found[0].episode)
    assert len(pictures(found, fps=10.0, hold=0.0)) == steps + 1
    assert len(pictures(found, fps=10.0, speed=0.5, hold=0.0)) == 2 * steps + 1


def test_pictures_are_of_the_times_at_which_they_are_shown(monkeypatch):
    times = []

    def noted(task, episode, time):
        times.append(time)
        return moment_at(task, episode, time)

    monkeypatch.setattr("rigid_envs.watch.films.moment_at", noted)
    found = played(PARK)
    for fps, speed in ((8.0, 2.0), (4.0, 0.5)):
        times.clear()
        assert len(pictures([found], fps=fps, speed=speed, hold=0.0)) == len(times)
        assert times == pytest.approx(speed / fps * np.arange(len(times)))
        assert times[-2] < len(found.episode) * found.task.dt <= times[-1] + 1e-9


def test_pictures_of_two_episodes_are_side_by_side_under_their_labels():
    found = [played(PARK), played(PARK, "random")]
    alone, both = pictures(found[:1], hold=0.0)[0], pictures(found, hold=0.0)[0]
    height, width, _ = alone.shape
    assert width == 96 and height > 96
    assert both.shape == (height, 2 * width, 3)
    assert np.array_equal(both[:, : width - 1], alone[:, : width - 1])


def test_no_labels_take_no_room_and_long_words_are_cut():
    picture = np.zeros((96, 96, 3), np.uint8)
    assert films.labelled([picture], [""]).shape == (96, 96, 3)
    assert films.labelled([picture] * 2, ["", "x"]).shape[0] > 96
    one, other = (films.labelled([picture], [text]) for text in ("x" * 100, "x" * 200))
    assert np.array_equal(one, other)
    short, none = (films.labelled([picture], [text])[: len(one) - 96] for text in ("x", " "))
    assert 0 < np.count_nonzero(short != none) < np.count_nonzero(one[: len(none)] != none)
    assert len(np.unique(none[:-1])) == 1  # a line below the text, and nothing else
    assert np.all(none[-1] == none[-1, 0]) and np.all(none[-1] != none[0])
    narrow = films.labelled([np.zeros((8, 8, 3), np.uint8)], ["x" * 9])
    assert narrow.shape[1] == 8


def test_a_long_label_goes_on_in_further_lines_with_letters_as_tall():
    picture, label = np.zeros((96, 198, 3), np.uint8), "minimum_fuel: effort 0.542 N m s"
    lines = wrapped(label, 198, films.LETTERS)
    assert lines == ("minimum_fuel:", "effort 0.542 N m s")
    moments = "I1 0.97, I2 0.97, I3 0.55"
    assert wrapped(moments, 132, films.LETTERS) == ("I1 0.97,", "I2 0.97, I3 0.55")
    page = films.labelled([picture] * 2, ["uncontrolled", label])
    assert len(page) - 96 == films.labels_height([label], 198)
    short = films.labelled([picture] * 2, ["uncontrolled", ""])
    high = len(short) - 97
    assert np.array_equal(page[:high, :198], short[:high, :198])  # the neighbour's text as before
    first = films.labelled([picture], [lines[0]])
    assert np.array_equal(page[:high, 199:], first[:high, 1:])


def test_a_line_stands_between_neighbours_and_nowhere_else():
    picture = np.zeros((8, 8, 3), np.uint8)
    for n, lines in ((1, []), (2, [8]), (9, [8, 16])):
        page = films.labelled([picture] * n, [""] * n)
        assert np.flatnonzero(page.any(axis=(0, 2))).tolist() == lines


def test_control_periods_are_met_exactly():
    found = played(PARK)
    for k in range(len(found.episode) + 1):
        moment = moment_at(found.task, found.episode, 0.1 * k)
        assert (
            np.array_equal(moment.y, found.episode.y[k]) and moment.time == found.episode.times[k]
        )


@pytest.mark.parametrize("env_id", [PARK, GRID])
def test_between_steps_a_ball_rolls_without_slipping(env_id):
    found = played(env_id)
    episode, dt = found.episode, found.task.dt
    radius = episode.parameters["radius"]
    at = [moment_at(found.task, episode, dt * s).y for s in (0.2, 0.21)]
    turn = rotations.log(rotations.multiply(at[1][:4], rotations.conjugate(at[0][:4])))
    move = at[1][4:6] - at[0][4:6]
    assert np.linalg.norm(move) > 0.0
    assert turn == pytest.approx([-move[1] / radius, move[0] / radius, 0.0], abs=1e-9)


@pytest.mark.parametrize("env_id", ENVIRONMENTS)
def test_attitudes_between_steps_have_unit_length(env_id):
    found = played(env_id, "zero")
    moment = moment_at(found.task, found.episode, 0.37 * found.task.dt)
    part = found.task.system_type.components.get("q")
    if part is not None:
        assert np.linalg.norm(moment.y[part]) == pytest.approx(1.0)
    for head in ("goal", "reference"):
        names = [f"{head}_{letter}" for letter in "wxyz"]
        if set(names) <= set(moment.aux):
            assert np.linalg.norm([moment.aux[name] for name in names]) == pytest.approx(1.0)


def test_a_caption_says_who_and_how_well():
    assert played(PARK).captioned()[1].label.startswith("shortest_path: path ")
    assert played(PARK).captioned()[1].label.endswith(" m")
    assert played(PARK).value == pytest.approx(played(PARK).episode.costs.sum())
    assert played(PARK, "zero").captioned()[1].label == "zero: no success"
    roll = "RigidEnvs/DiskRoll-v0"
    assert films.figure(roll, played(roll, "zero").task, 1e-9) == "error 1e-09"  # without a unit
    assert films.figure(PARK, played(PARK).task, 1e-9) == "path 0 m"  # what is nothing to a cost
    coils = "RigidEnvs/MagneticDetumble-v0"
    assert films.figure(coils, played(coils, "zero").task, 1256.4) == "time 1256 s"


def test_an_episode_is_over_at_success_and_else_cut_off():
    won, late = played(PARK).episode, played(PARK, "zero").episode
    assert (won.terminated, won.truncated) == (late.truncated, late.terminated) == (True, False)


def test_episodes_of_several_tasks_share_a_film():
    found = [played(PARK), played("RigidEnvs/SleepingTop-v0", "zero")]
    tasks = [each.task for each in found]
    assert films.pictures_per_second(*tasks) == films.pictures_per_second(tasks[1]) == 40.0
    assert films.pictures_per_second(replace(tasks[0], dt=0.125)) == 24.0
    seconds = max(len(each.episode) * each.task.dt for each in found)
    assert len(pictures(found, fps=5.0, hold=0.0)) == round(seconds * 5.0) + 1


def test_what_draws_is_closed_also_if_no_more_pictures_are_taken(monkeypatch):
    closed = []
    close = Drawing.close
    monkeypatch.setattr(Drawing, "close", lambda each: (closed.append(each), close(each)))
    found = played(PARK, "zero")
    source = films.episode_pictures([(found.task, found.episode)] * 2, SMALL)
    next(source)
    assert not closed
    del source
    assert len(set(closed)) == 2


def test_what_is_no_setting_of_the_task_is_not_played():
    policy = untrained_policy(PARK, "zero")
    for name in ("num_envs", "max_episode_steps", "radii"):
        with pytest.raises(ConfigError, match=f"^config.{name}: unknown key"):
            films.play_episode(policy, PARK, 7, {name: 2})


def test_nothing_to_show_and_numbers_that_cannot_be_are_refused():
    refuses(r"episodes = \(\); expected at least one", next, films.episode_pictures([]))
    found = played(PARK)
    for name, bad in (("fps", (0.0, -1.0)), ("speed", (0.0, -1.0)), ("hold", (-1.0,))):
        for value in (*bad, np.nan, np.inf, "1"):
            options = {name: value}
            with pytest.raises(ValueError, match=f"^{name} = {value!r}; expected"):
                next(films.episode_pictures([(found.task, found.episode)], SMALL, **options))


@pytest.mark.push
@pytest.mark.long
def test_the_example_of_the_guide_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (Path(__file__).parents[2] / "docs" / "watching.md").read_text()
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    exec(code, {})
    assert 0 < (tmp_path / "both.webp").stat().st_size <= 250_000


N = 3  # pictures


def shown(monkeypatch, *typed):
    """Numbers of the pictures, if at each look at the keyboard one of these is found.

    A word is a key that is pressed, a pair a key and what is done with it; "" is nothing.
    """
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    names = {"space": pygame.K_SPACE, "r": pygame.K_r, "escape": pygame.K_ESCAPE, "x": pygame.K_x}
    script, numbers = iter(typed), []

    def events():
        word = next(script)  # the window must close before the script is over
        if word == "close":
            return [pygame.event.Event(pygame.QUIT)]
        key, kind = (word, "KEYDOWN") if isinstance(word, str) else word
        return [pygame.event.Event(getattr(pygame, kind), key=names[key])] if key else []

    def pictures():
        for k in range(N):
            numbers.append(k)
            yield np.full((8, 8, 3), k, dtype=np.uint8)

    monkeypatch.setattr(pygame.event, "get", events)
    assert show(pictures, 1000.0, "a test")
    assert next(script, None) is None  # and no sooner
    return numbers


def test_the_last_picture_stays_until_the_window_is_closed(monkeypatch):
    assert shown(monkeypatch, "", "", "", "", "close") == [0, 1, 2]
    assert shown(monkeypatch, "", "", "", "", "escape") == [0, 1, 2]


def test_escape_closes_at_once(monkeypatch):
    assert shown(monkeypatch, "", "escape") == [0, 1]
    assert shown(monkeypatch, "space", "escape") == [0]


def test_space_pauses_and_goes_on(monkeypatch):
    assert shown(monkeypatch, "space", "", "", "escape") == [0]
    assert shown(monkeypatch, "space", "", "space", "", "close") == [0, 1, 2]


def test_r_begins_again_also_after_the_end_or_a_pause(monkeypatch):
    assert shown(monkeypatch, "", "r", "", "close") == [0, 1, 0, 1]
    assert shown(monkeypatch, "", "", "", "r", "close") == [0, 1, 2, 0]
    assert shown(monkeypatch, "space", "r", "", "close") == [0, 0, 1]


def test_other_keys_and_keys_let_go_do_nothing(monkeypatch):
    others = [(key, "KEYUP") for key in ("space", "r", "escape")]
    assert shown(monkeypatch, "x", *others, "close") == [0, 1, 2]


def test_where_no_window_can_be_opened_that_is_said(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "no such driver")
    assert not show(lambda: iter([np.zeros((8, 8, 3), np.uint8)]), 1000.0, "a test")
