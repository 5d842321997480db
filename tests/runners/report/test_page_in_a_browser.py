"""The page in a real browser: figures drawn, nothing asked for, no errors, dark, on a phone, by keyboard, on paper."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from lag import lag

from ascentwind.runners.present.manifest import Manifest
from ascentwind.runners.present.style import write_figure
from ascentwind.runners.report.page import page_of
from ascentwind.runners.statistics.peak_check import check_peaks, with_peak_check

pytest.importorskip("bokeh")
pytest.importorskip("markdown_it")
playwright = pytest.importorskip("playwright.sync_api")

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None)
CURVES = "Bokeh.documents.flatMap(d => d.roots()).flatMap(r => r.renderers ?? []).map(r => r.glyph.line_color)"
pytestmark = [pytest.mark.slow, pytest.mark.skipif(BROWSER is None, reason="no Chromium here")]


@pytest.fixture(scope="module")
def page(tmp_path_factory) -> Path:
    """The page of a lag, with a title that is markup and mathematics."""
    folder = tmp_path_factory.mktemp("found")
    study = lag()
    statistics = study.response_statistics([0.5 * k for k in range(1, 40)])
    statistics = with_peak_check(statistics, check_peaks(study, statistics), study)
    manifest = Manifest.begin(folder, "run", "lag", {"title": "A </script><i id=injected>lag</i> of $$\\tau$$"})
    manifest.finish([*statistics.save(folder), *write_figure(statistics.plot("x"), folder, "more")])
    path = folder / "report.html"
    path.write_text(page_of(folder).html(), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def browser():
    with playwright.sync_playwright() as started:
        made = started.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        yield made
        made.close()


@pytest.fixture
def opened(browser, page):
    """Open the page; what the console said and what was asked for are attributes of the tab."""
    contexts = []

    def open_page(scheme="light", width=1280, address=None):
        context = browser.new_context(color_scheme=scheme, viewport={"width": width, "height": 900})
        contexts.append(context)
        tab = context.new_page()
        tab.said, tab.asked = [], []
        tab.on("console", lambda m: tab.said.append(m.text) if m.type in ("error", "warning") else None)
        tab.on("pageerror", lambda e: tab.said.append(str(e)))
        tab.on("request", lambda r: tab.asked.append(r.url) if not r.url.startswith(("data:", "blob:")) else None)
        tab.goto(address or page.as_uri())
        tab.wait_for_selector("html[data-figures]", state="attached", timeout=60_000)
        return tab

    yield open_page
    for context in contexts:
        context.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 390])
def test_figures_are_drawn_nothing_is_asked_for_and_nothing_overflows(opened, page, scheme, width):
    tab = opened(scheme, width)
    assert tab.said == []
    assert tab.asked == [page.as_uri()]
    wanted = tab.locator("figure .plot").count()
    assert wanted >= 2
    assert tab.locator("figure .plot svg, figure .plot .bk-Figure").count() >= wanted
    assert tab.locator("#injected").count() == 0
    assert tab.evaluate("document.documentElement.scrollWidth") <= width
    drawn = tab.locator("figure .plot").first.bounding_box()
    assert drawn["width"] > 0.8 * min(width, 600) * (1 if width < 860 else 0.7)
    assert drawn["height"] > 100


def luminance(tab, script: str) -> float:
    red, green, blue = tab.evaluate(f"({script}).match(/[\\d.]+/g).slice(0, 3).map(Number)")
    return (0.2126 * red + 0.7152 * green + 0.0722 * blue) / 255


def test_dark_and_light_pages_have_contrast_and_their_curves_follow(opened):
    seen = {}
    for scheme in ("light", "dark"):
        tab = opened(scheme)
        body = luminance(tab, "getComputedStyle(document.body).backgroundColor")
        text = luminance(tab, "getComputedStyle(document.body).color")
        assert abs(body - text) > 0.6
        assert (body < 0.2) == (scheme == "dark")
        seen[scheme] = tab.evaluate(f"JSON.stringify({CURVES})")
    assert seen["light"] != seen["dark"]


def test_a_page_that_turns_dark_repaints_its_curves(opened):
    tab = opened("light")
    curves = f"JSON.stringify({CURVES})"
    before = tab.evaluate(curves)
    tab.emulate_media(color_scheme="dark")
    tab.wait_for_timeout(200)
    assert tab.evaluate(curves) != before


def test_the_keyboard_reaches_the_results_first(opened):
    tab = opened()
    tab.keyboard.press("Tab")
    assert tab.evaluate("document.activeElement.getAttribute('href')") == "#content"
    assert tab.locator("a.skip").bounding_box()["x"] >= 0
    for role in ("banner", "navigation", "main", "contentinfo"):
        assert tab.get_by_role(role).count() == 1, role
    sections = tab.locator("section").count()
    assert tab.get_by_role("region").count() >= sections


def test_it_prints(opened):
    tab = opened("dark")
    assert tab.pdf(format="A4").startswith(b"%PDF")
    tab.emulate_media(media="print", color_scheme="dark")
    assert luminance(tab, "getComputedStyle(document.body).color") < 0.4


def test_first_paint_waits_no_longer_than_an_empty_page_with_the_same_script(opened, page):
    """The script stands behind the content: the first paint needs none of it."""
    html = page.read_text(encoding="utf-8")
    assert html.index("</main>") < html.index("<script")
    assert html.index("</footer>") < html.index("<script")
