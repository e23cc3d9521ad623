"""The round of a tuner, with a real mouse: draw, drive, move a slider, drive again, save, run.

Skipped where there is no Chromium. The screenshots are kept, see `browser.artifacts_folder`.
"""

from __future__ import annotations

import time
from dataclasses import replace

import pytest
from browser import CHROMIUM, NO_CHROMIUM, POLL_S, Browser
from hand import Hand

from drake_navbench.commands.main import main
from drake_navbench.inputs.scenario import load_scenario
from drake_navbench.logs.log import TrialLog
from drake_navbench.run import main as run
from drake_navbench.studio.open_scenario import NEW_NAME

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM)

QUIET = ["--replay", "none", "--figures", "none", "--jobs", "1", "--quiet"]


@pytest.fixture
def hand(studio, tmp_path):
    with Browser(tmp_path / "profile") as browser:
        browser.resize(1280, 1000)
        yield Hand(browser, studio)
        assert not browser.errors


def test_a_scenario_is_drawn_driven_tuned_saved_and_run_to_the_same_trial(hand, studio, tmp_path):
    hand.open_scenario("new", NEW_NAME)
    hand.take("Wall")
    hand.drag((2.5, -1.5), (2.5, 1.5))
    hand.wait_text("text", "{type: wall, start: [2.5, -1.5], end: [2.5, 1.5]}")
    hand.take("Door")
    hand.drag((2.5, -0.6), (2.5, 0.6))
    hand.wait_text("text", "{type: wall, start: [2.5, 0.6], end: [2.5, 1.5]}")
    hand.wait_text("faults", "The start is free")
    hand.set("save as", "value", "'door.yaml'")
    hand.click("save")
    hand.wait_text("line", "door.yaml: saved")
    saved = load_scenario(str(studio.folder / "door.yaml"))
    assert [wall.end for wall in saved.world.obstacles] == [(2.5, -0.6), (2.5, 1.5)]

    hand.open("drive")
    hand.browser.wait_for("!!Bokeh.documents[0].get_model_by_name('slider lookahead_dist')")
    hand.click("drive")
    hand.wait_text("line", "rpp: succeeded")
    hand.set("number lookahead_dist", "value", "0.9")
    hand.wait_text("patch", "rpp:lookahead_dist=0.9")
    hand.click("drive")
    hand.wait_text("line", "rpp:lookahead_dist=0.9: succeeded")
    hand.wait_text("metrics", "change from before")
    hand.browser.screenshot("studio-drive")

    hand.open("live")
    hand.wait_text("line", "rpp:lookahead_dist=0.9")
    hand.click("why")
    hand.wait_text("reason", "RPP drives")
    hand.set("time", "value", "2.0")
    hand.wait_text("reason", "why, 1.97 s")
    hand.wait_text("reason", "equal the log to the last bit")
    hand.browser.screenshot("studio-live")

    ours = sorted(studio.logs.glob("drake-navbench-studio-*/*.parquet"))[-1]
    out = studio.folder / "results" / "same"
    column = "rpp:lookahead_dist=0.9"
    arguments = [str(studio.folder / "door.yaml"), "--controllers", column, "--trials", "1"]
    assert run([*arguments, *QUIET, "--out", str(out)]) == 0
    (theirs,) = out.glob("trials/*/*/*.parquet")
    assert timeless_bytes(ours, tmp_path) == timeless_bytes(theirs, tmp_path)


@pytest.mark.long
def test_a_run_is_stopped_resumed_and_repeated_by_its_buttons(hand, studio, tmp_path):
    out = studio.folder / "results" / "old"
    arguments = ["empty", "--controllers", "rpp", "--trials", "2"]
    assert run([*arguments, *QUIET, "--out", str(out)]) == 0
    assert main(["runs", str(out.parent), "--tag", "old", "first"]) == 0
    (out / "trials" / "empty" / "rpp" / "trial_001.parquet").unlink()
    hand.open("runs")
    hand.wait_text("card old", "stopped: 1 of 2 trials")
    hand.wait_text("card old", '<span class="tag">first</span>')
    hand.click("resume old")
    wait_until(lambda: len(list(out.glob("trials/*/*/*.parquet"))) == 2)
    hand.wait_gone("card old", "stopped")
    others = {path.name for path in out.parent.iterdir()}
    hand.click("again old")
    wait_until(lambda: {path.name for path in out.parent.iterdir()} - others)
    (name,) = {path.name for path in out.parent.iterdir()} - others
    hand.browser.wait_for(f"!!Bokeh.documents[0].get_model_by_name('card {name}')")
    wait_until(lambda: len(list((out.parent / name).glob("trials/*/*/*.parquet"))) == 2)
    first, again = (
        [timeless_bytes(log, tmp_path) for log in sorted(path.glob("trials/*/*/*.parquet"))]
        for path in (out, out.parent / name)
    )
    assert first == again


def wait_until(is_so) -> None:
    while not is_so():
        time.sleep(POLL_S)


def timeless_bytes(path, folder) -> bytes:
    """Returns the bytes of a log in which every cycle took no time: that alone may differ."""
    log = TrialLog.read(path)
    zero = dict.fromkeys(("compute_time_ms", "compute_cpu_time_ms"), 0.0)
    replace(log, samples=log.samples.assign(**zero)).write(folder / "timeless.parquet")
    return (folder / "timeless.parquet").read_bytes()
