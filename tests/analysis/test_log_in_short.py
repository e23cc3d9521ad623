"""How a log shows itself at a prompt and in a notebook."""

from __future__ import annotations

from pathlib import Path

from synthetic_logs import straight_log

from drake_navbench.analysis.notebook import ReplayPage


def test_a_log_is_one_short_line_at_a_prompt():
    text = repr(straight_log(info={"controller": "rpp", "reason": "x\n" * 500}))
    assert text.startswith("TrialLog(scenario=")
    assert "controller=rpp" in text
    assert "\n" not in text
    assert len(text) < 400


def test_in_a_notebook_it_is_a_small_table_and_names_are_text():
    html = straight_log(info={"controller": "<b>", "reason": "goal reached"})._repr_html_()
    assert html.startswith("<table>")
    assert "<tr><th>controller</th><td>&lt;b&gt;</td></tr>" in html
    assert len(html) < 1000


def test_the_address_of_a_replay_is_quoted_and_its_name_is_text():
    shown = ReplayPage(Path("run #2/50%<.html"))._repr_html_()
    assert 'src="run%20%232/50%25%3C.html"' in shown
    assert ">run #2/50%&lt;.html</a>" in shown
