"""Lines about a run's Nav2 files by the doctor's rules."""

from __future__ import annotations

from pathlib import Path

import pytest
from doctor_texts import DWB, nav2_text

from drake_navbench.nav2.whole_files import WholeFile, columns_of_files
from drake_navbench.studies.doctor.files import Patient
from drake_navbench.studies.doctor.on_files import lines_on_change, lines_on_file
from drake_navbench.studies.doctor.reading import findings_of
from drake_navbench.studies.doctor.told import without_repeated_cures

SLOW = {
    "max_vel_x": 0.3,
    "max_speed_xy": 0.3,
    "critics": ["RotateToGoal", "ObstacleFootprint", "GoalDist", "PathDist"],
}


@pytest.fixture
def lines(tmp_path, monkeypatch):
    """A function that returns the lines on files of DWB with these changes, a first, then b."""
    monkeypatch.chdir(tmp_path)

    def read(**changed):
        files = []
        for name, changes in changed.items():
            path = Path(f"{name}.yaml")
            path.write_text(nav2_text(SLOW | changes, plugin=DWB))
            files.append(WholeFile(name, (path,)))
        return lines_on_change(columns_of_files(files, "wheelchair", {}, release="jazzy"))

    return read


def test_a_speed_that_another_limit_cuts_is_told_of_the_file_that_has_it(lines):
    told = (
        "max_speed_xy is 0.3 m/s, less than max_vel_x 0.5 m/s: the robot never reaches max_vel_x; "
        "cure: raise FollowPath.max_speed_xy to 0.5 m/s (dwb-two-speed-limits)"
    )
    faster = {"max_vel_x": 0.5}
    assert lines(a={}, b=faster) == [f"The doctor finds in b, not in a: {told}"]
    assert lines(a=faster, b={}) == [f"The doctor finds in a, not in b: {told}"]


def test_what_both_files_have_is_no_finding_of_the_change(lines):
    assert lines(a={"max_vel_x": 0.5}, b={"max_vel_x": 0.45}) == []


def test_each_further_file_is_compared_with_the_first(lines):
    found = lines(a={}, b={"max_vel_x": 0.5}, c={"max_vel_x": 0.4})
    assert [line.split(":")[0] for line in found] == [
        "The doctor finds in b, not in a",
        "The doctor finds in c, not in a",
    ]


def test_of_a_single_file_the_number_of_findings_is_told_with_the_command_that_shows_them(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text(nav2_text(SLOW | {"max_vel_x": 0.5}, plugin=DWB))
    patient = Patient((path,), "wheelchair", {}, "jazzy")
    shown = len(without_repeated_cures(findings_of(patient.facts())))
    assert shown > 1
    assert lines_on_file(patient, "doctor a.yaml") == [
        f"The doctor's rules find {shown} possible faults in the file: doctor a.yaml"
    ]
