"""Replay files: what is saved is read to the bit, and anything else is refused."""

import contextlib
import io
import json
import zipfile
from dataclasses import replace
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from rigid_envs.base.files import DamagedFileError, digest, read_arrays, write_arrays
from rigid_envs.scores.best import best_known
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.testing.environments import in_full
from rigid_envs.watch.replays.recording import RecordReplay, RecordRows
from rigid_envs.watch.replays.replay import load_replay, play_again, same_bits
from tests.refusals import refuses
from tests.replays.examples import recorded


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    replay = recorded("RigidEnvs/BallPark-v0", radius=(0.8, 1.2))
    return replay.save(tmp_path_factory.mktemp("replays") / "ball.npz")


def changed(file, out, change, version=3):
    """A copy of a replay with its arrays changed, and a digest to match; version 2 has none."""
    with np.load(file) as archive:
        arrays = dict(archive)
    change(arrays)
    rest = {name: array for name, array in arrays.items() if name != "header"}
    with contextlib.suppress(KeyError, ValueError):  # where there is no header any more
        header = json.loads(arrays["header"].tobytes())
        assert header.pop("sha256")
        seal = {"sha256": digest(header, rest)} if version == 3 else {"version": 2}
        arrays["header"] = as_bytes({**header, **seal})
    np.savez(out, **arrays)
    return out


def as_bytes(header):
    return np.frombuffer(json.dumps(header).encode(), dtype=np.uint8)


def header_with(**entries):
    def change(arrays):
        arrays["header"] = as_bytes(json.loads(arrays["header"].tobytes()) | entries)

    return change


def header_without(name):
    def change(arrays):
        header = json.loads(arrays["header"].tobytes())
        del header[name]
        arrays["header"] = as_bytes(header)

    return change


@in_full(ENVIRONMENTS)
def test_every_environment_is_saved_and_read_and_played_again_to_the_bit(env_id, tmp_path):
    noisy = {"action_noise": 0.3, "observation_noise": 0.1, "action_delay": 2}
    replay = recorded(env_id, n_episodes=2, **({} if "Grid" in env_id else noisy))
    file = replay.save(tmp_path / "replay")
    read, known = load_replay(file), best_known(env_id)
    assert read.env_id == env_id and read.task == replay.task
    assert read.provenance == replay.provenance
    for before, after in zip(replay.episodes, read.episodes, strict=True):
        again = play_again(read.task, after.start, after.actions, after.label)
        for each in (after, again):
            assert same_bits(before, each) and before.label == each.label
        assert (before.terminated, before.truncated) == (after.terminated, after.truncated)
        assert len(after) == 6 or after.terminated
    with np.load(file) as archive:
        header = json.loads(archive["header"].tobytes())
    assert known is not None and header["version"] == 3  # as of those that were saved before
    assert header["units"] == {"cost": replay.task.cost_unit, "metric": known.cost}


def test_the_name_of_a_file_ends_in_npz_whatever_was_asked_for(tmp_path):
    replay = recorded("RigidEnvs/Detumble-v0", n_steps=1)
    for name, written in (("a", "a.npz"), ("b.npz", "b.npz"), ("of.mine", "of.mine.npz")):
        file = replay.save(tmp_path / "new" / name)
        assert file == tmp_path / "new" / written and file.is_file()
    assert len(list(file.parent.iterdir())) == 3


def test_equal_replays_are_equal_bytes(tmp_path):
    replay = recorded("RigidEnvs/Detumble-v0")
    files = [replay.save(tmp_path / name) for name in ("one.npz", "two.npz")]
    assert files[0].read_bytes() == files[1].read_bytes()


def test_a_replay_of_a_hundred_steps_is_small(tmp_path):
    file = recorded("RigidEnvs/Reorient-v0", n_steps=100).save(tmp_path / "replay")
    assert file.stat().st_size < 40_000


def test_an_array_that_claims_more_than_it_holds_is_refused(file, tmp_path):
    buffer = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        buffer, {"descr": "<f8", "fortran_order": False, "shape": (10**12, 6)}
    )
    with zipfile.ZipFile(tmp_path / "large.npz", "w") as archive:
        archive.writestr("0/y.npy", buffer.getvalue())
    with pytest.raises(DamagedFileError, match="48000000000000 bytes unpacked; expected at most"):
        load_replay(tmp_path / "large.npz")


def test_arrays_that_together_claim_more_than_is_left_are_refused(tmp_path):
    write_arrays(tmp_path / "a.npz", dict.fromkeys("abc", np.zeros(1000)))
    assert read_arrays(tmp_path / "a.npz", 24_000).keys() == set("abc")
    with pytest.raises(DamagedFileError, match="8000 bytes unpacked; expected at most 7999"):
        read_arrays(tmp_path / "a.npz", 23_999)


@pytest.mark.parametrize("array", [np.array("1"), np.array(1, "m8[s]"), np.zeros(1, "f8, i4")])
def test_an_array_of_anything_but_numbers_or_booleans_is_refused(array, tmp_path):
    np.savez(tmp_path / "a.npz", a=array)
    with pytest.raises(DamagedFileError, match="expected numbers or booleans"):
        read_arrays(tmp_path / "a.npz")


def test_two_arrays_of_one_name_are_refused(tmp_path):
    write_arrays(tmp_path / "a.npz", {"a": np.zeros(1)})
    with zipfile.ZipFile(tmp_path / "a.npz", "a") as archive:
        archive.writestr("a", archive.read("a.npy"))
    with pytest.raises(DamagedFileError, match="two arrays of one name"):
        read_arrays(tmp_path / "a.npz")


def test_more_than_can_be_read_again_is_not_written(tmp_path):
    for arrays in ({"a": np.empty(2**25 + 1)}, {str(k): np.zeros(0) for k in range(50_001)}):
        with pytest.raises(ValueError, match=r"expected at most 50000 of .*: write several files"):
            write_arrays(tmp_path / "a.npz", arrays)
    assert not [*tmp_path.iterdir()]


@pytest.mark.parametrize("packed", [False, True])
def test_whatever_is_written_can_be_read_again_up_to_the_last_byte(packed, tmp_path, monkeypatch):
    path, sizes = tmp_path / "a.npz", range(1700, 2003)
    noise = np.frombuffer(np.random.default_rng(0).bytes(sizes[-1]), np.uint8)
    monkeypatch.setattr("rigid_envs.base.files._LIMIT", 2000)
    monkeypatch.setattr("rigid_envs.base.files.write_atomic", Path.write_bytes)  # at once
    taken = []
    for size in sizes:
        array = noise[:size] * (0 if packed else 1)
        try:
            write_arrays(path, {"a": array})
        except ValueError:
            continue
        assert np.array_equal(read_arrays(path, 2000)["a"], array)
        taken.append(size)
    assert taken == [*range(1700, taken[-1] + 1)]
    assert (taken[-1] if packed else path.stat().st_size) == 2000  # what is in it, or the file


def test_as_many_arrays_are_written_as_can_be_read_again(tmp_path, monkeypatch):
    monkeypatch.setattr("rigid_envs.base.files._MOST", 3)
    path = tmp_path / "a.npz"
    write_arrays(path, dict.fromkeys("abc", np.zeros(1)))
    assert read_arrays(path).keys() == set("abc")
    with pytest.raises(ValueError, match="4 arrays of 32 bytes; expected at most 3 of "):
        write_arrays(path, dict.fromkeys("abcd", np.zeros(1)))


CHANGES = {
    r"no array '0/y'": lambda a: a.pop("0/y"),
    r"array 'more'; expected": lambda a: a.update(more=np.zeros(3)),
    r"0/y has shape \(5, 6\); expected \(7, 6\)": lambda a: a.update({"0/y": a["0/y"][:5]}),
    r"0/rewards has dtype float32": lambda a: a.update(
        {"0/rewards": a["0/rewards"].astype(np.float32)}
    ),
    r"0/rewards has shape \(\); expected \(0,\)": lambda a: a.update({"0/rewards": np.array(1.0)}),
    r"0/u\[0, 0\] = nan": lambda a: a["0/u"].__setitem__((0, 0), np.nan),
    r"0/q.*length 1": lambda a: a["0/y"].__setitem__((2, slice(0, 4)), 2.0),
    r"0/times do not increase": lambda a: a["0/times"].__setitem__(3, 0.0),
    r"expected start/y": lambda a: a["0/y"].__setitem__((0, 4), 9.0),
    r"radius = -1.0; expected": lambda a: a["0/parameters"].__setitem__(0, -1.0),
    r"no header": lambda a: a.pop("header"),
    r"header is no JSON": lambda a: a.update(header=np.zeros(9, dtype=np.uint8)),
    r"another format": header_with(format="video"),
    r"version = 99; expected 2 or 3": header_with(version=99),
    r"did you mean 'RigidEnvs/BallPark-v0'": header_with(env_id="RigidEnvs/BallPork-v0"),
    r"header has keys .*'more', .*; expected \['config'": header_with(more=1),
    r"'sha256', 'version'\]; expected .*'units'": header_without("units"),
    r"env_id = 3; expected a value of type str": header_with(env_id=3),
    r"config.radius: radius": header_with(config={"radius": "large"}),
    r"rows = .*another version": header_with(rows={"y": ["w"]}),
    r"episodes\[0\] = 5": header_with(episodes=[5]),
    r"expected true or false": header_with(
        episodes=[{"label": "", "terminated": 1, "truncated": False}]
    ),
    r"episodes = .*can be printed": header_with(
        episodes=[{"label": "\x1b[2J", "terminated": True, "truncated": False}]
    ),
    r"provenance = .*can be printed": header_with(provenance={"versions": {"numpy": "1\n2"}}),
    r"episodes = \(\)": lambda a: (header_with(episodes=[])(a), [a.pop(k) for k in [*a][1:]]),
}


@pytest.mark.parametrize("name", ["rewards", "costs", "success", "applied", "u"])
def test_numbers_of_an_episode_cannot_be_changed(name, file, tmp_path):
    def change(arrays):
        array = arrays[f"0/{name}"]
        array[2] = ~array[2] if array.dtype == np.bool_ else array[2] + 1.0

    out = tmp_path / "changed.npz"
    with np.load(file) as archive:
        arrays = dict(archive)
    change(arrays)
    np.savez(out, **arrays)
    with pytest.raises(DamagedFileError, match=r"changed\.npz: sha256: that of other content"):
        load_replay(out)
    with pytest.raises(DamagedFileError, match=r"changed\.npz: episodes\[0\]: other numbers than"):
        load_replay(changed(file, out, change, version=2))


def test_a_file_of_the_version_before_digests_is_read(file, tmp_path):
    old = load_replay(changed(file, tmp_path / "old.npz", lambda arrays: None, version=2))
    assert same_bits(old.episodes[0], load_replay(file).episodes[0])


@pytest.mark.parametrize("message", CHANGES)
def test_wrong_content_is_refused_by_name(message, file, tmp_path):
    with pytest.raises(DamagedFileError, match=message):
        load_replay(changed(file, tmp_path / "changed.npz", CHANGES[message]))


@pytest.mark.parametrize("k", [1, 3, 6])
@pytest.mark.parametrize("step", [0.0, -0.05, -1.0])
def test_times_that_stand_still_or_go_back_are_refused(k, step, file, tmp_path):
    def change(arrays):
        times = arrays["0/times"]
        times[k:] += times[k - 1] + step - times[k]  # all others go on as they did

    with pytest.raises(DamagedFileError, match="0/times do not increase"):
        load_replay(changed(file, tmp_path / "changed.npz", change))


@pytest.mark.parametrize("label", ["\x1b[2J", "two\nlines", "x" * 201, 3])
def test_a_label_that_could_not_be_read_again_is_refused_before_anything_is_played(label, file):
    refuses(r"^label = ", RecordReplay, gym.make("RigidEnvs/Detumble-v0"), label=label)
    with pytest.raises(ValueError, match=r"^label = "):
        RecordRows(gym.make_vec("RigidEnvs/Detumble-v0", num_envs=2), label=label)
    replay = load_replay(file)
    named = [replace(episode, label=label) for episode in replay.episodes]
    with pytest.raises(ValueError, match=r"^episodes\[0\]\.label = "):
        replace(replay, episodes=named)


def test_a_provenance_that_could_not_be_read_again_is_refused_before_it_is_written(file):
    refuses("^provenance = .*can be printed", replace, load_replay(file), provenance={"a": "\n"})


def test_a_missing_file_is_a_missing_file(tmp_path):
    with pytest.raises(FileNotFoundError):
        load_replay(tmp_path / "none.npz")
