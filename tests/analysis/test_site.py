"""The built site in Chromium: its search answers, old headings lead on, no other host is asked.

Needs the programs that `make site` installs.
"""

from __future__ import annotations

import functools
import http.server
import json
import os
import subprocess
import sys
import threading
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import quote

import pytest
import yaml
from browser import CHROMIUM, NO_CHROMIUM, Browser

REPOSITORY = Path(__file__).parents[2]
DOCS = REPOSITORY / "docs"
PROGRAMS = REPOSITORY / ".venv-site"
QUESTIONS = yaml.safe_load((REPOSITORY / "tests/site_questions.yaml").read_text(encoding="utf-8"))
PAGES = sorted(path.stem for path in DOCS.glob("*.md") if path.stem not in ("README", "package"))
HITS = 3
FOUND = (
    "[...document.querySelectorAll('.md-search-result__item')].map("
    "item => item.querySelector('a').pathname)"
)
pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM),
    pytest.mark.skipif(not PROGRAMS.is_dir(), reason="`make site` makes .venv-site"),
]


class Quiet(http.server.SimpleHTTPRequestHandler):
    """A server of files that writes no lines."""

    def log_message(self, *_parts):
        """Says nothing."""


@contextmanager
def served(folder):
    """Serves a folder on the loopback; yields the address."""
    handler = functools.partial(Quiet, directory=str(folder))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://localhost:{server.server_address[1]}"
        server.shutdown()


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Yields the address of the site of today's pages."""
    folder = tmp_path_factory.mktemp("site")
    subprocess.run(["make", "--quiet", "package-links"], cwd=REPOSITORY, check=True)
    subprocess.run(
        [PROGRAMS / "bin/mkdocs", "build", "--strict", "--site-dir", folder],
        cwd=REPOSITORY,
        env=os.environ | {"NO_MKDOCS_2_WARNING": "1"},
        check=True,
    )
    with served(folder) as address:
        yield address


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with Browser(tmp_path_factory.mktemp("profile")) as opened:
        yield opened


@pytest.mark.parametrize("question", QUESTIONS, ids=lambda question: question["typed"])
def test_one_of_the_first_three_hits_of_the_search_answers(question, site, browser):
    browser.open(f"{site}/glossary.html?q={quote(question['typed'])}")
    browser.wait_for(f"{FOUND}.length > 0")
    first = [Path(path).stem for path in browser.evaluate(FOUND)[:HITS]]
    assert set(first) & set(question["pages"]), first


@pytest.mark.parametrize("page", ["index", "tutorial", *PAGES])
def test_a_page_is_as_wide_as_a_telephone_and_asks_no_other_host(page, site, browser):
    browser.resize(400, 800)
    browser.requests.clear()
    browser.errors.clear()
    browser.open(f"{site}/{page}.html")
    assert browser.evaluate("document.documentElement.scrollWidth") <= 400
    asked = {address for address in browser.requests if not address.startswith("data:")}
    assert {address for address in asked if not address.startswith(site)} == set()
    assert browser.errors == []


def test_an_old_heading_leads_to_that_of_today(site, browser):
    moved = yaml.safe_load((DOCS / "site/redirects.yaml").read_text(encoding="utf-8"))
    old = "doctor.md#what-it-knows"
    assert moved[old] == "doctor.md#what-the-doctor-knows"
    browser._ask("Page.navigate", url=f"{site}/{old.replace('.md', '.html')}")
    browser.wait_for("location.hash === '#what-the-doctor-knows'")


def test_a_tag_and_today_are_versions_of_the_site(tmp_path, browser):
    clone = tmp_path / "clone"
    subprocess.run(["git", "clone", "--quiet", REPOSITORY, clone], check=True)
    subprocess.run(["git", "-C", clone, "tag", "v0.1.0"], check=True)
    (clone / ".venv-site").symlink_to(PROGRAMS)
    subprocess.run([sys.executable, clone / "studies/site_versions.py"], check=True)
    folder = clone / "build/versions"
    listed = json.loads((folder / "versions.json").read_text(encoding="utf-8"))
    assert [entry["version"] for entry in listed] == ["latest", "v0.1.0"]
    with served(folder) as address:
        browser.open(f"{address}/v0.1.0/ci.html")
        browser.wait_for("document.querySelectorAll('.md-version__link').length === 2")
