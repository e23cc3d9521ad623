"""A report in a real browser: opened from disk, sorted, filtered, and a replay's link followed.

The screenshots are kept, see `browser.artifacts_folder`. Skipped where there is no Chromium.
"""

from __future__ import annotations

import time

import numpy as np
import pytest
from browser import CHROMIUM, NO_CHROMIUM, Browser
from PIL import Image
from replay_logs import replay_log

from drake_navbench.analysis.figures.album import FigureChoice
from drake_navbench.analysis.replay import write_race_replay
from drake_navbench.analysis.report import build_report
from drake_navbench.inputs.robot import load_robot
from drake_navbench.results import ResultsFolder

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM)

SCENARIO = "beside_a_box"
SPEEDS_MPS = {"dwb": 0.5, "rpp": 0.3}
SEEDS = (11, 22)
ON_DISK = ("file:", "data:", "blob:", "about:")
TABLE = "document.getElementById('metrics-table')"
MEAN = "th:nth-child(7)"


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """The report of two controllers, of which one never arrives, with a replay."""
    folder = ResultsFolder(tmp_path_factory.mktemp("results") / "campaign")
    folder.write_manifest({"scenarios": [SCENARIO], "controllers": list(SPEEDS_MPS)})
    logs = [
        replay_log(
            controller,
            speed_mps=speed_mps,
            outcome="succeeded" if controller == "dwb" else "timed_out",
            info={"trial": trial, "seed": seed},
        )
        for controller, speed_mps in SPEEDS_MPS.items()
        for trial, seed in enumerate(SEEDS)
    ]
    for log in logs:
        folder.write_log(log)
    replay = folder.replay_path(SCENARIO)
    replay.parent.mkdir()
    write_race_replay(logs[:: len(SEEDS)], replay, model=load_robot("wheelchair").model_path)
    return build_report(folder.path, figures=FigureChoice.ALL, jobs=1).path


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with Browser(tmp_path_factory.mktemp("profile")) as running:
        yield running


@pytest.fixture
def opened(browser, report):
    """The report, newly opened."""
    browser.errors.clear()
    browser.requests.clear()
    browser.open(report.as_uri())
    return browser


def color_count(picture, box=None):
    pixels = np.asarray(Image.open(picture).convert("RGB").crop(box), dtype=np.uint32)
    return len(np.unique(pixels @ np.array([1 << 16, 1 << 8, 1], dtype=np.uint32)))


def test_it_opens_from_disk_without_errors_or_requests(opened):
    # Figures are loaded when they come into sight; here all of them at once.
    widths = opened.evaluate(
        """Promise.all(Array.from(document.images).map((image) => {
          image.loading = "eager";
          for (let e = image; e; e = e.parentElement) if (e.tagName === "DETAILS") e.open = true;
          return image.decode().then(() => image.naturalWidth);
        }))"""
    )
    assert len(widths) >= 5
    assert min(widths) > 0
    assert color_count(opened.screenshot("report")) > 20
    assert opened.errors == []
    assert opened.requests
    assert [url for url in opened.requests if not url.startswith(ON_DISK)] == []


def test_nothing_moves_when_the_figures_above_are_loaded(opened):
    heading = "document.getElementById('metrics').getBoundingClientRect().top + window.scrollY"
    before = opened.evaluate(heading)
    opened.evaluate(
        """Promise.all(Array.from(document.querySelectorAll(".figures img")).map((image) => {
          image.loading = "eager";
          return image.decode();
        }))"""
    )
    # A figure's size is told in whole points.
    assert opened.evaluate(heading) == pytest.approx(before, abs=5.0)


def mean_column(browser):
    return browser.evaluate(
        f"Array.from({TABLE}.tBodies[0].rows, (row) => row.cells[6].dataset.value)"
    )


def test_a_click_sorts_by_number_and_another_turns_it_round(opened):
    assert opened.evaluate(f"{TABLE}.querySelector('{MEAN}').textContent") == "mean"
    for reverse, said in ((False, "ascending"), (True, "descending")):
        opened.click(f"#metrics-table {MEAN} button")
        opened.wait_for(f"{TABLE}.querySelector('{MEAN}').ariaSort === {said!r}")
        values = mean_column(opened)
        filled = [float(value) for value in values if value]
        assert filled == sorted(filled, reverse=reverse)
        # Empty cells come last in both directions.
        assert values[len(filled) :] == [""] * (len(values) - len(filled))
        assert 0 < len(filled) < len(values)
    opened.screenshot("report-sorted")


def test_filters_leave_the_rows_that_fit(opened):
    opened.evaluate(
        """(() => {
          const filters = document.querySelector('.filters[data-table="metrics-table"]');
          filters.querySelectorAll("select")[1].value = "rpp";
          filters.querySelector("input").value = "min_clearance_m";
          filters.dispatchEvent(new Event("input"));
        })()"""
    )
    shown = f"Array.from({TABLE}.tBodies[0].rows).filter((row) => !row.hidden).length"
    assert opened.evaluate(shown) == 1
    said = "document.querySelector('.filters[data-table=\"metrics-table\"] output').textContent"
    assert opened.evaluate(said).startswith("1 of ")


def test_an_address_with_an_anchor_shows_that_section(browser, report):
    # From another page: within the report the browser would only scroll.
    browser.open("about:blank")
    browser.open(report.as_uri() + "#metrics")
    top = browser.evaluate("document.getElementById('metrics').getBoundingClientRect().top")
    # Browsers scroll by fractions of a pixel.
    assert -1 < top < 200
    assert color_count(browser.screenshot("report-metrics")) > 20


def test_a_click_on_the_replay_link_opens_a_replay_that_is_drawn_and_moves(opened, report):
    opened.click("a.replay")
    replay = report.parent / "replays" / f"{SCENARIO}.html"
    opened.wait_for(f"location.href === {replay.as_uri()!r}")
    opened.wait_for("viewer.animator.duration > 0")
    canvas = opened.evaluate(
        """(() => {
          const box = viewer.renderer.domElement.getBoundingClientRect();
          return [box.left, box.top, box.right, box.bottom];
        })()"""
    )
    early_s = opened.evaluate("viewer.animator.time")
    first = opened.screenshot("replay-early")
    # Floor, grid, sky, box, chairs and paths; a blank canvas has one colour.
    assert color_count(first, canvas) > 100
    opened.wait_for(f"viewer.animator.time > {early_s} + 0.5")
    time.sleep(0.1)
    second = opened.screenshot("replay-late")
    assert first.read_bytes() != second.read_bytes()
    assert opened.errors == []
    assert [url for url in opened.requests if not url.startswith(ON_DISK)] == []
