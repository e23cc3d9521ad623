"""A replay opened from disk in a real browser: it draws, it moves, it needs no network."""

from __future__ import annotations

import html
import json
import re
import subprocess
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from browser import CHROMIUM, HEADLESS_FLAGS, NO_CHROMIUM, Browser
from PIL import Image
from replay_logs import replay_log, with_diagnostics

from drake_navbench.analysis.replay import write_race_replay, write_trial_replay
from drake_navbench.explanation import Explanation
from drake_navbench.inputs.robot import load_robot

MODEL = load_robot("wheelchair").model_path
# Longer than the probe waits; the browser's clock then runs ahead of the wall's.
VIRTUAL_TIME_MS = 3000

# Only what the page itself carries may load; whatever else it asks for is refused and reported.
PROBE_HEAD = """
<meta http-equiv="Content-Security-Policy"
      content="default-src data: blob: 'unsafe-inline' 'unsafe-eval'">
<script>
  const probe = {errors: [], refused: []};
  addEventListener("error", event => probe.errors.push(String(event.message)));
  addEventListener("unhandledrejection", event => probe.errors.push(String(event.reason)));
  addEventListener("securitypolicyviolation", event => probe.refused.push(event.blockedURI));
  console.error = (...words) => probe.errors.push(words.join(" "));
</script>
"""
PROBE_BODY = """
<script>
  function picture() {
    viewer.render();
    const small = document.createElement("canvas");
    [small.width, small.height] = [160, 100];
    const context = small.getContext("2d");
    context.drawImage(viewer.renderer.domElement, 0, 0, small.width, small.height);
    return Array.from(new Uint32Array(context.getImageData(0, 0, 160, 100).data.buffer));
  }
  function differing(a, b) { return a.filter((pixel, k) => pixel !== b[k]).length; }
  function seek(time) {
    const slider = document.querySelector("#navbench-player input");
    slider.value = time;
    slider.dispatchEvent(new Event("input"));
    return picture();
  }
  // Headless browsers may skip frames; asking for one moves the animation to the clock's time.
  function time_now() { viewer.animate(); return viewer.animator.time; }
  function when_loaded(action) {
    viewer.animator.duration > 0 ? action() : setTimeout(when_loaded, 50, action);
  }
  when_loaded(() => setTimeout(() => { probe.time_early = time_now(); }, 200));
  when_loaded(() => setTimeout(() => {
    probe.time_late = time_now();
    probe.label = document.querySelector("#navbench-player button").textContent;
    const early = seek(0.5), late = seek(3.0);
    probe.color_count = new Set(early).size;
    probe.moved = differing(early, late);
    document.querySelector("#navbench-legend input").click();
    probe.hidden = differing(late, picture());
    document.querySelector("#navbench-legend input").click();
    probe.shown_again = differing(late, picture());
    const output = document.createElement("pre");
    output.id = "probe";
    output.textContent = JSON.stringify(probe);
    document.body.append(output);
  }, 600));
</script>
"""

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM)


def opened(page: Path, folder: Path) -> dict:
    """Returns what the probe saw when the browser opened the page from disk."""
    text = page.read_text(encoding="utf-8").replace("<head>", "<head>" + PROBE_HEAD, 1)
    body, end, rest = text.rpartition("</body>")
    probed = folder / "probed.html"
    probed.write_text(body + PROBE_BODY + end + rest, encoding="utf-8")
    command = [
        CHROMIUM,
        *HEADLESS_FLAGS,
        f"--user-data-dir={folder / 'profile'}",
        "--window-size=640,400",
        f"--virtual-time-budget={VIRTUAL_TIME_MS}",
        "--dump-dom",
        probed.as_uri(),
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    found = re.search(r'<pre id="probe">(.*?)</pre>', done.stdout, re.DOTALL)
    assert found, f"the probe did not run: {done.stderr[-500:]}"
    return json.loads(html.unescape(found[1]))


@pytest.fixture(scope="module")
def race(tmp_path_factory):
    folder = tmp_path_factory.mktemp("race")
    page = folder / "race.html"
    logs = [replay_log("dwb"), replay_log("rpp", speed_mps=0.3)]
    write_race_replay(logs, page, model=MODEL)
    return opened(page, folder)


@pytest.mark.long
def test_a_race_that_may_load_nothing_is_drawn_plays_by_itself_and_hides_a_controller(race):
    assert (race["errors"], race["refused"]) == ([], [])
    # Floor, grid, sky, box, chairs and paths; a blank canvas has one colour.
    assert race["color_count"] > 100
    assert race["time_late"] > race["time_early"] > 0.0
    assert race["label"] == "Pause"
    assert race["moved"] > 100
    assert race["hidden"] > 50
    assert race["shown_again"] == 0


def test_trial_with_all_diagnostics_opens_without_errors(tmp_path):
    page = tmp_path / "alone.html"
    write_trial_replay(with_diagnostics(replay_log("mppi")), page, model=MODEL)
    seen = opened(page, tmp_path)
    assert (seen["errors"], seen["refused"]) == ([], [])
    assert seen["moved"] > 100


class Told(NamedTuple):
    """A decision with its reasons."""

    time_s: float
    explanation: Explanation
    assurance: tuple[str, ...] = ("Recomputed.",)


def told(time_s, sentence, cost) -> Told:
    columns = ("critic", "chosen")
    return Told(time_s, Explanation(None, sentence, columns, (("CostCritic", cost),)))


@pytest.fixture(scope="module")
def tab(tmp_path_factory):
    """A browser in which a race is open: one robot arrives, the other gives up after 2 s."""
    folder = tmp_path_factory.mktemp("tab")
    page = folder / "race.html"
    failure = {"reason": "no valid control"}
    logs = [
        replay_log("dwb"),
        replay_log("rpp", speed_mps=0.3, outcome="aborted", end_time_s=2.0, info=failure),
    ]
    reasons = {"rpp": [told(0.0, "It starts.", 0.1), told(1.0, "<b>It turns.</b>", 0.25)]}
    write_race_replay(logs, page, model=MODEL, reasons=reasons)
    with Browser(folder / "profile") as browser:
        browser.open(page.as_uri() + "#t=1")
        browser.wait_for("viewer.animator.duration > 0 && !viewer.animator.playing")
        yield browser
        assert browser.errors == []


def press_space(tab, focused):
    tab.evaluate(
        f"""(() => {{
          const element = document.querySelector({focused!r});
          element.focus();
          const say = (type) => element.dispatchEvent(new KeyboardEvent(type,
            {{code: "Space", key: " ", bubbles: true, cancelable: true}}));
          say("keydown");
          say("keyup");
        }})()"""
    )


def test_what_is_open_is_drawn_and_asks_for_nothing_that_it_does_not_carry(tab):
    pixels = np.asarray(Image.open(tab.screenshot("replay")).convert("RGB"))
    # Floor, grid, sky, box, chairs and paths; a blank canvas has one colour.
    assert len(np.unique(pixels.reshape(-1, 3), axis=0)) > 100
    assert tab.requests
    assert [url for url in tab.requests if not url.startswith(("file:", "data:", "blob:"))] == []


def test_the_legend_hides_a_controller_and_shows_it_again(tab):
    for is_shown in (False, True):
        tab.evaluate("document.querySelector('#navbench-legend input').click()")
        assert visible(tab, "/controllers/dwb") is is_shown


@pytest.mark.parametrize("focused", ["body", ".play", ".speed", "#navbench-legend input", "input"])
def test_the_space_bar_plays_whatever_has_the_focus(tab, focused):
    # Far from the end, at which it stops by itself.
    seek(tab, 0.2)
    playing = tab.evaluate("viewer.animator.playing")
    press_space(tab, focused)
    assert tab.evaluate("viewer.animator.playing") is not playing
    press_space(tab, focused)
    assert tab.evaluate("viewer.animator.playing") is playing


def select(tab, selector, value):
    tab.evaluate(
        f"""(() => {{
          const element = document.querySelector({selector!r});
          element.value = {value!r};
          element.dispatchEvent(new Event("change", {{bubbles: true}}));
        }})()"""
    )


def seek(tab, time_s):
    tab.evaluate(
        f"""(() => {{
          const slider = document.querySelector("#navbench-player input");
          slider.value = {time_s};
          slider.dispatchEvent(new Event("input"));
        }})()"""
    )
    tab.wait_for(f"Math.abs(viewer.animator.time - {time_s}) < 0.02")


CAMERA = "viewer.camera.position.toArray()"
TARGET = "viewer.controls.target.toArray()"


def test_the_camera_follows_the_chosen_robot_and_comes_back(tab):
    seek(tab, 1.0)
    free = tab.evaluate(CAMERA)
    select(tab, ".camera", "follow")
    # At 0.5 m/s after 1 s; three.js's y points up.
    tab.wait_for(f"Math.abs({TARGET}[0] - 0.5) < 0.05")
    seek(tab, 3.0)
    tab.wait_for(f"Math.abs({TARGET}[0] - 1.5) < 0.05")
    tab.screenshot("replay-follow")
    select(tab, ".camera", "top")
    x, height, _ = tab.evaluate(CAMERA)
    assert x == pytest.approx(tab.evaluate(TARGET)[0])
    assert height > 2.0
    tab.screenshot("replay-top")
    select(tab, ".camera", "free")
    assert tab.evaluate(CAMERA) == pytest.approx(free, abs=1e-3)


def test_the_failure_is_one_click_away(tab):
    assert tab.evaluate("document.querySelectorAll('.jump').length") == 1
    tab.click(".jump")
    tab.wait_for("Math.abs(viewer.animator.time - 1) < 0.02")
    assert tab.evaluate("document.querySelectorAll('.choose')[1].ariaPressed") == "true"
    assert tab.evaluate("document.querySelector('.failure').hidden") is False
    tab.click(".choose")
    assert tab.evaluate("document.querySelector('.failure').hidden") is True


def visible(tab, path):
    segments = [part for part in path.split("/") if part]
    return tab.evaluate(f"viewer.scene_tree.find({segments!r}).object.visible")


def test_only_the_chosen_robots_costmap_is_shown(tab):
    tab.evaluate("document.querySelectorAll('.choose')[1].click()")
    assert visible(tab, "/local_costmap/rpp")
    assert not visible(tab, "/local_costmap/dwb")
    tab.evaluate("document.querySelectorAll('.choose')[0].click()")
    assert visible(tab, "/local_costmap/dwb")
    assert not visible(tab, "/local_costmap/rpp")


def test_robots_that_overlap_are_set_apart(tab):
    height = "viewer.scene_tree.find(['controllers', 'rpp']).object.position.z"
    assert tab.evaluate(height) == 0
    select(tab, ".robots select", "apart")
    assert tab.evaluate(height) > 1.0
    tab.screenshot("replay-apart")
    select(tab, ".robots select", "ghosts")
    assert tab.evaluate(height) == 0


def test_the_speed_is_the_animations(tab):
    select(tab, ".speed", "4")
    assert tab.evaluate("viewer.animator.mixer.timeScale") == 4
    select(tab, ".speed", "1")


def test_the_strip_shows_the_moment_and_takes_a_click(tab):
    seek(tab, 1.0)
    tab.evaluate(
        """(() => {
          const strip = document.querySelector("#navbench-strip");
          const box = strip.getBoundingClientRect();
          const x = box.right - 12;
          strip.setPointerCapture = () => {};
          strip.dispatchEvent(new PointerEvent("pointerdown", {clientX: x, clientY: box.top + 5}));
        })()"""
    )
    tab.wait_for("Math.abs(viewer.animator.time - viewer.animator.duration) < 0.02")
    # The view ends where the dock begins.
    low, top = tab.evaluate(
        """[viewer.renderer.domElement.getBoundingClientRect().bottom,
            document.querySelector("#navbench-dock").getBoundingClientRect().top]"""
    )
    assert low == pytest.approx(top, abs=1.0)


def test_the_reasons_are_those_of_the_chosen_robot_at_the_shown_time(tab):
    panel = "document.querySelector('#navbench-why')"
    choices = "document.querySelectorAll('.choose')"
    tab.evaluate(f"{choices}[0].click()")
    assert tab.evaluate(f"{panel}.hidden")
    tab.evaluate(f"{choices}[1].click()")
    seek(tab, 0.99)
    tab.wait_for(f"{panel}.innerText.includes('It starts.')")
    seek(tab, 1.0)
    tab.wait_for(f"{panel}.innerText.includes('<b>It turns.</b>')")
    assert tab.evaluate(f"{panel}.querySelector('tr:last-child').innerText") == "CostCritic\t0.25"
    tab.evaluate(f"{choices}[0].click()")


@pytest.mark.parametrize(("width", "height", "is_dark"), [(1280, 800, True), (390, 844, False)])
def test_it_fits_the_window(tab, width, height, is_dark):
    tab.resize(width, height, is_dark=is_dark)
    tab.wait_for(f"viewer.renderer.domElement.clientWidth === {width}")
    assert tab.evaluate("document.documentElement.scrollWidth") <= width
    boxes = tab.evaluate(
        """Array.from(document.querySelectorAll("#navbench-player > *:not([hidden])"),
          (element) => element.getBoundingClientRect().right)"""
    )
    assert max(boxes) <= width
    tab.screenshot(f"replay-{width}-{'dark' if is_dark else 'light'}")
    tab.restore()


@pytest.mark.parametrize(
    ("height", "is_open"), [(544, False), pytest.param(900, True, marks=pytest.mark.long)]
)
def test_a_small_window_shows_the_robot_before_the_legend(tab, height, is_open):
    # An embedded replay of the doctor's page is 544 pixels high.
    page = tab.evaluate("location.pathname")
    tab.resize(1000, height)
    tab.open(f"file://{page}?height={height}")
    assert tab.evaluate("document.querySelector('#navbench-legend').open") is is_open
    tab.restore()
