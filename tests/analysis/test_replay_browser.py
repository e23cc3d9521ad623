"""A replay opened from disk in a real browser: it draws, it moves, it needs no network."""

from __future__ import annotations

import html
import json
import re
import subprocess
from pathlib import Path

import pytest
from browser import CHROMIUM, HEADLESS_FLAGS, NO_CHROMIUM
from replay_logs import replay_log, with_diagnostics

from drake_navbench.analysis.replay import write_race_replay, write_trial_replay
from drake_navbench.inputs.robot import load_robot

TIMEOUT_S = 120
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
    done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S, check=True)
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


def test_race_opens_without_errors(race):
    assert race["errors"] == []


def test_race_asks_for_nothing_that_it_does_not_carry(race):
    assert race["refused"] == []


def test_race_is_drawn(race):
    # Floor, grid, sky, box, chairs and paths; a blank canvas has one colour.
    assert race["color_count"] > 100


def test_race_plays_by_itself(race):
    assert race["time_late"] > race["time_early"] > 0.0
    assert race["label"] == "Pause"


def test_race_shows_another_picture_at_another_time(race):
    assert race["moved"] > 100


def test_legend_hides_a_controller_and_shows_it_again(race):
    assert race["hidden"] > 50
    assert race["shown_again"] == 0


def test_trial_with_all_diagnostics_opens_without_errors(tmp_path):
    page = tmp_path / "alone.html"
    write_trial_replay(with_diagnostics(replay_log("mppi")), page, model=MODEL)
    seen = opened(page, tmp_path)
    assert (seen["errors"], seen["refused"]) == ([], [])
    assert seen["moved"] > 100
