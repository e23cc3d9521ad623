"""What goes wrong beside a page is a line on it: no way, a changed file, markup, a closed tab."""

from __future__ import annotations

import pytest
from browser import CHROMIUM, NO_CHROMIUM, Browser
from hand import Hand

pytestmark = [pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM), pytest.mark.long]

ROOM = """\
description: {words}
world:
  obstacles:
    - {{type: wall, start: [2.5, -1.5], end: [2.5, 1.5]}}
start: [0.0, 0.0, 0.0]
goal: [5.0, 0.0, 0.0]
"""


@pytest.fixture(scope="module")
def hand(studio, tmp_path_factory):
    with Browser(tmp_path_factory.mktemp("profile")) as browser:
        browser.resize(1280, 1000)
        yield Hand(browser, studio)
        assert not browser.errors


def open_room(hand: Hand, studio, name: str, words: str = "") -> None:
    (studio.folder / f"{name}.yaml").write_text(ROOM.format(words=words or f"A wall, {name}"))
    hand.open_scenario(f"file:{name}.yaml", f"{name}.yaml")
    hand.wait_text("text", name)


def test_a_drawing_without_a_way_is_told_by_the_check_and_by_the_drive(hand, studio):
    open_room(hand, studio, "no_way")
    hand.wait_text("faults", "The start is free")
    hand.take("Box")
    # A ring of walls round the goal, with no door.
    for begin, end in (
        ((3.7, -1.3), (6.3, -1.1)),
        ((3.7, 1.1), (6.3, 1.3)),
        ((3.7, -1.3), (3.9, 1.3)),
        ((6.1, -1.3), (6.3, 1.3)),
    ):
        hand.drag(begin, end)
    hand.wait_text("faults", "no way to [5.0, 0.0]")
    hand.open("drive")
    hand.browser.wait_for("!!Bokeh.documents[0].get_model_by_name('slider lookahead_dist')")
    hand.click("drive")
    hand.wait_text("line", "goal: not reachable")
    hand.browser.screenshot("studio-no-way")


def test_a_file_that_has_changed_on_disk_is_told_and_not_overwritten(hand, studio):
    open_room(hand, studio, "changed")
    theirs = ROOM.format(words="Somebody else's")
    (studio.folder / "changed.yaml").write_text(theirs)
    hand.wait_text("line", "changed.yaml: has changed on disk since it was opened")
    hand.take("Box")
    hand.drag((0.5, 0.8), (1.0, 1.2))
    hand.wait_text("text", "type: box")
    hand.click("save")
    hand.wait_text("line", "nothing was overwritten, give another name")
    assert (studio.folder / "changed.yaml").read_text() == theirs
    hand.set("save as", "value", "'ours.yaml'")
    hand.click("save")
    hand.wait_text("line", "ours.yaml: saved")
    assert "type: box" in (studio.folder / "ours.yaml").read_text()


def test_markup_in_a_file_is_text_on_the_page(hand, studio):
    words = "<img src=x onerror='window.bad = 1'> markup <script>window.bad = 2</script>"
    open_room(hand, studio, "markup", words=f'"{words}"')
    text = "Bokeh.documents[0].get_model_by_name('text')"
    hand.browser.wait_for(f"{text}.text.includes('&lt;img src=x')")
    shown = f"Bokeh.index.find_one({text}).el.shadowRoot"
    hand.browser.wait_for(f"{shown}.textContent.includes('<img src=x')")
    assert hand.browser.evaluate(f"{shown}.querySelectorAll('img, script').length") == 0
    assert hand.browser.evaluate("window.bad === undefined")


def test_a_trial_whose_tab_was_closed_is_there_when_the_page_is_opened_again(hand, studio):
    open_room(hand, studio, "closed")
    hand.open("drive")
    hand.browser.wait_for("!!Bokeh.documents[0].get_model_by_name('slider lookahead_dist')")
    hand.set("number lookahead_dist", "value", "0.77")
    hand.wait_text("patch", "rpp:lookahead_dist=0.77")
    hand.click("drive")
    hand.browser.wait_for("Bokeh.documents[0].get_model_by_name('drive').disabled")
    hand.browser.open("about:blank")
    hand.open("drive")
    hand.wait_text("metrics", "rpp:lookahead_dist=0.77")
    hand.click("drive")
    hand.wait_text("line", "rpp:lookahead_dist=0.77: ")
    # With the preset's own value it is no change, and other tests have the column as it was.
    hand.set("number lookahead_dist", "value", "0.6")
    hand.wait_gone("patch", "lookahead_dist")
