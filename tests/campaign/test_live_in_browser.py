"""The controls of `run --live` with a real mouse: pause, restart, a slider; a closed browser."""

from __future__ import annotations

import subprocess
import sys
import time

import pytest
from browser import CHROMIUM, NO_CHROMIUM, Browser

pytestmark = [pytest.mark.long, pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM)]

WAIT_S = 60
PAUSE, RESTART, SPEED = "pause / go on", "restart", "max_linear_vel [m/s]"
ROW = (
    "Array.from(document.querySelectorAll('.dg .property-name')).find(e => e.textContent === {!r})"
)
X = "viewer.scene_tree.find(['controllers', 'rpp', 'robot']).object.position.x"


def click(browser, name: str) -> None:
    browser.wait_for(f"!!{ROW.format(name)}")
    x, y = browser.evaluate(
        f"""(() => {{ const row = {ROW.format(name)}; row.scrollIntoView({{block: "center"}});
          const box = row.getBoundingClientRect();
          return [box.x + box.width / 2, box.y + box.height / 2]; }})()"""
    )
    browser.drag((x, y), (x, y))


def wait_still(browser) -> float:
    """Waits until the robot stands; returns where."""
    before = None
    while (now := browser.evaluate(X)) != before:
        before = now
        time.sleep(0.5)
    return now


def test_pause_restart_slider_and_a_closed_browser(tmp_path):
    with Browser(tmp_path / "profile") as browser:
        command = ["run", "static_obstacles", "--controllers", "rpp", "--trials", "1", "--live"]
        options = ["--live-wait", str(WAIT_S), "--out", str(tmp_path / "out")]
        process = subprocess.Popen(
            [sys.executable, "-m", "drake_navbench", *command, *options],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        address = process.stdout.readline().split()[1]
        browser.open(address.replace("127.0.0.1", "localhost"))
        browser.wait_for(f"{X} > 0.5")
        click(browser, PAUSE)
        stood = wait_still(browser)
        click(browser, PAUSE)
        browser.wait_for(f"{X} > {stood} + 0.2")
        browser.evaluate(
            f"viewer.gui.__controllers.find(c => c.property === {SPEED!r}).setValue(0.2)"
        )
        browser.screenshot("live-controls")
        click(browser, RESTART)
        browser.wait_for(f"{X} < {stood}")
        assert browser.errors == []
    _, faults = process.communicate(timeout=20 * WAIT_S)
    assert process.returncode == 2
    (line,) = faults.splitlines()
    assert f"within {WAIT_S} s" in line
    assert not list((tmp_path / "out").glob("trials/*/*/*.parquet"))
