"""What a page is packed from: read back, it is what the replay holds."""

import base64
import json
import re
import zlib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rigid_envs.replays import Replay
from rigid_envs.replays.packing import Packer
from rigid_envs.replays.page import html
from tests.replays.examples import rolling_ball, view_of


def unpacked(blob: str, place: list[Any]) -> Any:
    """The array of a reference, as the page reads it."""
    kind, offset, count = place
    block = zlib.decompress(base64.b64decode(blob))
    return np.frombuffer(block, f"<{kind}", count, offset)


def shown(replay: Replay) -> dict[str, Any]:
    """What a page is given to show."""
    text = html([(replay, 0)], view_of)
    (document,) = re.findall(r'id="replay">(.*)</script>', text)
    found: dict[str, Any] = json.loads(document)
    return found


def test_equal_arrays_are_kept_once_and_all_are_read_back() -> None:
    packer = Packer()
    values = np.array([0.1, 2.0, -3.0])
    places = [packer.array(values), packer.array(values.tolist()), packer.array(values, "f8")]
    places.append(packer.array([7, 8, 255], "u1"))
    places.append(packer.array(values[::-1], "f8"))
    assert places[0] == places[1] and len({tuple(place) for place in places}) == 4
    block = len(zlib.decompress(base64.b64decode(packer.blob())))
    assert block == 16 + 24 + 8 + 24  # each begins at a multiple of 8 bytes
    expected = [values.astype(np.float32)] * 2 + [values, [7, 8, 255], values[::-1]]
    for place, array in zip(places, expected, strict=True):
        assert np.array_equal(unpacked(packer.blob(), place), array)


@pytest.fixture(scope="module")
def ball() -> Replay:
    return rolling_ball("policy", 0, 12)


def test_times_and_frames_of_a_page_are_those_of_the_episode(ball: Replay) -> None:
    (episode,) = ball.episodes
    page = shown(ball)
    (found,) = page["episodes"]
    assert np.array_equal(unpacked(page["blob"], found["times"]), episode.times)
    assert len(found["text"]) == len(episode) + 1
    assert [text[0] for text in found["text"][1:]] == [f"cost {cost:.2f}" for cost in episode.costs]
    (part,) = found["stage"]["parts"]
    times = unpacked(page["blob"], found["stage"]["times"])
    path = unpacked(page["blob"], part["position"]).reshape(-1, 3)
    at = np.searchsorted(times, episode.times - 1e-9)
    assert np.allclose(path[at, :2], episode.y[:, 4:6], atol=1e-6)


def test_a_page_says_success_where_the_last_step_was_one(ball: Replay) -> None:
    (episode,) = ball.episodes
    for flags in ([False] * 12, [True] + [False] * 11, [False] * 11 + [True]):
        once = replace(episode, success=np.array(flags))
        (found,) = shown(replace(ball, episodes=(once,)))["episodes"]
        result = f"{episode.rewards.sum():.4g} return, 12 steps"
        assert found["success"] is flags[-1]
        assert found["result"] == (f"success, {result}" if flags[-1] else result)
