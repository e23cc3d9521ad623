"""The report in a real browser: opens from disk, asks nothing of the network, sorts, filters.

Skipped where there is no Chromium. The page is driven by a script appended to a copy of it, whose
findings the browser prints with the document.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
TIMEOUT_S = 120.0

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium")

WATCH_ERRORS = """<script>
window.errors = [];
addEventListener("error", (event) => errors.push(String(event.message || event.target.src)), true);
addEventListener("unhandledrejection", (event) => errors.push(String(event.reason)));
</script>"""

DRIVE = """<script>
addEventListener("load", () => {
  const table = document.getElementById("metrics-table");
  const column = Array.from(table.tHead.rows[0].cells, (c) => c.textContent).indexOf("mean");
  const values = () => Array.from(table.tBodies[0].rows, (r) => r.cells[column].dataset.value);
  const press = () => table.tHead.rows[0].cells[column].querySelector("button").click();
  press();
  const ascending = values();
  press();
  const descending = values();
  const filters = document.querySelector('.filters[data-table="metrics-table"]');
  filters.querySelector("select").value = "own_corridor";
  filters.querySelector("input").value = "min_clearance_m";
  filters.dispatchEvent(new Event("input"));
  const shown = Array.from(table.tBodies[0].rows).filter((r) => !r.hidden).length;
  const images = Array.from(document.images).filter((i) => i.getClientRects().length);
  images.forEach((i) => { i.loading = "eager"; });
  Promise.all(images.map((i) => i.decode().then(() => i.naturalWidth, () => 0))).then((widths) => {
    const found = {
      errors, ascending, descending, shown, widths,
      said: filters.querySelector("output").textContent,
      sort: table.tHead.rows[0].cells[column].getAttribute("aria-sort"),
      urls: Array.from(document.querySelectorAll("[src], link[href]"), (e) => e.src || e.href),
      replay: document.querySelector("a.replay").href,
    };
    const output = document.createElement("pre");
    output.id = "findings";
    output.textContent = JSON.stringify(found);
    document.body.append(output);
  });
});
</script>"""


@pytest.fixture(scope="module")
def findings(reported, tmp_path_factory):
    text = reported.path.read_text(encoding="utf-8")
    text = text.replace("<head>", f"<head>{WATCH_ERRORS}", 1)
    text = text.replace("</body>", f"{DRIVE}</body>", 1)
    page = reported.path.with_name("driven.html")
    page.write_text(text, encoding="utf-8")
    document = subprocess.run(
        [
            CHROMIUM,
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-background-networking",
            "--no-first-run",
            # What the page might still ask of a server would be an error.
            "--host-resolver-rules=MAP * ~NOTFOUND",
            f"--user-data-dir={tmp_path_factory.mktemp('profile')}",
            "--virtual-time-budget=20000",
            "--dump-dom",
            page.as_uri(),
        ],
        capture_output=True,
        text=True,
        timeout=TIMEOUT_S,
        check=True,
    ).stdout
    page.unlink()
    found = re.search(r'<pre id="findings">(.*?)</pre>', document, re.S)
    assert found, "the page's script did not finish"
    return json.loads(
        found.group(1).replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&")
    )


def test_there_are_no_errors_and_every_figure_is_drawn(findings):
    assert findings["errors"] == []
    assert findings["widths"]
    assert min(findings["widths"]) > 0


def test_everything_comes_from_the_disk(findings):
    assert findings["urls"]
    assert all(url.startswith(("file:", "data:")) for url in findings["urls"])


def test_a_click_sorts_by_number_and_another_turns_it_round(findings):
    for name, reverse in (("ascending", False), ("descending", True)):
        filled = [float(value) for value in findings[name] if value]
        assert filled == sorted(filled, reverse=reverse)
        # Empty cells come last in both directions.
        assert findings[name][len(filled) :] == [""] * (len(findings[name]) - len(filled))
        assert len(filled) < len(findings[name])
    assert findings["sort"] == "descending"


def test_filters_leave_the_rows_that_fit(findings):
    # One scenario, one metric, two controllers.
    assert findings["shown"] == 2
    assert findings["said"].startswith("2 of ")


def test_the_replay_link_leads_to_the_file(findings):
    assert findings["replay"].endswith("/replays/own_corridor.html")
