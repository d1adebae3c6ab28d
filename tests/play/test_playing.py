"""A game is the environment itself, in real time, beside the reference from the same start."""

import itertools

import gymnasium as gym
import numpy as np
import pytest

from rigid_envs.scores.best import limit_of
from rigid_envs.scores.evaluation import make_rows
from rigid_envs.scores.policies import untrained_policy
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.watch.play.game import (
    Game,
    GameWindow,
    Status,
    board_height,
    page,
    play,
    pointed,
)
from rigid_envs.watch.replays.replay import load_replay
from tests.refusals import refuses

pytestmark = pytest.mark.long

pygame = pytest.importorskip("pygame")
pytest.importorskip("panda3d")

PARK, GRID, PUMP = (f"RigidEnvs/{name}-v0" for name in ("BallPark", "BallGrid", "RollPump"))
SIZE = 240


@pytest.fixture(autouse=True)
def no_display(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")


@pytest.fixture
def table():
    game = Game(PARK, 3)
    with GameWindow(game, pygame, SIZE) as opened:
        pygame.event.clear()
        press("space")  # leaves the help
        opened.turn(0.0)
        release("space")
        yield opened
    game.close()


def press(name):
    pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.key.key_code(name)))


def release(name):
    pygame.event.post(pygame.event.Event(pygame.KEYUP, key=pygame.key.key_code(name)))


def turns(table, seconds, dt=0.02):
    for _ in range(round(seconds / dt)):
        table.turn(dt)


def test_time_passes_as_fast_as_it_does(table):
    turns(table, 1.12)
    assert table.game.moment.time == pytest.approx(1.12, abs=1e-6)
    press("tab")
    turns(table, 0.5)
    assert table.game.moment.time == pytest.approx(1.37, abs=0.02)


def test_the_ball_stays_in_the_picture_and_an_arrow_points_to_a_goal_that_leaves_it(table):
    def places():
        poses = table._drawing.view.frame(table.game.moment).poses
        return [table._drawing.place_of(poses[name].position) for name in ("ball", "goal")]

    def green():
        picture = table.picture(np.zeros(3))[:SIZE]
        lines, columns = np.nonzero((picture == (0, 130, 95)).all(axis=-1))
        return np.array([columns.mean(), lines.mean()]) if len(lines) else None

    assert np.abs(places()[1]).max() < 1.0 and green() is None
    press("right")
    turns(table, 4.0)
    ball, goal = places()
    assert np.abs(ball).max() < 0.3 < 1.0 < -goal[0]
    arrow = green()
    assert arrow is not None and arrow[0] < 0.15 * SIZE


def test_an_arrow_at_the_edge_points_away_from_the_middle_and_none_is_there_inside():
    picture = np.full((100, 200, 3), 255, np.uint8)
    for place in ([0.9, -0.9], [-1.0, 1.0]):
        assert np.array_equal(pointed(picture, np.array(place)), picture)
    for place in ([5.0, 0.0], [0.0, 5.0], [-7.0, -9.0]):
        lines, columns = np.nonzero((pointed(picture, np.array(place)) != 255).any(axis=-1))
        found = np.array([columns.mean() / 100.0 - 1.0, 1.0 - lines.mean() / 50.0])
        assert 0.75 < np.abs(found).max() < 0.95
        assert found @ place > 0.95 * np.linalg.norm(found) * np.linalg.norm(place)


def test_the_overlay_says_what_the_board_says(table):
    press("up")
    turns(table, 1.0)
    said = table._drawing.view.frame(table.game.moment).text[1]
    assert said == f"cost {table.game.score.removeprefix('path ')} (distance rolled)"


def test_a_paused_game_stands_still(table):
    turns(table, 0.3)
    press("space")
    table.turn(0.02)
    before = table.game.moment
    turns(table, 0.5)
    assert table.paused and np.array_equal(table.game.moment.y, before.y)
    press("p")
    turns(table, 0.2)
    assert table.game.moment.time > before.time


@pytest.mark.push
def test_arrow_keys_roll_the_ball_as_seen(table):
    start = table.game.moment.y[4:6]
    press("right")
    turns(table, 0.6)
    release("right")
    turns(table, 0.6)
    moved = table.game.moment.y[4:6] - start
    right = table.steering.matrix[:, 0]
    assert moved @ right / np.linalg.norm(moved) == pytest.approx(1.0, abs=1e-6)
    assert np.array_equal(table.hands.stick(0.02), np.zeros(3))


def test_the_mouse_and_a_gamepad_steer_too(table):
    at = (round(0.9 * SIZE), SIZE // 2)
    pygame.event.post(pygame.event.Event(pygame.MOUSEMOTION, pos=at, rel=(0, 0), buttons=(1, 0, 0)))
    table.turn(0.02)
    assert table.hands.stick(0.0) == pytest.approx([1.0, 0.0, 0.0], abs=1e-6)
    pygame.event.post(pygame.event.Event(pygame.MOUSEBUTTONUP, pos=at, button=1))
    table.turn(0.02)
    assert table.hands.stick(0.0) == pytest.approx(np.zeros(3))
    up = pygame.event.Event(pygame.CONTROLLERAXISMOTION, axis=1, value=-32768, instance_id=0)
    pygame.event.post(up)
    table.turn(0.02)
    assert table.hands.stick(0.0) == pytest.approx([0.0, 1.0, 0.0])


def test_again_gives_the_same_start_and_next_another(table):
    start = table.game.moment.y
    press("up")
    turns(table, 0.3)
    release("up")
    press("r")
    table.turn(0.0)
    assert np.array_equal(table.game.moment.y, start) and table.game.seed == 3
    press("n")
    table.turn(0.0)
    assert table.game.seed == 4 and not np.array_equal(table.game.moment.y, start)
    press("escape")
    table.turn(0.0)
    assert not table.running


def test_the_first_key_only_leaves_the_help():
    with GameWindow(Game(PARK), pygame, SIZE) as opened:
        pygame.event.clear()
        turns(opened, 0.5)
        assert opened.help and opened.game.moment.time == 0.0
        press("n")
        opened.turn(0.0)
        assert not opened.help and opened.game.seed == 0


def test_a_move_on_the_grid_waits_for_its_key():
    with GameWindow(Game(GRID, 1), pygame, SIZE) as opened:
        pygame.event.clear()
        press("space")
        turns(opened, 0.5)
        release("space")
        assert opened.game.moment.time == 0.0
        press("right")
        turns(opened, 0.5)
        assert opened.game.moment.time == 1.0 and opened.game.waiting
        turns(opened, 1.0)  # a held key makes one move
        assert opened.game.moment.time == 1.0


@pytest.mark.parametrize("env_id", ENVIRONMENTS)
def test_every_environment_can_be_played(env_id):
    game = Game(env_id, 5)
    with GameWindow(game, pygame, SIZE) as opened:
        pygame.event.clear()
        press("space")
        opened.turn(0.0)
        for name in ("right", "up", "e"):
            press(name)
        turns(opened, 0.6, 0.06)
        picture = opened.picture(opened.hands.stick(0.0))
    assert picture.shape == (SIZE + board_height(SIZE), SIZE, 3)
    assert game.moment.time > 0.0 and game.rival.name
    game.close()
    assert len(game.episodes) == 1


def test_the_environment_is_that_of_gymnasium():
    rng, game, env = np.random.default_rng(0), Game(PARK, 8), gym.make(PARK)
    env.reset(seed=8)
    for _ in range(5):
        action = rng.uniform(-1, 1, 2).astype(np.float32)
        game.step(action)
        game.advance(game.period)
        env.step(action)
    assert np.array_equal(game.moment.y, env.unwrapped.y)


@pytest.mark.parametrize("env_id", [PARK, PUMP])
def test_the_reference_and_the_bound_are_of_this_very_start(env_id):
    game = Game(env_id, 12)
    envs = make_rows(env_id, 1)
    envs.reset(seed=[12])
    assert np.array_equal(envs.y[0], game.moment.y)
    metric = ENVIRONMENTS[env_id].metrics[0]
    limit = limit_of(env_id, metric)
    bound = float(limit.values(envs)[0])
    assert f"{bound:.3g}" in game.rival.bound and game.rival.bound.startswith("at least")
    policy = untrained_policy(env_id, "reference")
    act = policy(envs)
    obs, _ = envs.reset(seed=[12])
    total = 0.0
    for _ in itertools.count():
        obs, _, ended, _, infos = envs.step(act(obs))
        total += float((infos["final_info"] if ended[0] else infos)["cost"][0])
        if ended[0]:
            break
    assert game.rival.name == policy.name and game.rival.text.startswith(f"{metric} {total:.3g}")


@pytest.mark.push
def test_an_episode_ends_with_a_verdict_and_its_result():
    game = Game(PARK, 3, {"position_tolerance": 1.5, "angle_tolerance": 3.1})
    game.step(np.zeros(2, np.float32))
    assert game.over and game.verdict == "success" and game.score == "path 0 m"
    other = Game(PARK, 3)
    while not other.over:
        other.step(np.zeros(2, np.float32))
    assert other.verdict == "time is over" and not other.waiting


def test_what_was_played_is_saved_as_a_replay(tmp_path, monkeypatch):
    def steered(table):
        press("space")
        table.turn(0.0)
        for key in ("up", "r", "left"):
            press(key)
            turns(table, 0.5)

    monkeypatch.setattr(GameWindow, "run", steered)
    path = play(PARK, 3, {"radius": 0.4}, SIZE, tmp_path / "mine")
    replay = load_replay(path)
    assert [episode.label for episode in replay.episodes] == ["you", "you"]
    one, other = replay.episodes
    assert np.array_equal(one.y[0], other.y[0]) and one.parameters["radius"] == 0.4
    assert len(one) == 5 and not np.array_equal(one.actions, other.actions)


@pytest.mark.push
def test_the_loop_keeps_time_and_ends(monkeypatch):
    now = 0.0
    slept = []

    def sleep(seconds):
        nonlocal now
        slept.append(seconds)
        now += seconds

    game = Game(PARK, 3)
    with GameWindow(game, pygame, SIZE, lambda: now, sleep) as opened:
        pygame.event.clear()
        press("space")
        shown = 0

        def turn(seconds, old=opened.turn):
            nonlocal shown, now
            old(seconds)
            shown, now = shown + 1, now + 0.005
            opened.running = shown < 61

        monkeypatch.setattr(opened, "turn", turn)
        opened.run()
    assert game.moment.time == pytest.approx(1.0, abs=0.02)
    assert sum(slept) == pytest.approx(1.0 - 60 * 0.005, abs=0.02)


def test_without_a_display_it_says_what_to_do(without_display):
    refuses("DISPLAY = None; expected a display", play, PARK)


def test_the_board_shows_the_action_as_bars():
    picture = np.zeros((SIZE, SIZE, 3), np.uint8)
    shown = [
        page(picture, Status("a", "b", "c", "", False, (("x", value),), "d"))
        for value in (-1.0, 0.0, 1.0)
    ]
    blue = [np.argwhere((each == (0, 114, 178)).all(axis=-1))[:, 1] for each in shown]
    assert blue[0].max() <= blue[2].min() and blue[0].size > 100 < blue[2].size
    assert blue[1].size < 20
