"""A trial watched while it runs: followed, with the replay's scene, legend and layers."""

from __future__ import annotations

import sys
import time
from contextlib import nullcontext, suppress
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import urlopen

import pytest
from rich.console import Console

from drake_navbench.analysis.replay.stage import make_meshcat, without_late_texture_warnings
from drake_navbench.campaign import live
from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.campaign.live_server import LiveServer
from drake_navbench.inputs.scenario import load_scenario

sys.path.append(str(Path(__file__).parents[1] / "analysis"))

from browser import CHROMIUM, NO_CHROMIUM, Browser


def test_the_server_tells_when_there_is_another_page():
    with LiveServer() as server:
        server.show("<p>first</p>")
        first = urlopen(f"{server.address}number").read()
        assert urlopen(server.address).read() == b"<p>first</p>"
        server.show("<p>second</p>")
        assert urlopen(server.address).read() == b"<p>second</p>"
        assert urlopen(f"{server.address}number").read() != first


def test_a_texture_that_was_replaced_is_no_news(caplog):
    """A page that lagged behind made over a hundred such lines a minute."""
    meshcat = make_meshcat()
    stranger = f"{meshcat.web_url()}/cas-v1/{64 * '0'}"
    for wanted, is_quiet in ((1, False), (1, True)):
        with without_late_texture_warnings() if is_quiet else nullcontext():
            with suppress(HTTPError):
                urlopen(stranger)
            time.sleep(0.1)
        assert sum("Unknown CAS key" in line for line in caplog.messages) == wanted


@pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM)
def test_the_camera_follows_the_robot_among_the_replays_layers(tmp_path):
    """Two trials of 3 s each, as fast as they go; the second is looked at when it is over."""
    told, looked = [], []

    class Terminal(Console):
        is_terminal = True

        def print(self, text, **options):
            told.append(text)

        def input(self, text):
            with Browser(tmp_path / "profile") as browser:
                look_at(browser, told[0].split()[1])
            looked.append(text)

    scenario = load_scenario("static_obstacles").model_copy(update={"timeout_s": 3.0})
    campaign = plan_campaign([scenario], ["rpp", "mppi_nav2"], trials=1)
    assert live.show_live(campaign, Terminal(), realtime_rate=0.0) is False
    assert looked
    assert any("mppi_nav2, trial 0" in line for line in told)


def look_at(browser, address):
    browser.open(address)
    names = "Array.from(document.querySelectorAll('.name'), (name) => name.textContent)"
    layers = ["driven path", "global plan", "lidar hits", "local costmap", "prediction"]
    assert browser.evaluate(names) == ["mppi_nav2", *layers]
    robot = "viewer.scene_tree.find(['controllers', 'mppi_nav2', 'robot']).object.position.x"
    browser.wait_for(f"{robot} > 0.5")
    browser.wait_for(f"Math.abs(viewer.controls.target.x - {robot}) < 0.01")
    robots = "Object.keys(viewer.scene_tree.find(['controllers']).children)"
    assert browser.evaluate(robots) == ["mppi_nav2"]
    for path in (["controllers", "mppi_nav2", "path"], ["plan"], ["local_costmap"], ["prediction"]):
        browser.wait_for(f"Object.keys(viewer.scene_tree.find({path!r}).children).length > 0")
    browser.screenshot("live")
    browser.evaluate("document.querySelectorAll('#navbench-legend input')[4].click()")
    assert browser.evaluate("viewer.scene_tree.find(['local_costmap']).object.visible") is False
    assert browser.errors == []
