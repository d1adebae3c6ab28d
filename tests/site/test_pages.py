"""Pages of the site in Chromium: films become replays, and environments are chosen by cards.

They are opened from the disk: what works there, from addresses relative to the page, works below
any path of a server, too.
"""

import json
from pathlib import Path

import pytest

from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools.pages.films import filmed
from rigid_envs.watch.replays.page import write_html
from tests.programs import printed
from tests.replays import test_page

pytestmark = [pytest.mark.long, pytest.mark.push]
browser = test_page.browser

BALL = "RigidEnvs/BallPark-v0"
DOCS = Path(__file__).parents[2] / "docs"
LEFT_OUT = "exclude_patterns=_build,*.py,notebooks,tutorials,reference,project"


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Folder of the site, without tutorials and reference, and with one replay."""
    pytest.importorskip("furo")
    folder = tmp_path_factory.mktemp("a site")
    printed("-m", "sphinx", "-q", "-D", LEFT_OUT, "-d", folder / "doctrees", DOCS, folder)
    write_html(folder / "_static/replays/BallPark.html", [(shown, 0) for shown in filmed(BALL)])
    return folder


def test_a_film_becomes_its_replay_by_a_click_and_nothing_of_it_is_fetched_before(browser, site):
    watched = test_page.Watched(browser, 1400, 900)
    page, picture = watched.page, watched.page.locator("figure.moving img")
    page.goto((site / "environments/BallPark.html").as_uri())
    assert not any("/replays/" in url for url in watched.requests)
    page.get_by_role("button", name="Turn it yourself").click()
    page.frame_locator("iframe").locator("#canvas").wait_for()
    test_page.wait_until(page.frames[1], "window.rigidReplay?.clock.time > 0")  # it plays
    films = json.loads((DOCS / "environments/films/films.json").read_text())["films"]
    assert page.frames[1].locator(".head strong").all_inner_texts() == films[BALL]["shows"]
    assert picture.is_hidden()
    page.get_by_role("button", name="Back to the picture").click()
    assert picture.is_visible() and len(page.frames) == 1
    assert watched.complaints == []
    assert all(url.startswith((site.as_uri(), "data:", "blob:")) for url in watched.requests)
    page.close()


@pytest.mark.parametrize("script", [True, False], ids=["script", "no script"])
def test_all_environments_are_seen_and_filters_leave_those_asked_for(browser, site, script):
    page = browser.new_page(java_script_enabled=script)
    page.goto((site / "environments/README.html").as_uri())
    names = page.locator(".card:visible strong")
    assert names.count() == len(ENVIRONMENTS)
    assert page.locator("form.filters").is_visible() == script
    if script:
        page.locator("select[name=goal]").select_option("goal environment")
        page.locator("select[name=action]").select_option("2 numbers")
        assert names.all_inner_texts() == ["BallParkGoal", "TwoWheels"]
        assert page.locator("#top").is_hidden()  # a family of which no card is left
    page.close()


@pytest.mark.parametrize("touch", [False, True], ids=["mouse", "touch"])
def test_a_card_shows_its_film_when_it_is_looked_at_and_few_are_fetched(browser, site, touch):
    size = {"width": 390, "height": 844}
    page = browser.new_page(viewport=size, is_mobile=touch, has_touch=touch)
    films = []
    page.on("request", lambda request: films.append(request.url) if "_images" in request.url else 0)
    page.goto((site / "environments/README.html").as_uri())
    page.wait_for_timeout(500)
    assert len(films) <= 1 if touch else films == []
    card = page.locator(".card", has_text="BallParkGoal")
    source = "document.querySelector('img[alt=BallParkGoal]').src"
    assert page.evaluate(source).endswith("/_static/stills/BallParkGoal.webp")
    if touch:
        card.evaluate("card => card.scrollIntoView({ block: 'center' })")
    else:
        card.hover()
    test_page.wait_until(page, f"{source}.endsWith('/_images/BallParkGoal.webp')")
    page.close()


def test_formulas_are_mathematics_and_on_a_phone_wide_ones_scroll(browser, site):
    page = test_page.Watched(browser, 390, 844).page
    page.goto((site / "environments/BallPlate.html").as_uri())
    page.wait_for_selector("mjx-container.wide")
    assert page.locator("mjx-merror").count() == 0
    assert "$" not in page.locator("article").inner_text()
    ends = page.evaluate(
        """() => [document.documentElement.scrollWidth,
            ...[...document.querySelectorAll("mjx-container")].map(
                (formula) => formula.getBoundingClientRect().right)]"""
    )
    assert len(ends) > 40
    assert max(ends) <= 390
    after = "nodes => nodes.map(node => node.parentElement.nextSibling?.nodeValue ?? '')"
    texts = page.locator("mjx-container.wide").evaluate_all(after)
    assert texts and not any(text.startswith((",", ".")) for text in texts)  # at the head of a line
    page.close()
