"""A trial watched while it runs: followed, with the replay's scene, legend and layers."""

from __future__ import annotations

import socket
import struct
import sys
import time
from collections.abc import Iterator
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
        # Before the first one, what there is comes again by itself.
        assert b'<meta http-equiv="refresh" content="1">' in urlopen(server.address).read()
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


@pytest.fixture(scope="module")
def shown() -> Iterator[LiveServer]:
    """A server with a page; one for all odd requests, since each takes half a second to end."""
    with LiveServer() as server:
        server.show("<p>page</p>")
        yield server


def status_of(server, request: bytes) -> int:
    """Returns the status that raw bytes are answered with, 0 where there is no answer."""
    port = int(server.address.split(":")[2].strip("/"))
    with socket.create_connection(("127.0.0.1", port), timeout=10.0) as stranger:
        stranger.sendall(request)
        stranger.shutdown(socket.SHUT_WR)
        answer = b"".join(iter(lambda: stranger.recv(4096), b""))
    return int(answer.split()[1]) if answer.startswith(b"HTTP/1.") else 0


def get(path="/", *headers: str) -> bytes:
    return "\r\n".join([f"GET {path} HTTP/1.0", *headers, "", ""]).encode()


@pytest.mark.parametrize(
    ("request_bytes", "status"),
    [
        (get("/", "Host: localhost:8000"), 200),
        (get("/", "Host: 127.0.0.1"), 200),
        (get("/favicon.ico", "Host: 127.0.0.1"), 200),
        (get("/", "Host: [::1]:7"), 200),
        (get("/", "Host: localhost:1", "Origin: http://localhost:1"), 200),
        # A name of somebody else that leads here, and a page of somebody else that asks.
        (get("/", "Host: rebound.example"), 403),
        (get("/", "Host: localhost.example:80"), 403),
        (get("/number", "Host: localhost", "Origin: http://other.example"), 403),
        (get("/number", "Host: localhost:1", "Origin: http://localhost:2"), 403),
        (get("/", "Host: localhost", "Origin: null"), 403),
        (get("/", "Host: localhost", "Host: localhost"), 403),
        (get("/", "Host: [::1"), 403),
        (get("/"), 403),
        (get("/other", "Host: localhost"), 404),
        (get("/cas-v1/../../etc/passwd", "Host: localhost"), 404),
        (get("/cas-v1/%0d%0aX:", "Host: localhost"), 404),
        (get("/cas-v1/\x01", "Host: localhost"), 404),
        (get("/cas-v1/none", "Host: localhost"), 404),
        (get("//@x/cas-v1/", "Host: localhost"), 404),
        (b"POST / HTTP/1.0\r\nHost: localhost\r\n\r\n", 501),
        (b"GET / HTTP/9.x\r\n\r\n", 0),
        (b"\x16\x03\x01\x02\x00\r\n\r\n", 0),
        (b"GET /" + b"a" * 70_000 + b" HTTP/1.0\r\n\r\n", 414),
        (b"", 0),
    ],
)
def test_odd_requests_are_answered_and_print_nothing(request_bytes, status, shown, capfd):
    assert status_of(shown, request_bytes) == status
    # Nobody else is kept from the page.
    assert urlopen(shown.address).read() == b"<p>page</p>"
    assert "".join(capfd.readouterr()) == ""


def test_a_browser_that_leaves_early_prints_nothing(capfd):
    with LiveServer() as server:
        server.show("x" * 10_000_000)
        port = int(server.address.split(":")[2].strip("/"))
        with socket.create_connection(("127.0.0.1", port)) as stranger:
            reset_at_close = struct.pack("ii", 1, 0)
            stranger.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, reset_at_close)
            stranger.sendall(get("/", "Host: localhost"))
            stranger.recv(10)
        assert len(urlopen(server.address).read()) == 10_000_000
    assert "".join(capfd.readouterr()) == ""


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
    assert live.show_live(campaign, Terminal(), live.LiveOptions(0.0, None)) is False
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
