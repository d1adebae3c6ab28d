"""Pages of the site in Chromium: films become replays, and environments are chosen by cards."""

import functools
import threading
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools.pages.films import filmed
from rigid_envs.watch.replays.page import write_html
from tests.programs import printed
from tests.replays import test_page

pytestmark = [pytest.mark.long, pytest.mark.push]

browser = test_page.browser
DOCS = Path(__file__).parents[2] / "docs"
LEFT_OUT = "exclude_patterns=_build,*.py,tutorials,reference,project"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Folder above the site, which has no tutorials, no reference, and one replay."""
    pytest.importorskip("furo")
    above = tmp_path_factory.mktemp("site")
    site = above / "below" / "a path"
    printed("-m", "sphinx", "-q", "-D", LEFT_OUT, "-d", above / "doctrees", DOCS, site)
    shown = [(replay, 0) for replay in filmed("RigidEnvs/BallPark-v0")]
    write_html(site / "_static" / "replays" / "BallPark.html", shown)
    return above


@pytest.fixture(params=["file", "http"])
def site(request, folder):
    """Address of the site, on the disk or below a path of a server."""
    handler = functools.partial(SimpleHTTPRequestHandler, directory=folder)
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever).start()
        root = {"file": folder.as_uri(), "http": f"http://127.0.0.1:{server.server_port}"}
        yield f"{root[request.param]}/below/a%20path"
        server.shutdown()


def test_a_film_becomes_its_replay_by_a_click_and_nothing_of_it_is_fetched_before(browser, site):
    watched = test_page.Watched(browser, 1400, 900)
    page, picture = watched.page, watched.page.locator("figure.moving img")
    page.goto(f"{site}/environments/BallPark.html")
    sizes = "performance.getEntriesByType('resource').map(entry => entry.encodedBodySize)"
    test_page.wait_until(page, "document.querySelector('figure.moving img').naturalWidth > 0")
    assert sum(page.evaluate(sizes)) < 1e6  # without the page: of a file, they are 0
    assert not any("/replays/" in url for url in watched.requests)
    page.get_by_role("button", name="Turn it yourself").click()
    page.frame_locator("iframe").locator("#canvas").wait_for()
    test_page.wait_until(page.frames[1], "window.rigidReplay?.clock.time > 0")  # it plays
    assert page.frames[1].locator("#title").inner_text() == "BallPark-v0"
    assert page.frames[1].locator(".panel").count() == 2 and picture.is_hidden()
    page.get_by_role("button", name="Back to the picture").click()
    assert picture.is_visible() and len(page.frames) == 1
    assert watched.complaints == []
    assert all(url.startswith((site, "data:", "blob:")) for url in watched.requests)
    page.close()


def test_filters_leave_the_environments_that_are_asked_for(browser, site):
    page = browser.new_page()
    page.goto(f"{site}/environments/README.html")
    names, said = page.locator(".card:visible strong"), page.locator("output")
    assert names.count() == len(ENVIRONMENTS)
    page.locator("select[name=goal]").select_option("goal environment")
    goals = [env_id for env_id, record in ENVIRONMENTS.items() if record.goal]
    assert [f"RigidEnvs/{name}-v0" for name in names.all_inner_texts()] == goals
    assert page.locator("#top").is_hidden() and page.locator("#ball").is_visible()
    page.locator("select[name=family]").select_option("Ball")
    page.locator("select[name=action]").select_option("2 numbers")
    page.locator("select[name=observation]").select_option("attitude")
    assert said.inner_text() == f"1 of {len(ENVIRONMENTS)}"
    page.get_by_role("button", name="all").click()
    page.locator("#top").wait_for()
    assert names.count() == len(ENVIRONMENTS)
    page.close()


def test_without_javascript_all_cards_are_seen_and_a_link_leads_to_the_replay(browser, site):
    page = browser.new_page(java_script_enabled=False)
    page.goto(f"{site}/environments/README.html")
    assert page.locator(".card:visible").count() == len(ENVIRONMENTS)
    assert page.locator("form.filters").is_hidden()
    page.goto(f"{site}/environments/BallPark.html")
    assert page.locator("figure.moving button").is_hidden()
    page.get_by_role("link", name="full page").click()
    assert page.url == f"{site}/_static/replays/BallPark.html"
    page.close()
