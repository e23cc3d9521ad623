"""A studio answers on loopback, behind its token, under its own names, and nobody else."""

from __future__ import annotations

import http.client
import socket
from urllib.parse import urlsplit

import pytest

from drake_navbench.commands import studio as command


def status(studio, path: str, **headers: str) -> int:
    return answer(studio, path, **headers).status


def answer(studio, path: str, **headers: str) -> http.client.HTTPResponse:
    parts = urlsplit(studio.address)
    connection = http.client.HTTPConnection(parts.hostname, parts.port, timeout=60)
    connection.request("GET", path, headers={"Host": parts.netloc, **headers})
    found = connection.getresponse()
    found.content = found.read()
    connection.close()
    return found


def path_of(studio, name: str) -> str:
    return f"{urlsplit(studio.address).path.rpartition('/')[0]}/{name}"


def test_the_first_page_needs_the_token(studio):
    assert status(studio, path_of(studio, "runs")) == 200
    for path in ("/", "/runs", "/wrong-token/runs", "/static/js/bokeh.min.js"):
        assert status(studio, path) == 404


@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "evil.example"},
        {"Host": "127.0.0.1:1"},
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
    ],
)
def test_another_name_or_origin_is_refused(studio, headers):
    for name in ("runs", "static/js/bokeh.min.js", "runs/ws", "file/turtlebot3_waffle.yaml"):
        assert status(studio, path_of(studio, name), **headers) == 403


def test_only_pages_inside_the_folder_are_served_and_they_run_as_nobodys(studio):
    (studio.folder / "results").mkdir(exist_ok=True)
    (studio.folder / "results" / "report.html").write_text("<p>report</p>")
    (studio.folder / "results" / "out.html").symlink_to("/etc/hostname")
    found = answer(studio, path_of(studio, "file/results/report.html"))
    assert (found.status, found.content) == (200, b"<p>report</p>")
    assert found.getheader("Content-Security-Policy").startswith("sandbox allow-scripts")
    for name in (
        "turtlebot3_waffle.yaml",
        "results/out.html",
        "../../etc/passwd",
        "..%2f..%2f..%2f..%2fetc%2fhostname",
        "results/none.html",
    ):
        assert status(studio, path_of(studio, f"file/{name}")) == 404


def test_nothing_listens_beyond_loopback(studio):
    parts = urlsplit(studio.address)
    with socket.socket() as other:
        # Any other address of loopback stands for one of a network card.
        assert other.connect_ex(("127.0.0.2", parts.port)) != 0


def test_a_second_studio_and_a_taken_port_end_in_one_line(studio, tmp_path, capsys):
    assert command.main([str(studio.folder), "--no-browser"]) == 2
    port = urlsplit(studio.address).port
    assert capsys.readouterr().err.splitlines() == [
        f"{studio.folder}: a studio is open on it (process {studio.process.pid}, "
        f"http://127.0.0.1:{port}); close that one first"
    ]
    assert command.main([str(tmp_path), "--no-browser", "--port", str(port)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"--port {port}: cannot be used (Address already in use)")


def test_a_folder_that_is_none_ends_in_one_line(tmp_path, capsys):
    assert command.main([str(tmp_path / "none")]) == 2
    assert capsys.readouterr().err == f"{tmp_path / 'none'}: no such folder\n"
