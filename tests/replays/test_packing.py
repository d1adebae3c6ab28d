"""What a page is packed from: read back, it is what the replay holds."""

import base64
import json
import re
import zlib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rigid_envs.watch.replays.episode import moments
from rigid_envs.watch.replays.page import Packer, html
from rigid_envs.watch.replays.panels import curves, insets
from rigid_envs.watch.replays.replay import Replay
from tests.replays.examples import free_body, idle, rolling_ball


def unpacked(blob: str, place: list[Any]) -> Any:
    """The array of a reference, as the page reads it."""
    kind, offset, count = place
    block = zlib.decompress(base64.b64decode(blob))
    return np.frombuffer(block, f"<{kind}", count, offset)


def shown(*replays: Replay) -> dict[str, Any]:
    """What a page of the first episode of each is given to show."""
    text = html([(replay, 0) for replay in replays])
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


def test_a_trace_is_what_it_passed_or_whole_from_the_beginning(body: Replay) -> None:
    (episode,) = body.episodes
    path = moments(body.task, episode, 1)
    (panel,) = insets(body.task.system(episode.parameters), path, driven=True)
    packer = Packer()
    traces = packer.stage(panel)["traces"]
    assert [trace["whole"] for trace in traces] == [True, False]
    expected = (panel.whole["separatrices"], [frame.points["polhode"] for frame in panel.frames])
    for trace, points in zip(traces, expected, strict=True):
        found = unpacked(packer.blob(), trace["points"]).reshape(-1, 3)
        np.testing.assert_array_equal(found, np.asarray(points, np.float32))


@pytest.fixture(scope="module")
def ball() -> Replay:
    return rolling_ball("policy", 0, 12)


def test_times_and_frames_of_a_page_are_those_of_the_episode(ball: Replay) -> None:
    (episode,) = ball.episodes
    page = shown(ball)
    (found,) = page["episodes"]
    assert np.array_equal(unpacked(page["blob"], found["times"]), episode.times)
    assert len(found["text"]) == len(episode) + 1
    for (_, said, *_), cost in zip(found["text"][1:], episode.costs, strict=True):
        assert said.startswith(f"cost {cost:.3g} m")
    (part,) = (each for each in found["stage"]["parts"] if each["name"] == "ball")
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


@pytest.fixture(scope="module")
def body() -> Replay:
    return free_body(5)


def test_a_plot_has_the_curve_of_every_episode_and_none_of_one_that_has_no_such_curve(
    ball: Replay, body: Replay
) -> None:
    other = rolling_ball("reference", 1, 7)
    coin = idle("RigidEnvs/CoinPark-v0", 5)
    for replays in ((ball,), (ball, other), (body, ball), (coin, ball, other)):
        page = shown(*replays)
        told = ("key", "title", "unit", "kind", "names", "held")
        plots = {str([plot[name] for name in told]): plot["episodes"] for plot in page["plots"]}
        assert len(plots) == len(page["plots"])
        for k, replay in enumerate(replays):
            (episode,) = replay.episodes
            drawn = {place: lines[k] for place, lines in plots.items() if lines[k] is not None}
            for curve in curves(replay.task, episode, driven=True):
                of_steps = len(curve.values) == len(episode)
                place = [curve.key, curve.title, curve.unit, curve.kind, [*curve.names], of_steps]
                lines = drawn.pop(str(place))
                x, *columns = (unpacked(page["blob"], y) for y in (lines["x"], *lines["lines"]))
                if curve.kind == "plan":
                    x, columns = unpacked(page["blob"], lines["times"]), [x, *columns]
                assert np.array_equal(x, episode.times[1:] if of_steps else episode.times)
                assert np.array_equal(columns, curve.values.T)
                assert lines["end"] == episode.times[-1]
            assert not drawn


def test_a_page_says_what_it_shows_and_what_is_equal_once(ball: Replay, body: Replay) -> None:
    body = replace(body, provenance=ball.provenance)
    alone, twice, both = shown(ball), shown(ball, ball), shown(ball, body)
    assert alone["title"] == twice["title"] == "BallPark-v0"
    summary = str(type(ball.task).__doc__).splitlines()[0].replace("`", "")
    assert alone["subtitle"] == twice["subtitle"] == summary
    assert both["title"] == "BallPark-v0 and IntermediateAxis-v0" and both["subtitle"] == ""
    assert [each["label"] for each in twice["episodes"]] == ["policy 1", "policy 2"]
    assert [each["label"] for each in both["episodes"]] == ["policy", "free"]
    assert [name for name, _ in twice["facts"]] == ["parameters", "made with"]
    assert twice["facts"] == alone["facts"]
    names = [name for name, _ in both["facts"]]
    assert names == ["parameters: policy", "made with", "parameters: free"]
    for (_, text), replay in zip([both["facts"][0], both["facts"][2]], (ball, body), strict=True):
        values = replay.episodes[0].parameters.items()
        assert text == f"{', '.join(f'{k} = {x:.6g}' for k, x in values)} ({replay.env_id})"
    assert f"numpy {np.__version__}" in dict(alone["facts"])["made with"]


def test_too_many_and_unknown_episodes_are_refused() -> None:
    replay = rolling_ball("one", 0, 3)
    assert html(4 * [(replay, 0)])
    with pytest.raises(ValueError, match="5 episodes; expected 1 to 4"):
        html(5 * [(replay, 0)])
    with pytest.raises(ValueError, match="episode = 1; expected 0 to 0"):
        html([(replay, 1)])
