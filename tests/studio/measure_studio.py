"""The times of docs/studio.md, in headless Chromium.

To be called with PYTHONPATH=tests/analysis, where the browser's driver is. First page: from the
command to a page that is drawn. A column: from the click on Drive to its trial on the page. Round:
draw a wall with a door, save, drive, move a slider and drive again, without pauses.
"""

from __future__ import annotations

import os
import signal
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import mkdtemp

from browser import Browser
from conftest import Studio
from hand import Hand

REPEATS = 5
COLUMNS = ("rpp", "dwb", "mppi_nav2")
IS_DRAWN = "Bokeh.documents.length && Bokeh.documents[0].is_idle"


def timed(function: Callable[[], object]) -> float:
    began_s = time.perf_counter()
    function()
    return time.perf_counter() - began_s


def tell(name: str, times_s: list[float]) -> None:
    low, middle, high = min(times_s), statistics.median(times_s), max(times_s)
    print(f"{name}: {middle:.2f} s ({low:.2f} to {high:.2f}, {len(times_s)} times)", flush=True)


def begun(folder: Path) -> Studio:
    process = subprocess.Popen(
        [sys.executable, "-m", "drake_navbench", "studio", str(folder), "--no-browser"],
        stdout=subprocess.PIPE,
        text=True,
    )
    return Studio(folder, folder, process.stdout.readline().split()[1], process)


def end(studio: Studio) -> None:
    studio.process.send_signal(signal.SIGINT)
    studio.process.wait()


def first_page(browser: Browser) -> float:
    found: list[Studio] = []

    def begin() -> None:
        found.append(begun(Path(mkdtemp())))
        browser.open(found[0].page("runs"))
        browser.wait_for(IS_DRAWN)

    took_s = timed(begin)
    end(found[0])
    return took_s


def drive(hand: Hand, column: str) -> None:
    """Clicks Drive, and waits for the trial."""
    line = "Bokeh.documents[0].get_model_by_name('line')"
    hand.browser.evaluate(f"void {line}.setv({{text: ''}}, {{sync: false}})")
    hand.click("drive")
    hand.browser.wait_for(f"{line}.text.includes({column + ':'!r})")


def round_of(hand: Hand, number: int) -> None:
    hand.open("scenario")
    hand.set("file", "value", "'new'")
    hand.wait_text("text", "obstacles: []")
    for tool, one, other in (("Wall", (2.5, -1.5), (2.5, 1.5)), ("Door", (2.5, -0.6), (2.5, 0.6))):
        hand.take(tool)
        hand.drag(one, other)
    hand.wait_text("text", "{type: wall, start: [2.5, 0.6], end: [2.5, 1.5]}")
    hand.wait_text("faults", "The start is free")
    hand.set("save as", "value", f"'door_{number}.yaml'")
    hand.click("save")
    hand.wait_text("line", "saved")
    hand.open("drive")
    hand.browser.wait_for("!!Bokeh.documents[0].get_model_by_name('slider lookahead_dist')")
    drive(hand, "rpp")
    lookahead_m = f"0.{7 + number % 2}"
    hand.set("number lookahead_dist", "value", lookahead_m)
    hand.wait_text("patch", f"rpp:lookahead_dist={lookahead_m}")
    drive(hand, f"rpp:lookahead_dist={lookahead_m}")


def main() -> None:
    """Prints the times, and the machine's load before and after."""
    print(f"load {os.getloadavg()[0]:.1f}, {os.cpu_count()} cores")
    with Browser(Path(mkdtemp())) as browser:
        browser.resize(1280, 1000)
        tell("first page", [first_page(browser) for _ in range(REPEATS)])
        studio = begun(Path(mkdtemp()))
        hand = Hand(browser, studio)
        hand.open("drive")
        for column in COLUMNS:
            hand.set("column", "value", f"':{column}'")
            time.sleep(1.0)
            print(f"{column}, first: {timed(lambda name=column: drive(hand, name)):.2f} s")
            tell(column, [timed(lambda name=column: drive(hand, name)) for _ in range(REPEATS)])
        hand.set("column", "value", "':rpp'")
        tell("round", [timed(lambda k=k: round_of(hand, k)) for k in range(REPEATS)])
        end(studio)
    print(f"load {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
