"""A drag over a floor with 200 shapes: the browser draws it, and the server hears of its end."""

from __future__ import annotations

import math
import time

import pytest
from browser import CHROMIUM, NO_CHROMIUM, Browser
from hand import ON_FLOOR, Hand

pytestmark = [pytest.mark.long, pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM)]

MOVES = 150
COUNT_PAINTS = """(() => {
  const view = Bokeh.index.find_one(Bokeh.documents[0].get_model_by_name("floor"));
  const paint = view.paint.bind(view);
  window.paints = window.frames_shown = 0;
  view.paint = (...rest) => { window.paints++; return paint(...rest); };
  (function count() { window.frames_shown++; requestAnimationFrame(count); })();
})()"""


def many_shapes() -> str:
    boxes = (
        f"    - {{type: box, min: [{x:.2f}, {y:.2f}], max: [{x + 0.3:.2f}, {y + 0.3:.2f}]}}"
        for x, y in ((0.9 * (k % 20) - 4.0, k // 20 - 5.0) for k in range(200))
    )
    head = "description: 200 boxes\nstart: [-3.0, 7.0, 0.0]\ngoal: [5.0, 7.0, 0.0]\n"
    return "\n".join([f"{head}world:\n  obstacles:", *boxes, ""])


def test_a_drag_over_200_shapes_is_drawn_by_the_browser_alone(studio, tmp_path):
    (studio.folder / "many.yaml").write_text(many_shapes())
    with Browser(tmp_path / "profile") as browser:
        browser.resize(1280, 1000)
        hand = Hand(browser, studio)
        hand.open("scenario")
        hand.set("file", "value", "'file:many.yaml'")
        hand.wait_text("text", "200 boxes")
        hand.take("Box")
        browser.evaluate(COUNT_PAINTS)
        x, y = browser.evaluate(ON_FLOOR.format(x=0.0, y=6.0))
        browser.move(x, y, is_down=False)
        browser.press(x, y)
        before, began_s = browser.work_s(), time.monotonic()
        for k in range(1, MOVES):
            browser.move(x + 60.0 + 60.0 * math.cos(k / 15), y + 60.0 * math.sin(k / 15))
        took_s = time.monotonic() - began_s
        frames, paints = browser.evaluate("[window.frames_shown, window.paints]")
        work_ms = 1e3 * (browser.work_s() - before) / paints
        print(
            f"frames {frames / took_s:.0f}/s, paints {paints / took_s:.0f}/s, {work_ms:.1f} ms each"
        )
        assert paints > 1
        text = "Bokeh.documents[0].get_model_by_name('text').text"
        assert browser.evaluate(text).count("type: box") == 200
        browser.release(x + 100.0, y + 50.0)
        browser.wait_for(f"{text}.split('type: box').length === 202")
