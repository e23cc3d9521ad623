"""A visit that was stopped goes on; what it cannot use is one line."""

from __future__ import annotations

import json
from types import SimpleNamespace

import pytest
from doctor_texts import RPP, RPP_BLOCK, nav2_text

from drake_navbench.commands.command_line import EXIT_INTERRUPTED
from drake_navbench.commands.doctor import main
from drake_navbench.studies.doctor import driving
from drake_navbench.studies.doctor.driving import Driver


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "nav2.yaml"
    path.write_text(nav2_text(RPP_BLOCK, plugin=RPP))
    return path


@pytest.fixture
def driven(monkeypatch):
    """The trials that were driven, by identity; the first visit is stopped after five."""
    identities = []
    stops = [5]

    def drive_each(specs, kept_of, *, jobs, on_row):
        for spec in specs:
            if stops and len(identities) == stops[0]:
                stops.clear()
                raise KeyboardInterrupt
            identities.append(spec.identity)
            on_row(spec, {"scenario": spec.scenario.name, "outcome": "succeeded", "severity": {}})

    monkeypatch.setattr(driving, "drive_each", drive_each)
    return identities


def test_after_ctrl_c_the_same_command_drives_only_the_rest(file, tmp_path, driven, capsys):
    out = tmp_path / "visit"
    command = [str(file), "--out", str(out)]
    assert main(command) == EXIT_INTERRUPTED
    printed = capsys.readouterr()
    assert "Robot: wheelchair, as no --robot is given." in printed.out
    assert "driving 34 trials" in printed.out
    assert printed.err.endswith("interrupted; the same command goes on\n")
    # What is known so far is written: five trials and the page.
    lines = (out / "journal.jsonl").read_text().splitlines()
    assert [json.loads(line)["identity"] for line in lines] == driven
    assert len(driven) == 5
    assert (out / "doctor.html").exists()

    assert main(command) == 0
    # 17 probes of two seeds, none twice.
    assert len(driven) == len(set(driven)) == 34
    assert "Nothing to improve" in capsys.readouterr().out


def test_a_trial_that_failed_is_driven_again_by_the_next_command(tmp_path):
    driver = Driver(tmp_path, "wheelchair", jobs=1, budget_s=600.0, tell=print)
    spec = SimpleNamespace(identity="a")
    driver._keep(spec, {"outcome": "error"})
    assert not (tmp_path / "journal.jsonl").exists()
    driver._keep(spec, {"outcome": "aborted"})
    assert len((tmp_path / "journal.jsonl").read_text().splitlines()) == 1


def test_progress_tells_the_expected_time_and_the_rest_of_the_budget(tmp_path):
    driver = Driver(tmp_path, "wheelchair", jobs=1, budget_s=600.4, tell=print)
    # Before the first trial nobody knows how long one takes.
    assert driver.told_time(34) == "left 10:00 of the budget"
    driver.driven, driver._driving_s = 10, 5.0
    assert driver.told_time(34).startswith("about 17 s;")


def test_a_long_batch_tells_every_half_minute_how_far_it_is(tmp_path, monkeypatch):
    """Five trials of 20 s: told after 40 s and 80 s, and not after the last."""
    told, clock = [], [0.0]

    def drive_each(specs, kept_of, *, jobs, on_row):
        for spec in specs:
            clock[0] += 20.0
            on_row(spec, {"outcome": "succeeded"})

    monkeypatch.setattr(driving, "drive_each", drive_each)
    driver = Driver(
        tmp_path, "wheelchair", jobs=1, budget_s=600.0, tell=told.append, clock=lambda: clock[0]
    )
    driver._drive_all([SimpleNamespace(identity=name) for name in "abcde"])
    assert told == [
        "  2 of 5 trials driven",
        "  4 of 5 trials driven: about 20 s more",
    ]
    assert driver.trial_s == 20.0


@pytest.mark.parametrize(("jobs", "enough"), [(1, 4), (2, 4), (4, 8)])
def test_the_first_trials_tell_how_long_the_first_look_takes(tmp_path, monkeypatch, jobs, enough):
    """Each worker's first trial takes 20 s, all others 4 s; jobs of them are driven at a time."""
    told, clock = [], [0.0]

    def drive_each(specs, kept_of, *, jobs, on_row):
        for number, spec in enumerate(specs):
            if number % jobs == 0:
                clock[0] += 4.0 if number else 20.0
            on_row(spec, {"outcome": "succeeded"})

    monkeypatch.setattr(driving, "drive_each", drive_each)
    driver = Driver(
        tmp_path, "wheelchair", jobs=jobs, budget_s=600.0, tell=told.append, clock=lambda: clock[0]
    )
    driver._drive_all([SimpleNamespace(identity=str(number)) for number in range(enough + 2)])
    rest_s = 2 * 4 // jobs
    assert told[0] == f"  {enough} of {enough + 2} trials driven: about {rest_s} s more"


def test_a_layer_that_ends_below_the_borrowed_lidar_is_told_before_anything_is_driven(
    file, tmp_path, driven, capsys
):
    # The Jackal's lidar is at 0.33 m.
    file.write_text(file.read_text().replace("obstacle_height: 2.0", "obstacle_height: 0.32"))
    out = tmp_path / "visit"
    main([str(file), "--robot", "jackal", "--out", str(out)])
    told = "obstacle_layer.scan.max_obstacle_height: the lidar's height, 0.33 m, is outside of"
    printed = " ".join(capsys.readouterr().out.split())
    assert printed.index(told) < printed.index("driving 34 trials")
    assert told in (out / "doctor.html").read_text().replace("&#x27;", "'")


@pytest.mark.parametrize(
    ("text", "options", "told"),
    [
        ("", ["--symptom", "purple", "--read-only"], "--symptom 'purple': unknown class of sympt"),
        (RPP, ["--out", "o"], "{path}, line 20: controller_server.ros__parameters.FollowPath."),
        ("", ["--bag", "none", "--read-only"], "none: "),
        ("", ["--out", "o", "--try", "lookahead"], "--try 'lookahead': expected PARAMETER=VALUE"),
        (
            "",
            ["--out", "o", "--try", "FollowPath.lookahead_dst=0.8"],
            "--try 'FollowPath.lookahead_dst=0.8': controller_server does not read "
            "FollowPath.lookahead_dst: unknown; did you mean 'lookahead_dist'?",
        ),
        (
            "",
            ["--out", "o", "--try", "FolowPath.lookahead_dist=0.8"],
            "--try 'FolowPath.lookahead_dist=0.8': the file has neither a node nor a controller's "
            "block FolowPath",
        ),
        (
            "",
            ["--out", "o", "--try", "FollowPath.lookahead_dist=0.6"],
            "--try 'FollowPath.lookahead_dist=0.6': the file has this value already",
        ),
        (
            "",
            ["--out", "o", "--try", "FollowPath.lookahead_dist=long"],
            "--try 'FollowPath.lookahead_dist=long': ",
        ),
        ("", ["--read-only", "--try", "local_costmap.width=4"], "--try: is of no use with --read"),
    ],
)
def test_an_input_that_cannot_be_used_is_one_line(
    text, options, told, file, monkeypatch, tmp_path, capsys
):
    monkeypatch.chdir(tmp_path)
    file.write_text(file.read_text().replace(text or "\0", "x::Y"))
    assert main([str(file), *options]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(told.format(path=file))
