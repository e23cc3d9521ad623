"""Why a controller decided as it did: the trial is driven again, and equals its log."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from drake_navbench.campaign.logged_trial import logged_trial
from drake_navbench.commands.main import main
from drake_navbench.commands.why import WIDTH, table_lines
from drake_navbench.explanation import Explanation
from drake_navbench.logs.header import METADATA_KEY
from drake_navbench.trial.trial import run_trial
from drake_navbench.trial.why import whole_why

AT_S = 1.0


@pytest.fixture(scope="module")
def rpp_log():
    return run_trial("one_obstacle", "rpp", 3)


@pytest.fixture
def path(rpp_log, tmp_path):
    rpp_log.write(tmp_path / "log.parquet")
    return tmp_path / "log.parquet"


def asked(path, capsys, at=AT_S):
    """The status and what was printed: the answer's lines, and those of a fault."""
    status = main(["why", str(path), "--at", str(at)])
    printed = capsys.readouterr()
    return status, printed.out.splitlines(), printed.err.splitlines()


def with_header(path, **changes):
    """The log with other values in its header."""
    table = pq.read_table(path)
    header = json.loads(table.schema.metadata[METADATA_KEY]) | changes
    pq.write_table(table.replace_schema_metadata({METADATA_KEY: json.dumps(header).encode()}), path)
    return path


def test_the_reasons_of_a_logged_command(path, rpp_log, capsys):
    status, lines, faults = asked(path, capsys)
    assert (status, faults) == (0, [])
    text = " ".join(lines)
    row = rpp_log.samples[rpp_log.samples["time_s"] >= AT_S].iloc[0]
    assert lines[0].startswith("rpp at 0.97 s, control cycle 20: RPP drives")
    assert f"drives {row['command_v_mps']:.3g} m/s" in text
    # Samples every 0.02 s from 0 to 1.02 s.
    assert "command and all 52 samples up to then equal the log to the last bit." in text
    assert max(map(len, lines)) <= WIDTH


@pytest.mark.long
def test_every_decision_is_in_the_replay_that_is_asked_for_it(path, rpp_log, capsys):
    assert main(["replay", str(path), "--why"]) == 0
    page = path.with_suffix(".html").read_text(encoding="utf-8")
    (data,) = re.findall(r'id="navbench-data">(.*?)</script>', page)
    reasons = json.loads(data)["robots"][0]["reasons"]
    assert len(reasons) == rpp_log.samples["cycle_count"].max()
    at = next(entry for entry in reversed(reasons) if entry["time"] <= AT_S)
    _, lines, _ = asked(path, capsys)
    assert at["sentence"] in " ".join(lines)
    assert all(entry["notes"][-1].endswith("to the last bit.") for entry in reasons)


def test_decisions_before_the_first_difference_are_certain(rpp_log):
    samples = rpp_log.samples.copy()
    samples.loc[100, "command_v_mps"] += 1e-9
    log = replace(rpp_log, samples=samples)
    decisions = whole_why(logged_trial(log, Path("log.parquet")), log).decisions
    # Sample 100 is the one of 2 s; a sample of 0.02 s after a cycle is compared, too.
    doubtful = [entry.time_s for entry in decisions if entry.doubt]
    assert min(doubtful) == pytest.approx(2.0, abs=0.05)
    assert len(doubtful) == sum(entry.time_s >= min(doubtful) for entry in decisions)


def test_a_log_that_another_trial_left_is_not_explained_as_certain(rpp_log, tmp_path, capsys):
    samples = rpp_log.samples.copy()
    samples.loc[10, "command_v_mps"] = np.nextafter(samples.loc[10, "command_v_mps"], 1.0)
    replace(rpp_log, samples=samples).write(tmp_path / "log.parquet")
    status, lines, _ = asked(tmp_path / "log.parquet", capsys)
    assert status == 1
    assert "Not certain: command_v_mps at 0.20 s: logged" in " ".join(lines)
    assert "to the last bit" not in " ".join(lines)


def test_costmaps_are_not_needed(tmp_path, capsys):
    run_trial("empty", "rpp", 3, keeps_costmaps=False).write(tmp_path / "log.parquet")
    assert asked(tmp_path / "log.parquet", capsys)[0] == 0


@pytest.mark.parametrize(
    ("at", "fault"),
    [
        (-1.0, "--at -1: expected a time of the trial, 0.02 to "),
        (1e6, "--at 1e+06: expected a time of the trial, 0.02 to "),
        (0.0, "--at 0: expected a time of the trial, 0.02 to "),
    ],
)
def test_a_time_outside_of_the_trial_is_one_line(path, capsys, at, fault):
    status, lines, faults = asked(path, capsys, at)
    assert (status, lines, len(faults)) == (2, [], 1)
    assert fault in faults[0]


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"outcome": "error", "reason": "it broke"}, "the trial ended in an error, it broke"),
        ({"recording": {"file": "a.bag"}}, "made of a recording"),
        ({"running_stack": {}}, "a running ROS 2 stack drove"),
        ({"schema_version": 1}, "schema"),
        ({"identity": "0" * 64}, "expected unchanged inputs"),
        ({"controller": "their_plugin"}, "the inputs of the trial cannot be loaded again: "),
        ({"controller": "external"}, "the inputs of the trial cannot be loaded again: "),
        ({"seed": 4}, "expected unchanged inputs"),
    ],
)
def test_a_log_that_cannot_be_explained_is_one_line(path, capsys, changes, fault):
    status, lines, faults = asked(with_header(path, **changes), capsys)
    assert (status, lines, len(faults)) == (2, [], 1)
    assert fault in faults[0]
    assert faults[0].startswith(str(path))


def test_a_controller_that_cannot_tell_is_one_line(tmp_path, capsys):
    run_trial("empty", "learned", 3).write(tmp_path / "log.parquet")
    status, _, (fault,) = asked(tmp_path / "log.parquet", capsys)
    assert status == 2
    assert fault.endswith("learned: its controller cannot tell why; it has no method `explain`")


def test_no_log_is_one_line(tmp_path, capsys):
    status, _, (fault,) = asked(tmp_path / "none.parquet", capsys)
    assert status == 2
    assert "no such file" in fault


def test_a_log_in_a_results_folder_is_of_its_run(tmp_path, capsys):
    folder = tmp_path / "results"
    what = ["empty", "--controllers", "rpp:lookahead_dist=0.9", "--trials", "2", "--seed", "5"]
    how = ["--replay", "none", "--figures", "none", "--quiet", "--jobs", "1", "--out", str(folder)]
    assert main(["run", *what, *how]) == 0
    (log,) = folder.glob("trials/empty/rpp*/trial_001.parquet")
    capsys.readouterr()
    status, lines, faults = asked(log, capsys)
    assert (status, faults) == (0, [])
    assert lines[0].startswith("rpp:lookahead_dist=0.9 at 0.97 s")


def test_the_last_command_is_explained_too(path, rpp_log, capsys):
    assert asked(path, capsys, f"{rpp_log.end_time_s:.17g}")[0] == 0


def test_commands_are_equal_to_the_last_bit_only():
    found = Explanation(np.array([0.1, 0.0]), "It drives.", (), ())
    assert found.gives(np.array([0.1, 0.0]))
    assert found.gives(np.array([0.1, -0.0, 0.0]))
    assert not found.gives(np.array([np.nextafter(0.1, 1.0), 0.0]))
    assert not found.gives(None)
    assert found._replace(command=None).gives(None)


def test_a_table_fits_80_columns():
    rows = [("curvature", 0.41666, "*", "word " * 30), ("cost", None, "", "")]
    lines = table_lines(("rule", "speed [m/s]", "sets it", "because"), rows)
    assert max(map(len, lines)) <= WIDTH
    assert lines[2].startswith("curvature        0.417  *")
