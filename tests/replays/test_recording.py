"""Recording wrappers keep what the environment did; `rigid-envs replay` prints and shows it."""

import re
from dataclasses import replace
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from rigid_envs import __version__
from rigid_envs.envs.lookup import task_of
from rigid_envs.envs.shells import RigidEnv, RigidVectorEnv
from rigid_envs.scores.evaluation import evaluate
from rigid_envs.scores.policies import from_controller, reference_controllers, untrained_policy
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.testing.environments import break_physics
from rigid_envs.tools.cli import main
from rigid_envs.watch.films import play_episode
from rigid_envs.watch.replays.recording import RecordReplay, RecordRows, record_starts
from rigid_envs.watch.replays.replay import id_of, load_replay, play_again, same_bits
from tests.refusals import refuses
from tests.replays.examples import free_body, rolling_ball

PARK = "RigidEnvs/BallPark-v0"


def test_the_wrapper_changes_nothing_and_keeps_what_happened():
    plain, env = gym.make(PARK), RecordReplay(gym.make(PARK))
    env.action_space.seed(0)
    assert np.array_equal(plain.reset(seed=5)[0], env.reset(seed=5)[0])
    moments, states, rewards = [env.unwrapped.moment()], [env.unwrapped.y], []
    for _ in range(10):
        action = env.action_space.sample()
        one, other = plain.step(action), env.step(action)
        assert np.array_equal(one[0], other[0]) and one[1:] == other[1:]
        moments.append(env.unwrapped.moment())
        states.append(env.unwrapped.y)
        rewards.append(one[1])
    (episode,) = env.replay().episodes
    assert np.array_equal(episode.y, states) and np.array_equal(episode.rewards, rewards)
    assert not episode.terminated and not episode.truncated
    for k, moment in enumerate(moments):
        kept = episode.moment(k, env.unwrapped.task)
        for name in ("y", "u", "action", "time", "reward", "cost", "success"):
            assert np.array_equal(getattr(kept, name), getattr(moment, name))


def test_close_saves_finished_and_unfinished_episodes(tmp_path):
    label = 200 * "i"  # as long as it may be
    env = RecordReplay(gym.make(PARK, max_episode_steps=4), tmp_path / "some.npz", label)
    for n_steps in (6, 2):  # what is stepped past an end is in no episode
        env.reset(seed=1)
        for _ in range(n_steps):
            env.step(np.zeros(2, dtype=np.float32))
    env.close()
    episodes = load_replay(tmp_path / "some.npz").episodes
    assert [(len(e), e.truncated, e.label) for e in episodes] == [
        (4, True, label),
        (2, False, label),
    ]


def test_only_the_last_episodes_are_kept():
    env = RecordReplay(gym.make(PARK, max_episode_steps=2), last=2)
    firsts = []

    def begin(seed):
        env.reset(seed=seed)
        firsts.append(env.unwrapped.y.tolist())
        env.step(np.zeros(2, dtype=np.float32))

    for seed in range(4):
        begin(seed)
        env.step(np.zeros(2, dtype=np.float32))
    assert [e.y[0].tolist() for e in env.replay().episodes] == firsts[2:]
    begin(4)
    assert [e.y[0].tolist() for e in env.replay().episodes] == firsts[2:]  # and what goes on
    begin(5)
    assert [e.y[0].tolist() for e in env.replay().episodes] == firsts[3:]


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_rows_of_a_vector_environment_are_recorded_as_single_ones(mode):
    options = {"vectorization_mode": "vector_entry_point"}
    vector = gym.make_vec(
        PARK, 3, **options, max_episode_steps=5, autoreset_mode=mode, action_noise=0.1
    )
    envs = RecordRows(vector, rows=(2,))
    single = RecordReplay(gym.make(PARK, max_episode_steps=5, action_noise=0.1))
    envs.reset(seed=7)
    single.reset(seed=9)
    envs.action_space.seed(1)
    over = False
    for _ in range(14):
        actions = envs.action_space.sample()
        if over and mode is AutoresetMode.DISABLED:
            envs.reset(options={"reset_mask": np.ones(3, dtype=bool)})
        if over:
            single.reset()
        if not over or mode is not AutoresetMode.NEXT_STEP:
            _, _, terminated, truncated, _ = single.step(actions[2])
            over = terminated or truncated
        else:
            over = False
        envs.step(actions)
    found, expected = envs.replay().episodes, single.replay().episodes
    assert len(found) >= 2
    for one, other in zip(found, expected, strict=True):
        assert same_bits(one, other) and one.truncated == other.truncated


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_a_masked_reset_ends_the_recordings_of_its_rows_alone(mode):
    vector = gym.make_vec(PARK, 4, autoreset_mode=mode, max_episode_steps=9)
    envs = RecordRows(vector, rows=(0, 1, 3))
    envs.action_space.seed(0)
    envs.reset(seed=0)
    seen = [[] for _ in range(4)]  # states of the episodes of each row
    for chosen in ((0, 1, 2, 3), (0, 2), (1, 2), (2,)):
        if len(chosen) < 4:
            envs.reset(options={"reset_mask": np.isin(np.arange(4), chosen)})
        for row in chosen:
            seen[row].append([vector.unwrapped.y[row]])
        for _ in range(2):
            envs.step(envs.action_space.sample())
            for row in range(4):
                seen[row][-1].append(vector.unwrapped.y[row])
    episodes = iter(envs.replay().episodes)
    for row, lengths in ((0, [2, 6]), (1, [4, 4]), (3, [8])):
        for n, states in zip(lengths, seen[row], strict=True):
            episode = next(episodes)
            assert len(episode) == n and not episode.truncated
            assert np.array_equal(episode.y, states)
    assert next(episodes, None) is None


def test_the_first_episode_of_each_row_can_be_recorded_alone(tmp_path):
    vector = gym.make_vec(PARK, 2, max_episode_steps=3, autoreset_mode="SameStep")
    envs = RecordRows(vector, rows=(0, 1), file=tmp_path / "rows.npz", first=1)
    envs.reset(seed=0)
    for _ in range(10):
        envs.step(envs.action_space.sample())
    envs.close()
    assert [len(e) for e in load_replay(tmp_path / "rows.npz").episodes] == [3, 3]


@pytest.mark.parametrize("file", [None, "rows.npz"])
def test_what_records_or_plays_closes_its_environment(tmp_path, monkeypatch, file):
    closed = []
    for kind in (RigidEnv, RigidVectorEnv):
        monkeypatch.setattr(kind, "close", lambda env, **_: closed.append(env))
    place = None if file is None else tmp_path / file
    for env in (
        RecordReplay(gym.make(PARK), place),
        RecordRows(gym.make_vec(PARK, 2, vectorization_mode="vector_entry_point"), file=place),
    ):
        env.close()
        assert closed.pop() is env.unwrapped and not closed
    policy = untrained_policy(PARK, "zero")
    assert len(record_starts(policy, PARK).episodes) == 1
    play_episode(policy, PARK, 0)
    assert [env.num_envs for env in closed] == [1, 1]


def test_a_recorder_is_made_again_from_the_spec_of_its_environment(tmp_path):
    env = gym.make(PARK, max_episode_steps=1)
    env = gym.make(RecordReplay(env, tmp_path / "again.npz", "PPO", last=1).spec)
    for _ in range(2):
        env.reset()
        env.step(np.zeros(2, dtype=np.float32))
    env.close()
    (episode,) = load_replay(tmp_path / "again.npz").episodes
    assert episode.label == "PPO"


def test_what_cannot_be_recorded_is_refused():
    refuses("expected an environment of rigid_envs", RecordReplay, gym.make("CartPole-v1"))
    rescaled = gym.wrappers.RescaleAction(gym.make(PARK), np.float32(-2.0), np.float32(2.0))
    refuses("record first, then wrap", RecordReplay, rescaled)
    for rows in ((2,), (0, -1), (True,)):
        refuses("; expected rows from 0 to 1", RecordRows, gym.make_vec(PARK, 2), rows=rows)
    refuses("play an episode first", RecordReplay(gym.make(PARK)).replay)


def test_the_id_is_that_of_the_environment_or_else_that_of_its_task(monkeypatch):
    mine = replace(ENVIRONMENTS[PARK], id="Mine/Park-v0")  # another id of the same task
    known = {**ENVIRONMENTS, mine.id: mine}
    monkeypatch.setattr("rigid_envs.watch.replays.replay.ENVIRONMENTS", known)
    env, task = gym.make(PARK), task_of(PARK)
    for made, told in ((PARK, PARK), (mine.id, mine.id), ("Strange/Park-v0", PARK)):
        env.spec.id = made
        assert id_of(env, task) == told
    assert id_of(RigidEnv(mine.task), task) == PARK  # without a spec
    monkeypatch.setattr("rigid_envs.watch.replays.replay.ENVIRONMENTS", {})
    refuses(r"^env = Strange/Park-v0; expected an .* registered", id_of, env, task)


def test_a_state_that_is_set_past_the_wrapper_is_noticed():
    env = RecordReplay(gym.make(PARK, max_episode_steps=2))
    env.reset(seed=0)
    env.step(np.ones(2, dtype=np.float32))
    env.unwrapped.reset(seed=4)
    refuses("past RecordReplay", env.step, np.ones(2, dtype=np.float32))


def test_a_start_outside_an_episode_is_not_played_on():
    env = gym.make(PARK).unwrapped
    actions = np.ones((1, 2), dtype=np.float32)
    told = "expected that of an episode: call reset"
    refuses(told, play_again, env.task, env.get_state(), actions)
    env.reset(seed=0)
    break_physics(env)
    env.step(actions[0])
    refuses(told, play_again, env.task, env.get_state(), actions)


def test_other_wrappers_go_around_the_recording_one():
    env = gym.wrappers.RescaleAction(
        RecordReplay(gym.make(PARK)), np.float32(-2.0), np.float32(2.0)
    )
    env.reset(seed=0)
    env.step(np.full(2, 1.0, dtype=np.float32))
    recording = env.env
    assert recording.replay().episodes[0].actions[0].tolist() == [0.5, 0.5]


def test_replays_of_an_evaluation_are_its_episodes():
    policy = from_controller(reference_controllers(PARK)["shortest_path"])
    replay = record_starts(policy, PARK, 3, "reference")
    found = evaluate(PARK, policy, n=3)
    assert [len(e) for e in replay.episodes] == found.values["length"].tolist()
    assert [e.terminated for e in replay.episodes] == found.successes.tolist()
    returns = [e.rewards.sum() for e in replay.episodes]
    assert np.allclose(returns, found.values["return"], rtol=1e-12)
    for episode in replay.episodes:
        assert same_bits(episode, play_again(replay.task, episode.start, episode.actions))


def test_the_example_of_the_guide_runs(tmp_path, monkeypatch):
    text = (Path(__file__).parents[2] / "docs" / "replays.md").read_text()
    (code,) = re.findall(r"```python\n(.+?)```", text, flags=re.DOTALL)
    monkeypatch.chdir(tmp_path)
    exec(code, {})
    assert len(load_replay("first.npz").episodes) == 3


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("replays")
    return [
        free_body(20).save(folder / "body.npz"),
        rolling_ball("policy", 0, 10).save(folder / "ball.npz"),
    ]


def test_episodes_are_printed_and_played_again(files, capsys):
    assert main(["replay", *map(str, files)]) == 0
    text = capsys.readouterr().out
    head = "RigidEnvs/IntermediateAxis-v0   cost: torque impulse [N m s]   rigid-envs "
    assert f"{head}{__version__}\n" in text
    assert text.count("same bits") == 2 and "policy" in text


@pytest.mark.parametrize("provenance", [{}, {"versions": {}}, {"versions": "1.2"}])
def test_a_file_that_names_no_version_is_printed_too(provenance, files, tmp_path, capsys):
    file = replace(load_replay(files[0]), provenance=provenance).save(tmp_path / "some.npz")
    assert main(["replay", str(file)]) == 0
    assert "   rigid-envs ?\n" in capsys.readouterr().out


def test_the_status_says_whether_a_file_tells_what_its_actions_lead_to(files, tmp_path, capsys):
    replay = load_replay(files[0])
    (episode,) = replay.episodes
    better = replace(episode, rewards=episode.rewards + 1.0)
    edited = replace(replay, episodes=(episode, better)).save(tmp_path / "edited.npz")
    assert main(["replay", str(files[1]), str(edited)]) == 1
    assert "other bits" in capsys.readouterr().out


def test_a_row_says_whether_the_last_step_was_a_success_and_how_the_episode_ended(
    files, tmp_path, capsys
):
    replay = load_replay(files[1])
    (episode,) = replay.episodes
    first, last = ([k == end for k in range(len(episode))] for end in (0, len(episode) - 1))
    told = ((last, True, False), (first, False, True), (first, False, False))
    episodes = [
        replace(episode, success=np.array(won), terminated=ended, truncated=cut)
        for won, ended, cut in told
    ]
    file = replace(replay, episodes=tuple(episodes)).save(tmp_path / "ends.npz")
    assert main(["replay", str(file)]) == 1
    rows = [line.split("  ") for line in capsys.readouterr().out.splitlines()[3:]]
    words = [[word.strip() for word in row if word.strip()][-3:-1] for row in rows]
    assert words == [["yes", "ended"], ["no", "cut off"], ["no", "left"]]


def test_a_page_of_several_files_is_written(files, tmp_path, capsys):
    out = tmp_path / "page.html"
    assert main(["replay", *map(str, files), "--html", str(out)]) == 0
    assert f"written to {out}" in capsys.readouterr().out
    assert out.read_text().startswith("<!doctype html>")


@pytest.mark.parametrize(
    ("words", "lengths"),
    [
        ("MANY", [0, 1, 2, 3]),  # a page has room for so many
        ("MANY BALL", [0, 10]),
        ("BALL MANY", [10, 0]),
        ("MANY --episodes 4 2", [4, 2]),
        ("MANY BALL --episodes 0", [0, 10]),
    ],
)
def test_the_first_episodes_of_a_file_or_the_first_of_each_are_shown_or_those_that_are_named(
    files, tmp_path, monkeypatch, words,
    lengths
):  # fmt: skip
    ball = rolling_ball("policy", 0, 6)
    (whole,) = ball.episodes
    many = [play_again(ball.task, whole.start, whole.actions[:k]) for k in range(5)]
    places = {
        "MANY": str(replace(ball, episodes=tuple(many)).save(tmp_path / "many.npz")),
        "BALL": str(files[1]),
    }
    shown = []

    def note(file, chosen):
        shown.extend(len(replay.episodes[k]) for replay, k in chosen)
        return Path(places["MANY"])

    monkeypatch.setattr("rigid_envs.tools.cli.watching.write_html", note)
    given = [places.get(word, word) for word in words.split()]
    assert main(["replay", *given, "--html", str(tmp_path / "page.html")]) == 0
    assert shown == lengths


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("none.npz", "FILE = none.npz; expected a replay: there is no such file"),
        ("BALL --html none/page.html", "expected a file in a folder that exists"),
        ("BALL --episodes 7 --html OUT", "episode = 7; expected 0 to 0"),
        ("BALL --video a.avi", "expected a name that ends in"),
        ("BALL --video a.mp4 --speed 0", "--speed = 0.0; expected a positive"),
    ],
)
def test_what_cannot_be_shown_is_refused(files, tmp_path, arguments, message, capsys):
    places = {"BALL": str(files[1]), "OUT": str(tmp_path / "page.html")}
    assert main(["replay", *(places.get(word, word) for word in arguments.split())]) == 2
    said = capsys.readouterr()
    assert message in said.err
    assert said.out == "" or "--episodes" in arguments  # which are counted once they are shown
    assert not (tmp_path / "page.html").exists()


def test_a_film_of_several_files_is_written(files, tmp_path, capsys):
    pytest.importorskip("panda3d")
    film = tmp_path / "both.webp"
    words = [str(file) for file in files[:2]]
    assert main(["replay", *words, "--video", str(film), "--speed", "4"]) == 0
    assert f"written to {film}" in capsys.readouterr().out
    assert film.read_bytes()[8:12] == b"WEBP"
