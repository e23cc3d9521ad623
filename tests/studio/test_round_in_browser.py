"""The round of a tuner, with a real mouse: draw, drive, move a slider, drive again, save, run.

Skipped where there is no Chromium. The screenshots are kept, see `browser.artifacts_folder`.
"""

from __future__ import annotations

from dataclasses import replace

import pytest
from browser import CHROMIUM, NO_CHROMIUM, Browser

from drake_navbench.inputs.scenario import load_scenario
from drake_navbench.logs.log import TrialLog
from drake_navbench.run import main as run

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM)

WHERE = """(() => {{
  const view = Bokeh.index.find_one(Bokeh.documents[0].get_model_by_name({name!r}));
  const box = view.el.getBoundingClientRect();
  return [box.x + box.width / 2, box.y + box.height / 2];
}})()"""
# A place of the picture's floor on the screen.
ON_FLOOR = """(() => {{
  const view = Bokeh.index.find_one(Bokeh.documents[0].get_model_by_name("floor"));
  const box = view.el.getBoundingClientRect(), canvas = view.canvas_view.el.getBoundingClientRect();
  return [canvas.x + view.frame.x_scale.compute({x}), canvas.y + view.frame.y_scale.compute({y})];
}})()"""


class Hand:
    """A browser with a studio's page, and a hand on the mouse."""

    def __init__(self, browser: Browser, studio) -> None:
        self.browser, self._studio = browser, studio

    def open(self, page: str) -> None:
        self.browser.open(self._studio.page(page))
        self.browser.wait_for("Bokeh.documents.length && Bokeh.documents[0].is_idle")

    def click(self, name: str) -> None:
        x, y = self.browser.evaluate(WHERE.format(name=name))
        self.browser.drag((x, y), (x, y))

    def take(self, tool: str) -> None:
        self.set("tool", "active", f"m.labels.indexOf({tool!r})")

    def set(self, name: str, field: str, value: str) -> None:
        self.browser.evaluate(
            f"(() => {{ const m = Bokeh.documents[0].get_model_by_name({name!r});"
            f" m.{field} = {value}; }})()"
        )

    def drag(self, begin: tuple[float, float], end: tuple[float, float]) -> None:
        places = [self.browser.evaluate(ON_FLOOR.format(x=x, y=y)) for x, y in (begin, end)]
        self.browser.drag(tuple(places[0]), tuple(places[1]))

    def tap(self, place: tuple[float, float]) -> None:
        x, y = self.browser.evaluate(ON_FLOOR.format(x=place[0], y=place[1]))
        self.browser.drag((x, y), (x, y))

    def wait_text(self, name: str, text: str) -> None:
        self.browser.wait_for(
            f"Bokeh.documents[0].get_model_by_name({name!r}).text.includes({text!r})"
        )


@pytest.fixture
def hand(studio, tmp_path):
    with Browser(tmp_path / "profile") as browser:
        browser.resize(1280, 1000)
        yield Hand(browser, studio)
        assert not browser.errors


def test_a_scenario_is_drawn_driven_tuned_saved_and_run_to_the_same_trial(hand, studio, tmp_path):
    hand.open("scenario")
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
    hand.wait_text("metrics", "since before")
    hand.browser.screenshot("studio-drive")

    hand.open("live")
    hand.wait_text("line", "rpp:lookahead_dist=0.9")
    ours = sorted(studio.logs.glob("drake-navbench-studio-*/*.parquet"))[-1]
    out = studio.folder / "results" / "same"
    column = "rpp:lookahead_dist=0.9"
    arguments = [str(studio.folder / "door.yaml"), "--controllers", column, "--trials", "1"]
    assert (
        run(
            [
                *arguments,
                "--out",
                str(out),
                "--replay",
                "none",
                "--figures",
                "none",
                "--jobs",
                "1",
                "--quiet",
            ]
        )
        == 0
    )
    (theirs,) = out.glob("trials/*/*/*.parquet")
    assert timeless_bytes(ours, tmp_path) == timeless_bytes(theirs, tmp_path)


def timeless_bytes(path, folder) -> bytes:
    """Returns the bytes of a log in which every cycle took no time: that alone may differ."""
    log = TrialLog.read(path)
    zero = dict.fromkeys(("compute_time_ms", "compute_cpu_time_ms"), 0.0)
    replace(log, samples=log.samples.assign(**zero)).write(folder / "timeless.parquet")
    return (folder / "timeless.parquet").read_bytes()
