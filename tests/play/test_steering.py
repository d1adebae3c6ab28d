"""What hands do becomes an action, in every environment; the command tells its keys first."""

import math

import numpy as np
import pytest

from rigid_envs.envs.lookup import task_of
from rigid_envs.envs.spaces import action_space
from rigid_envs.tasks.fields import Entry
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools.cli import main
from rigid_envs.watch.play.steering import RIGHT, TWIST, UP, blended, dead, keys, steering_of
from tests.refusals import refuses

FROM_SOUTH = -90.0  # azimuth of a camera that sees +X to the right and +Y away from it


def steering(name, azimuth=FROM_SOUTH):
    return steering_of(task_of(f"RigidEnvs/{name}-v0"), azimuth)


@pytest.mark.parametrize("env_id", ENVIRONMENTS)
def test_every_stick_gives_an_action_of_the_space(env_id):
    task = task_of(env_id)
    how, space = steering_of(task, -60.0), action_space(task)
    if task.n_choices:
        ways = [(1, 0), (0, 1), (-1, 0), (0, -1)]
        assert sorted(how.choice(*way) for way in ways) == list(range(task.n_choices))
        return
    for stick in np.random.default_rng(0).uniform(-1.5, 1.5, (50, 3)):
        action = how.action(stick)
        assert action in space
        assert not how.bounded or np.linalg.norm(action) <= 1.0 + 1e-6


@pytest.mark.parametrize("env_id", ENVIRONMENTS)
def test_every_entry_can_be_driven_to_both_ends_and_rests_at_no_effect(env_id):
    task = task_of(env_id)
    if task.n_choices:
        return
    how = steering_of(task, FROM_SOUTH)
    ends = np.array([how.action(side * np.eye(3)[k]) for k in range(3) for side in (-1, 1)])
    assert np.allclose(ends.max(axis=0), 1.0) and np.allclose(ends.min(axis=0), -1.0)
    for entry, rest in zip(task.actions(), how.action(np.zeros(3)), strict=True):
        middle = 0.5 * (entry.low + entry.high) + 0.5 * (entry.high - entry.low) * rest
        assert middle == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("name", ["BallPark", "BallParkDynamic", "PivotTop", "BallSteer"])
def test_a_vector_points_where_it_is_seen(name):
    how = steering(name)
    assert how.action([1, 0, 0]) == pytest.approx([1, 0], abs=1e-7)
    assert how.action([0, 1, 0]) == pytest.approx([0, 1], abs=1e-7)
    turned = steering(name, 0.0)  # seen from +X: +Y is to the right, -X is away
    assert turned.action([1, 0, 0]) == pytest.approx([0, 1], abs=1e-7)
    assert turned.action([0, 1, 0]) == pytest.approx([-1, 0], abs=1e-7)


def test_a_torque_pushes_the_tip_of_a_top_where_it_is_seen():
    for way in ([1.0, 0.0], [0.0, 1.0]):
        tau = np.array([*steering("SleepingTop").action([*way, 0.0]), 0.0])
        assert np.cross(tau, [0.0, 0.0, 1.0])[:2] == pytest.approx(way, abs=1e-6)


def test_a_plate_slopes_down_where_it_is_seen():
    alpha_x, alpha_y = steering("BallPlate").action([1, 0, 0])  # X'' = g alpha_y, Y'' = -g alpha_x
    assert alpha_y == pytest.approx(1.0) and alpha_x == pytest.approx(0.0, abs=1e-7)
    alpha_x, alpha_y = steering("BallPlate").action([0, 1, 0])
    assert alpha_x == pytest.approx(-1.0) and alpha_y == pytest.approx(0.0, abs=1e-7)


def test_up_rolls_a_coin_along_its_heading_and_left_turns_it_to_the_left():
    psi, phi = steering("CoinPark").action([-1, 1, 0])
    assert psi == -1.0 and phi == 1.0  # (X', Y') = -radius psi' (cos phi, sin phi)


def test_three_torques_have_three_axes_and_one_sided_entries_rest_at_their_end():
    assert steering("Reorient").action([0.25, -0.5, 1.0]) == pytest.approx([0.25, -0.5, 1.0])
    assert set(steering("Reorient").axes) == {RIGHT, UP, TWIST}
    pump = steering("RollPump")
    assert [pump.action([s, 0, 0])[0] for s in (-1, 0, 0.5, 1)] == [-1, -1, 0, 1]


@pytest.mark.parametrize(
    ("azimuth", "choice"), [(-90.0, 0), (-60.0, 0), (0.0, 1), (90.0, 2), (180.0, 3)]
)
def test_right_on_the_grid_is_right_as_seen(azimuth, choice):
    assert steering("BallGrid", azimuth).choice(1.0, 0.0) == choice
    assert steering("BallGrid", azimuth).choice(0.0, 0.0) is None


def test_what_hands_cannot_steer_is_refused(monkeypatch):
    task = task_of("RigidEnvs/Reorient-v0")
    four = tuple(Entry(f"a{k}", "1", "body", -1.0, 1.0) for k in range(4))
    monkeypatch.setattr(type(task), "actions", lambda self: four)
    refuses("actions = 4 entries; expected 3 at most", steering_of, task, 0.0)
    grid = task_of("RigidEnvs/BallGrid-v0")
    named = (Entry("side", "1", "0: left, 1: right", 0.0, 1.0),)
    monkeypatch.setattr(type(grid), "actions", lambda self: named)
    refuses("side: frame = '0: left, 1: right'; expected", steering_of, grid, 0.0)


def test_held_keys_blend_in_with_their_time_constant():
    stick, aim = np.zeros(3), np.array([1.0, -1.0, 0.0])
    assert blended(stick, aim, 0.12) == pytest.approx((1 - math.exp(-1)) * aim)
    assert blended(aim, np.zeros(3), 0.07) == pytest.approx(math.exp(-1) * aim)
    assert np.array_equal(blended(stick, aim, 10.0), aim)
    assert np.array_equal(blended(aim, np.zeros(3), 10.0), np.zeros(3))


def test_blending_does_not_depend_on_the_rate_of_pictures():
    aim, slow = np.array([1.0, 0.0, -1.0]), np.array([0.2, 0.9, -0.1])
    fast = slow
    for _ in range(10):
        fast = blended(fast, aim, 0.01)
    assert fast == pytest.approx(blended(slow, aim, 0.1))


def test_a_gamepad_rests_in_its_dead_zone_and_reaches_its_ends():
    assert dead(0.1) == dead(-0.15) == 0.0
    assert dead(1.0) == 1.0 and dead(-1.2) == -1.0
    assert dead(0.575) == pytest.approx(0.5)


@pytest.mark.parametrize("env_id", ENVIRONMENTS)
def test_the_keys_of_every_environment_are_told(env_id):
    said = keys(env_id)
    assert "Esc" in said and "Space" in said
    assert ("E, Q" in said) == (len(task_of(env_id).actions()) == 3)


COIN = "RigidEnvs/CoinPark-v0"


def test_keys_are_told_without_a_display(capsys):
    assert main(["play", COIN, "--help-keys"]) == 0
    said = capsys.readouterr().out
    assert "roll forwards" in said and "turn right / left" in said and "gamepad" in said


def test_what_is_played_is_saved(tmp_path, monkeypatch, capsys):
    pygame = pytest.importorskip("pygame")
    pytest.importorskip("panda3d")
    from rigid_envs.watch.play.game import GameWindow

    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    turn = GameWindow.turn

    def hurried(table, _seconds):
        turn(table, 0.1)
        done = table.game.moment.time > 0.5
        key = pygame.K_ESCAPE if done else pygame.K_UP
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=key))

    monkeypatch.setattr(GameWindow, "turn", hurried)
    file = tmp_path / "mine.npz"
    words = ["play", COIN, "--seed", "2", "--size", "240", "--save", str(file)]
    assert main([*words, "--allow-import", "rigid_envs.sb3"]) == 0
    assert f"rigid-envs replay {file} --allow-import rigid_envs.sb3\n" in capsys.readouterr().out
    assert main(["replay", str(file)]) == 0
    assert "same bits" in capsys.readouterr().out
    assert main(["play", COIN, "--size", "240"]) == 0
    assert "written" not in capsys.readouterr().out
