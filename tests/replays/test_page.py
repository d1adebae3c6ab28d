"""The page of a replay, in Chromium: it shows what the file holds, and asks for nothing."""

import hashlib
import importlib
import io
import shutil
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from rigid_envs.watch.replays.page import MOST_BYTES, conservation_errors, html, write_html
from rigid_envs.watch.replays.replay import load_replay
from tests.replays.examples import free_body, idle, rolling_ball

pytestmark = pytest.mark.long

FLAGS = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
NAMES = ("chromium", "chromium-browser", "google-chrome")


def executable():
    """A Chromium that is installed; None leaves it to Playwright's own."""
    return next(filter(None, map(shutil.which, NAMES)), None)


@contextmanager
def chromium():
    """A browser; skips the test where there is none."""
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="no browser tests without Playwright: pip install playwright"
    )
    with playwright.sync_playwright() as started:
        path = executable() or started.chromium.executable_path
        if not Path(path).exists():
            pytest.skip(f"no browser tests without Chromium: none of {NAMES}, nor {path}")
        browser = started.chromium.launch(executable_path=path, args=list(FLAGS))
        yield browser
        browser.close()


class Watched:
    """A page with all that it logs, and all that it asks the network for."""

    def __init__(self, browser, width, height):
        self.page = browser.new_page(viewport={"width": width, "height": height})
        self.complaints = []
        self.requests = []
        self.page.on("console", self._logged)
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))

    def _logged(self, message):
        if message.type in ("error", "warning"):
            self.complaints.append(message.text)

    def open(self, file):
        """The page of a file, once it is ready."""
        self.page.goto(file.as_uri())
        wait_until(self.page, "window.rigidReplay !== undefined")
        return self.page


def wait_until(page, claim, seconds=20.0):
    """Wait for a claim; Playwright's own waiting evaluates text, which the page forbids."""
    end = time.monotonic() + seconds
    while not page.evaluate(claim):
        assert time.monotonic() < end, claim
        page.wait_for_timeout(50)


SIZES = {"desk": (1280, 800), "phone": (390, 844)}


@pytest.fixture(scope="module")
def browser():
    with chromium() as started:
        yield started


@pytest.fixture(scope="module")
def body(tmp_path_factory):
    """A replay, and its page."""
    folder = tmp_path_factory.mktemp("pages")
    file = free_body().save(folder / "body.npz")
    return file, write_html(folder / "body.html", [(load_replay(file), 0)])


@pytest.fixture(scope="module")
def balls(tmp_path_factory):
    shown = [(rolling_ball("policy", 0), 0), (rolling_ball("reference", 1, 25), 0)]
    return write_html(tmp_path_factory.mktemp("pages") / "balls.html", shown)


def picture(page, selector):
    """What is seen of an element, RGB."""
    image = pytest.importorskip("PIL.Image")
    shot = page.locator(selector).first.screenshot()
    return np.asarray(image.open(io.BytesIO(shot)).convert("RGB")).astype(int)


def settled(page, selector):
    """The picture once it stands still: what a busy machine draws is seen some frames later."""
    seen = [picture(page, selector)]
    while len(seen) < 4 or any(not np.array_equal(seen[-1], image) for image in seen[-4:]):
        assert len(seen) < 100, "the picture does not come to rest"
        page.wait_for_timeout(100)
        seen.append(picture(page, selector))
    return seen[-1]


def differs(one, other):
    """Pixels of another colour."""
    return np.abs(one - other).max(axis=-1) > 30


def seek(page, time):
    """Go to a time, and wait until it is drawn."""
    page.evaluate("time => rigidReplay.clock.seek(time)", time)
    page.evaluate("() => new Promise(done => requestAnimationFrame(() => setTimeout(done, 60)))")


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("which", ["body", "balls"])
def test_page_opens_from_disk_without_error_or_network(browser, body, balls, which, size):
    file = body[1] if which == "body" else balls
    watched = Watched(browser, *SIZES[size])
    page = watched.open(file)
    seek(page, 1.0)
    assert watched.complaints == []
    assert [url for url in watched.requests if not url.startswith(("data:", "blob:"))] == [
        file.as_uri()
    ]
    assert page.locator("#failure").is_hidden()
    page.close()


@pytest.mark.parametrize("size", SIZES)
def test_nothing_is_cut_off(browser, balls, size):
    width, height = SIZES[size]
    page = Watched(browser, width, height).open(balls)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    for selector in ("#stages", "#plots", "#play", "#scrub", "#speed", "#loop", "#about"):
        box = page.locator(selector).bounding_box()
        assert box["x"] >= 0 and box["x"] + box["width"] <= width
        assert box["y"] >= 0 and box["y"] + box["height"] <= height
    page.close()


OVERLAPS = """() => {
  const boxes = (selector) => [...document.querySelectorAll(selector)].map((node) =>
    [node.textContent, node.getBoundingClientRect()]).filter(([, box]) => box.width);
  return boxes(".arrow-label").flatMap(([label, a]) => boxes(".head > *, .name, .reset, h1")
    .filter(([, b]) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom)
    .map(([title]) => `${label} over ${title}`));
}"""


@pytest.mark.parametrize("size", [(390, 844), (704, 480), (390, 658), (1400, 900)])
def test_no_label_of_an_arrow_lies_over_a_title(browser, tmp_path, size):
    top = idle("RigidEnvs/SleepingTop-v0", label="a top that falls while nothing acts on it")
    page = Watched(browser, *size).open(write_html(tmp_path / "top.html", [(top, 0)]))
    assert page.locator(".inset .name").is_visible()
    for moment in np.linspace(0.0, top.episodes[0].times[-1], 6):
        seek(page, moment)
        assert set(page.locator(".arrow-label:visible").all_inner_texts()) >= {"L", "e₃"}
        assert page.evaluate(OVERLAPS) == []
    page.close()


@pytest.mark.push
def test_motion_is_seen_and_scrubbing_changes_it(browser, body):
    page = Watched(browser, *SIZES["desk"]).open(body[1])
    seek(page, 0.0)
    before = settled(page, ".panel > .view")
    assert before.std(axis=(0, 1)).max() > 20.0  # not blank
    box = page.locator("#scrub").bounding_box()
    page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    page.wait_for_timeout(300)
    assert page.evaluate("rigidReplay.clock.time") == pytest.approx(3.0, abs=0.1)
    after = settled(page, ".panel > .view")
    seen = differs(before, before[0, 0])  # all but the background
    assert differs(after, before).sum() > 0.5 * seen.sum()
    seek(page, 0.0)
    assert np.count_nonzero(settled(page, ".panel > .view") - before) == 0
    page.close()


def test_dragging_turns_the_camera_and_the_button_turns_it_back(browser, balls):
    page = Watched(browser, *SIZES["desk"]).open(balls)
    place = "rigidReplay.panels.main.map(stage => stage.camera.position.toArray())"
    before = np.array(page.evaluate(place))
    page.mouse.move(200, 400)
    page.mouse.down()
    page.mouse.move(300, 420, steps=4)
    page.mouse.up()
    turned = np.array(page.evaluate(place))
    assert np.linalg.norm(turned - before, axis=1).min() > 0.5  # of both: they are linked
    page.locator(".reset").first.click()
    assert np.allclose(page.evaluate(place), before)
    page.close()


def test_keys_play_step_and_change_speed(browser, body):
    page = Watched(browser, *SIZES["desk"]).open(body[1])
    now = "rigidReplay.clock.time"
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowRight")
    assert page.evaluate(now) == pytest.approx(0.2)
    page.keyboard.press("ArrowLeft")
    assert page.evaluate(now) == pytest.approx(0.1)
    page.keyboard.press("End")
    assert page.evaluate(now) == pytest.approx(6.0)
    page.keyboard.press("Home")
    page.keyboard.press("ArrowUp")
    assert page.evaluate("rigidReplay.clock.speed") == 2
    page.keyboard.press("Space")
    wait_until(page, "rigidReplay.clock.time > 0.2")
    page.keyboard.press("Space")
    assert not page.evaluate("rigidReplay.clock.playing")
    page.close()


@pytest.mark.push
def test_plotted_energy_error_is_the_stored_one(browser, body):
    replay = load_replay(body[0])
    (episode,) = replay.episodes
    errors = conservation_errors(replay.task.system(episode.parameters), episode.y)
    assert 0.0 < np.abs(errors["energy"]).max() < 1e-6
    page = Watched(browser, *SIZES["desk"]).open(body[1])
    for key, quantity in (("energy", "energy"), ("momentum", "L")):
        drawn = page.evaluate(
            "key => { const plot = rigidReplay.plots.find(plot => plot.data.key === key);"
            " return [...plot.data.episodes[0].lines[0]] }",
            key,
        )
        assert np.array_equal(drawn, errors[quantity])
    for k in (0, 17, 60):
        seek(page, float(episode.times[k]))
        read = page.locator("[data-plot=energy] output").inner_text()
        assert float(read) == pytest.approx(errors["energy"][k], rel=5e-3, abs=0.0)
        moved = page.locator("[data-plot=omega] output").all_inner_texts()
        assert np.allclose([float(x) for x in moved], episode.y[k, 4:7], rtol=1e-3)
    page.close()


def test_poses_of_the_page_are_those_of_the_file(browser, body):
    (episode,) = load_replay(body[0]).episodes
    page = Watched(browser, *SIZES["desk"]).open(body[1])
    for k in (0, 11, 60):
        seek(page, float(episode.times[k]))
        x, y, z, w = page.evaluate(
            "rigidReplay.panels.main[0].parts.get('body').object.quaternion.toArray()"
        )
        assert abs(np.dot((w, x, y, z), episode.y[k, :4])) > 1.0 - 1e-6
    page.close()


@pytest.mark.push
def test_no_text_of_a_file_can_end_the_document_of_the_page(browser, tmp_path):
    label = "</script><img src=x onerror=alert(1)><!--"
    file = write_html(tmp_path / "page.html", [(rolling_ball(label, 0, 3), 0)])
    watched = Watched(browser, 800, 600)
    page = watched.open(file)
    assert page.locator(".head strong").inner_text() == label
    assert watched.complaints == [] and page.locator("img").count() == 0
    page.close()


def test_long_episodes_side_by_side_fit_a_page():
    assert len(html(4 * [(free_body(300), 0)]).encode()) < MOST_BYTES


@pytest.mark.push
def test_shipped_viewer_is_built_from_the_sources_beside_it():
    folder = (
        Path(importlib.import_module("rigid_envs.watch.replays").__file__ or "").parent / "viewer"
    )
    names = [f"src/{file.name}" for file in (folder / "src").iterdir()]
    digest = hashlib.sha256()
    for name in sorted([*names, "build.mjs", "package.json", "package-lock.json"]):
        digest.update(f"{name}\0".encode() + (folder / name).read_bytes() + b"\0")
    built = (folder / "viewer.html").read_text()
    assert f"from sources {digest.hexdigest()} " in built, "run: npm ci && npm run build"
    licence = (folder / "THREE-LICENSE.txt").read_text()
    assert "The MIT License" in licence and licence.splitlines()[-1] in built
