"""Tracks of recorded people are read, checked line by line, and put where they belong."""

import numpy as np
import pytest

from drake_navbench.errors import InputError
from drake_navbench.inputs.people import Recording
from drake_navbench.inputs.recorded_people import load_recording
from drake_navbench.inputs.scenario import load_scenario
from drake_navbench.inputs.task_check import check_task
from drake_navbench.kernels.moving_bodies import FAR_AWAY_M
from drake_navbench.kernels.walking import VX, WALKED, YAW, X, Y

HEADER = "time_s,person,x_m,y_m\n"


def load(folder, text, duration_s=60.0, **settings):
    (folder / "crowd.csv").write_text(text, encoding="utf-8")
    return load_recording(folder / "crowd.csv", Recording(file="crowd.csv", **settings), duration_s)


ANNA = HEADER + "1.0,anna,0,0\n2.0,anna,1,0\n3.0,anna,1,2\n"


def test_places_are_linear_in_between_with_the_velocity_of_the_piece(tmp_path):
    people = load(tmp_path, ANNA)
    assert people.names == ["anna"]
    (anna,) = people.people_at(2.25)
    np.testing.assert_allclose(anna[[X, Y]], [1.0, 0.5])
    np.testing.assert_allclose(anna[[VX, VX + 1]], [0.0, 2.0])
    assert anna[WALKED] == pytest.approx(1.5)
    assert people.top_speed_mps == pytest.approx(2.0)


def test_the_heading_turns_evenly_from_row_to_row(tmp_path):
    people = load(tmp_path, ANNA)
    # Along x at first, along y at last, and in between as from the first to the last.
    corner = np.arctan2(2.0, 1.0)
    assert people.people_at(2.0)[0, YAW] == pytest.approx(corner)
    assert people.people_at(1.5)[0, YAW] == pytest.approx(0.5 * corner)
    assert people.people_at(2.5)[0, YAW] == pytest.approx(0.5 * (corner + np.pi / 2))


def test_who_stands_still_keeps_the_heading(tmp_path):
    people = load(tmp_path, HEADER + "0,a,0,0\n1,a,0,1\n2,a,0,2\n3,a,0,2\n4,a,0,2\n")
    assert people.people_at(3.9)[0, YAW] == pytest.approx(np.pi / 2)


def test_before_the_first_row_and_from_the_last_on_nobody_is_there(tmp_path):
    people = load(tmp_path, ANNA)
    is_there = [people.people_at(time_s)[0, X] < FAR_AWAY_M for time_s in (0.9, 1.0, 2.9, 3.0)]
    assert is_there == [False, True, True, False]
    np.testing.assert_array_equal(people.appearances_s, [1.0])


def test_who_has_no_row_for_long_was_away(tmp_path):
    text = HEADER + "0,a,0,0\n1,a,1,0\n3.5,a,9,0\n4,a,9,1\n"
    people = load(tmp_path, text, max_gap_s=2.0)
    is_there = [people.people_at(time_s)[0, X] < FAR_AWAY_M for time_s in (0.5, 2.0, 3.6)]
    assert is_there == [True, False, True]
    # A jump while away is none.
    assert people.top_speed_mps == pytest.approx(2.0)
    assert people.people_at(3.75)[0, WALKED] == pytest.approx(1.5)
    np.testing.assert_array_equal(people.appearances_s, [3.5])


def test_tracks_tell_the_same_places(tmp_path):
    people = load(tmp_path, ANNA + "0.5,bob,5,5\n4.0,bob,6,5\n", max_gap_s=10.0)
    for time_s in np.arange(0.0, 5.0, 0.13):
        np.testing.assert_allclose(
            people.tracks.poses_at(time_s)[:, :2], people.people_at(time_s)[:, :2]
        )


def test_the_transform_and_the_start_time(tmp_path):
    settings = {"origin": (10.0, -1.0), "yaw_rad": np.pi / 2, "start_time_s": 1.0}
    people = load(tmp_path, ANNA, **settings)
    # A metre along the recording's x is a metre along y.
    np.testing.assert_allclose(people.people_at(0.5)[0, [X, Y]], [10.0, -0.5])
    assert people.people_at(0.5)[0, YAW] > np.pi / 2


def test_the_format_of_eth_and_ucy(tmp_path):
    text = "780\t1.0\t8.46\t3.59\n790\t1.0\t9.57\t3.79\n790  20 1.0 1.0\n800  20 1.0 2.0\n"
    people = load(tmp_path, text, format="eth_ucy", frame_rate_hz=25.0, start_time_s=31.2)
    assert people.names == ["1", "20"]
    np.testing.assert_allclose(people.people_at(0.2)[0, [X, Y]], [9.015, 3.69])
    np.testing.assert_allclose(people.people_at(0.6)[1, [X, Y]], [1.0, 1.5])


def test_only_those_of_the_trial_are_kept_and_groups_are_by_name(tmp_path):
    text = ANNA + "1,bob,0,5\n2,bob,1,5\n500,late,0,0\n501,late,1,0\n"
    people = load(tmp_path, text, groups=(("bob", "anna"), ("late",)))
    assert people.names == ["anna", "bob"]
    assert people.groups == [0, 0]


@pytest.mark.parametrize(
    ("text", "settings", "expected"),
    [
        (ANNA + "2.5,anna,1,3\n", {}, "line 5: person anna has the time 2.5 s after 3 s in line 4"),
        (ANNA + "3.1,anna,9,2\n", {}, "line 5: person anna jumps 8.00 m in 0.1 s, 80 m/s"),
        (ANNA + "4,anna,x,2\n", {}, "line 5: expected a number, got 'x'"),
        (ANNA + "4,anna,nan,2\n", {}, "line 5: expected a number, got 'nan'"),
        (ANNA + "4,anna,1\n", {}, "line 5: expected 4 columns, time_s,person,x_m,y_m, got 3"),
        (ANNA + "4,anna,1e6,0\n", {"max_gap_s": 0.5}, "line 5: person anna is at [1e+06, 0] m"),
        ("t,x,y\n", {}, "line 1: expected the header time_s,person,x_m,y_m, got 't,x,y'"),
        (HEADER, {}, "expected rows, found none"),
        (ANNA, {"groups": (("eve",),)}, "recording.groups[0]: nobody is called 'eve'"),
        (
            ANNA,
            {"groups": (("anna",), ("anna",))},
            "recording.groups: 'anna' is in two groups, expected one",
        ),
        ("1 2 3\n", {"format": "eth_ucy", "frame_rate_hz": 25.0}, "line 1: expected 4 columns"),
    ],
)
def test_what_is_wrong_is_one_line_with_file_and_line(tmp_path, text, settings, expected):
    with pytest.raises(InputError) as raised:
        load(tmp_path, text, **settings)
    assert str(raised.value).startswith(str(tmp_path / "crowd.csv"))
    assert expected in str(raised.value)
    assert "\n" not in str(raised.value)


SCENARIO = """\
description: a hall
world:
  obstacles:
    - {type: box, min: [3.0, 1.0], max: [4.0, 2.0]}
  people:
    recording: crowd.csv
goal: [8.0, 0.0, 0.0]
"""


def checked(folder, recording, scenario=SCENARIO):
    (folder / "crowd.csv").write_text(recording, encoding="utf-8")
    (folder / "hall.yaml").write_text(scenario, encoding="utf-8")
    hall = load_scenario(str(folder / "hall.yaml"))
    check_task(hall, hall.load_robot("wheelchair"))
    return hall


def test_somebody_who_stands_on_the_start_is_told_by_file_and_line(tmp_path):
    stands = HEADER + "0,7,0.2,0.1\n5,7,0.2,0.2\n"
    with pytest.raises(InputError, match=r"crowd.csv, line 2: person 7 stands where scenario hall"):
        checked(tmp_path, stands, SCENARIO.replace("crowd.csv", "{file: crowd.csv, max_gap_s: 9}"))
    # Who comes there later is not there yet.
    checked(tmp_path, HEADER + "10,7,0.2,0.1\n11,7,0.2,0.2\n")


def test_somebody_who_walks_through_an_obstacle_is_told_by_file_and_line(tmp_path):
    with pytest.raises(InputError, match=r"line 3: person 7 walks through an obstacle of scenario"):
        checked(tmp_path, HEADER + "10,7,3.5,0.5\n11,7,3.5,2.5\n")


def test_a_recording_of_nobody_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"crowd.csv: no person appears in the 120 s of a"):
        checked(tmp_path, HEADER + "500,7,3,3\n501,7,3,4\n")


def test_the_recording_is_one_of_the_files_of_a_scenario(tmp_path):
    hall = checked(tmp_path, HEADER + "0,anna,0,5\n1,anna,1,5\n")
    assert [path.name for path in hall.files] == ["crowd.csv"]
    assert len(hall.file_hashes) == 1


@pytest.mark.parametrize(
    ("people", "expected"),
    [
        ("{recording: crowd.csv, model: orca}", "model: has no effect on recorded people"),
        ("{recording: {file: crowd.csv, format: eth_ucy}}", "frame_rate_hz: expected the frames"),
        ("{recording: {file: crowd.csv, frame_rate_hz: 2}}", "frame_rate_hz: expected none with"),
        ("{recording: {file: crowd.csv, max_sped_mps: 2}}", "max_sped_mps: unknown field"),
        ("{}", "persons: expected at least one person, or a recording"),
        ("{recording: other.csv}", "other.csv: cannot be read: No such file"),
    ],
)
def test_wrong_settings_are_one_line(tmp_path, people, expected):
    with pytest.raises(InputError) as raised:
        checked(tmp_path, ANNA, SCENARIO.replace("\n    recording: crowd.csv", f" {people}"))
    assert expected in str(raised.value)
    assert "\n" not in str(raised.value)
