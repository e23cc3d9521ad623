"""Drawing with a real mouse: clicks and drags of each tool, and a drag over 200 shapes."""

from __future__ import annotations

import math
import time

import pytest
import yaml
from browser import CHROMIUM, NO_CHROMIUM, Browser
from hand import ON_FLOOR, Hand

from drake_navbench.studio.open_scenario import NEW_NAME

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM)

MOVES = 150
COUNT_PAINTS = """(() => {
  const view = Bokeh.index.find_one(Bokeh.documents[0].get_model_by_name("floor"));
  const paint = view.paint.bind(view);
  window.paints = window.frames_shown = 0;
  view.paint = (...rest) => { window.paints++; return paint(...rest); };
  (function count() { window.frames_shown++; requestAnimationFrame(count); })();
})()"""


@pytest.fixture
def hand(studio, tmp_path):
    with Browser(tmp_path / "profile") as browser:
        browser.resize(1280, 1000)
        hand = Hand(browser, studio)
        hand.open_scenario("new", NEW_NAME)
        yield hand
        assert not browser.errors


@pytest.mark.long
def test_each_click_and_each_drag_is_heard_once(hand, studio):
    """No step waits for the one before: quick clicks are no double click unless on one place."""
    for tool, begin, end in (
        ("Wall", (2.5, -1.5), (2.5, 1.5)),
        ("Door", (2.5, -0.6), (2.5, 0.6)),
        ("Box", (3.5, 0.8), (4.0, 1.4)),
        ("Start", (0.5, 0.0), (1.5, 0.0)),
        ("Waypoint", (3.0, 0.0), (3.0, 0.8)),
        ("Goal", (4.0, 0.0), (4.8, 0.0)),
    ):
        hand.take(tool)
        hand.drag(begin, end)
    hand.take("Goal")
    hand.tap((4.5, 0.0))
    hand.take("Person")
    for place in ((1.0, -1.0), (2.0, -1.0), (2.0, -1.5), (2.0, -1.5)):
        hand.tap(place)
    # The way has ended. Another one, by a button that stays down, and by a hand that is not still.
    hand.hold((1.0, 1.0), 0.5)
    hand.hold((2.0, 1.0), 0.5)
    hand.drag((2.0, 1.5), (2.05, 1.5))
    hand.take("Cart")
    for place in ((3.0, -1.0), (4.0, -1.0)):
        hand.tap(place)
    hand.wait_text("text", "moving_obstacles")
    hand.set("save as", "value", "'clicks.yaml'")
    hand.click("save")
    hand.wait_text("line", "clicks.yaml: saved")
    saved = yaml.safe_load((studio.folder / "clicks.yaml").read_text())
    assert saved["start"] == [0.5, 0.0, 0.0]
    assert saved["waypoints"] == [[3.0, 0.0, pytest.approx(math.pi / 2, abs=1e-3)]]
    assert saved["goal"] == [4.5, 0.0, 0.0]
    assert saved["world"]["obstacles"] == [
        {"type": "wall", "start": [2.5, -1.5], "end": [2.5, -0.6]},
        {"type": "wall", "start": [2.5, 0.6], "end": [2.5, 1.5]},
        {"type": "box", "min": [3.5, 0.8], "max": [4.0, 1.4]},
    ]
    assert saved["world"]["people"]["persons"] == [
        {"start": [1.0, -1.0], "goals": [[2.0, -1.0], [2.0, -1.5]]},
        {"start": [1.0, 1.0], "goals": [[2.0, 1.0], [2.0, 1.5]]},
    ]
    (cart,) = saved["world"]["moving_obstacles"]
    # 1 m at 0.5 m/s.
    assert [(knot["time_s"], knot["position"]) for knot in cart["waypoints"]] == [
        (0.0, [3.0, -1.0]),
        (2.0, [4.0, -1.0]),
    ]


def many_shapes() -> str:
    boxes = (
        f"    - {{type: box, min: [{x:.2f}, {y:.2f}], max: [{x + 0.3:.2f}, {y + 0.3:.2f}]}}"
        for x, y in ((0.9 * (k % 20) - 4.0, k // 20 - 5.0) for k in range(200))
    )
    head = "description: 200 boxes\nstart: [-3.0, 7.0, 0.0]\ngoal: [5.0, 7.0, 0.0]\n"
    return "\n".join([f"{head}world:\n  obstacles:", *boxes, ""])


@pytest.mark.long
def test_a_drag_over_200_shapes_is_drawn_by_the_browser_alone(hand, studio):
    (studio.folder / "many.yaml").write_text(many_shapes())
    hand.open("scenario")
    browser = hand.browser
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
    print(f"frames {frames / took_s:.0f}/s, paints {paints / took_s:.0f}/s, {work_ms:.1f} ms each")
    assert paints > 1
    text = "Bokeh.documents[0].get_model_by_name('text').text"
    assert browser.evaluate(text).count("type: box") == 200
    browser.release(x + 100.0, y + 50.0)
    browser.wait_for(f"{text}.split('type: box').length === 202")
