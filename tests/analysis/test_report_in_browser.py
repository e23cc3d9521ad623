"""A report in a real browser: opened from disk, sorted, filtered, and a replay's link followed.

The screenshots are kept, see `browser.artifacts_folder`. Skipped where there is no Chromium.
"""

from __future__ import annotations

import re
import time
from itertools import groupby, pairwise

import numpy as np
import pytest
from browser import CHROMIUM, NO_CHROMIUM, Browser
from PIL import Image
from replay_logs import replay_log

from drake_navbench.analysis.figures.choice import FigureChoice
from drake_navbench.analysis.replay import write_race_replay
from drake_navbench.analysis.report import build_report
from drake_navbench.inputs.robot import load_robot
from drake_navbench.logs.results import ResultsFolder

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


@pytest.fixture
def untouched(browser, report):
    """The report, opened anew unless the test before has left it as it was."""
    if not browser.evaluate("window.isUntouched === true"):
        browser.open(report.as_uri())
        browser.evaluate("window.isUntouched = true")
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
    # Paths, metrics and two sheets of motion; where one alone arrives there are no places.
    assert len(widths) == 4
    assert min(widths) > 0
    assert color_count(opened.screenshot("report")) > 20
    assert opened.errors == []
    assert opened.requests
    assert [url for url in opened.requests if not url.startswith(ON_DISK)] == []


def test_nothing_moves_when_the_figures_above_are_loaded(untouched):
    heading = "document.getElementById('metrics').getBoundingClientRect().top + window.scrollY"
    before = untouched.evaluate(heading)
    untouched.evaluate(
        """Promise.all(Array.from(document.querySelectorAll(".figures img")).map((image) => {
          image.loading = "eager";
          return image.decode();
        }))"""
    )
    # A figure's size is told in whole points.
    assert untouched.evaluate(heading) == pytest.approx(before, abs=5.0)


SCREENS = [(1280, 900, False), (1280, 900, True), (390, 844, False), (390, 844, True)]


@pytest.fixture
def as_it_was(browser):
    """Gives the window back its size and colours."""
    yield
    browser.restore()


@pytest.mark.parametrize(("width", "height", "is_dark"), SCREENS)
def test_it_fits_every_window_in_either_colour(untouched, as_it_was, width, height, is_dark):
    untouched.resize(width, height, is_dark=is_dark)
    picture = untouched.screenshot(f"report-{width}-{'dark' if is_dark else 'light'}")
    # Nothing is wider than the window: the page is not to be scrolled sideways.
    assert untouched.evaluate("document.documentElement.scrollWidth") <= width
    pixels = np.asarray(Image.open(picture).convert("L"), dtype=float)
    assert bool(np.median(pixels) < 64) is is_dark
    small = untouched.evaluate("""Array.from(document.querySelectorAll("p, li"))
        .map((text) => Number.parseFloat(getComputedStyle(text).fontSize))""")
    assert min(small) >= 12


CHARTED = "document.querySelectorAll('.box[data-drawn=yes] .live').length"


def test_figures_become_charts_that_can_be_touched_without_anything_moving(opened):
    heading = "document.getElementById('metrics').getBoundingClientRect().top + window.scrollY"
    before = opened.evaluate(heading)
    opened.evaluate("document.querySelector('.chart').scrollIntoView()")
    opened.wait_for(f"{CHARTED} > 1")
    opened.screenshot("report-charts")
    assert opened.evaluate(heading) == pytest.approx(before, abs=1.0)
    # Of the two controllers one is switched off; its dots and lines go.
    opened.click('.legend button[data-controller="rpp"]')
    shown = """Bokeh.documents.flatMap((one) => one.roots()).flatMap((figure) => figure.renderers)
        .filter((one) => one.visible).length"""
    less = opened.evaluate(shown)
    opened.click('.legend button[data-controller="rpp"]')
    assert opened.evaluate(shown) > less
    assert opened.errors == []


@pytest.mark.long
def test_it_prints_on_a_few_pages(untouched):
    assert len(re.findall(rb"/Type\s*/Page\b", untouched.printed("report"))) <= 8


def test_sent_alone_it_has_its_pictures_and_says_that_the_replays_are_elsewhere(
    browser, report, tmp_path
):
    alone = tmp_path / "report.html"
    alone.write_bytes(report.read_bytes())
    browser.open(alone.as_uri())
    browser.wait_for("document.querySelectorAll('.missing').length > 0")
    told = browser.evaluate("document.querySelector('h2 .missing').textContent")
    assert told == "open the replay: not in this folder"
    assert browser.evaluate("document.querySelectorAll('a.replay, a.to-replay').length") == 0
    widths = browser.evaluate("Array.from(document.images).map((image) => image.naturalWidth)")
    assert min(widths) > 0
    browser.screenshot("report-alone")


def cells(browser, what):
    return browser.evaluate(f"Array.from({TABLE}.tBodies[0].rows, (row) => {what})")


def mean_column(browser):
    return cells(browser, "row.cells[6].dataset.value")


def test_sorted_published_metrics_keep_the_units_apart(untouched):
    """Metres once stood between seconds and percent, by the bare number."""
    untouched.evaluate("document.querySelectorAll('table[class=sortable] thead button')[2].click()")
    units = untouched.evaluate(
        """Array.from(document.querySelector("table[class=sortable]").tBodies[0].rows,
          (row) => row.dataset.unit)"""
    )
    changes = sum(first != second for first, second in pairwise(units))
    assert len(set(units)) > 3
    assert changes == len(set(units)) - 1


def test_the_scale_of_the_distance_from_the_plan_has_three_numbers(untouched):
    bars = """Bokeh.documents.flatMap((one) => one.roots()).flatMap((figure) => figure.center)
      .filter((one) => one.type === "ColorBar").map((bar) => bar.ticker.ticks)"""
    untouched.evaluate("document.querySelector('.by-error').scrollIntoView()")
    untouched.wait_for(f"{bars}.length > 0")
    low, middle, high = untouched.evaluate(bars)[0]
    assert low == 0.0
    assert 2.0 * middle == pytest.approx(high)
    assert high > 0.0


def test_a_click_sorts_by_number_within_a_unit_and_another_turns_it_round(opened):
    assert opened.evaluate(f"{TABLE}.querySelector('{MEAN}').textContent") == "mean"
    for reverse, said in ((False, "ascending"), (True, "descending")):
        opened.click(f"#metrics-table {MEAN} button")
        opened.wait_for(f"{TABLE}.querySelector('{MEAN}').ariaSort === {said!r}")
        units = [unit for unit, _ in groupby(cells(opened, "row.cells[4].textContent"))]
        assert len(units) == len(set(units)) > 3
        rows = zip(cells(opened, "row.cells[4].textContent"), mean_column(opened), strict=True)
        for _, own in groupby(rows, key=lambda row: row[0]):
            values = [value for _, value in own]
            filled = [float(value) for value in values if value]
            assert filled == sorted(filled, reverse=reverse)
            # Empty cells come last in both directions.
            assert values[len(filled) :] == [""] * (len(values) - len(filled))
        assert "" in mean_column(opened)
    opened.screenshot("report-sorted")


def test_counts_have_no_unit_and_are_sorted_over_all_rows(opened):
    opened.click("#metrics-table th:nth-child(6) button")
    counts = [int(count) for count in cells(opened, "row.cells[5].dataset.value")]
    assert counts == sorted(counts)
    assert len(set(counts)) > 1


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


@pytest.mark.long
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
    # It plays by itself; how far it is at a picture depends on how busy the machine is.
    opened.wait_for("viewer.animator.time > 0.5")
    pictures = []
    for moment_s in (0.5, 3.0):
        opened.evaluate(
            f"viewer.animator.pause(), viewer.animator.time = {moment_s}, "
            f"viewer.animator.seek({moment_s}), viewer.set_dirty()"
        )
        time.sleep(0.3)
        pictures.append(opened.screenshot(f"replay-at-{moment_s}"))
    # Floor, grid, sky, box, chairs and paths; a blank canvas has one colour.
    assert color_count(pictures[0], canvas) > 100
    assert pictures[0].read_bytes() != pictures[1].read_bytes()
    assert opened.errors == []
    assert [url for url in opened.requests if not url.startswith(ON_DISK)] == []


CHIP = "document.querySelector('#columns button[data-controller=rpp]')"
ROWS = (
    "Array.from(document.querySelectorAll('#trials-table tbody tr'))"
    ".filter((row) => row.offsetParent !== null).length"
)


def test_a_chip_hides_its_controller_everywhere_and_stands_in_the_address(untouched, browser):
    assert untouched.evaluate(ROWS) == 4
    untouched.evaluate(f"{CHIP}.click()")
    try:
        assert untouched.evaluate(ROWS) == 2
        assert untouched.evaluate(f"{CHIP}.getAttribute('aria-pressed')") == "false"
        shown = "Array.from(document.querySelectorAll('.bar')).filter((b) => b.offsetParent)"
        names = untouched.evaluate(f"[...new Set({shown}.map((b) => b.dataset.controller))]")
        assert names == ["dwb"]
        heads = "document.querySelectorAll('#summary thead th:not(.of-hidden)').length"
        assert untouched.evaluate(heads) < untouched.evaluate(heads.replace(":not(.of-hidden)", ""))
        assert untouched.evaluate("location.search") == "?hide=rpp"
        # Who opens the address sees the same.
        untouched.evaluate("hiddenControllers.clear(), restoreState()")
        assert untouched.evaluate(ROWS) == 2
    finally:
        untouched.evaluate("hiddenControllers.clear(), showHidden(), keepState()")
    assert untouched.evaluate(ROWS) == 4
    assert untouched.evaluate("location.search") == ""


# A figure among the charts of metrics, by its title.
FIGURE = """(() => {
  const box = document.querySelector('.box[data-kind=metrics]');
  box.scrollIntoView({block: 'center'});
  if (box.dataset.drawn !== 'yes') return undefined;
  const figures = Bokeh.documents.flatMap((one) => one.roots());
  return figures.findLast((figure) => figure.title?.text.includes(%r));
})()"""
LENGTH = FIGURE % "Driven length"
# The place in the window of a point of a figure's data.
PLACE = """((figure, x, y) => {
  const view = Bokeh.index.find_one(figure);
  const box = view.canvas_view.el.getBoundingClientRect();
  const {x_scale, y_scale} = view.frame;
  return [box.x + x_scale.compute(x), box.y + y_scale.compute(y)];
})"""


def ends(browser, figure):
    """Returns the ends of a figure's y axis."""
    browser.wait_for(f"{figure}.y_range.end > {figure}.y_range.start")
    return browser.evaluate(f"[{figure}.y_range.start, {figure}.y_range.end]")


def test_axes_fit_the_controllers_that_are_shown(untouched):
    """In 4 s dwb drives 2 m and rpp 1.2 m, around which the axis lies where dwb is hidden."""
    both = ends(untouched, LENGTH)
    assert sum(both) == pytest.approx(2.0 + 1.2)
    try:
        untouched.evaluate("document.querySelector('#columns button[data-controller=dwb]').click()")
        untouched.wait_for(f"Math.abs({LENGTH}.y_range.start + {LENGTH}.y_range.end - 2.4) < 1e-6")
    finally:
        untouched.evaluate("hiddenControllers.clear(), showHidden(), keepState()")
    untouched.wait_for(f"Math.abs({LENGTH}.y_range.end - {both[1]}) < 1e-6")


@pytest.mark.long
def test_what_is_seen_of_a_zoomed_chart_stands_in_the_address(opened):
    low, high = ends(opened, LENGTH)
    x, y = opened.evaluate(f"{PLACE}({LENGTH}, 0.5, {0.5 * (low + high)})")
    opened.drag((x, y), (x, y + 30.0))
    opened.wait_for("location.search.startsWith('?zoom.')")
    moved = ends(opened, LENGTH)
    assert moved[0] > low
    address = opened.evaluate("location.href")
    # Who opens the address sees the same.
    opened.open("about:blank")
    opened.open(address)
    assert ends(opened, LENGTH) == pytest.approx(moved, abs=1e-4)
    opened.evaluate(f"Bokeh.index.find_one({LENGTH}).reset()")
    opened.wait_for("location.search === ''")
    assert ends(opened, LENGTH) == pytest.approx([low, high])


def test_a_click_on_a_dot_opens_the_replay(opened):
    figure = FIGURE % "Time to goal"
    ends(opened, figure)
    dot = f"""(() => {{
      const {{x, y}} = {figure}.renderers[0].data_source.data;
      return [x[0], y[0]];
    }})()"""
    place = tuple(opened.evaluate(f"{PLACE}({figure}, ...{dot})"))
    opened.drag(place, place)
    opened.wait_for("location.pathname.includes('/replays/')")
    assert SCENARIO in opened.evaluate("location.pathname")


def test_every_table_is_had_as_csv(untouched):
    buttons = untouched.evaluate("document.querySelectorAll('button.csv').length")
    assert buttons == untouched.evaluate("document.querySelectorAll('table').length") > 3
    text = untouched.evaluate("csvOf(document.getElementById('trials-table'))")
    header, *rows = text.splitlines()
    assert header.startswith("scenario,controller,trial,seed,outcome,")
    assert len(rows) == 4
    assert rows[0].startswith(f"{SCENARIO},")


def test_a_trial_without_a_replay_is_pointed_at_in_the_table(untouched):
    untouched.evaluate(f"showTrial('{SCENARIO}', 'rpp', 1)")
    told = untouched.evaluate("document.querySelector('.pointed-at')?.textContent")
    assert "drake-navbench replay trials/" in told
    untouched.evaluate("document.querySelector('.pointed-at')?.classList.remove('pointed-at')")


def test_tables_of_a_scenario_stand_behind_its_charts(untouched):
    order = untouched.evaluate(
        "document.querySelector('#scenario-1 .figures').compareDocumentPosition("
        "document.querySelector('#scenario-1 table')) & Node.DOCUMENT_POSITION_FOLLOWING"
    )
    assert order
