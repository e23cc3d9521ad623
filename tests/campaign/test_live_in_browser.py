"""The controls of `run --live` with a real mouse: pause, restart, sliders; a closed browser."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

import pytest

from drake_navbench.logs.log import TrialLog

sys.path.append(str(Path(__file__).parents[1] / "analysis"))

from browser import CHROMIUM, NO_CHROMIUM, Browser

pytestmark = [pytest.mark.long, pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM)]

# For a browser on a busy machine.
WAIT_S = 30
PAUSE, RESTART = "pause / go on", "restart"
PACE, SPEED = "speed [times real time]", "max_linear_vel [m/s]"
ROW = (
    "Array.from(document.querySelectorAll('.dg .property-name')).find(e => e.textContent === {!r})"
)
X = "viewer.scene_tree.find(['controllers', 'rpp', 'robot']).object.position.x"


@pytest.fixture
def browser(tmp_path):
    with Browser(tmp_path / "profile") as browser:
        # Small, since the machine's processor draws it.
        browser.resize(640, 480)
        yield browser


def watched(browser, out):
    """Begins a watched trial and opens its page at once, before its scene is made."""
    words = f"-m drake_navbench run empty --controllers rpp --trials 1 --live --live-wait {WAIT_S}"
    process = subprocess.Popen(
        [sys.executable, *words.split(), "--out", out],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    browser.open(process.stdout.readline().split()[1].replace("127.0.0.1", "localhost"))
    return process


def click(browser, name: str) -> None:
    browser.wait_for(f"!!{ROW.format(name)}")
    x, y = browser.evaluate(
        f"""(() => {{ const row = {ROW.format(name)}; row.scrollIntoView({{block: "center"}});
          const box = row.getBoundingClientRect();
          return [box.x + box.width / 2, box.y + box.height / 2]; }})()"""
    )
    browser.drag((x, y), (x, y))


def set_slider(browser, name: str, value: float) -> None:
    browser.wait_for(f"!!{ROW.format(name)}")
    browser.evaluate(
        f"void viewer.gui.__controllers.find(c => c.property === {name!r}).setValue({value})"
    )


def wait_still(browser) -> float:
    """Waits until the robot stands; returns where."""
    before = None
    while (now := browser.evaluate(X)) != before:
        before = now
        time.sleep(0.5)
    return now


def is_late_costmap(error: str) -> bool:
    """Whether a slow browser asked for a costmap that was replaced meanwhile."""
    return "404" in error or "THREE.GLTFLoader" in error


def test_a_trial_is_paused_begun_again_and_driven_at_the_sliders_speed(browser, tmp_path):
    process = watched(browser, str(tmp_path / "out"))
    # So slow that a busy browser clicks before the robot arrives.
    set_slider(browser, PACE, 0.1)
    browser.wait_for(f"{X} > 0.3")
    click(browser, PAUSE)
    stood = wait_still(browser)
    browser.screenshot("live-controls")
    click(browser, PAUSE)
    browser.wait_for(f"{X} > {stood} + 0.1")
    set_slider(browser, SPEED, 0.3)
    click(browser, RESTART)
    browser.wait_for(f"{X} < {stood}")
    set_slider(browser, PACE, 5.0)
    _, faults = process.communicate()
    assert (process.returncode, faults) == (0, "")
    assert not list((tmp_path / "out").glob("trials/*/*/*.parquet"))
    log = TrialLog.read(tmp_path / "out" / "changed_live" / "empty" / "rpp" / "trial_000.parquet")
    # A restart keeps the sliders: the speed is that of the first cycle, at 0.02 s, on.
    assert log.info["live_changes"] == [
        {"time_s": pytest.approx(0.02), "name": "max_linear_vel", "value": 0.3}
    ]
    assert log.samples["command_v_mps"].max() == 0.3
    assert [error for error in browser.errors if not is_late_costmap(error)] == []


def test_a_closed_browser_is_one_line(browser, tmp_path):
    process = watched(browser, str(tmp_path / "out"))
    browser.wait_for(f"{X} > 0.2")
    browser.open("about:blank")
    _, faults = process.communicate()
    assert process.returncode == 2
    (line,) = faults.splitlines()
    assert f"did not come back within {WAIT_S} s" in line
